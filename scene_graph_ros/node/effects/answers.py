"""What effects compute of a snapshot: once, for whoever publishes it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
import time
from typing import Any, Protocol

from scene_graph_ros.node.effects.beside import Beside, Found
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["Answer", "Question", "SlowAnswer"]

_RECENT = 100
"""Answers that the mean time is taken over."""


class Question(Protocol):
    """Finds something out about a snapshot; made without arguments when something asks for it."""

    def __call__(self, snapshot: WorldSnapshot) -> Any:
        """Compute the answer, or return what others were answered about the same snapshot."""

    def counters(self, answer: Any) -> Mapping[str, Any]:
        """Return how much there is in an answer, None before the first."""


class Answer:
    """The answer about the snapshot that was last asked about.

    A question about another snapshot computes it, and waits; what fails is not tried again.
    """

    def __init__(self, question: Question) -> None:
        """Compute nothing yet."""
        self._question = question
        self._sequence = -1
        self._answer: Any = None
        self._computed = 0
        self._accuracy = ""
        self._seconds: deque[float] = deque(maxlen=_RECENT)

    def is_new(self, snapshot: WorldSnapshot) -> bool:
        """Tell whether nobody has asked about a snapshot yet."""
        return snapshot.sequence != self._sequence

    def about(self, snapshot: WorldSnapshot) -> Any | None:
        """Return the answer; None where it is not there. Raises what the question does, once."""
        if self.is_new(snapshot):
            self._sequence, self._answer = snapshot.sequence, None
            self._answer = self._compute(snapshot)
        return self._answer

    def newest(self) -> Found | None:
        """Return an answer that may be about an earlier snapshot; only slow ones are kept."""
        return None

    def seconds_beside(self) -> float:
        """Return how long it takes where nobody waits for all of that, else 0."""
        return 0.0

    def counters(self) -> Mapping[str, Any]:
        """Return how often it was computed, how exactly and at what cost, and how much it is."""
        seconds = list(self._seconds)
        return {
            "computed": self._computed,
            "accuracy": self._accuracy,
            "time at this accuracy, mean (s)": sum(seconds) / len(seconds) if seconds else 0.0,
            **self._question.counters(self._last()),
        }

    def close(self) -> None:
        """Compute no more."""

    def _last(self) -> Any:
        """Return the last answer, None before the first."""
        return self._answer

    def _compute(self, snapshot: WorldSnapshot) -> Any:
        begin = time.perf_counter()
        answer = self._question(snapshot)
        if snapshot.query.accuracy != self._accuracy:
            self._accuracy = snapshot.query.accuracy
            self._seconds.clear()
        self._seconds.append(time.perf_counter() - begin)
        self._computed += 1
        return answer


class SlowAnswer(Answer):
    """An answer that takes long where a scene is fine: it is computed in a thread of its own.

    Whoever asks waits for a while; after that there is no answer about this snapshot.
    """

    def __init__(
        self, question: Question, patience: Callable[[], float], late: Callable[[], None]
    ) -> None:
        """Wait ``patience()`` seconds; call ``late`` when an answer has come after that."""
        super().__init__(question)
        self._patience = patience
        self._beside = Beside(self._compute, late)
        self._without = 0
        self._is_late = False

    def about(self, snapshot: WorldSnapshot) -> Any | None:
        """Return the answer; None where it is late. Raises what the question does."""
        is_new = self.is_new(snapshot)
        self._sequence = snapshot.sequence
        answer = self._beside.ask(snapshot, self._patience())
        self._is_late = answer is None
        self._without += is_new and self._is_late
        return answer

    def newest(self) -> Found | None:
        """Return the newest answer that has come, and the snapshot that it is about."""
        return self._beside.newest

    def seconds_beside(self) -> float:
        """Return how long the last one took, or how long one is being looked for by now."""
        return self._beside.seconds()

    def counters(self) -> Mapping[str, Any]:
        """Return the same as others, and how many snapshots went without."""
        return {
            **super().counters(),
            "late": self._is_late,
            "updates without, as they were late": self._without,
        }

    def close(self) -> None:
        """End the thread."""
        self._beside.close()

    def _last(self) -> Any:
        found = self._beside.newest
        return None if found is None else found.answer

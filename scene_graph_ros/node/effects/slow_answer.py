"""The answer of an effect that takes long where a scene is fine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from scene_graph_ros.node.effects.answer_thread import AnswerThread, Found
from scene_graph_ros.node.effects.state import Answer, Question
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["SlowAnswer"]


class SlowAnswer(Answer):
    """An answer that is computed in a thread of its own.

    Whoever asks waits for a while; after that there is no answer about this snapshot.
    """

    def __init__(
        self, question: Question, patience: Callable[[], float], late: Callable[[], None]
    ) -> None:
        """Wait ``patience()`` seconds; call ``late`` when an answer has come after that."""
        super().__init__(question)
        self._patience = patience
        self._thread = AnswerThread(self._compute, late)
        self._without = 0
        self._is_late = False

    def about(self, snapshot: WorldSnapshot) -> Any | None:
        """Return the answer; None where it is late. Raises the question's errors."""
        is_new = self.is_new(snapshot)
        self._sequence = snapshot.sequence
        answer = self._thread.ask(snapshot, self._patience())
        self._is_late = answer is None
        self._without += is_new and self._is_late
        return answer

    def newest(self) -> Found | None:
        """Return the newest answer that has come, and the snapshot that it is about."""
        return self._thread.newest

    def seconds_beside(self) -> float:
        """Return the time (s) of the last one, or of the present one up to now."""
        return self._thread.seconds()

    def counters(self) -> Mapping[str, Any]:
        """Return the same as others, and how many snapshots went without."""
        return {
            **super().counters(),
            "late": self._is_late,
            "updates without, as they were late": self._without,
        }

    def close(self) -> None:
        """End the thread."""
        self._thread.close()

    def _last(self) -> Any:
        found = self._thread.newest
        return None if found is None else found.answer

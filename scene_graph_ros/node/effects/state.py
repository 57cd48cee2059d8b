"""The state of one effect: whether it is on and why, its answer, its times, its warnings."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
import importlib
import time
from typing import Any, Protocol

from scene_graph_ros.node.effects.answer_thread import Found
from scene_graph_ros.node.effects.declarations import EffectDeclaration
from scene_graph_ros.node.effects.effect import Effect, WorksAlone
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["Answer", "EffectReport", "EffectState", "Question", "load"]

_RECENT = 100
"""Updates, or answers, that the mean and worst time of an effect are taken over."""

_TELL_PERIOD = 1.0
"""Seconds between two log entries about an effect that keeps failing or is slow."""


def load(factory: str) -> Any:
    """Import the class that ``module:class`` names."""
    module, kind = factory.split(":")
    return getattr(importlib.import_module(module), kind)


class Question(Protocol):
    """Finds something out about a snapshot; made without arguments when something asks for it."""

    def __call__(self, snapshot: WorldSnapshot) -> Any:
        """Compute the answer, or return the one about the same snapshot that is there already."""

    def counters(self, answer: Any) -> Mapping[str, Any]:
        """Return counts of an answer, None before the first."""


class Answer:
    """The answer about the snapshot that was last asked about.

    A question about another snapshot computes it, and waits; one that fails is not tried again.
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
        """Return the answer; None where it is not there. Raises the question's errors, once."""
        if self.is_new(snapshot):
            self._sequence, self._answer = snapshot.sequence, None
            self._answer = self._compute(snapshot)
        return self._answer

    def newest(self) -> Found | None:
        """Return an answer that may be about an earlier snapshot; only slow ones are kept."""
        return None

    def seconds_beside(self) -> float:
        """Return its time (s) where nobody waits for all of that, else 0."""
        return 0.0

    def counters(self) -> Mapping[str, Any]:
        """Return counts of the answer, of its computations, their tier and their time."""
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


@dataclass(frozen=True)
class EffectReport:
    """An effect's activity and its reason; times in seconds over recent updates.

    A time is that of the effect's own answers and messages, without other effects' answers.
    ``failures`` counts its failures; ``failure`` is the reason, while it fails. ``warning`` says
    that it takes too long, while it does, or why it is not on yet; ``stale`` names the object
    that it lost.
    """

    name: str
    is_on: bool
    reason: str
    topics: tuple[str, ...]
    count: int
    mean_seconds: float
    max_seconds: float
    counters: dict[str, Any]
    failures: int = 0
    failure: str = ""
    warning: str = ""
    stale: str = ""


@dataclass
class EffectState:
    """One effect, from its declaration to its work in this update.

    ``effect`` publishes, also while it lingers; ``answer`` is there only while it is on.
    """

    declaration: EffectDeclaration
    reason: str = ""
    waiting_reason: str = ""
    kernels: tuple[str, ...] = ()
    """The groups of kernels that it needs for the scene, beside the main job's."""
    effect: Effect | None = None
    answer: Answer | None = None
    closes_at: float | None = None
    count: int = 0
    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=_RECENT))
    failures: int = 0
    failure: str = ""
    warning: str = ""
    _told_at: float = float("-inf")
    _spent: float = 0.0
    _did_work: bool = False
    _failed: bool = False

    @property
    def is_on(self) -> bool:
        """Whether something asks for the effect, and its answers and kernels are there."""
        return bool(self.reason)

    def is_to_be_told(self) -> bool:
        """Tell whether the last log entry about the effect is long enough ago for another."""
        now = time.monotonic()
        if now - self._told_at < _TELL_PERIOD:
            return False
        self._told_at = now
        return True

    def begin_update(self) -> None:
        """Begin to count the work of one update."""
        self._spent, self._did_work, self._failed = 0.0, False, False

    def spend(self, seconds: float) -> None:
        """Book time that it took in this update, with computing or with publishing."""
        self._spent += seconds
        self._did_work = True

    def fail(self, error: Exception) -> None:
        """Count a failure in this update."""
        self._failed = True
        self.failures += 1
        self.failure = f"{type(error).__name__}: {error}"

    def end_update(self, period: float) -> bool:
        """Book the work done; tell whether it takes longer than ``period`` seconds.

        That is how far contacts of anybody may be apart.
        """
        if not self._did_work or self._failed:
            return False
        self.record(self._spent)
        self.failure = self.warning = ""
        beside = 0.0 if self.answer is None else self.answer.seconds_beside()
        seconds = max(self._spent, beside)
        if seconds <= period:
            return False
        self.warning = (
            f"an update takes {seconds:.3g} s, longer than the {period:.3g} s of min_update_rate:"
            " contacts wait for it or go without it"
        )
        return True

    def record(self, seconds: float) -> None:
        """Count one more that took some seconds."""
        self.seconds.append(seconds)
        self.count += 1

    def close(self) -> None:
        """Stop computing and publishing."""
        effect, answer = self.effect, self.answer
        self.effect, self.answer, self.closes_at = None, None, None
        if answer is not None:
            answer.close()
        if effect is not None:
            effect.close()

    def report(
        self, resolve: Callable[[str], str], lack: Callable[[Iterable[str]], str], why_off: str
    ) -> EffectReport:
        """Describe it; ``resolve`` makes names of topics absolute.

        ``lack`` returns a sentence about groups of kernels that are not ready.
        """
        seconds, count, failure, stale = list(self.seconds), self.count, self.failure, ""
        effect: object = self.effect
        if isinstance(effect, WorksAlone):
            seconds, count = effect.recent_seconds(), effect.count()
            failure, stale = failure or effect.failure(), effect.stale()
        waits = ""
        if self.waiting_reason:
            doing = lack(self.kernels) or "its kernels are compiled by now"
            waits = f"not yet: {doing}; {self.waiting_reason}"
        return EffectReport(
            name=self.declaration.name,
            is_on=self.is_on,
            reason=self.reason or waits or why_off,
            topics=tuple(resolve(topic) for topic in self.declaration.topics),
            count=count,
            mean_seconds=sum(seconds) / len(seconds) if seconds else 0.0,
            max_seconds=max(seconds, default=0.0),
            counters=self._counters(),
            failures=self.failures,
            failure=failure if self.is_on else "",
            warning=self.warning if self.is_on else waits,
            stale=stale if self.is_on else "",
        )

    def _counters(self) -> dict[str, Any]:
        computed = {} if self.answer is None else self.answer.counters()
        published = {} if self.effect is None else self.effect.counters()
        return {**computed, **published}

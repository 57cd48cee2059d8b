"""Turns effects on and off with the scene, runs those that have work, and reports on all."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
import importlib
import threading
import time
import traceback
from typing import Any

from scene_graph_ros.geometry.model.state import ROLES
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.node.effects.declarations import (
    camera_effect,
    count_compliant,
    count_deformable,
    Demand,
    EffectDeclaration,
    EFFECTS,
)
from scene_graph_ros.node.effects.effect import Effect, Host, WorksAlone, WorksBeside
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["EffectReport", "Effects"]

LINGER = 2.0
"""Seconds that a publisher outlives its effect, so that reliable readers get the last message."""

_RECENT = 100
"""Updates that the mean and worst time of an effect are taken over."""

_TELL_PERIOD = 1.0
"""Seconds between two log entries about an effect that keeps failing or is slow."""


@dataclass(frozen=True)
class EffectReport:
    """What an effect is doing and why; times in seconds over recent updates.

    ``failures`` counts what it could not do; ``failure`` says why, while it can't. ``warning``
    says that it takes too long, while it does, or what it waits for before it comes on; ``stale``
    what it lost that it is about.
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
class _State:
    declaration: EffectDeclaration
    reason: str = ""
    waiting_reason: str = ""
    effect: Effect | None = None
    closes_at: float | None = None
    count: int = 0
    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=_RECENT))
    failures: int = 0
    failure: str = ""
    warning: str = ""
    told_at: float = float("-inf")

    @property
    def is_on(self) -> bool:
        """Whether something asks for the effect, and what it needs is there."""
        return bool(self.reason)


def _load(factory: str) -> Any:
    """Import the class that ``module:class`` names."""
    module, kind = factory.split(":")
    return getattr(importlib.import_module(module), kind)


class Effects:
    """All effects of the node."""

    def __init__(
        self,
        host: Host,
        declarations: Iterable[EffectDeclaration] = EFFECTS,
        lack: Callable[[str], str] = lambda group: "",
    ) -> None:
        """``lack`` says what is being done where a group of kernels is not ready, and does it."""
        self._host = host
        self._lack = lack
        self._lock = threading.RLock()
        self._requests_lock = threading.Lock()
        self._states = {d.name: _State(d) for d in declarations}
        self._requests: Counter[str] = Counter()
        self._switched_off: frozenset[str] = frozenset()
        self._scene_version = -1
        self._is_open = False
        self._counted: tuple[int, Demand] = (-1, Demand({}, self._requests))

    def open(self) -> None:
        """Let effects come on."""
        with self._lock:
            self._is_open = True

    def switch_off(self, names: Iterable[str]) -> None:
        """Keep effects off whatever asks for them; effects not named follow the scene again."""
        self._switched_off = frozenset(names)
        self._scene_version = -1

    def come_on(self, snapshot: WorldSnapshot) -> None:
        """Follow that kernels have become ready; in the thread that had them compiled."""
        self.prepare(snapshot)
        self._scene_version = -1

    def record(self, query: str, seconds: float) -> None:
        """Count a request that a service answered for an effect."""
        # Not the lock of updates: an answer must not wait for what is being published.
        with self._requests_lock:
            self._requests[query] += 1
            state = self._states.get(query)
            if state is not None and not state.declaration.factory:
                state.count += 1
                state.seconds.append(seconds)
                state.reason = state.declaration.asked_by(Demand({}, self._requests))

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do beforehand what takes long for a scene that is going to be; in the edit's thread."""
        between_steps()
        demand = self._demand_of(snapshot)
        for state in list(self._states.values()):
            declaration = state.declaration
            if not declaration.factory or not self._reason(declaration, demand):
                continue
            if self._lack(declaration.kernels):
                continue
            between_steps()
            try:
                _load(declaration.factory).prepare(self._host, snapshot)
            except Exception:  # noqa: BLE001 - the update meets it again, and says so
                self._host.node.get_logger().debug(
                    f"effect {declaration.name} can't be prepared:\n{traceback.format_exc()}"
                )

    def update(self, snapshot: WorldSnapshot) -> None:
        """Follow the scene, then let each effect publish that has somebody to publish to."""
        with self._lock:
            if not self._is_open:
                return
            if snapshot.scene_version != self._scene_version:
                self._follow(snapshot)
            for state in list(self._states.values()):
                if state.effect is not None:
                    with self._isolated(state):
                        self._run(state, state.effect, snapshot)

    def _run(self, state: _State, effect: Effect, snapshot: WorldSnapshot) -> None:
        if state.closes_at is not None:
            self._close_if_time(state, effect)
        elif effect.has_work():
            begin = time.perf_counter()
            effect.update(snapshot)
            seconds = time.perf_counter() - begin
            state.seconds.append(seconds)
            state.count += 1
            state.failure = ""
            self._judge_time(state, seconds)

    def _judge_time(self, state: _State, seconds: float) -> None:
        """Warn where an effect alone takes longer than may be between contacts of anybody."""
        period = 1.0 / self._host.parameter("min_update_rate")
        effect: object = state.effect
        if isinstance(effect, WorksBeside):
            seconds = max(seconds, effect.seconds_beside())
        state.warning = ""
        if seconds <= period:
            return
        state.warning = (
            f"an update takes {seconds:.3g} s, longer than the {period:.3g} s of min_update_rate:"
            " contacts wait for it or go without it"
        )
        if self._is_to_be_told(state):
            logger = self._host.node.get_logger()
            logger.warning(f"effect {state.declaration.name}: {state.warning}")

    @staticmethod
    def _is_to_be_told(state: _State) -> bool:
        """Tell whether the last entry about an effect is long enough ago for another."""
        now = time.monotonic()
        if now - state.told_at < _TELL_PERIOD:
            return False
        state.told_at = now
        return True

    @contextmanager
    def _isolated(self, state: _State) -> Iterator[None]:
        """Keep what goes wrong with one effect from the others: count it, and tell of it."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - one effect never costs another
            state.failures += 1
            state.failure = f"{type(error).__name__}: {error}"
            if self._is_to_be_told(state):
                self._host.node.get_logger().error(
                    f"effect {state.declaration.name} failed:\n{traceback.format_exc()}"
                )

    def running(self, name: str) -> Any:
        """Return an effect that publishes, or None while it is off."""
        # Without the lock of updates: who prepares a scene must not wait for them.
        state = self._states[name]
        return state.effect if state.is_on else None

    def close(self) -> None:
        """Stop all effects at once, until they are opened again."""
        with self._lock:
            self._is_open = False
            for state in self._states.values():
                effect = state.effect
                state.effect, state.closes_at = None, None
                state.reason = state.waiting_reason = ""
                if effect is not None:
                    with self._isolated(state):
                        effect.close()
            self._scene_version = -1

    def reports(self) -> list[EffectReport]:
        """Describe every effect, also those that are off."""
        with self._lock:
            return [self._report(state) for state in self._states.values()]

    def _demand_of(self, snapshot: WorldSnapshot) -> Demand:
        """Count what asks for effects, once for each version of the scene."""
        version, demand = self._counted
        if version != snapshot.scene_version:
            inspector = snapshot.inspector
            counts = {role: inspector.num_geometries_with_role(role) for role in ROLES}
            demand = Demand(
                counts,
                self._requests,
                count_compliant(inspector),
                count_deformable(inspector),
                snapshot.cameras,
            )
            self._counted = (snapshot.scene_version, demand)
        return demand

    def _reason(self, declaration: EffectDeclaration, demand: Demand) -> str:
        return "" if self._is_switched_off(declaration) else declaration.asked_by(demand)

    def _is_switched_off(self, declaration: EffectDeclaration) -> bool:
        return (declaration.switch or declaration.name) in self._switched_off

    def _follow(self, snapshot: WorldSnapshot) -> None:
        self._scene_version = snapshot.scene_version
        demand = self._demand_of(snapshot)
        self._declare_cameras(snapshot)
        for state in list(self._states.values()):
            reason = self._reason(state.declaration, demand)
            waits = bool(reason and self._lack(state.declaration.kernels))
            state.waiting_reason = reason if waits else ""
            reason = "" if waits else reason
            changed = bool(reason) != state.is_on
            state.reason = reason
            if changed:
                with self._isolated(state):
                    self._switch(state, snapshot)

    def _switch(self, state: _State, snapshot: WorldSnapshot) -> None:
        name, factory = state.declaration.name, state.declaration.factory
        logger = self._host.node.get_logger()
        if not factory:
            return
        if state.is_on:
            logger.info(f"effect {name} is on: {state.reason}")
            state.closes_at = None
            if state.effect is None:
                argument = state.declaration.argument
                told = (self._host,) if argument is None else (self._host, argument)
                state.effect = _load(factory)(*told)
        elif state.effect is not None:
            logger.info(f"effect {name} is off: {self._why_off(state)}")
            state.closes_at = time.monotonic() + LINGER
            state.effect.vanish(snapshot)

    def _close_if_time(self, state: _State, effect: Effect) -> None:
        if state.closes_at is not None and time.monotonic() >= state.closes_at:
            self._close(state, effect)

    @staticmethod
    def _close(state: _State, effect: Effect) -> None:
        state.effect, state.closes_at = None, None
        effect.close()

    def _declare_cameras(self, snapshot: WorldSnapshot) -> None:
        """Have an effect for each camera of the scene, and for no other."""
        states = dict(self._states)
        for name, state in self._states.items():
            camera = state.declaration.argument
            if camera is None or snapshot.cameras.get(camera.name) is camera:
                continue
            # Another of the same name must not meet its topics.
            if state.effect is not None:
                with self._isolated(state):
                    self._close(state, state.effect)
            del states[name]
        for camera in snapshot.cameras.values():
            declaration = camera_effect(camera)
            states.setdefault(declaration.name, _State(declaration))
        # Others read without the lock: what they have does not change.
        self._states = states

    def _why_off(self, state: _State) -> str:
        if self._is_switched_off(state.declaration):
            return "switched off by the scene file"
        return f"nothing asks for it; {state.declaration.would_ask} would"

    def _report(self, state: _State) -> EffectReport:
        resolve = self._host.node.resolve_topic_name
        seconds, count, failure, stale = list(state.seconds), state.count, state.failure, ""
        effect: object = state.effect
        if isinstance(effect, WorksAlone):
            seconds, count = effect.recent_seconds(), effect.count()
            failure, stale = failure or effect.failure(), effect.stale()
        counters: dict[str, Any] = dict(state.effect.counters()) if state.effect else {}
        waits = ""
        if state.waiting_reason:
            lack = self._lack(state.declaration.kernels) or "its kernels are compiled by now"
            waits = f"not yet: {lack}; {state.waiting_reason}"
        return EffectReport(
            name=state.declaration.name,
            is_on=state.is_on,
            reason=state.reason or waits or self._why_off(state),
            topics=tuple(resolve(topic) for topic in state.declaration.topics),
            count=count,
            mean_seconds=sum(seconds) / len(seconds) if seconds else 0.0,
            max_seconds=max(seconds, default=0.0),
            counters=counters,
            failures=state.failures,
            failure=failure if state.is_on else "",
            warning=state.warning if state.is_on else waits,
            stale=stale if state.is_on else "",
        )

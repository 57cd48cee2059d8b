"""Turns effects on and off with the scene, runs those that have work, and has their answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
import threading
import time
import traceback
from typing import Any

from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.node.effects.answer_thread import Found
from scene_graph_ros.node.effects.declarations import (
    AnswerDeclaration,
    camera_effect,
    EffectDeclaration,
    EFFECTS,
    sensed_effect,
    SensedSource,
)
from scene_graph_ros.node.effects.demand import Demand
from scene_graph_ros.node.effects.effect import Effect, Host
from scene_graph_ros.node.effects.slow_answer import SlowAnswer
from scene_graph_ros.node.effects.state import Answer, EffectReport, EffectState, load
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["Effects"]

LINGER = 2.0
"""Seconds that a publisher outlives its effect, so that reliable readers get the last message."""


class Effects:
    """All effects of the node."""

    def __init__(
        self,
        host: Host,
        declarations: Iterable[EffectDeclaration] = EFFECTS,
        lack: Callable[[str], str] = lambda group: "",
    ) -> None:
        """``lack`` has a group of kernels compiled; a sentence while it is not ready."""
        self._host = host
        self._lack = lack
        self._lock = threading.RLock()
        self._requests_lock = threading.Lock()
        self._states = {d.name: EffectState(d) for d in declarations}
        self._answering = {
            state.declaration.answer.name: state
            for state in self._states.values()
            if state.declaration.answer is not None
        }
        self._answering_seconds = 0.0
        self._requests: Counter[str] = Counter()
        self._kept: dict[str, int] = {}
        self._switched_off: frozenset[str] = frozenset()
        self._scene_version = -1
        self._is_open = False
        self._demanded: tuple[int, Demand] = (-1, Demand(None, self._requests))

    def open(self) -> None:
        """Let effects come on."""
        with self._lock:
            self._is_open = True

    def switch_off(self, names: Iterable[str]) -> None:
        """Keep effects off in spite of any demand; effects not named follow the scene again."""
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
            if state is not None and not state.declaration.modules:
                state.record(seconds)
                state.reason = self._reason(state.declaration, Demand(None, self._requests))

    def keeps(self, what: str, count: int) -> None:
        """Follow how many things of a kind the node keeps beside the scene."""
        self._kept[what] = count
        self._scene_version = -1

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do slow work for a scene before it counts; in the edit's thread."""
        between_steps()
        demand = self._demand_of(snapshot)
        coming = [
            state
            for state in self._states.values()
            if state.declaration.modules
            and self._reason(state.declaration, demand)
            and not self._lacks(state.declaration.kernel_groups(demand))
        ]
        heard: list[tuple[EffectState, Effect]] = []
        for state in coming:
            with self._tried(state):
                for module in state.declaration.modules:
                    load(module)
                effect = state.effect if state.is_on else None
                if effect is not None and effect.is_heard():
                    heard.append((state, effect))
        needs = {need for state, _ in heard for need in state.declaration.needs}
        for state in coming:
            answer = state.declaration.answer
            if answer is not None and answer.name in needs:
                with self._tried(state):
                    load(answer.question)()(snapshot)
        for state, effect in heard:
            with self._tried(state):
                effect.prepare(snapshot)

    @contextmanager
    def _tried(self, state: EffectState) -> Iterator[None]:
        """Go on where an effect can't be prepared: the update meets it again, and says so."""
        between_steps()
        try:
            yield
        except Exception:  # noqa: BLE001 - no edit fails by an effect
            self._host.node.get_logger().debug(
                f"effect {state.declaration.name} can't be prepared:\n{traceback.format_exc()}"
            )

    def due(self, snapshot: WorldSnapshot) -> list[EffectState]:
        """Follow the scene, and return the effects that have somebody to publish to by now.

        An update begins with that, before it reads poses.
        """
        with self._lock:
            if not self._is_open:
                return []
            for state in self._states.values():
                state.begin_update()
            if snapshot.scene_version != self._scene_version:
                try:
                    self._follow(snapshot)
                except BaseException:
                    # The next update tries again: a scene half followed would stay so.
                    self._scene_version = -1
                    raise
            due = []
            for state in self._states.values():
                if state.effect is not None:
                    with self._isolated(state):
                        if self._has_work(state, state.effect):
                            due.append(state)
            return due

    @staticmethod
    def _has_work(state: EffectState, effect: Effect) -> bool:
        if state.closes_at is None:
            return effect.has_work()
        if time.monotonic() >= state.closes_at:
            state.close()
        return False

    def update(self, snapshot: WorldSnapshot, due: Iterable[EffectState] | None = None) -> None:
        """Let effects publish their messages about a snapshot.

        They are those that were ``due``, unless the scene is another by now, or none were given:
        then those that are due for ``snapshot``.
        """
        with self._lock:
            if due is None or snapshot.scene_version != self._scene_version:
                due = self.due(snapshot)
            if not self._is_open:
                return
            for state in due:
                if state.effect is not None:
                    with self._isolated(state):
                        self._run(state, state.effect, snapshot)
            self._end_update()

    def _run(self, state: EffectState, effect: Effect, snapshot: WorldSnapshot) -> None:
        begin, others = time.perf_counter(), self._answering_seconds
        effect.update(snapshot)
        state.spend(time.perf_counter() - begin - (self._answering_seconds - others))

    def _end_update(self) -> None:
        """Warn where an effect alone takes longer than may be between contacts of anybody."""
        period = 1.0 / self._host.parameter("min_update_rate")
        for state in self._states.values():
            is_late = state.end_update(period)
            # The first update imports, and reads kernels from the disk: that is said of none.
            if is_late and state.count > 1 and state.is_to_be_told():
                logger = self._host.node.get_logger()
                logger.warning(f"effect {state.declaration.name}: {state.warning}")

    @contextmanager
    def _isolated(self, state: EffectState) -> Iterator[None]:
        """Keep the errors of one effect from the others: count and report them."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - one effect never costs another
            state.fail(error)
            if state.is_to_be_told():
                # What the system refuses says all there is to say.
                why = f" {error}" if isinstance(error, OSError) else f"\n{traceback.format_exc()}"
                self._host.node.get_logger().error(f"effect {state.declaration.name} failed:{why}")

    def answer(self, name: str, snapshot: WorldSnapshot) -> Any | None:
        """Return an answer about ``snapshot``, computed once for all its publishers.

        None where the effect that has it is off, where it is late, and where it failed, which is
        told under the name of that effect. To be called in an update.
        """
        state = self._answering[name]
        answer = state.answer
        if answer is None:
            return None
        is_new = answer.is_new(snapshot)
        begin = time.perf_counter()
        found = None
        with self._isolated(state):
            found = answer.about(snapshot)
        seconds = time.perf_counter() - begin
        self._answering_seconds += seconds
        if is_new:
            state.spend(seconds)
        return found

    def newest_answer(self, name: str) -> Found | None:
        """Return the newest answer that came, of an effect whose answers may be late."""
        answer = self._answering[name].answer
        return None if answer is None else answer.newest()

    def running(self, name: str) -> Any:
        """Return an effect that publishes, or None while it is off."""
        state = self._states[name]
        return state.effect if state.is_on else None

    def require(self, name: str, otherwise: str) -> None:
        """Raise OSError, with a remedy, where an effect could not do its work."""
        problem = self._states[name].failure
        if problem:
            raise OSError(f"{problem}; {otherwise}")

    def close(self) -> None:
        """Stop all effects at once, until they are opened again."""
        with self._lock:
            self._is_open = False
            for state in self._states.values():
                state.reason = state.waiting_reason = ""
                with self._isolated(state):
                    state.close()
            self._scene_version = -1

    def reports(self) -> list[EffectReport]:
        """Describe every effect, also those that are off."""
        resolve = self._host.node.resolve_topic_name
        with self._lock:
            return [
                state.report(resolve, self._lacks, self._why_off(state.declaration))
                for state in self._states.values()
            ]

    def _demand_of(self, snapshot: WorldSnapshot) -> Demand:
        """Return the demand for effects; its counts are made once for each scene."""
        version, demand = self._demanded
        if version != snapshot.scene_version:
            demand = Demand(
                snapshot.inspector,
                self._requests,
                snapshot.cameras,
                self._host.parameter,
                self._kept,
                _imaging(snapshot),
            )
            self._demanded = (snapshot.scene_version, demand)
        return demand

    def _lacks(self, groups: Iterable[str]) -> str:
        """Return a sentence about groups of kernels that are not ready; "" where all are."""
        return "; ".join(filter(None, [self._lack(group) for group in groups]))

    def _reason(self, declaration: EffectDeclaration, demand: Demand) -> str:
        return "" if self._is_switched_off(declaration) else declaration.asked_by(demand)

    def _is_switched_off(self, declaration: EffectDeclaration) -> bool:
        return (declaration.switch or declaration.name) in self._switched_off

    def _follow(self, snapshot: WorldSnapshot) -> None:
        self._scene_version = snapshot.scene_version
        demand = self._demand_of(snapshot)
        self._declare_cameras(snapshot)
        for state in self._states.values():
            if not state.declaration.modules:
                # Nothing is switched, and a request may come just now.
                with self._requests_lock:
                    state.reason = self._reason(state.declaration, demand)
                continue
            reason = self._reason(state.declaration, demand)
            state.kernels = state.declaration.kernel_groups(demand)
            waits = bool(reason and self._lacks(state.kernels))
            state.waiting_reason = reason if waits else ""
            reason = "" if waits else reason
            changed = bool(reason) != state.is_on
            state.reason = reason
            if changed:
                with self._isolated(state):
                    self._switch(state, snapshot)

    def _switch(self, state: EffectState, snapshot: WorldSnapshot) -> None:
        declaration, logger = state.declaration, self._host.node.get_logger()
        name = declaration.name
        if state.is_on:
            logger.info(f"effect {name} is on: {state.reason}")
            state.closes_at = None
            if state.answer is None and declaration.answer is not None:
                state.answer = self._make_answer(declaration.answer)
            if state.effect is None and declaration.factory:
                argument = declaration.argument
                told = (self._host,) if argument is None else (self._host, argument)
                state.effect = load(declaration.factory)(*told)
            return
        waits = f"it waits for its kernels; {state.waiting_reason}" if state.waiting_reason else ""
        logger.info(f"effect {name} is off: {waits or self._why_off(declaration)}")
        answer, state.answer = state.answer, None
        if answer is not None:
            answer.close()
        if state.effect is not None:
            state.closes_at = time.monotonic() + LINGER
            if not state.waiting_reason:
                # One that waits for kernels can't say that there is nothing.
                state.effect.vanish(snapshot)

    def _make_answer(self, declaration: AnswerDeclaration) -> Answer:
        question = load(declaration.question)()
        if not declaration.is_slow:
            return Answer(question)
        return SlowAnswer(
            question,
            lambda: 1.0 / self._host.parameter("min_update_rate"),
            self._host.request_update,
        )

    def _declare_cameras(self, snapshot: WorldSnapshot) -> None:
        """Have an effect for each camera of the scene, and each that sends images; no others."""
        states = dict(self._states)
        for name, state in self._states.items():
            argument = state.declaration.argument
            if argument is None or snapshot.cameras.get(argument.name) is argument:
                continue
            if isinstance(argument, SensedSource) and argument.name in _imaging(snapshot):
                continue
            # Another of the same name must not meet its topics.
            with self._isolated(state):
                state.close()
            del states[name]
        for camera in snapshot.cameras.values():
            declaration = camera_effect(camera)
            states.setdefault(declaration.name, EffectState(declaration))
        for source in _imaging(snapshot):
            declaration = sensed_effect(source)
            states.setdefault(declaration.name, EffectState(declaration))
        # Others read without the lock: what they have does not change.
        self._states = states

    def _why_off(self, declaration: EffectDeclaration) -> str:
        if self._is_switched_off(declaration):
            return "switched off by the scene file"
        return f"nothing asks for it; {declaration.would_ask} would"


def _imaging(snapshot: WorldSnapshot) -> list[str]:
    """Return the names of the sources of whose sensors the scene file says something."""
    return [
        name
        for name, record in snapshot.records.items()
        if record.sensor is not None and record.filled in snapshot.sensing
    ]

"""Configurations of a checker's robots as OMPL's states, with our limits and our proofs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
import math
from typing import Any
import weakref

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.edges.edge_proofs import EdgeProver
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.parallel.stoppable import new_stop
from scene_graph_ros.planning.paths.ompl_bridge.ompl_library import get_ompl
from scene_graph_ros.planning.paths.search.path_search import search_rules, SearchTask
from scene_graph_ros.planning.paths.search.position_space import (
    moving_positions,
    normalized,
    PositionSpace,
)

__all__ = ["OmplSpace"]

_TURN = 2.0 * math.pi


@one_line()
class OmplSpace:
    """The state space of a checker for OMPL's planners, for one thread.

    States are the positions that may move, or those of a ``group`` of the SRDF; all others stay as
    they are in q ``(nq,)``. They are a ``RealVectorStateSpace`` with our limits and our distance.
    Where joints turn without an end, or float, they are a ``CompoundStateSpace`` of that, an
    ``SO2StateSpace`` for each turning joint and an ``SO3StateSpace`` for each floating one;
    it adds up the distances of its parts. Motions between states are our straight edges.

    ``information`` is the ``ompl.base.SpaceInformation``, set up. Its motion validator proves each
    motion, as the checker was when this was made; a state is valid that keeps as much. Whoever
    uses it must keep this object.

    Raises MissingOmplError; PlanningError where nothing moves; and as the checker for q.
    """

    def __init__(
        self, checker: SceneGraphCollisionChecker, q: ArrayLike, *, group: str | None = None
    ) -> None:
        plan = checker.plan
        at = real_array(q, "q must be numbers (nq,)", PlanningError)
        if at.ndim != 1:
            raise PlanningError(f"q must have shape (nq,), not {at.shape}")
        held = normalized(plan.tree, checker.checked_configurations(at))
        space = PositionSpace.of(plan, held, moving_positions(plan.tree, group))
        self._set_up(plan, space, search_rules(checker.tolerance), new_stop())

    @classmethod
    def of_search(cls, task: SearchTask, watch: Callable[[], None]) -> OmplSpace:
        """Return that of a search; ``watch`` is called before each proof."""
        result = cls.__new__(cls)
        result._set_up(task.plan, task.space, task.rules, task.stop, watch)
        return result

    def _set_up(
        self,
        plan: CheckerPlan,
        space: PositionSpace,
        rules: EdgeRules,
        stop: NDArray[np.int64],
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        self._layout = _Layout(space)
        self._proofs = _Proofs(plan, space, self._layout, rules, stop, watch)
        self.information = _information(self._layout.new_space(), self._proofs)

    @property
    def edges(self) -> int:
        """How many motions were looked at."""
        return self._proofs.edges

    def state(self, q: ArrayLike) -> Any:
        """Return a new ``ompl.base.State`` at q ``(nq,)``; positions that do not move are left."""
        state = self.information.allocState()
        self._layout.write(np.asarray(q, dtype=np.float64), state)
        return state

    def configuration(self, state: Any) -> NDArray[np.float64]:
        """Return the configuration ``(nq,)`` of a state."""
        return self._layout.read(state)

    def path(self, path: Any) -> NDArray[np.float64]:
        """Return the configurations ``(n, nq)`` of a ``PathGeometric``, with all turns counted."""
        return self._proofs.unwound([self._layout.read(state) for state in path.getStates()])


class _Layout:
    """Which numbers of a state are which positions."""

    def __init__(self, space: PositionSpace) -> None:
        """Raise PlanningError where nothing moves."""
        moves = space.least < space.most
        floats = np.zeros(len(moves), dtype=np.bool_)
        for s in space.quaternions:
            floats[s : s + 4] = True
        turns = (space.table.periods > 0.0) & moves
        self._held = space.lower.copy()
        self._vector = np.flatnonzero(moves & ~turns & ~floats)
        self._turns = np.flatnonzero(turns)
        self._quaternions = space.quaternions
        self._lower, self._upper = space.lower[self._vector], space.upper[self._vector]
        if not len(self._vector) + len(self._turns) + len(self._quaternions):
            raise PlanningError("no position may move: OMPL has no space without dimensions")

    def new_space(self) -> Any:
        """Return the ``ompl.base.StateSpace``."""
        base = get_ompl().base
        parts, weights = [], []
        if len(self._vector):
            bounds = base.RealVectorBounds(len(self._vector))
            for k, limits in enumerate(zip(self._lower, self._upper, strict=True)):
                bounds.setLow(k, float(limits[0]))
                bounds.setHigh(k, float(limits[1]))
            parts.append(base.RealVectorStateSpace(len(self._vector)))
            parts[0].setBounds(bounds)
            weights.append(1.0)
        if len(parts) + len(self._turns) + len(self._quaternions) == 1 and parts:
            return parts[0]
        parts += [base.SO2StateSpace() for _ in self._turns]
        # The distance of SO3StateSpace is half the angle.
        parts += [base.SO3StateSpace() for _ in self._quaternions]
        weights += [1.0] * len(self._turns) + [2.0] * len(self._quaternions)
        return base.CompoundStateSpace(parts, weights)

    def _parts(self, state: Any) -> tuple[Any, list[Any], list[Any]]:
        """Return the vector of a state, its angles and its quaternions."""
        angles, quaternions = len(self._turns), len(self._quaternions)
        if not angles + quaternions:
            return state, [], []
        first = int(len(self._vector) > 0)
        rest = [state[first + k] for k in range(angles + quaternions)]
        return state[0] if first else None, rest[:angles], rest[angles:]

    def read(self, state: Any) -> NDArray[np.float64]:
        """Return the configuration ``(nq,)`` of a state."""
        q = self._held.copy()
        vector, angles, quaternions = self._parts(state)
        for k, position in enumerate(self._vector):
            q[position] = vector[k]
        for position, angle in zip(self._turns, angles, strict=True):
            q[position] = angle.value
        for s, each in zip(self._quaternions, quaternions, strict=True):
            q[s : s + 4] = each.w, each.x, each.y, each.z
        return q

    def write(self, q: NDArray[np.float64], state: Any) -> None:
        """Set a state to a configuration ``(nq,)``; angles to the turn around zero."""
        vector, angles, quaternions = self._parts(state)
        for k, position in enumerate(self._vector):
            vector[k] = float(q[position])
        for position, angle in zip(self._turns, angles, strict=True):
            angle.value = math.remainder(float(q[position]), _TURN)
        for s, each in zip(self._quaternions, quaternions, strict=True):
            length = float(np.linalg.norm(q[s : s + 4]))
            each.w, each.x, each.y, each.z = (float(c) / length for c in q[s : s + 4])


class _Proofs:
    """Answers OMPL's questions about states and motions."""

    def __init__(
        self,
        plan: CheckerPlan,
        space: PositionSpace,
        layout: _Layout,
        rules: EdgeRules,
        stop: NDArray[np.int64],
        watch: Callable[[], None],
    ) -> None:
        self._space, self._layout, self._watch = space, layout, watch
        self._motion = EdgeProver(plan, rules, stop)
        # What is free without any motion has to keep as much, but no more.
        self._still = EdgeProver(plan, rules._replace(part=1.0), stop)
        self.edges = 0

    def is_valid(self, state: Any) -> bool:
        """Tell whether a state keeps the paddings of motions."""
        self._watch()
        q = self._layout.read(state)
        return self._still.is_free(q, q)

    def is_motion_free(self, first: Any, second: Any) -> bool:
        """Tell whether the straight motion between two states is proven free."""
        self.edges += 1
        self._watch()
        a, b = self._layout.read(first), self._layout.read(second)
        return self._motion.is_free(a, b + self._space.turns(a, b))

    def unwound(self, rows: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return a path ``(n, nq)`` whose joints go on turning where angles begin anew."""
        path = rows[:1]
        for q in rows[1:]:
            path.append(q + self._space.turns(path[-1], q))
        return np.array(path)


def _information(space: Any, proofs: _Proofs) -> Any:
    """Return an ``ompl.base.SpaceInformation`` that asks for proofs, but does not keep them.

    OMPL's objects hold each other in circles which Python does not see, so they must hold nothing
    that is large.
    """
    information = get_ompl().base.SpaceInformation(space)
    asked = weakref.ref(proofs)
    information.setStateValidityChecker(lambda state: _still_there(asked).is_valid(state))
    information.setMotionValidator(_motion_validator()(information, asked))
    information.setup()
    return information


def _still_there(asked: weakref.ref[_Proofs]) -> _Proofs:
    proofs = asked()
    if proofs is None:
        raise PlanningError("the OmplSpace of this SpaceInformation is gone: keep it")
    return proofs


@cache
def _motion_validator() -> Any:
    """Return the class, which needs OMPL to be defined."""
    base = get_ompl().base

    class ProvenMotions(base.MotionValidator):  # type: ignore[name-defined]
        """Accepts motions that are proven free."""

        def __init__(self, information: Any, asked: weakref.ref[_Proofs]) -> None:
            super().__init__(information)
            self._asked = asked

        def checkMotion(self, first: Any, second: Any) -> bool:
            """Answer OMPL."""
            return _still_there(self._asked).is_motion_free(first, second)

    return ProvenMotions

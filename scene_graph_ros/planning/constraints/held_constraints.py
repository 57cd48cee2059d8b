"""Conditions on the links of one robot: measured, proven along edges, and put into words."""

from __future__ import annotations

from collections.abc import Iterable
import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.constraints.chain_states import measure
from scene_graph_ros.planning.constraints.constraint_table import (
    BOX,
    constraint_table,
    ConstraintTable,
)
from scene_graph_ros.planning.constraints.link_constraints import (
    AngleBetweenVectorsConstraint,
    as_constraints,
    LinkConstraint,
    OrientationConstraint,
)
from scene_graph_ros.planning.constraints.proof_kernels import (
    DEPTH,
    HELD,
    prove_constraints,
    UNDECIDED,
    VIOLATED,
)
from scene_graph_ros.planning.edges.curves import point_on_curve, turning_quaternions
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.parallel.stoppable import new_stop
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = [
    "ConstraintMeasure",
    "ConstraintProofs",
    "ConstraintStatus",
    "HeldConstraints",
    "measure_constraints",
]


class ConstraintStatus(enum.Enum):
    """What is known of conditions along an edge."""

    HELD = HELD
    """Proven: they hold at all configurations of it."""
    VIOLATED = VIOLATED
    """There is a configuration on it that violates one."""
    UNDECIDED = UNDECIDED
    """Somewhere it is so near to a bound that neither is shown: it counts as not held."""


@one_line()
class ConstraintMeasure(NamedTuple):
    """Whether constraints are held all along an edge, and where one is not.

    ``constraint`` is the index of the one that is violated, or not proven; then ``at``, from 0 to
    1, is where on the edge, and ``reason`` says its value and its bound there.
    """

    status: ConstraintStatus
    constraint: int | None
    at: float | None
    reason: str | None


class ConstraintProofs(NamedTuple):
    """The proofs of edges."""

    answers: NDArray[np.int64]
    """``(n,)``: HELD, VIOLATED or UNDECIDED."""
    found: NDArray[np.int64]
    """``(n,)``: the condition that is not held, or -1."""
    where: NDArray[np.float64]
    """``(n,)``: from 0 to 1 on the edge."""


class HeldConstraints:
    """Conditions on the links of one tree."""

    def __init__(self, tree: KinematicTree, constraints: Iterable[LinkConstraint]) -> None:
        """Raise PlanningError for bad constraints, KinematicTreeError for unknown links."""
        self.constraints = as_constraints(constraints)
        self.tree = tree
        self.table: ConstraintTable | None = None
        if self.constraints:
            self.table = constraint_table(tree, self.constraints)

    def __bool__(self) -> bool:
        return self.table is not None

    def prove(
        self,
        edges: NDArray[np.float64],
        *,
        part: float = 1.0,
        stop: NDArray[np.int64] | None = None,
    ) -> ConstraintProofs:
        """Prove that edges ``(n, m, nq)`` hold all conditions; see ``prove_constraints``."""
        n = len(edges)
        proofs = ConstraintProofs(np.full(n, HELD, np.int64), np.full(n, -1, np.int64), np.ones(n))
        if self.table is not None:
            prove_constraints(
                self.tree.table,
                self.table,
                edges,
                part,
                new_stop() if stop is None else stop,
                *proofs,
                self._scratch(),
            )
        return proofs

    def _scratch(self) -> tuple[NDArray[np.float64], ...]:
        assert self.table is not None
        count = len(self.table.elements)
        return (
            np.empty(self.tree.num_positions),
            np.empty((count, 3, 3)),
            np.empty((count, 3)),
            np.empty((DEPTH, 5)),
        )

    def values(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values ``(n, c, 3)`` at configurations ``(n, nq)``: of turns the first."""
        values = np.zeros((len(q), len(self.constraints), 3))
        if self.table is not None:
            _, axes, origins, _ = self._scratch()
            measure(self.table, q, axes, origins, values)
        return values

    def describe_excess(self, q: NDArray[np.float64]) -> str | None:
        """Return a sentence on the first condition that q ``(nq,)`` violates, or None."""
        if self.table is None:
            return None
        values, table = self.values(q[np.newaxis])[0], self.table
        for c in range(len(values)):
            count = 3 if table.kinds[c] == BOX else 1
            slack = table.rounding[c]
            for i in range(count):
                low, high = table.lower[c, i], table.upper[c, i]
                if not low - slack <= values[c, i] <= high + slack:
                    return f"violates {self._words(c, i, values[c, i], low, high)}"
        return None

    def name(self, c: int) -> str:
        """Return a condition's name: its number, kind and link."""
        each = self.constraints[c]
        return f"constraint {c} ({type(each).__name__} on {each.link!r})"

    def _words(self, c: int, i: int, value: float, low: float, high: float) -> str:
        each = self.constraints[c]
        frame = "the world" if each.frame is None else repr(each.frame)
        if isinstance(each, OrientationConstraint):
            return (
                f"{self.name(c)}: its orientation in {frame} is {value:.10g} rad off, and"
                f" theta_bound is {high:.10g}"
            )
        bounds = f"must be from {low:.10g} to {high:.10g}"
        if isinstance(each, AngleBetweenVectorsConstraint):
            return f"{self.name(c)}: the angle in {frame} {bounds} rad, and is {value:.10g}"
        axis = "xyz"[i]
        return f"{self.name(c)}: {axis} of its point in the box {bounds} m, and is {value:.10g}"

    def describe(self, edge: NDArray[np.float64], proofs: ConstraintProofs, row: int) -> str:
        """Return a sentence on an edge ``(m, nq)`` that is not proven to hold all conditions."""
        c, t = int(proofs.found[row]), float(proofs.where[row])
        if proofs.answers[row] == VIOLATED:
            words = self.describe_excess(point_on_curve(self.tree, edge, t))
            if words is not None:
                return words
        return f"is not proven to hold {self.name(c)}: it is too near to its bound"


def measure_constraints(
    robots: SceneGraphCollisionChecker | KinematicTree,
    edges: ArrayLike,
    constraints: Iterable[LinkConstraint],
) -> list[ConstraintMeasure]:
    """Return whether edges ``(n, 2, nq)``, or curves ``(n, m, nq)``, hold constraints, proven.

    Edges are as of `SceneGraphCollisionChecker.check_edges_collision_free`, and nothing is
    checked for collisions here. What is held is held at all configurations of an edge, to 1e-9 rad
    and m (for points far away also to 1e-14 of how far). Raises PlanningError for bad
    constraints and edges of another shape, KinematicTreeError for unknown links and infinities.
    """
    tree = robots if isinstance(robots, KinematicTree) else robots.plan.tree
    held, nq = HeldConstraints(tree, constraints), tree.num_positions
    array = real_array(edges, "edges must be numbers", PlanningError)
    if array.ndim != 3 or array.shape[1] < 2 or array.shape[2] != nq:
        raise PlanningError(
            f"edges must have shape (n, 2, {nq}), or more control points, not {array.shape}"
        )
    tree.checked_configurations(array.reshape(-1, nq) if nq else array[:, 0])
    for edge, name in turning_quaternions(tree, array) if array.shape[1] > 2 else ():
        raise PlanningError(
            f"edge {edge} is curved, so its joint {name!r}, which floats, must not turn"
        )
    proofs = held.prove(array)
    result = []
    for row, (answer, c, t) in enumerate(zip(*(each.tolist() for each in proofs), strict=True)):
        status = ConstraintStatus(answer)
        if status is ConstraintStatus.HELD:
            result.append(ConstraintMeasure(status, None, None, None))
        else:
            words = held.describe(array[row], proofs, row)
            result.append(ConstraintMeasure(status, c, t, words))
    return result

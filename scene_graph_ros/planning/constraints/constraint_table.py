"""Conditions on links as kernels read them: the chain of joints of each, and what it bounds.

A chain leads from the frame A of a condition to its link, up to the joint that both hang on and
down again. Each coordinate of a joint is an element: it turns about or slides along the z axis of
its frame, or turns as a floating joint's quaternion does. On the way up they are inverted.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.poses import inverse, quaternions_from_poses
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.planning.constraints.link_constraints import (
    AngleBetweenVectorsConstraint,
    LinkConstraint,
    OrientationConstraint,
    PositionConstraint,
)
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

__all__ = [
    "BALL",
    "BALL_INVERSE",
    "BETWEEN",
    "BOX",
    "NEAR",
    "SLIDE",
    "TURN",
    "ConstraintTable",
    "constraint_table",
]

TURN, SLIDE, BALL, BALL_INVERSE = range(4)
"""Kinds of elements."""

BETWEEN, NEAR, BOX = range(3)
"""Kinds of conditions: an angle between vectors, a turn from an orientation, a box."""


class ConstraintTable(NamedTuple):
    """Conditions, and the elements of all their chains, one after the other."""

    kinds: NDArray[np.int64]
    """``(c,)``: of conditions."""
    firsts: NDArray[np.int64]
    """``(c + 1,)``: the first element of each chain."""
    ends_Q: NDArray[np.float64]
    """``(c, 4)``, w first: the tool in the frame of the last element."""
    ends_p: NDArray[np.float64]
    """``(c, 3)`` m."""
    targets: NDArray[np.float64]
    """``(c, 4)``: the vector in A, or the orientation's quaternion, w first."""
    vectors: NDArray[np.float64]
    """``(c, 3)``: the vector in L."""
    lower: NDArray[np.float64]
    """``(c, 3)`` rad or m; where one number counts, the first."""
    upper: NDArray[np.float64]
    """``(c, 3)``."""
    rounding: NDArray[np.float64]
    """``(c,)`` rad or m: beyond a bound by that it is held."""
    elements: NDArray[np.int64]
    """``(e,)``: kinds of elements."""
    columns: NDArray[np.int64]
    """``(e,)``: the position of each, or the first of a quaternion."""
    multipliers: NDArray[np.float64]
    """``(e,)``: it turns or slides by ``multiplier * position + offset``."""
    offsets: NDArray[np.float64]
    """``(e,)``."""
    frames: NDArray[np.float64]
    """``(e, 4)``, w first: the frame of each, in that after the one before."""
    places: NDArray[np.float64]
    """``(e, 3)`` m."""


HELD = 1e-9
"""rad or m: beyond a bound by less it counts as held."""

_DIGITS = 1e-14
"""Relative to its distance: by how much a point is rounded, at most."""


class _Chain:
    """The elements from a frame on, and the pose since the last of them."""

    def __init__(self, tree: KinematicTree, X: NDArray[np.float64]) -> None:
        self._tree, self.X = tree, X
        self.rows: list[tuple[int, int, float, float]] = []
        self.frames: list[NDArray[np.float64]] = []

    def _add(
        self, kind: int, column: int, multiplier: float, offset: float, axis: int | None
    ) -> None:
        """Add an element along an axis of the frame where the chain is."""
        turned = np.eye(4) if axis is None else _axis_frame(axis)
        self.frames.append(product(self.X, turned))
        self.X = np.ascontiguousarray(turned.T)
        self.rows.append((kind, column, multiplier, offset))

    def down(self, row: int) -> None:
        """Go through a joint, from its parent's frame to its own."""
        self._to(self._tree.joints[row - 1].X_PJ)
        for element in _elements(self._tree, row):
            self._add(*element)

    def up(self, row: int) -> None:
        """Go through a joint, from its own frame to its parent's."""
        for kind, column, multiplier, offset, axis in reversed(_elements(self._tree, row)):
            other = BALL_INVERSE if kind == BALL else kind
            self._add(other, column, -multiplier, -offset, axis)
        self._to(inverse(self._tree.joints[row - 1].X_PJ))

    def _to(self, X: NDArray[np.float64]) -> None:
        self.X = product(self.X, X)

    def end(self, X: NDArray[np.float64]) -> None:
        """Go on to the link's frame, or the tool's."""
        self._to(X)


def _axis_frame(axis: int) -> NDArray[np.float64]:
    """Return a frame ``(4, 4)`` whose z axis is the axis of that number."""
    X = np.zeros((4, 4))
    for column in range(3):
        X[(axis + 1 + column) % 3, column] = 1.0
    X[3, 3] = 1.0
    return X


_Element = tuple[int, int, float, float, int | None]


def _elements(tree: KinematicTree, row: int) -> list[_Element]:
    table = tree.table
    kind, start = int(table.kinds[row]), int(table.starts[row])
    if kind == FLOATING:
        slides: list[_Element] = [(SLIDE, start + 4 + k, 1.0, 0.0, k) for k in range(3)]
        return [*slides, (BALL, start, 1.0, 0.0, None)]
    if kind == PLANAR:
        return [
            (SLIDE, start, 1.0, 0.0, 0),
            (SLIDE, start + 1, 1.0, 0.0, 1),
            (TURN, start + 2, 1.0, 0.0, 2),
        ]
    assert kind in (REVOLUTE, PRISMATIC)
    own = TURN if kind == REVOLUTE else SLIDE
    return [(own, start, float(table.multipliers[row]), float(table.offsets[row]), 2)]


def _joints_above(tree: KinematicTree, link: str) -> list[int]:
    """Return the joints that carry a link, from the base on."""
    rows, row = [], tree.joint_of_link[tree.link_index(link)]
    while row > 0:
        rows.append(row)
        row = int(tree.table.parents[row])
    return rows[::-1]


def _chain(
    tree: KinematicTree, each: Any, X_FA: NDArray[np.float64], X_LT: NDArray[np.float64]
) -> _Chain:
    """Return the chain from F, in the frame of a condition, to the tool."""
    below = _joints_above(tree, each.link)
    if each.frame is None:
        chain = _Chain(tree, product(X_FA, tree.X_WB))
    else:
        own = _joints_above(tree, each.frame)
        shared = 0
        while shared < min(len(own), len(below)) and own[shared] == below[shared]:
            shared += 1
        X_JA = tree.X_JL[tree.link_index(each.frame)]
        chain = _Chain(tree, product(X_FA, inverse(X_JA)))
        for row in reversed(own[shared:]):
            chain.up(row)
        below = below[shared:]
    for row in below:
        chain.down(row)
    chain.end(product(tree.X_JL[tree.link_index(each.link)], X_LT))
    return chain


def _w_first(X: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quaternion of a pose, w first."""
    return quaternions_from_poses(X[np.newaxis])[0, [3, 0, 1, 2]]


def constraint_table(
    tree: KinematicTree, constraints: tuple[LinkConstraint, ...]
) -> ConstraintTable:
    """Return the table of conditions. Raises KinematicTreeError for an unknown link."""
    chains, kinds, targets, vectors, lower, upper = [], [], [], [], [], []
    for each in constraints:
        X_FA, X_LT = np.eye(4), np.eye(4)
        target, vector = np.zeros(4), np.zeros(3)
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        if isinstance(each, AngleBetweenVectorsConstraint):
            kind = BETWEEN
            target[:3], vector = each.a_A, each.b_L
            low[0], high[0] = each.angle_lower, each.angle_upper
        elif isinstance(each, OrientationConstraint):
            kind, X_AT = NEAR, np.eye(4)
            X_AT[:3, :3], X_LT[:3, :3] = each.R_AT, each.R_LT
            target, low[0], high[0] = _w_first(X_AT), 0.0, each.theta_bound
        else:
            assert isinstance(each, PositionConstraint)
            kind, X_FA, X_LT[:3, 3] = BOX, inverse(each.X_AF), each.p_LQ
            low, high = each.p_FQ_lower, each.p_FQ_upper
        kinds.append(kind)
        chains.append(_chain(tree, each, X_FA, X_LT))
        targets.append(target)
        vectors.append(vector)
        lower.append(low)
        upper.append(high)
    rows = [row for chain in chains for row in chain.rows]
    frames = [X for chain in chains for X in chain.frames]
    poses = np.array([*frames, *(chain.X for chain in chains)]).reshape(-1, 4, 4)
    quaternions = np.ascontiguousarray(quaternions_from_poses(poses)[:, [3, 0, 1, 2]])
    places, count = np.ascontiguousarray(poses[:, :3, 3]), len(frames)
    elements, columns, multipliers, offsets = zip(*rows, strict=True) if rows else ((),) * 4
    firsts = np.concatenate([[0], np.cumsum([len(chain.rows) for chain in chains])])
    sizes = [
        math.fsum(float(np.abs(X[:3, 3]).max()) for X in [*chain.frames, chain.X])
        for chain in chains
    ]
    return ConstraintTable(
        np.array(kinds, dtype=np.int64),
        firsts.astype(np.int64),
        quaternions[count:],
        places[count:],
        np.array(targets),
        np.array(vectors),
        np.array(lower),
        np.array(upper),
        HELD + _DIGITS * np.where(np.array(kinds) == BOX, sizes, 0.0),
        np.array(elements, dtype=np.int64),
        np.array(columns, dtype=np.int64),
        np.array(multipliers, dtype=np.float64),
        np.array(offsets, dtype=np.float64),
        quaternions[:count],
        places[:count],
    )

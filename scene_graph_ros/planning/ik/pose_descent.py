"""Many configurations at once that go down towards a target, each on its own.

Levenberg and Marquardt's steps, damped in proportion to what is left of the error, which needs no
care at singular configurations (Sugihara, *Solvability-Unconcerned Inverse Kinematics by the
Levenberg-Marquardt Method*, 2011). Positions stay within their limits: those that a step would
move beyond are held, and the step is taken with the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.ik.pose_target import PoseTarget
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR

__all__ = ["Descents", "PoseDescent"]

_MOST_STEPS = 120
"""Of one try."""

_LONGEST = 0.8
"""rad or m: what one position changes in a step at most."""

_LEAST_DAMPING = 1e-13
"""rad² and m²: keeps equations solvable where no joint moves the tool in some direction."""

_HOPELESS = 1e7
"""Damping, times the squared error: no step helps where that much is needed."""

_CENTERED = 1e-6
"""rad or m: a larger tolerance is used up; with a smaller one the target itself is looked for."""

_HALF_TURN = 1e-3
"""Twice the sine of an angle near pi below which the axis is read off R + 1 instead."""

_NO_TURN = 1e-12
"""Twice the sine of an angle below which a turn is as large as its sine."""

_USED = 0.999
"""Of a tolerance."""


class Descents(NamedTuple):
    """Where some tries ended."""

    q: NDArray[np.float64]
    """``(n, nq)``."""
    position_errors: NDArray[np.float64]
    """``(n,)`` m."""
    rotation_errors: NDArray[np.float64]
    """``(n,)`` rad."""
    reached: NDArray[np.bool_]
    """``(n,)``: both are within the target's tolerances."""


class PoseDescent:
    """The way to one target, for positions between limits of which some may move."""

    def __init__(
        self,
        tree: KinematicTree,
        target: PoseTarget,
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        moves: NDArray[np.bool_],
    ) -> None:
        """Take limits ``(nq,)`` and what ``moves`` ``(nq,)``; of a quaternion all or nothing."""
        self._tree, self._target = tree, target
        self._lower, self._upper = lower, upper
        self._places = np.full(tree.num_velocities, -1)
        """``(nv,)``: the position that a velocity is of; -1 for turns of floating joints."""
        self._turns: list[tuple[int, int]] = []
        """Where quaternions begin, and their angular velocities."""
        table = tree.table
        joints = zip(table.kinds[1:], table.starts[1:], table.velocity_starts[1:], strict=True)
        for kind, s, v in joints:
            if kind == FLOATING:
                self._places[v + 3 : v + 6] = np.arange(s + 4, s + 7)
                self._turns.append((int(s), int(v)))
            else:
                count = 3 if kind == PLANAR else 1
                self._places[v : v + count] = np.arange(s, s + count)
        self._linear = self._places >= 0
        self._moves = np.zeros(tree.num_velocities, dtype=np.bool_)
        self._moves[self._linear] = moves[self._places[self._linear]]
        for s, v in self._turns:
            self._moves[v : v + 3] = moves[s]

    def descend(self, q: NDArray[np.float64]) -> Descents:
        """Return where tries from ``q`` ``(n, nq)`` end."""
        q = q.copy()
        errors, left = self._errors(q)
        damping, open_ones = np.full(len(q), 1e-2), np.flatnonzero((left > 0.0).any(axis=1))
        for _ in range(_MOST_STEPS):
            if not len(open_ones):
                break
            rows = open_ones
            steps = self._steps(q[rows], left[rows], damping[rows])
            tried = self._stepped(q[rows], steps)
            new_errors, new_left = self._errors(tried)
            is_better = (new_left**2).sum(axis=1) < (left[rows] ** 2).sum(axis=1)
            taken = rows[is_better]
            q[taken], errors[taken] = tried[is_better], new_errors[is_better]
            left[taken] = new_left[is_better]
            damping[rows] = np.where(is_better, 0.25 * damping[rows], 8.0 * damping[rows])
            is_open = ~self._reached(errors[rows]) & (damping[rows] < _HOPELESS)
            open_ones = rows[is_open]
        return Descents(q, errors[:, 1], errors[:, 0], self._reached(errors))

    def _reached(self, errors: NDArray[np.float64]) -> NDArray[np.bool_]:
        limits = self._target.rotation_tolerance, self._target.position_tolerance
        return np.asarray((errors <= limits).all(axis=1))

    def _errors(self, q: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angles and distances ``(n, 2)``, and what is left of both as ``(n, 6)`` in W."""
        target = self._target
        X_WT = self._tree.link_poses(q, [target.link])[:, 0] @ target.X_LT
        turns = _rotation_vectors(target.X_WT[:3, :3] @ X_WT[:, :3, :3].transpose(0, 2, 1))
        ways = target.X_WT[:3, 3] - X_WT[:, :3, 3]
        errors = np.stack([np.linalg.norm(each, axis=1) for each in (turns, ways)], axis=1)
        parts = []
        tolerances = target.rotation_tolerance, target.position_tolerance
        for vectors, sizes, tolerance in zip((turns, ways), errors.T, tolerances, strict=True):
            allowed = _USED * tolerance if tolerance > _CENTERED else 0.0
            shares = np.zeros_like(sizes)
            np.divide(sizes - allowed, sizes, out=shares, where=sizes > allowed)
            parts.append(vectors * shares[:, np.newaxis])
        return errors, np.concatenate(parts, axis=1)

    def _steps(
        self, q: NDArray[np.float64], left: NDArray[np.float64], damping: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return velocities ``(n, nv)`` that take away what is left, as far as limits allow."""
        target = self._target
        J = self._tree.jacobians(q, target.link, target.X_LT[:3, 3])
        J[:, :, ~self._moves] = 0.0
        amount = damping * (left**2).sum(axis=1) + _LEAST_DAMPING
        steps = _damped(J, left, amount)
        places, linear = self._places[self._linear], np.flatnonzero(self._linear)
        at_lower, at_upper = (
            q[:, places] <= self._lower[places],
            q[:, places] >= self._upper[places],
        )
        held = (at_lower & (steps[:, linear] < 0.0)) | (at_upper & (steps[:, linear] > 0.0))
        rows = np.flatnonzero(held.any(axis=1))
        if len(rows):
            row, column = np.nonzero(held)
            J[row, :, linear[column]] = 0.0
            steps[rows] = _damped(J[rows], left[rows], amount[rows])
        largest = np.abs(steps).max(axis=1, initial=_LONGEST)
        return steps * (_LONGEST / largest)[:, np.newaxis]

    def _stepped(self, q: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
        result = q.copy()
        places = self._places[self._linear]
        moved = q[:, places] + steps[:, self._linear]
        result[:, places] = np.clip(moved, self._lower[places], self._upper[places])
        for s, v in self._turns:
            result[:, s : s + 4] = _turned(q[:, s : s + 4], steps[:, v : v + 3])
        return result


def _damped(
    J: NDArray[np.float64], left: NDArray[np.float64], damping: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``J^T (J J^T + damping)^-1 left`` for ``(n, 6, nv)``, ``(n, 6)`` and ``(n,)``."""
    J_T = J.transpose(0, 2, 1)
    A = J @ J_T + damping[:, np.newaxis, np.newaxis] * np.eye(6)
    return (J_T @ np.linalg.solve(A, left[:, :, np.newaxis]))[:, :, 0]


def _rotation_vectors(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return axes times angles ``(n, 3)`` of rotations ``(n, 3, 3)``."""
    doubled = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    sines = np.linalg.norm(doubled, axis=1)
    cosines = np.trace(R, axis1=1, axis2=2) - 1.0
    angles = np.arctan2(sines, cosines)
    # Near half a turn the axis is a column of R + 1, near none it does not matter.
    is_half = (cosines < 0.0) & (sines < _HALF_TURN)
    for row in np.flatnonzero(is_half):
        columns = R[row] + np.eye(3)
        axis = columns[:, np.argmax(np.diag(columns))]
        sign = 1.0 if doubled[row] @ axis >= 0.0 else -1.0
        doubled[row], sines[row] = sign * axis, np.linalg.norm(axis)
    scales = np.full_like(angles, 0.5)
    np.divide(angles, sines, out=scales, where=sines > _NO_TURN)
    return doubled * scales[:, np.newaxis]


def _turned(quaternions: NDArray[np.float64], turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions ``(n, 4)``, w first, turned further by rotation vectors ``(n, 3)``."""
    half = 0.5 * np.linalg.norm(turns, axis=1)[:, np.newaxis]
    a = np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * turns], axis=1)
    b = quaternions / np.linalg.norm(quaternions, axis=1)[:, np.newaxis]
    w = a[:, 0] * b[:, 0] - (a[:, 1:] * b[:, 1:]).sum(axis=1)
    xyz = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.concatenate([w[:, np.newaxis], xyz], axis=1)

"""Where links are as quotients of polynomials: angles are turned into tangents of their halves.

With ``s = tan((q - q_star) / 2)``, ``q - q_star`` has the cosine ``(1 - s^2) / (1 + s^2)`` and the
sine ``2 s / (1 + s^2)`` (Dai, Amice, Werner, Zhang and Tedrake, "Certified polyhedral
decompositions of collision-free configuration space", 2023, section III). Of a joint that slides s
is ``q - q_star``. J is the frame of a joint after it has moved, P that of the joint before it, G
that of a geometry.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.polynomials import (
    constant,
    linear,
    Polynomial,
    scaled,
    sum_of_products,
    total,
    weighted_sum,
)
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import PRISMATIC, REVOLUTE

__all__ = ["PathToFrame", "RationalForwardKinematics", "RationalPose", "Stretch"]

_WIDEST = math.pi - 1e-3
"""rad: farther from q_star tangents of half angles are no numbers to reckon with."""


class Stretch(NamedTuple):
    """The values of one s, as ``middle + half u`` with u in [-1, 1]."""

    middle: Fraction
    half: Fraction


class PathToFrame(NamedTuple):
    """The joints (rows of the tree's table) between a body and a frame E in which it is looked at.

    From the body up through ``up``, then down through ``down`` to E, which is after the last of
    the latter, or before the last of the former.
    """

    up: tuple[int, ...]
    down: tuple[int, ...]


class RationalPose(NamedTuple):
    """A pose X_EG as polynomials: ``matrix[i][k] / denominator``, of 3 rows and 4 columns."""

    matrix: list[list[Polynomial]]
    denominator: Polynomial


@one_line("tree", "q_star")
class RationalForwardKinematics:
    """The poses of a tree's links as rational functions of s ``(nq,)``."""

    def __init__(self, tree: KinematicTree, q_star: ArrayLike | None = None) -> None:
        """Take s = 0 at ``q_star`` ``(nq,)``; without, at zero.

        Raises CertificateError for joints that are neither revolute nor prismatic, and for
        revolute ones that mimic another with a multiplier that is none of -1, 0 and 1;
        KinematicTreeError for a bad q_star.
        """
        for joint in tree.joints:
            if joint.kind not in (REVOLUTE, PRISMATIC):
                raise CertificateError(
                    f"joint {joint.name!r} is planar or floating; rational kinematics are those of"
                    " revolute and prismatic joints"
                )
            if joint.kind == REVOLUTE and joint.multiplier not in (-1.0, 0.0, 1.0):
                raise CertificateError(
                    f"joint {joint.name!r} mimics {joint.mimics!r} with the multiplier"
                    f" {joint.multiplier:g}; that of a revolute joint must be -1, 0 or 1"
                )
        self.tree = tree
        star = tree.zero_configuration() if q_star is None else _numbers("q_star", q_star)
        self.q_star: NDArray[np.float64] = tree.checked_configurations(star[np.newaxis])[0].copy()
        self.turns: NDArray[np.bool_] = np.zeros(tree.num_positions, dtype=np.bool_)
        self._starts = [int(start) for start in tree.table.starts]
        for row, joint in enumerate(tree.joints, 1):
            if joint.mimics:
                continue
            self.turns[self._starts[row]] = joint.kind == REVOLUTE
        for row, joint in enumerate(tree.joints, 1):
            turns = self.turns[self._starts[row]]
            if joint.multiplier and turns != (joint.kind == REVOLUTE):
                raise CertificateError(
                    f"joint {joint.name!r} mimics {joint.mimics!r}, and only one of them turns"
                )

    def compute_s_value(self, q: ArrayLike) -> NDArray[np.float64]:
        """Return s ``(..., nq)`` of configurations ``(..., nq)``.

        Raises CertificateError for an angle that is half a turn or more from q_star.
        """
        way = self._rows("q", q) - self.q_star
        far = self.turns & (np.abs(way) > _WIDEST)
        if far.any():
            column = int(np.argwhere(far)[0][-1])
            raise CertificateError(
                f"q: position {self.tree.position_names[column]!r} must be less than half a turn"
                f" from q_star, not {quoted(way[far].flat[0])} rad"
            )
        return np.where(self.turns, np.tan(0.5 * np.where(self.turns, way, 0.0)), way)

    def compute_q_value(self, s: ArrayLike) -> NDArray[np.float64]:
        """Return configurations ``(..., nq)`` of s ``(..., nq)``."""
        values = self._rows("s", s)
        return self.q_star + np.where(self.turns, 2.0 * np.arctan(values), values)

    def compute_q_jacobian(self, s: ArrayLike) -> NDArray[np.float64]:
        """Return derivatives ``(..., nq, nq)`` of `compute_q_value` at s ``(..., nq)``."""
        values = self._rows("s", s)
        slopes = np.where(self.turns, 2.0 / (1.0 + values * values), 1.0)
        return slopes[..., np.newaxis] * np.eye(self.tree.num_positions)

    def _rows(self, name: str, values: ArrayLike) -> NDArray[np.float64]:
        """Return numbers ``(..., nq)``. Raises CertificateError."""
        found = _numbers(name, values)
        if found.shape[-1:] != (self.tree.num_positions,):
            raise CertificateError(
                f"{name} must have shape (..., {self.tree.num_positions}), not {found.shape}"
            )
        return found

    def s_limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return limits ``(nq,)`` of s, from those of the joints; infinite where there is none.

        Angles are not more than half a turn from q_star.
        """
        lower, upper = self.tree.lower - self.q_star, self.tree.upper - self.q_star
        ends = []
        for way, end in ((lower, -_WIDEST), (upper, _WIDEST)):
            kept = np.clip(way, -_WIDEST, _WIDEST)
            kept = np.where(np.isfinite(kept), kept, end)
            ends.append(np.where(self.turns, np.tan(0.5 * kept), way))
        return ends[0], ends[1]

    def path_between(
        self, joint_A: int, joint_B: int, *, at_B: bool = False
    ) -> tuple[PathToFrame, PathToFrame]:
        """Return the ways of two bodies, by their joints, to the frame in the middle between them.

        Each sees half of the joints between them move, so that degrees are small. With ``at_B``
        the frame is that of B's joint, and A sees all of them.
        """
        parents = self.tree.table.parents
        chains = []
        for row in (joint_A, joint_B):
            chain = []
            while row > 0:
                chain.append(int(row))
                row = parents[row]
            chains.append(chain)
        while chains[0] and chains[1] and chains[0][-1] == chains[1][-1]:
            chains[0].pop()
            chains[1].pop()
        a, b = (tuple(chain) for chain in chains)
        if at_B:
            return PathToFrame(a, tuple(reversed(b))), PathToFrame((), ())
        half = (len(a) + len(b) + 1) // 2
        if len(a) >= half:
            return PathToFrame(a[:half], ()), PathToFrame(b, tuple(reversed(a[half:])))
        half = len(a) + len(b) - half
        return PathToFrame(a, tuple(reversed(b[half:]))), PathToFrame(b[:half], ())

    def positions_of(self, path: PathToFrame) -> list[int]:
        """Return the positions (entries of q) that move a body on its way to E, in order."""
        rows = [row for row in (*path.up, *path.down) if self._joint(row).multiplier]
        return sorted({self._starts[row] for row in rows})

    def pose(
        self,
        X_JG: NDArray[np.float64],
        path: PathToFrame,
        stretches: Sequence[Stretch],
        variables: Sequence[int],
    ) -> RationalPose:
        """Return X_EG in ``u``, the variables of some positions of q, in exact arithmetic.

        ``X_JG`` ``(3, 4)`` is where the body is in its joint's frame, or in the base's. Raises
        CertificateError where one position turns the body twice.
        """
        n = len(variables)
        column = {position: k for k, position in enumerate(variables)}
        matrix = [[constant(Fraction(float(v)), n) for v in row] for row in X_JG]
        pose = RationalPose(matrix, constant(1, n))

        def value(row: int) -> Polynomial:
            k = column[self._starts[row]]
            slopes = [stretches[k].half if i == k else Fraction(0) for i in range(n)]
            return linear(stretches[k].middle, slopes)

        for row in path.up:
            joint = self._joint(row)
            pose = self._moved(pose, row, value(row) if joint.multiplier else constant(0, n), 1)
            pose = _placed(pose, joint.X_PJ[:3, :3], joint.X_PJ[:3, 3])
        for row in path.down:
            joint = self._joint(row)
            R_JP = joint.X_PJ[:3, :3].T
            pose = _placed(pose, R_JP, -R_JP @ joint.X_PJ[:3, 3])
            pose = self._moved(pose, row, value(row) if joint.multiplier else constant(0, n), -1)
        for k in range(n):
            if any(e[k] > 2 for line in pose.matrix for entry in line for e in entry):
                raise CertificateError(
                    f"position {self.tree.position_names[variables[k]]!r} turns a body twice"
                )
        return pose

    def _joint(self, row: int) -> TreeJoint:
        return self.tree.joints[row - 1]

    def _moved(self, pose: RationalPose, row: int, t: Polynomial, sign: int) -> RationalPose:
        """Let a joint move a pose: forwards with the sign 1, backwards with -1."""
        joint = self._joint(row)
        n = len(next(iter(pose.denominator)))
        at_star = joint.multiplier * self.q_star[self._starts[row]] + joint.offset
        x, y, z = pose.matrix
        one = constant(1, n)
        if joint.kind == PRISMATIC:
            way = total(
                [constant(Fraction(float(at_star)), n), scaled(t, _exact(joint.multiplier))]
            )
            moved = sum_of_products([(sign, way, pose.denominator)])
            return RationalPose([x, y, [*z[:3], total([z[3], moved])]], pose.denominator)
        c, s = Fraction(math.cos(at_star)), Fraction(math.sin(at_star)) * sign
        if joint.multiplier:
            square = sum_of_products([(1, t, t)])
            turned = scaled(t, 2 * _exact(joint.multiplier) * sign)
            rest, over = total([one, scaled(square, Fraction(-1))]), total([one, square])
            cosine = total([scaled(rest, c), scaled(turned, -s)])
            sine = total([scaled(rest, s), scaled(turned, c)])
        else:
            cosine, sine, over = constant(c, n), constant(s, n), one
        rows = [
            [sum_of_products([(1, cosine, a), (-1, sine, b)]) for a, b in zip(x, y, strict=True)],
            [sum_of_products([(1, sine, a), (1, cosine, b)]) for a, b in zip(x, y, strict=True)],
            [sum_of_products([(1, over, a)]) for a in z],
        ]
        return RationalPose(rows, sum_of_products([(1, over, pose.denominator)]))


def _exact(value: float) -> Fraction:
    return Fraction(float(value))


def _placed(pose: RationalPose, R: NDArray[np.float64], p: NDArray[np.float64]) -> RationalPose:
    """Return a pose in another frame, in which its own is turned by R and is at p."""
    rows = []
    for i in range(3):
        row = [
            weighted_sum((_exact(R[i, j]), pose.matrix[j][k]) for j in range(3)) for k in range(4)
        ]
        row[3] = weighted_sum([(Fraction(1), row[3]), (_exact(p[i]), pose.denominator)])
        rows.append(row)
    return RationalPose(rows, pose.denominator)


def _numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    rule = f"{name} must be finite numbers"
    found = real_array(values, rule, CertificateError)
    if not np.isfinite(found).all():
        raise CertificateError(f"{rule}: {quoted(values)}")
    return found

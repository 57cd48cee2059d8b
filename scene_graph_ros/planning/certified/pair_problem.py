"""The claim about two geometries: a plane keeps them apart at all s of a region.

In the frame E in the middle between them the plane is ``a(s) . x + b(s) = 0`` with a and b affine
in s, and ``|a(s)| <= 1`` in the region. A is on its positive side, B on the negative one, each by
its radius and a clearance: then their distance is at least twice that clearance, in metres. Beside
a half space the plane is parallel to it, and E is its own frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.exact_matrices import exact_array, ExactArray
from scene_graph_ros.planning.certified.pair_shapes import rounded_hull
from scene_graph_ros.planning.certified.pair_side import BodyPoints, MovingFrame, Side
from scene_graph_ros.planning.certified.polynomials import scaled
from scene_graph_ros.planning.certified.rational_kinematics import (
    PathToFrame,
    RationalForwardKinematics,
    RationalPose,
    Stretch,
)
from scene_graph_ros.planning.certified.tangent_region import power_of_two, Row, TangentRegion
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan

__all__ = ["HalfSpaceInE", "PairProblem", "PairProblems"]


_SHORTER = 1 - Fraction(1, 2**15)
"""What a half space's normal is multiplied by, so that its length is below 1 with some room."""


class HalfSpaceInE(NamedTuple):
    """All points x of E with ``normal . x <= offset``; the normal is a little shorter than 1."""

    normal: tuple[Fraction, Fraction, Fraction]
    offset: Fraction

    def plane(self, clearance: Fraction, variables: int) -> tuple[tuple[Fraction, ...], ...]:
        """Return the plane that is beside it by a clearance: three coordinates and the offset."""
        constants = (*self.normal, -self.offset - clearance)
        return tuple((v, *[Fraction(0)] * variables) for v in constants)


@dataclass(frozen=True)
class PairProblem:
    """Two geometries, in variables u in [-1, 1] of some positions.

    ``rows`` are those of the region's C that are about them, in u, each divided by its scale.
    """

    names: tuple[str, str]
    variables: tuple[int, ...]
    sides: tuple[Side, Side]
    rows: tuple[Row, ...]
    row_numbers: tuple[int, ...]
    row_scales: tuple[Fraction, ...]
    stretches: tuple[Stretch, ...]
    """Of each variable: where its s are."""
    num_positions: int
    plane_index: int
    """Which of the checker's pairs it is."""
    half_space: HalfSpaceInE | None = None
    """B, if it is one: the plane is parallel to it."""

    @property
    def all_rows(self) -> list[Row]:
        """The constant 1, ``1 + u_k`` and ``1 - u_k`` of each variable, and the region's rows."""
        n = len(self.variables)
        result: list[Row] = [(Fraction(1), (Fraction(0),) * n)]
        for k, sign in itertools.product(range(n), (1, -1)):
            result.append((Fraction(1), tuple(Fraction(sign * (i == k)) for i in range(n))))
        return [*result, *self.rows]

    @cached_property
    def exact_rows(self) -> ExactArray:
        """The region's own rows ``(own, n + 1)``, the constant first."""
        if not self.rows:
            return ExactArray(np.zeros((0, len(self.variables) + 1), dtype=object), 1)
        return exact_array([(offset, *slopes) for offset, slopes in self.rows])

    @cached_property
    def float_rows(self) -> NDArray[np.float64]:
        """The same in floats."""
        return self.exact_rows.floats()


def _scaled_pose(pose: RationalPose) -> RationalPose:
    """Divide numerators and denominator so that the latter is at most 1 where all |u| are."""
    scale = 1 / power_of_two(sum(map(abs, pose.denominator.values()), Fraction(0)))
    matrix = [[scaled(entry, scale) for entry in row] for row in pose.matrix]
    return RationalPose(matrix, scaled(pose.denominator, scale))


def _half_space(X_EG: NDArray[np.float64]) -> HalfSpaceInE:
    """Return a half space, whose outside is along z of its frame; see `HalfSpaceInE`."""
    normal = [Fraction(float(v)) * _SHORTER for v in X_EG[:, 2]]
    place = [Fraction(float(v)) for v in X_EG[:, 3]]
    return HalfSpaceInE(
        (normal[0], normal[1], normal[2]),
        sum((n * p for n, p in zip(normal, place, strict=True)), Fraction(0)),
    )


class PairProblems:
    """Makes the problems of a checker's pairs in a region."""

    def __init__(
        self,
        kinematics: RationalForwardKinematics,
        plan: CheckerPlan,
        inspector: Any,
        region: TangentRegion,
    ) -> None:
        """Take the pairs of ``plan``, whose rows number them."""
        self._kinematics, self._plan = kinematics, plan
        self._inspector, self._region = inspector, region
        self._frames: dict[tuple[PathToFrame, tuple[int, ...]], MovingFrame] = {}
        self._bodies: dict[int, BodyPoints] = {}

    def make(self, pair: int) -> PairProblem:
        """Return a pair's problem.

        Raises CertificateError for a robot's half space, a negative padding, and a position that
        turns a body twice.
        """
        plan, region = self._plan, self._region
        a, b = plan.pairs.bodies[pair]
        joints = [self._joint_of(body) for body in (a, b)]
        if isinstance(self._shape_of(a), HalfSpace):
            raise CertificateError(
                f"geometry {self._name_of(a)!r}: a half space that a robot carries has no planes"
                " beside it here; ignore its pairs"
            )
        is_half_space = isinstance(self._shape_of(b), HalfSpace)
        paths = self._kinematics.path_between(*joints, at_B=is_half_space)
        moved = [self._kinematics.positions_of(path) for path in paths]
        variables = region.variables_with(sorted({*moved[0], *moved[1]}))
        padding = float(plan.pairs.paddings[pair])
        names = tuple(self._name_of(body) for body in (a, b))
        if padding < 0.0:
            raise CertificateError(
                f"the padding of {names[0]!r} and {names[1]!r} must not be negative: {padding:g}"
            )
        sides = []
        for sign, body, path, own in zip((1, -1), (a, b), paths, moved, strict=True):
            frame = self._frame(path, tuple(own), tuple(variables))
            points = self._points(body)
            radius = points.hull.radius + (padding if sign > 0 else 0.0)
            sides.append(Side(sign, frame, points, radius))
        rows = region.rows(variables)
        return PairProblem(
            (names[0], names[1]),
            tuple(variables),
            (sides[0], sides[1]),
            tuple(row for _, _, row in rows),
            tuple(number for number, _, _ in rows),
            tuple(scale for _, scale, _ in rows),
            region.stretches(variables),
            len(region.lower),
            pair,
            _half_space(self._pose_in_joint(b)) if is_half_space else None,
        )

    def _frame(
        self, path: PathToFrame, positions: tuple[int, ...], variables: tuple[int, ...]
    ) -> MovingFrame:
        """Return the frame of a joint, made once for all bodies in it."""
        key = path, variables
        if key not in self._frames:
            stretches = self._region.stretches(list(variables))
            pose = self._kinematics.pose(np.eye(3, 4), path, stretches, variables)
            moving = tuple(variables.index(k) for k in positions)
            self._frames[key] = MovingFrame(_scaled_pose(pose), moving)
        return self._frames[key]

    def _points(self, body: int) -> BodyPoints:
        if body not in self._bodies:
            hull = rounded_hull(self._shape_of(body), self._name_of(body))
            self._bodies[body] = BodyPoints(hull, self._pose_in_joint(body))
        return self._bodies[body]

    def _shape_of(self, body: int) -> Shape:
        shape: Shape = self._inspector.get_shape(self._plan.geometry_ids[body])
        return shape

    def _joint_of(self, body: int) -> int:
        joints = self._plan.bodies.joints
        return int(joints[body]) if body < len(joints) else 0

    def _pose_in_joint(self, body: int) -> NDArray[np.float64]:
        bodies = self._plan.bodies
        if body < len(bodies.joints):
            return bodies.X_JG[body]
        X_WB, X_WG = self._kinematics.tree.X_WB, bodies.X_WG[body - len(bodies.joints)]
        R_BW = X_WB[:3, :3].T
        return np.column_stack([R_BW @ X_WG[:, :3], R_BW @ (X_WG[:, 3] - X_WB[:3, 3])])

    def _name_of(self, body: int) -> str:
        return str(self._inspector.get_name(self._plan.geometry_ids[body]))

"""Which geometries planes are between, and in which links' frames."""

from __future__ import annotations

from dataclasses import dataclass
import enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.pair_shapes import rounded_hull
from scene_graph_ros.planning.certified.rational_kinematics import RationalForwardKinematics
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker

__all__ = [
    "CIrisCollisionGeometry",
    "CIrisGeometryType",
    "CSpaceSeparatingPlane",
    "PlaneSide",
    "SeparatingPlaneOrder",
    "separating_planes",
]


class PlaneSide(enum.Enum):
    """On which side of a plane ``a(s) . x + b(s) = 0`` a geometry is."""

    POSITIVE = "positive"
    NEGATIVE = "negative"


class SeparatingPlaneOrder(enum.Enum):
    """The degree of a plane's normal and offset in s."""

    AFFINE = 1


class CIrisGeometryType(enum.Enum):
    """How a geometry's side of a plane is written down."""

    SPHERE = "sphere"
    POLYTOPE = "polytope"
    """A box, a convex or a mesh's hull; an ellipsoid, by its box."""
    CYLINDER = "cylinder"
    """By a prism around it."""
    CAPSULE = "capsule"
    HALF_SPACE = "half space"
    """Planes are parallel to it."""


_TYPES: dict[type, CIrisGeometryType] = {
    Sphere: CIrisGeometryType.SPHERE,
    Cylinder: CIrisGeometryType.CYLINDER,
    Capsule: CIrisGeometryType.CAPSULE,
    HalfSpace: CIrisGeometryType.HALF_SPACE,
}
"""All others are polytopes."""


@one_line()
@dataclass(frozen=True, eq=False)
class CIrisCollisionGeometry:
    """A geometry beside a plane: its shape, and its pose ``X_BG`` ``(4, 4)`` in a body's frame.

    The body is the link that carries it, or the world, for geometry that no robot moves;
    ``body_index`` is its `CheckerBody`'s, that of the geometry's own frame.
    """

    id: GeometryId
    geometry: Shape
    type: CIrisGeometryType
    body_index: int
    body_name: str
    X_BG: NDArray[np.float64]

    @property
    def num_rationals(self) -> int:
        """How many quotients of polynomials must not be negative: one for each point of a hull."""
        return len(rounded_hull(self.geometry, str(int(self.id))).points)


@one_line()
@dataclass(frozen=True, eq=False)
class CSpaceSeparatingPlane:
    """A plane that is to be between two geometries, in the frame of ``expressed_body``.

    That is the link in the middle of the joints between the two, or the base's frame, which is
    None; beside a half space it is the half space's. A certificate has the plane itself, as its
    ``a`` and ``b``.
    """

    positive_side_geometry: CIrisCollisionGeometry
    negative_side_geometry: CIrisCollisionGeometry
    expressed_body: str | None
    plane_degree: SeparatingPlaneOrder = SeparatingPlaneOrder.AFFINE

    def geometry(self, side: PlaneSide) -> CIrisCollisionGeometry:
        """Return the geometry on one side. Raises CertificateError for what is no side."""
        given: Any = side
        if not isinstance(given, PlaneSide):
            raise CertificateError(f"side must be a PlaneSide, not {quoted(given)}")
        is_positive = given is PlaneSide.POSITIVE
        return self.positive_side_geometry if is_positive else self.negative_side_geometry


def separating_planes(
    checker: SceneGraphCollisionChecker, kinematics: RationalForwardKinematics
) -> tuple[CSpaceSeparatingPlane, ...]:
    """Return the plane of each pair that a checker checks, in the plan's order."""
    plan, tree = checker.plan, checker.plan.tree
    inspector = checker.snapshot.inspector
    count = len(plan.carried)

    def geometry_of(body: int) -> CIrisCollisionGeometry:
        geometry_id = plan.geometry_ids[body]
        shape: Shape = inspector.get_shape(geometry_id)
        is_robot = body < count
        return CIrisCollisionGeometry(
            geometry_id,
            shape,
            _TYPES.get(type(shape), CIrisGeometryType.POLYTOPE),
            checker.get_body(inspector.get_frame_id(geometry_id)).index,
            tree.link_names[int(plan.owners[body])] if is_robot else "world",
            plan.X_LG[body] if is_robot else _whole(plan.bodies.X_WG[body - count]),
        )

    geometries = {int(b): geometry_of(int(b)) for b in np.unique(plan.pairs.bodies)}
    joints = plan.bodies.joints
    result = []
    for a, b in plan.pairs.bodies.tolist():
        rows = [int(joints[body]) if body < count else 0 for body in (a, b)]
        at_B = geometries[b].type is CIrisGeometryType.HALF_SPACE
        path = kinematics.path_between(*rows, at_B=at_B)[0]
        row = rows[0]
        if path.down:
            row = path.down[-1]
        elif path.up:
            row = int(tree.table.parents[path.up[-1]])
        expressed = None if row == 0 else _link_of_joint(checker, row)
        result.append(CSpaceSeparatingPlane(geometries[a], geometries[b], expressed))
    return tuple(result)


def _link_of_joint(checker: SceneGraphCollisionChecker, row: int) -> str:
    """Return the link whose frame is that of a joint."""
    tree = checker.plan.tree
    for name, joint, X_JL in zip(tree.link_names, tree.joint_of_link, tree.X_JL, strict=True):
        if joint == row and (np.eye(4) == X_JL).all():
            return str(name)
    raise AssertionError(f"joint {row} has a link of its own")


def _whole(X: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.vstack([X, [0.0, 0.0, 0.0, 1.0]])

"""The table of pairs of shapes with a closed form for their signed distance."""

import numpy as np

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, merged_kernel
from scene_graph_ros.geometry.query.distance.distance_box_box import distance_box_box
from scene_graph_ros.geometry.query.distance.distance_box_half_space import distance_box_half_space
from scene_graph_ros.geometry.query.distance.distance_capsule_box import distance_capsule_box
from scene_graph_ros.geometry.query.distance.distance_capsule_capsule import (
    distance_capsule_capsule,
)
from scene_graph_ros.geometry.query.distance.distance_capsule_half_space import (
    distance_capsule_half_space,
)
from scene_graph_ros.geometry.query.distance.distance_cylinder_half_space import (
    distance_cylinder_half_space,
)
from scene_graph_ros.geometry.query.distance.distance_ellipsoid_half_space import (
    distance_ellipsoid_half_space,
)
from scene_graph_ros.geometry.query.distance.distance_half_space_convex import (
    distance_half_space_convex,
)
from scene_graph_ros.geometry.query.distance.distance_sphere_box import distance_sphere_box
from scene_graph_ros.geometry.query.distance.distance_sphere_capsule import distance_sphere_capsule
from scene_graph_ros.geometry.query.distance.distance_sphere_convex import distance_sphere_convex
from scene_graph_ros.geometry.query.distance.distance_sphere_cylinder import (
    distance_sphere_cylinder,
)
from scene_graph_ros.geometry.query.distance.distance_sphere_ellipsoid import (
    distance_sphere_ellipsoid,
)
from scene_graph_ros.geometry.query.distance.distance_sphere_half_space import (
    distance_sphere_half_space,
)
from scene_graph_ros.geometry.query.distance.distance_sphere_sphere import distance_sphere_sphere
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import load_vector

__all__ = ["BY_TRIANGLES", "CLOSED_FORMS", "HAS_CLOSED_FORM", "distance_closed_form"]

BY_TRIANGLES = len(ShapeKind)
"""Stands for the kind of a mesh that is measured by its triangles; others are their hulls."""

CLOSED_FORMS = {
    (ShapeKind.SPHERE, ShapeKind.SPHERE): distance_sphere_sphere,
    (ShapeKind.SPHERE, ShapeKind.CAPSULE): distance_sphere_capsule,
    (ShapeKind.SPHERE, ShapeKind.BOX): distance_sphere_box,
    (ShapeKind.SPHERE, ShapeKind.CYLINDER): distance_sphere_cylinder,
    (ShapeKind.SPHERE, ShapeKind.ELLIPSOID): distance_sphere_ellipsoid,
    (ShapeKind.SPHERE, ShapeKind.HALF_SPACE): distance_sphere_half_space,
    (ShapeKind.SPHERE, ShapeKind.CONVEX): distance_sphere_convex,
    (ShapeKind.SPHERE, ShapeKind.MESH): distance_sphere_convex,
    (ShapeKind.CAPSULE, ShapeKind.CAPSULE): distance_capsule_capsule,
    (ShapeKind.CAPSULE, ShapeKind.BOX): distance_capsule_box,
    (ShapeKind.CAPSULE, ShapeKind.HALF_SPACE): distance_capsule_half_space,
    (ShapeKind.BOX, ShapeKind.BOX): distance_box_box,
    (ShapeKind.BOX, ShapeKind.HALF_SPACE): distance_box_half_space,
    (ShapeKind.CYLINDER, ShapeKind.HALF_SPACE): distance_cylinder_half_space,
    (ShapeKind.ELLIPSOID, ShapeKind.HALF_SPACE): distance_ellipsoid_half_space,
    (ShapeKind.HALF_SPACE, ShapeKind.CONVEX): distance_half_space_convex,
    (ShapeKind.HALF_SPACE, ShapeKind.MESH): distance_half_space_convex,
    (ShapeKind.HALF_SPACE, BY_TRIANGLES): distance_half_space_convex,
}
"""By kinds in ``ShapeKind`` order."""


def _known() -> np.ndarray:
    """Return the pairs of kinds in the table."""
    known = np.zeros((BY_TRIANGLES + 1, BY_TRIANGLES + 1), bool)
    for kind_A, kind_B in CLOSED_FORMS:
        known[kind_A, kind_B] = True
    return known


HAS_CLOSED_FORM = _known()


@inlined_kernel
def _none():
    zero = (0.0, 0.0, 0.0)
    return 0.0, zero, zero, (0.0, 0.0, 1.0), False


@inlined_kernel
def _size_A(table, i):
    return load_vector(table.size, i)


@inlined_kernel
def _size_B(table, j):
    return load_vector(table.size, j)


@by_kind(
    merged_kernel,
    ["kind_A", "kind_B"],
    CLOSED_FORMS,
    otherwise=_none,
    given={"size_A": _size_A, "size_B": _size_B},
)
def distance_closed_form(table, i, j, kind_A, kind_B, R_AB, p_AB, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) of rows whose kinds ``HAS_CLOSED_FORM``."""

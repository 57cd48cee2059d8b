"""The pairs of shapes with a closed form for their signed distance, in ``ShapeKind`` order."""

from scene_graph_ros.geometry.compiled.kernel import merged_kernel
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

__all__ = ["distance_closed_form"]

_SPHERE = int(ShapeKind.SPHERE)
_CAPSULE = int(ShapeKind.CAPSULE)
_BOX = int(ShapeKind.BOX)
_CYLINDER = int(ShapeKind.CYLINDER)
_ELLIPSOID = int(ShapeKind.ELLIPSOID)
_HALF_SPACE = int(ShapeKind.HALF_SPACE)
_CONVEX = int(ShapeKind.CONVEX)
_MESH = int(ShapeKind.MESH)


@merged_kernel
def distance_closed_form(table, i, j, R_AB, p_AB, max_distance):  # noqa: C901 - the table of pairs
    """Return (found, (phi, p_ACa, p_ACb, nhat_BA_A, unique)) of rows with kind_A <= kind_B.

    ``found`` is False where the pair has no closed form. A mesh is taken as its convex hull,
    except that a sphere's distance to a mesh measured by its triangles is left to others.
    """
    kind_A, kind_B = table.kind[i], table.kind[j]
    size_A, size_B = load_vector(table.size, i), load_vector(table.size, j)
    if kind_A == _SPHERE:
        if kind_B == _SPHERE:
            return True, distance_sphere_sphere(size_A, size_B, R_AB, p_AB)
        if kind_B == _CAPSULE:
            return True, distance_sphere_capsule(size_A, size_B, R_AB, p_AB)
        if kind_B == _BOX:
            return True, distance_sphere_box(size_A, size_B, R_AB, p_AB)
        if kind_B == _CYLINDER:
            return True, distance_sphere_cylinder(size_A, size_B, R_AB, p_AB)
        if kind_B == _ELLIPSOID:
            return True, distance_sphere_ellipsoid(size_A, size_B, R_AB, p_AB)
        if kind_B == _HALF_SPACE:
            return True, distance_sphere_half_space(size_A, size_B, R_AB, p_AB)
        if kind_B == _CONVEX or (kind_B == _MESH and not table.exact[j]):
            return True, distance_sphere_convex(size_A, R_AB, p_AB, table, j)
    if kind_A == _CAPSULE:
        if kind_B == _CAPSULE:
            return True, distance_capsule_capsule(size_A, size_B, R_AB, p_AB)
        if kind_B == _BOX:
            return True, distance_capsule_box(size_A, size_B, R_AB, p_AB)
        if kind_B == _HALF_SPACE:
            return True, distance_capsule_half_space(size_A, size_B, R_AB, p_AB)
    if kind_A == _BOX:
        if kind_B == _BOX:
            return True, distance_box_box(size_A, size_B, R_AB, p_AB, max_distance)
        if kind_B == _HALF_SPACE:
            return True, distance_box_half_space(size_A, size_B, R_AB, p_AB)
    if kind_A == _CYLINDER and kind_B == _HALF_SPACE:
        return True, distance_cylinder_half_space(size_A, size_B, R_AB, p_AB)
    if kind_A == _ELLIPSOID and kind_B == _HALF_SPACE:
        return True, distance_ellipsoid_half_space(size_A, size_B, R_AB, p_AB)
    if kind_A == _HALF_SPACE and kind_B != _HALF_SPACE:
        return True, distance_half_space_convex(R_AB, p_AB, table, j)
    zero = (0.0, 0.0, 0.0)
    return False, (0.0, zero, zero, (0.0, 0.0, 1.0), False)

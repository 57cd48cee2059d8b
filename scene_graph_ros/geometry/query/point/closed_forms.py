"""Which kernel measures points to which of the shapes that have a closed form."""

from scene_graph_ros.geometry.query.point.point_box import point_box
from scene_graph_ros.geometry.query.point.point_capsule import point_capsule
from scene_graph_ros.geometry.query.point.point_cylinder import point_cylinder
from scene_graph_ros.geometry.query.point.point_half_space import point_half_space
from scene_graph_ros.geometry.query.point.point_sphere import point_sphere
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["CLOSED_FORMS"]

CLOSED_FORMS = {
    ShapeKind.SPHERE: point_sphere,
    ShapeKind.CAPSULE: point_capsule,
    ShapeKind.BOX: point_box,
    ShapeKind.CYLINDER: point_cylinder,
    ShapeKind.HALF_SPACE: point_half_space,
}
"""Each takes a shape's size and a point in its frame, and returns (phi, p_GN, grad_G, unique)."""

"""Where a contact lies beyond the border of a hull's face: which edge of it is next."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    cross,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tables.hull_blocks import corners_of_face, normal_of_face, vertex

__all__ = ["edge_before", "is_beyond_face"]


@lean_kernel
def edge_before(placed, hulls, feature, x, allowed):
    """Return a hull's face, or that edge of it beyond which the point x of its plane lies most.

    Any other feature is returned as it is.
    """
    R, p = placed.R, placed.p
    best = feature
    if feature[0] != FACE or not feature[4] > 0.0:
        return best
    face = int(feature[4]) - 1
    n = normal_of_face(hulls, face)
    q = rotate_inverse(R, subtract(x, p))
    corners = corners_of_face(hulls, face)
    last = corners + int(hulls[corners])
    a = vertex(hulls, int(hulls[last]))
    for slot in range(corners + 1, last + 1):
        b = vertex(hulls, int(hulls[slot]))
        e = subtract(b, a)
        length = norm(e)
        beyond = -dot(cross(n, e), subtract(q, a))
        if beyond > allowed * length:
            allowed = beyond / length
            middle = add(rotate(R, axpy(0.5, e, a)), p)
            e = rotate(R, scale(1.0 / length, e))
            best = (LINE, middle, e, 0.0, -0.5 * length, 0.5 * length)
        a = b
    return best


@lean_kernel
def is_beyond_face(placed, hulls, feature, x, allowed):
    """Return whether the point x of the plane of a hull's face is outside of its polygon."""
    return edge_before(placed, hulls, feature, x, allowed)[0] != feature[0]

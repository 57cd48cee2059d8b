"""Signed distance of a half space to a convex hull or a mesh: the deepest vertex decides."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    dot,
    load_vector,
    rotate,
    rotate_inverse,
    scale,
)
from scene_graph_ros.geometry.tables.hull_blocks import furthest_vertex, vertex, vertex_number
from scene_graph_ros.geometry.tolerances import PARALLEL

__all__ = ["distance_half_space_convex"]


@inlined_kernel
def _deepest_point(hulls, k, down, tolerance):
    """Return (point, depth): the middle of the vertices that lie furthest along ``down``."""
    block = hulls.block_start[k]
    place = furthest_vertex(hulls.blocks, block, down)
    best = hulls.vertex_start[k] + vertex_number(block, place)
    point = load_vector(hulls.vertices, best)
    depth = dot(point, down)
    is_tied = False
    for slot in range(hulls.neighbor_start[best], hulls.neighbor_start[best + 1]):
        neighbor = load_vector(hulls.vertices, hulls.neighbors[slot])
        is_tied = is_tied or dot(neighbor, down) >= depth - tolerance
    if not is_tied:
        return point, depth
    total, count = (0.0, 0.0, 0.0), 0
    for v in range(hulls.vertex_start[k], hulls.vertex_start[k + 1]):
        vertex = load_vector(hulls.vertices, v)
        if dot(vertex, down) >= depth - tolerance:
            total = add(total, vertex)
            count += 1
    return scale(1.0 / count, total), depth


@lean_kernel
def distance_half_space_convex(R_AB, p_AB, table, j):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) for A the half space and row j's hull B.

    The witness is the middle of the vertices that are equally deep; for a mesh measured by its
    triangles, which may be hollow between them, one of these vertices.
    """
    down = scale(-1.0, rotate_inverse(R_AB, (0.0, 0.0, 1.0)))
    k = table.hull[j]
    if table.exact[j]:
        hulls = table.hulls
        place = furthest_vertex(hulls.blocks, hulls.block_start[k], down)
        p_BCb = vertex(hulls.blocks, place)
        depth = dot(p_BCb, down)
    else:
        p_BCb, depth = _deepest_point(table.hulls, k, down, PARALLEL * table.scale[j])
    phi = p_AB[2] - depth
    p_ACb = add(rotate(R_AB, p_BCb), p_AB)
    nhat_BA_A = (0.0, 0.0, -1.0)
    return phi, axpy(phi, nhat_BA_A, p_ACb), p_ACb, nhat_BA_A, True

"""A triangle."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import every, select
from scene_graph_ros.geometry.spatial.vectors import add, rotate

__all__ = ["lane_support", "support", "triangle_corners"]


@lean_kernel
def support(params, d):
    """Return (point, index) of a corner."""
    h0 = params[0] * d[0] + params[1] * d[1] + params[2] * d[2]
    h1 = params[3] * d[0] + params[4] * d[1] + params[5] * d[2]
    h2 = params[6] * d[0] + params[7] * d[1] + params[8] * d[2]
    if h0 >= h1 and h0 >= h2:
        return (params[0], params[1], params[2]), 0
    if h1 >= h2:
        return (params[3], params[4], params[5]), 1
    return (params[6], params[7], params[8]), 2


@inlined_kernel
def lane_support(params, d):
    """Return the vertices of a triangle that lie furthest along directions d."""
    x, y, z = every(params[0]), every(params[1]), every(params[2])
    height = params[0] * d[0] + params[1] * d[1] + params[2] * d[2]
    for k in (3, 6):
        along = params[k] * d[0] + params[k + 1] * d[1] + params[k + 2] * d[2]
        is_higher = along > height
        height = select(is_higher, along, height)
        x, y, z = (
            select(is_higher, every(params[k]), x),
            select(is_higher, every(params[k + 1]), y),
            select(is_higher, every(params[k + 2]), z),
        )
    return x, y, z


@lean_kernel
def triangle_corners(core, R, p):
    """Return the corners of a TRIANGLE at pose (R, p)."""
    c = core[3]
    return (
        add(rotate(R, (c[0], c[1], c[2])), p),
        add(rotate(R, (c[3], c[4], c[5])), p),
        add(rotate(R, (c[6], c[7], c[8])), p),
    )

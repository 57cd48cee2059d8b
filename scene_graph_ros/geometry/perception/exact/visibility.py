"""Find the nearest body along the ray of each pixel, body by body."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, select
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.perception.exact.bodies import element
from scene_graph_ros.geometry.perception.exact.ray_intervals import inside_of
from scene_graph_ros.geometry.perception.exact.screen import (
    clear_screen,
    keep_nearest,
    sphere_box,
)
from scene_graph_ros.geometry.perception.exact.triangles import draw_triangles
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    load_rotation,
    load_translation,
    load_vector,
    relative_pose,
    rotate,
)

__all__ = ["box_of_body", "draw_body", "find_visible"]

_CONVEX = int(ShapeKind.CONVEX)


@lean_kernel
def _draw_closed_form(sensor, screen, kind, size, p_GS, R_GS, box, row):
    """Draw a shape with a closed form into the pixels of its box."""
    use_widest_vectors()
    near, far = sensor.clipping
    number = element(row, 0)
    right, down, ahead = column(R_GS, 0), column(R_GS, 1), column(R_GS, 2)
    stride = screen.depth.shape[1]
    for v in range(box[2], box[3] + 1):
        y = sensor.y[v & LAST_PLACE]
        line = axpy(y, down, ahead)
        for u in range(box[0], box[1] + 1, LANES):
            x = load_lanes(sensor.x, u)
            d = (line[0] + x * right[0], line[1] + x * right[1], line[2] + x * right[2])
            enter, leave = inside_of(kind, size, p_GS, d)
            # Where the near plane is inside, the far side is seen from within.
            depth = select(enter >= near, enter, leave)
            is_hit = (enter <= leave) & (depth >= near) & (depth <= far)
            keep_nearest(screen, v * stride + u, is_hit, depth, row, number)


@inlined_kernel
def _box_of(sensor, bodies, row, R_SG, p_SG):
    """Return (u0, u1, v0, v1), the pixels that can see a body."""
    radius = bodies.radius[row]
    if not math.isfinite(radius):
        return 0, sensor.size[0] - 1, 0, sensor.size[1] - 1
    p_SB = add(rotate(R_SG, load_vector(bodies.center, row)), p_SG)
    return sphere_box(sensor, p_SB, radius)


@lean_kernel
def box_of_body(sensor, bodies, row):
    """Return (u0, u1, v0, v1), the pixels that can see a body, u0 > u1 or v0 > v1 if none can."""
    R_WG, p_WG = load_rotation(bodies.X_WG, row), load_translation(bodies.X_WG, row)
    R_SG, p_SG = relative_pose(sensor.R_WS, sensor.p_WS, R_WG, p_WG)
    return _box_of(sensor, bodies, row, R_SG, p_SG)


@inlined_kernel
def draw_body(sensor, bodies, row, screen, corners):
    """Draw one body; ``corners`` is memory for the vertices of its mesh."""
    R_WG, p_WG = load_rotation(bodies.X_WG, row), load_translation(bodies.X_WG, row)
    R_SG, p_SG = relative_pose(sensor.R_WS, sensor.p_WS, R_WG, p_WG)
    box = _box_of(sensor, bodies, row, R_SG, p_SG)
    if box[0] > box[1] or box[2] > box[3]:
        return
    if bodies.kind[row] >= _CONVEX:
        draw_triangles(sensor, screen, bodies, row, R_SG, p_SG, corners)
    else:
        R_GS, p_GS = relative_pose(R_WG, p_WG, sensor.R_WS, sensor.p_WS)
        size = load_vector(bodies.size, row)
        kind = bodies.kind[row]
        _draw_closed_form(sensor, screen, kind, size, p_GS, R_GS, box, row)


@lean_kernel
def find_visible(sensor, bodies, is_drawn, screen, corners):
    """Let every pixel see the nearest of the bodies that are drawn; ties go to the first row.

    ``is_drawn`` (n,) tells which; ``corners`` is memory for the vertices of the largest mesh.
    """
    clear_screen(screen)
    for i in range(bodies.kind.shape[0]):
        row = i & LAST_PLACE
        if not is_drawn[row]:
            continue
        draw_body(sensor, bodies, row, screen, corners)

"""The colour of any surface at the point that a pixel sees, pictures and alpha included."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.perception.exact.bodies import row_of, triangle_of
from scene_graph_ros.geometry.perception.exact.cover import picture_of
from scene_graph_ros.geometry.perception.exact.image_kernels import level, paint_of
from scene_graph_ros.geometry.perception.exact.normals import normal_at, triangle_normal
from scene_graph_ros.geometry.perception.exact.pictures import texel_at
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    column,
    dot,
    load_rotation,
    load_translation,
    load_vector,
    relative_pose,
)

__all__ = ["lit_color", "sensor_in_body", "write_pictures"]

_HALF_SPACE = int(ShapeKind.HALF_SPACE)


@inlined_kernel
def sensor_in_body(sensor, bodies, row):
    """Return the sensor's axes and centre in a body's frame: (right, down, ahead, p_GS)."""
    R_WG, p_WG = load_rotation(bodies.X_WG, row), load_translation(bodies.X_WG, row)
    R_GS, p_GS = relative_pose(R_WG, p_WG, sensor.R_WS, sensor.p_WS)
    return column(R_GS, 0), column(R_GS, 1), column(R_GS, 2), p_GS


@lean_kernel
def lit_color(bodies, cover, row, triangle, p_GQ, ahead):
    """Return red, green, blue and alpha, 0 to 1, of a point by Lambert's law.

    The light is white, along ``ahead``, the camera's axis in G. Both sides of a surface look
    alike.
    """
    kind, paint = bodies.kind[row], -1
    if kind > _HALF_SPACE:
        if bodies.is_painted[row]:
            paint = paint_of(bodies, row, triangle)
        normal = triangle_normal(bodies, row, triangle)
    else:
        normal = normal_at(kind, load_vector(bodies.size, row), p_GQ)
    light = abs(dot(normal, ahead))
    red, green, blue = bodies.diffuse[row, 0], bodies.diffuse[row, 1], bodies.diffuse[row, 2]
    alpha = cover.alpha[row]
    if paint >= 0:
        at = paint & LAST_PLACE
        red, green, blue = bodies.palette[at, 0], bodies.palette[at, 1], bodies.palette[at, 2]
    picture = picture_of(cover, row, triangle)
    if picture >= 0:
        texel = texel_at(bodies, cover, row, triangle, picture, p_GQ)
        red, green, blue = red * texel[0], green * texel[1], blue * texel[2]
        alpha *= texel[3]
    return red * light, green * light, blue * light, alpha


@lean_kernel
def write_pictures(sensor, screen, bodies, cover, image):
    """Write red, green and blue of the pixels that see a picture."""
    known = -1
    right, down, ahead, p_GS = sensor.p_WS, sensor.p_WS, sensor.p_WS, sensor.p_WS
    for v in range(image.shape[0]):
        y = sensor.y[v]
        for u in range(image.shape[1]):
            number = screen.seen[v, u]
            row = row_of(number) & LAST_PLACE if number >= 0.0 else 0
            if number < 0.0 or picture_of(cover, row, triangle_of(number)) < 0:
                continue
            if row != known:
                known = row
                right, down, ahead, p_GS = sensor_in_body(sensor, bodies, row)
            d = axpy(sensor.x[u], right, axpy(y, down, ahead))
            p_GQ = axpy(screen.depth[v, u], d, p_GS)
            color = lit_color(bodies, cover, row, triangle_of(number), p_GQ, ahead)
            for channel in range(3):
                image[v, u, channel] = level(color[channel])

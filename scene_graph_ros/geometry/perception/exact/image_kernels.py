"""Images of visible points; colour is computed once per visible pixel."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.perception.exact.bodies import row_of, triangle_of
from scene_graph_ros.geometry.perception.exact.normals import normal_at, triangle_normal
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

__all__ = ["level", "paint_of", "write_color", "write_depth", "write_label"]

_HALF_SPACE = int(ShapeKind.HALF_SPACE)
_OPAQUE = 255


@lean_kernel
def write_depth(screen, nearest, farthest, image):
    """Write depths in m as float32: 0 nearer than ``nearest``, inf beyond ``farthest``."""
    for v in range(image.shape[0]):
        for u in range(image.shape[1]):
            depth = screen.depth[v, u]
            if depth > farthest:
                image[v, u] = np.float32(np.inf)
            elif depth < nearest:
                image[v, u] = np.float32(0.0)
            else:
                image[v, u] = np.float32(depth)


@lean_kernel
def write_label(screen, bodies, empty, image):
    """Write the label of each pixel's body, ``empty`` where it sees none."""
    for v in range(image.shape[0]):
        for u in range(image.shape[1]):
            number = screen.seen[v, u]
            image[v, u] = empty if number < 0.0 else bodies.label[row_of(number) & LAST_PLACE]


@inlined_kernel
def paint_of(bodies, row, triangle):
    """Return the colour's row in the palette, -1 for the body's own colour."""
    mesh = bodies.mesh[row] & LAST_PLACE
    return bodies.paint[(bodies.triangle_start[mesh] + triangle) & LAST_PLACE]


@inlined_kernel
def level(share):
    """Return a share of full intensity as a level of 0 to 255, rounded to nearest."""
    return np.uint8(255.0 * share + 0.5)


@lean_kernel
def write_color(sensor, screen, bodies, background, image):
    """Write red, green, blue and alpha: Lambert's law with a white light along the camera's axis.

    ``background`` is the colour where nothing is. Both sides of a surface look alike.
    """
    known = -1
    R_WG, p_WG = sensor.R_WS, sensor.p_WS
    R_GS, p_GS = relative_pose(R_WG, p_WG, sensor.R_WS, sensor.p_WS)
    right, down, ahead = column(R_GS, 0), column(R_GS, 1), column(R_GS, 2)
    for v in range(image.shape[0]):
        y = sensor.y[v]
        for u in range(image.shape[1]):
            number = screen.seen[v, u]
            image[v, u, 3] = _OPAQUE
            if number < 0.0:
                for channel in range(3):
                    image[v, u, channel] = background[channel]
                continue
            row = row_of(number) & LAST_PLACE
            if row != known:
                known = row
                R_WG, p_WG = load_rotation(bodies.X_WG, row), load_translation(bodies.X_WG, row)
                R_GS, p_GS = relative_pose(R_WG, p_WG, sensor.R_WS, sensor.p_WS)
                right, down, ahead = column(R_GS, 0), column(R_GS, 1), column(R_GS, 2)
            kind, paint = bodies.kind[row], -1
            if kind > _HALF_SPACE:
                if bodies.is_painted[row]:
                    paint = paint_of(bodies, row, triangle_of(number))
                normal = triangle_normal(bodies, row, triangle_of(number))
            else:
                d = axpy(sensor.x[u], right, axpy(y, down, ahead))
                p_GQ = axpy(screen.depth[v, u], d, p_GS)
                normal = normal_at(kind, load_vector(bodies.size, row), p_GQ)
            light = abs(dot(normal, ahead))
            for channel in range(3):
                share = bodies.diffuse[row, channel]
                if paint >= 0:
                    share = bodies.palette[paint & LAST_PLACE, channel]
                image[v, u, channel] = level(share * light)

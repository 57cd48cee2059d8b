"""Transparent bodies: their layers before each pixel, from near to far.

Each body is one layer: its surface that is nearest to the camera. Layers are sorted for each pixel
in a list of its own, so that it makes no difference in which order bodies are drawn.
"""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.perception.exact.bodies import row_of, triangle_of
from scene_graph_ros.geometry.perception.exact.image_kernels import level
from scene_graph_ros.geometry.perception.exact.screen import TIE
from scene_graph_ros.geometry.perception.exact.shading import lit_color, sensor_in_body
from scene_graph_ros.geometry.perception.exact.visibility import box_of_body, draw_body
from scene_graph_ros.geometry.spatial.vectors import axpy

__all__ = ["Layers", "blend", "collect", "count_places"]

_LEVELS = 255.0


class Layers(NamedTuple):
    """Layers of transparent bodies before the pixels of an image, linked from near to far."""

    first: np.ndarray
    """(height, width) int64: the nearest layer, -1 where there is none."""
    following: np.ndarray
    """(k,) int64: the layer behind each, -1 for none."""
    depth: np.ndarray
    """(k,) metres."""
    seen: np.ndarray
    """(k,) what is there, as ``element`` numbers it."""


@lean_kernel
def count_places(sensor, bodies, is_drawn):
    """Return the largest number of layers."""
    count = 0
    for i in range(bodies.kind.shape[0]):
        row = i & LAST_PLACE
        if is_drawn[row]:
            u0, u1, v0, v1 = box_of_body(sensor, bodies, row)
            count += max(0, u1 - u0 + 1) * max(0, v1 - v0 + 1)
    return count


@inlined_kernel
def _is_before(depth, row, other_depth, other):
    """Tell whether a body's surface is seen before another's; at one place the first row is."""
    if row < row_of(other):
        return not other_depth < TIE * depth
    return depth < TIE * other_depth


@inlined_kernel
def _insert(layers, v, u, depth, number, new):
    """Put a layer of a body in its place; the rows of those that are there are smaller."""
    before, at = -1, layers.first[v, u]
    while at >= 0 and not depth < TIE * layers.depth[at & LAST_PLACE]:
        before, at = at, layers.following[at & LAST_PLACE]
    layers.depth[new], layers.seen[new], layers.following[new] = depth, number, at
    if before < 0:
        layers.first[v, u] = new
    else:
        layers.following[before & LAST_PLACE] = new


@lean_kernel
def collect(sensor, bodies, is_drawn, opaque, scratch, corners, layers):
    """Find the layers of the bodies that are drawn and not hidden by ``opaque`` ones.

    ``scratch`` is a screen that sees nothing, and does so again in the end. Returns the number of
    layers.
    """
    count = 0
    for i in range(bodies.kind.shape[0]):
        row = i & LAST_PLACE
        if not is_drawn[row]:
            continue
        box = box_of_body(sensor, bodies, row)
        if box[0] > box[1] or box[2] > box[3]:
            continue
        draw_body(sensor, bodies, row, scratch, corners)
        for v in range(box[2], box[3] + 1):
            for u in range(box[0], box[1] + 1):
                number, depth = scratch.seen[v, u], scratch.depth[v, u]
                if number < 0.0:
                    continue
                behind = opaque.seen[v, u]
                if behind < 0.0 or _is_before(depth, row, opaque.depth[v, u], behind):
                    _insert(layers, v, u, depth, number, count)
                    count += 1
            # Eight pixels are drawn at once, so some beyond the box may have been.
            for u in range(box[0], min(box[1] + 1 + LANES, scratch.seen.shape[1])):
                scratch.seen[v, u], scratch.depth[v, u] = -1.0, np.inf
    return count


@lean_kernel
def blend(sensor, bodies, cover, layers, image):
    """Put the layers over an image of opaque bodies: each hides a part of those behind.

    Colours are mixed as they are written, from 0 to 255, without a curve.
    """
    known = -1
    right, down, ahead, p_GS = sensor.p_WS, sensor.p_WS, sensor.p_WS, sensor.p_WS
    for v in range(image.shape[0]):
        y = sensor.y[v]
        for u in range(image.shape[1]):
            at = layers.first[v, u]
            if at < 0:
                continue
            red, green, blue, left = 0.0, 0.0, 0.0, 1.0
            while at >= 0 and left > 0.0:
                place = at & LAST_PLACE
                number, at = layers.seen[place], layers.following[place]
                row = row_of(number) & LAST_PLACE
                if row != known:
                    known = row
                    right, down, ahead, p_GS = sensor_in_body(sensor, bodies, row)
                d = axpy(sensor.x[u], right, axpy(y, down, ahead))
                p_GQ = axpy(layers.depth[place], d, p_GS)
                color = lit_color(bodies, cover, row, triangle_of(number), p_GQ, ahead)
                share = left * color[3]
                red, green, blue = (
                    red + share * color[0],
                    green + share * color[1],
                    blue + share * color[2],
                )
                left -= share
            image[v, u, 0] = level(red + left * image[v, u, 0] / _LEVELS)
            image[v, u, 1] = level(green + left * image[v, u, 1] / _LEVELS)
            image[v, u, 2] = level(blue + left * image[v, u, 2] / _LEVELS)

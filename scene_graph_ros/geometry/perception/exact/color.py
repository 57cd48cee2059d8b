"""The colour image of a view: opaque surfaces first, then those seen through others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.perception.exact.blending import (
    blend,
    collect,
    count_places,
    Layers,
)
from scene_graph_ros.geometry.perception.exact.image_kernels import write_color
from scene_graph_ros.geometry.perception.exact.screen import clear_screen, Screen, Sensor
from scene_graph_ros.geometry.perception.exact.shading import write_pictures
from scene_graph_ros.geometry.perception.exact.view import View
from scene_graph_ros.geometry.perception.exact.visibility import find_visible

__all__ = ["color_image"]

_MOST_LAYERS = 2**21
"""At a time, 24 bytes each: an image with more is made of bands of rows."""

_Background = tuple[int, int, int]


def color_image(view: View, background: _Background) -> NDArray[np.uint8]:
    """Return the colour image ``(height, width, 4)``, with ``background`` where nothing is."""
    image = np.empty((*view.screen.depth.shape[:1], view.sensor.size[0], 4), np.uint8)
    cover = view.cover
    if not cover.is_transparent.any():
        _write_opaque(view, view.screen, background, image)
        return image
    opaque = Screen(*np.empty((2, *view.screen.depth.shape)))
    find_visible(view.sensor, view.bodies, ~cover.is_transparent, opaque, view.corners)
    _write_opaque(view, opaque, background, image)
    # What has no alpha at all is not there.
    _blend_rows(view, cover.is_transparent & (cover.alpha > 0.0), opaque, image, 0, len(image))
    return image


def _write_opaque(
    view: View, screen: Screen, background: _Background, image: NDArray[np.uint8]
) -> None:
    write_color(view.sensor, screen, view.bodies, background, image)
    if len(view.cover.size):
        write_pictures(view.sensor, screen, view.bodies, view.cover, image)


def _blend_rows(
    view: View,
    is_drawn: NDArray[np.bool_],
    opaque: Screen,
    image: NDArray[np.uint8],
    start: int,
    stop: int,
) -> None:
    """Put transparent bodies over the rows from ``start`` to ``stop``, in parts if need be."""
    sensor = _band(view.sensor, start, stop)
    count = int(count_places(sensor, view.bodies, is_drawn))
    if count > _MOST_LAYERS and stop - start > 1:
        middle = (start + stop) // 2
        _blend_rows(view, is_drawn, opaque, image, start, middle)
        _blend_rows(view, is_drawn, opaque, image, middle, stop)
        return
    if count == 0:
        return
    part = Screen(opaque.depth[start:stop], opaque.seen[start:stop])
    scratch = Screen(*np.empty((2, *part.depth.shape)))
    clear_screen(scratch)
    layers = Layers(
        first=np.full((stop - start, sensor.size[0]), -1, np.int64),
        following=np.empty(count, np.int64),
        depth=np.empty(count),
        seen=np.empty(count),
    )
    collect(sensor, view.bodies, is_drawn, part, scratch, view.corners, layers)
    blend(sensor, view.bodies, view.cover, layers, image[start:stop])


def _band(sensor: Sensor, start: int, stop: int) -> Sensor:
    """Return the sensor of some rows of the image: their rays are the same."""
    cx, cy = sensor.center
    width = sensor.size[0]
    return sensor._replace(
        center=(cx, cy - start), size=(width, stop - start), y=sensor.y[start:stop]
    )

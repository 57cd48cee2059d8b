"""One camera's view of one snapshot, before it becomes images: depths are not rounded yet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.lanes import LANES
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.perception.camera import RenderCameraCore
from scene_graph_ros.geometry.perception.exact.bodies import Bodies
from scene_graph_ros.geometry.perception.exact.body_table import body_table, place_bodies
from scene_graph_ros.geometry.perception.exact.cover import Cover
from scene_graph_ros.geometry.perception.exact.screen import Screen, Sensor
from scene_graph_ros.geometry.perception.exact.triangles import CORNER
from scene_graph_ros.geometry.perception.exact.visibility import find_visible

__all__ = ["View", "look"]

_MARGIN = (1e-6, 1e-13)
"""Pixels, and relative to the numbers of a camera: projecting a point rounds by less."""


class View(NamedTuple):
    """The nearest body along the ray of each pixel."""

    sensor: Sensor
    bodies: Bodies
    cover: Cover
    screen: Screen
    corners: NDArray[np.float64]
    """Memory of ``find_visible``."""


def look(
    snapshot: Snapshot,
    core: RenderCameraCore,
    X_WS: NDArray[np.float64],
    diffuse: tuple[float, float, float, float],
) -> View:
    """Return the view of a sensor at ``X_WS``; ``diffuse`` is the colour of bodies without one.

    Raises MeshError for a mesh of too many triangles.
    """
    table = body_table(snapshot.state, core.renderer_name, diffuse)
    (bodies, cover), sensor = place_bodies(snapshot, table), _sensor(core, X_WS)
    width, height = sensor.size
    screen = Screen(*np.empty((2, height, width + LANES)))
    corners = np.empty((int(np.diff(bodies.vertex_start).max(initial=0)), CORNER))
    find_visible(sensor, bodies, np.ones(len(bodies.kind), np.bool_), screen, corners)
    return View(sensor, bodies, cover, screen, corners)


def _sensor(core: RenderCameraCore, X_WS: NDArray[np.float64]) -> Sensor:
    lens, clipping = core.intrinsics, core.clipping
    largest = max(lens.width + abs(lens.cx), lens.height + abs(lens.cy), lens.fx, lens.fy)
    return Sensor(
        R_WS=tuple(X_WS[:3, :3].ravel().tolist()),
        p_WS=tuple(X_WS[:3, 3].tolist()),
        focal=(lens.fx, lens.fy),
        center=(lens.cx, lens.cy),
        size=(lens.width, lens.height),
        clipping=(clipping.near, clipping.far),
        margin=_MARGIN[0] + _MARGIN[1] * largest,
        x=(np.arange(lens.width + LANES) - lens.cx) / lens.fx,
        y=(np.arange(lens.height) - lens.cy) / lens.fy,
    )

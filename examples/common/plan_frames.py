"""Draw moments of a world in which a robot plans, side by side, as the node shows them."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from visualization_msgs.msg import Marker

from common.picture import Camera, trace
from common.world_planner import WorldPlanner

CAMERA = Camera(
    eye=(-1.25, -1.1, 1.75), target=(0.08, 0.5, 0.8), field_of_view=34.0, width=560, height=600
)
DOT = 2.5
"""Pixels: the radius of the dots that make the hand's way."""
SAME = 1e-6
"""Metres, and of quaternions: ghosts that are nearer to the robot are where it is."""
BETWEEN = 8
"""Dots from each of its points to the next."""
GAP = 6
"""Pixels between two frames."""


class Frame(NamedTuple):
    """What was to be seen at a moment."""

    title: str
    markers: list[Marker]


class Frames:
    """Takes moments while the world goes on, and draws them when it has ended."""

    def __init__(self, samples: int, camera: Camera = CAMERA) -> None:
        self._frames: list[Frame] = []
        self._samples, self._camera = samples, camera

    def take(self, planner: WorldPlanner, title: str, *, stops: bool) -> None:
        """Keep what is to be seen once the path is shown, with or without what stops it."""

        def is_shown() -> bool:
            groups = {ns for ns, _ in planner.markers}
            has_path = "plan/way" in groups and any(not ns.startswith("plan/") for ns in groups)
            return has_path and any(ns.startswith("plan/stop") for ns in groups) == stops

        planner.wait(is_shown, "the path as markers")
        self._frames.append(Frame(title, copy.deepcopy(list(planner.markers.values()))))

    def draw(self, output: Path) -> None:
        """Write all frames, from left to right, to ``output`` (PNG)."""
        count, (width, height) = len(self._frames), (self._camera.width, self._camera.height)
        image = Image.new("RGB", (count * width + (count - 1) * GAP, height), "white")
        for k, frame in enumerate(self._frames):
            drawn = _drawn(frame, self._samples, self._camera)
            image.paste(drawn, (k * (width + GAP), 0))
        image.save(output)


def _drawn(frame: Frame, samples: int, camera: Camera) -> Image.Image:
    image = trace(_seen(frame.markers), camera, samples=samples).convert("RGB")
    draw = ImageDraw.Draw(image)
    for marker in frame.markers:
        if marker.type == Marker.LINE_STRIP:
            _draw_way(draw, marker, camera)
    draw.text((12, 10), frame.title, font=ImageFont.load_default(22), fill=(20, 20, 30))
    return image


def _seen(markers: list[Marker]) -> list[Marker]:
    """Leave ghosts out that are where the robot is: of two surfaces in one place both are seen."""
    real = np.array([_numbers(marker) for marker in markers if not marker.ns.startswith("plan/")])

    def is_elsewhere(marker: Marker) -> bool:
        return not (np.abs(real - _numbers(marker)) < SAME).all(axis=1).any()

    return [m for m in markers if not m.ns.startswith("plan/") or is_elsewhere(m)]


def _numbers(marker: Marker) -> list[float]:
    """Return a pose as numbers; quaternions of one sign."""
    p, q = marker.pose.position, marker.pose.orientation
    sign = -1.0 if q.w < 0.0 else 1.0
    return [p.x, p.y, p.z, sign * q.x, sign * q.y, sign * q.z, sign * q.w]


def _draw_way(draw: ImageDraw.ImageDraw, marker: Marker, camera: Camera) -> None:
    """Draw a line on top of all else, in its colours."""
    points = np.array([(p.x, p.y, p.z) for p in marker.points])
    colors = np.array([(c.r, c.g, c.b) for c in marker.colors])
    ratios = np.arange(BETWEEN * (len(points) - 1) + 1) / BETWEEN
    places = np.arange(len(points))
    dots = np.stack([np.interp(ratios, places, axis) for axis in points.T], axis=1)
    for dot, number in zip(dots, ratios.astype(int), strict=True):
        x, y = camera.project(dot)
        color = tuple(int(255 * part) for part in colors[number])
        draw.ellipse([x - DOT, y - DOT, x + DOT, y + DOT], fill=color)

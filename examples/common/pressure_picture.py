"""Draw the pressure between a gripper's pad and a ball: the scene, and the pad by itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from visualization_msgs.msg import Marker

from common.picture import Camera, trace
from scene_graph_ros.views.surfaces import pressure_colors

PAD = "left_pad"
HALF_WIDTH = 0.015
"""Metres shown around the middle of the pad: the pad itself."""
CAMERA = Camera(eye=(0.22, -0.24, 0.145), target=(0.0, 0.0, 0.068), field_of_view=32.0, width=900)
PANEL = 630
TILE = 176
SHARPER = 3
"""Patches are drawn so many times as large and then reduced."""
SEAM = 1e-6
"""Part of a triangle by which it is drawn larger, so that none of the picture is between two."""
INK = (30, 30, 40)


class Patch:
    """The contact surface of one pad, out of the node's answer."""

    def __init__(self, surfaces: Any, points: Any, opening: float) -> None:
        """Take the columns of the surface that ``PAD`` is part of; opening in metres."""
        name = dict(zip(surfaces.geometries.id, surfaces.geometries.name, strict=True))
        pairs = list(zip(surfaces.id_a, surfaces.id_b, strict=True))
        row = next(i for i, pair in enumerate(pairs) if PAD in (name[pair[0]], name[pair[1]]))
        vertices = slice(surfaces.vertex_start[row], surfaces.vertex_start[row + 1])
        first, last = surfaces.face_start[row], surfaces.face_start[row + 1]
        starts = np.asarray(surfaces.corner_start)
        corners = np.asarray(surfaces.corners, dtype=int)[starts[first] : starts[last]]
        self.corners = corners.reshape(-1, 3) - vertices.start
        self.vertices_W = np.reshape(surfaces.vertices, (-1, 3))[vertices]
        self.pressures = np.asarray(surfaces.pressures)[vertices]
        self.area = surfaces.areas[row]
        self.force = float(np.linalg.norm(np.reshape(surfaces.forces, (-1, 3))[row]))
        self.opening = opening
        self.depth = max(points.depth)

    def words(self) -> str:
        """Return force, area and pressure in one line."""
        return (
            f"{self.force:5.1f} N over {1e4 * self.area:4.2f} square cm: on average"
            f" {1e-3 * self.force / self.area:3.0f} kPa, at most"
            f" {1e-3 * self.pressures.max():3.0f} kPa"
        )


def summary(patches: Sequence[Patch], latencies: Sequence[float]) -> str:
    """Return what can be learnt, in words and figures."""
    soft, hard = patches[0], patches[-1]
    median, p99 = 1e3 * np.percentile(latencies or [np.nan], [50, 99])
    lines = [
        "",
        f"Faces      {len(hard.corners)} triangles on one pad at the end",
        f"Latency    pose sent to contact received: median {median:.1f} ms, 99 % {p99:.1f} ms",
        f"Points     would only say: one contact on each pad, {1e3 * hard.depth:.2f} mm deep",
    ]
    if len(patches) > 1:
        force, area = hard.force / soft.force, hard.area / soft.area
        pressure = hard.pressures.max() / soft.pressures.max()
        lines.append(
            f"Softness   {force:.1f} times the force: {area:.1f} times the area,"
            f" {pressure:.1f} times the pressure"
        )
    return "\n".join(lines)


def _map(patch: Patch, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Return pressure (pixels, pixels) seen along y, right is x and up is z, and where it is."""
    middle = np.array([0.0, 0.0, 0.093 - 0.045])
    flat = (patch.vertices_W - middle)[:, [0, 2]] * [1.0, -1.0]
    flat = (flat / HALF_WIDTH + 1.0) * 0.5 * pixels
    pressure, is_hit = np.zeros((pixels, pixels)), np.zeros((pixels, pixels), dtype=bool)
    for corners in patch.corners:
        a, b, c = flat[corners]
        double = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        low = np.clip(np.floor(np.min([a, b, c], axis=0)).astype(int), 0, pixels)
        high = np.clip(np.ceil(np.max([a, b, c], axis=0)).astype(int) + 1, 0, pixels)
        if double == 0.0 or (low >= high).any():
            continue
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]] + 0.5
        s = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / double
        t = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / double
        inside = (s >= -SEAM) & (t >= -SEAM) & (s + t <= 1.0 + SEAM)
        p, q, r = patch.pressures[corners]
        region = (slice(low[1], high[1]), slice(low[0], high[0]))
        pressure[region][inside] = (p + s * (q - p) + t * (r - p))[inside]
        is_hit[region] |= inside
    return pressure, is_hit


def _tile(patch: Patch, size: int, scale: float) -> Image.Image:
    """Return the pad, dark, with the pressure on it."""
    pixels = SHARPER * size
    pressure, is_hit = _map(patch, pixels)
    colors = pressure_colors(pressure.ravel(), scale)[:, :3].reshape(pixels, pixels, 3)
    image = np.where(is_hit[..., None], 255.0 * colors, (58.0, 60.0, 66.0)).astype(np.uint8)
    return Image.fromarray(image).resize((size, size), Image.Resampling.LANCZOS)


def _colour_bar(draw: ImageDraw.ImageDraw, x: int, y: int, height: int, scale: float) -> None:
    font = ImageFont.load_default(17)
    values = np.linspace(scale, 0.0, height)
    for row, color in enumerate(pressure_colors(values, scale)):
        rgb = tuple(int(255 * channel) for channel in color[:3])
        draw.line([(x, y + row), (x + 22, y + row)], fill=rgb)
    for k in range(5):
        row = y + round(k / 4 * (height - 1))
        draw.line([(x + 22, row), (x + 28, row)], fill=INK)
        label = f"{1e-3 * scale * (1 - k / 4):.0f}"
        draw.text((x + 33, row), label, font=font, fill=INK, anchor="lm")
    draw.text((x, y - 12), "kPa", font=font, fill=INK, anchor="ls")


def draw_pressure(
    path: Path, markers: Sequence[Marker], patches: Sequence[Patch], scale: float
) -> None:
    """Write the picture (PNG): the scene at the last force, and the pad at each force."""
    image = Image.new("RGB", (CAMERA.width + PANEL, CAMERA.height), "white")
    image.paste(trace(markers, CAMERA, samples=48).convert("RGB"))
    draw = ImageDraw.Draw(image)
    _draw_panel(image, draw, patches, scale)
    image.save(path)


def _draw_panel(
    image: Image.Image, draw: ImageDraw.ImageDraw, patches: Sequence[Patch], scale: float
) -> None:
    left, large = CAMERA.width + 30, 400
    title, text, small = (ImageFont.load_default(size) for size in (24, 20, 16))
    last = patches[-1]
    draw.text((left, 22), f"A soft pad presses on a soft ball with {last.force:.0f} N",
              font=title, fill=INK)  # fmt: skip
    image.paste(_tile(last, large, scale), (left, 74))
    _colour_bar(draw, left + large + 30, 100, large - 40, scale)
    bar = round(0.005 / (2.0 * HALF_WIDTH) * large)
    x, y = left + 16, 74 + large - 18
    draw.line([(x, y), (x + bar, y)], fill="white", width=3)
    draw.text((x, y - 6), "5 mm", font=small, fill="white", anchor="ls")
    words = [
        f"{last.force:.1f} N over {1e4 * last.area:.2f} square cm:"
        f" {1e-3 * last.force / last.area:.0f} kPa on average,"
        f" {1e-3 * last.pressures.max():.0f} kPa at most.",
        f"Point contact says: one point, {1e3 * last.depth:.2f} mm deep.",
    ]
    for k, line in enumerate(words):
        draw.text((left, 74 + large + 14 + 27 * k), line, font=text, fill=INK)
    others = patches[:-1][-3:]
    y = 74 + large + 90
    for k, patch in enumerate(others):
        x = left + k * (TILE + 20)
        image.paste(_tile(patch, TILE, scale), (x, y))
        kilopascals = 1e-3 * patch.pressures.max()
        label = f"{patch.force:.0f} N: {1e4 * patch.area:.1f} sq cm, {kilopascals:.0f} kPa"
        draw.text((x, y + TILE + 6), label, font=small, fill=INK)

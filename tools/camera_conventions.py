"""Draw docs/camera_conventions.png: `python -m tools.camera_conventions`.

The image in it is rendered, and everything else is placed by the same numbers: the poses of the
frames, the camera's lens, the point that a pixel sees.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import importlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import (
    GeometryInstance,
    PerceptionProperties,
    QueryObject,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ColorRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)

__all__ = [
    "CLIPPING",
    "LENS",
    "SHOWN",
    "X_BS",
    "X_PC",
    "X_WP",
    "ball_before_camera",
    "main",
    "shown_ray",
]

_NAME = "camera_conventions.png"
_DOCS = Path(__file__).resolve().parents[1] / "docs"
_AXES = (("x", "#c62828"), ("y", "#2e7d32"), ("z", "#1565c0"))
_INK, _FAINT = "#263238", "#90a4ae"

LENS = CameraIntrinsics(12, 9, 10.0, 10.0, 5.5, 4.0)
CLIPPING = ClippingRange(0.3, 2.6)
SHOWN = (8, 2)
"""The pixel (u, v) whose ray is drawn."""


def _pose(columns: Sequence[Sequence[float]], p: Sequence[float]) -> NDArray[np.float64]:
    """Return a pose by the axes of its frame and its origin."""
    X = np.eye(4)
    X[:3, :3] = np.array(columns, np.float64).T
    X[:3, 3] = p
    return X


X_WP = _pose([(1, 0, 0), (0, 1, 0), (0, 0, 1)], (0.3, 0.5, 0.7))
X_PC = _pose([(1, 0, 0), (0, 1, 0), (0, 0, 1)], (0.85, 0.0, 0.1))
X_BS = _pose([(0, -1, 0), (0, 0, -1), (1, 0, 0)], (0.75, 0.0, 0.0))
X_WS = X_WP @ X_PC @ X_BS
p_SB = np.array([0.12, -0.1, 1.6])
"""The ball's middle, in S."""
RADIUS = 0.5


def shown_ray() -> tuple[NDArray[np.float64], float]:
    """Return the direction of the shown pixel's ray, of depth 1, and the depth of its end."""
    u, v = SHOWN
    d = np.array([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, 1.0])
    # |t d - p| = r
    a, b, c = d @ d, d @ p_SB, p_SB @ p_SB - RADIUS**2
    return d, float((b - np.sqrt(b * b - a * c)) / a)


def ball_before_camera() -> QueryObject:
    """Return queries of the scene that is drawn."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    seen = PerceptionProperties()
    seen.add_property("phong", "diffuse", Rgba(0.95, 0.6, 0.25))
    X_WG = np.eye(4)
    X_WG[:3, 3] = X_WS[:3, :3] @ p_SB + X_WS[:3, 3]
    ball = GeometryInstance(X_WG, Sphere(RADIUS), "ball")
    ball.set_perception_properties(seen)
    graph.register_anchored_geometry(graph.register_source("picture"), ball)
    return graph.query_object(graph.create_default_context())


def _image() -> NDArray[np.uint8]:
    camera = ColorRenderCamera(RenderCameraCore("exact", LENS, CLIPPING, X_BS))
    world = SceneGraph.world_frame_id()
    return ball_before_camera().render_color_image(camera, world, X_WP @ X_PC)


def _seen(p_W: Any) -> NDArray[np.float64]:
    """Return where points (..., 3) of the world are on the paper, seen from the front left."""
    right, up = np.array([0.80, -0.52, 0.0]), np.array([0.18, 0.27, 0.94])
    p = np.asarray(p_W, np.float64)
    return np.stack([p @ right, p @ up], axis=-1)


def _arrow(axis: Any, start: Any, end: Any, color: str, **looks: Any) -> None:
    style = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "color": color, "linewidth": 1.6}
    axis.annotate(
        "",
        xy=tuple(end),
        xytext=tuple(start),
        arrowprops={**style, **looks},
        annotation_clip=False,
    )


def _frame(axis: Any, X_WF: NDArray[np.float64], name: str, place: tuple[float, float]) -> None:
    """Draw a frame's axes and its name, which stands so far from its origin."""
    origin = _seen(X_WF[:3, 3])
    for (letter, color), column in zip(_AXES, X_WF[:3, :3].T, strict=True):
        end = _seen(X_WF[:3, 3] + 0.3 * column)
        _arrow(axis, origin, end, color, linewidth=2.2)
        axis.text(*(origin + 1.17 * (end - origin)), letter, color=color, ha="center", va="center")
    axis.text(*(origin + place), name, color=_INK, fontsize=13, weight="bold", ha="center")


def _frames(axis: Any) -> None:
    """Draw the chain of frames, the frustum and the ball."""
    X_WC = X_WP @ X_PC
    chain = [np.eye(4), X_WP, X_WC, X_WS]
    for one, other, name, shift in zip(
        chain[:-1],
        chain[1:],
        ("X_WP", "X_PC", "X_BS"),
        ((0.1, -0.05), (-0.06, -0.2), (-0.1, -0.17)),
        strict=True,
    ):
        start, end = _seen(one[:3, 3]), _seen(other[:3, 3])
        curve = {"linestyle": "--", "linewidth": 1.1, "connectionstyle": "arc3,rad=0.15"}
        _arrow(axis, start, end, _INK, **curve)
        axis.text(
            *(0.5 * (start + end) + shift), name, color=_INK, family="monospace", fontsize=10
        )
    corners = np.array([(-0.5, -0.5), (11.5, -0.5), (11.5, 8.5), (-0.5, 8.5)])
    rays = np.column_stack([(corners - (LENS.cx, LENS.cy)) / (LENS.fx, LENS.fy), np.ones(4)])
    far = _seen(1.0 * rays @ X_WS[:3, :3].T + X_WS[:3, 3])
    origin = _seen(X_WS[:3, 3])
    for corner in far:
        axis.plot(*np.stack([origin, corner]).T, color=_FAINT, linewidth=0.8)
    axis.fill(*far.T, facecolor="#cfd8dc", alpha=0.45, edgecolor=_FAINT)
    axis.text(*(far[0] + (0.0, 0.06)), "pixel (0, 0)", color=_INK, fontsize=9, ha="center")
    axis.text(*(far[2] + (0.05, -0.12)), "(11, 8)", color=_INK, fontsize=9, ha="center")
    _frame(axis, chain[0], "W", (-0.12, -0.14))
    _frame(axis, X_WP, "P", (-0.14, -0.08))
    _frame(axis, X_WC, "C", (-0.1, -0.17))
    _frame(axis, X_WS, "S", (-0.1, 0.1))
    words = (
        ("W", "world"),
        ("P", "frame that the query names: a link"),
        ("C", "camera's body, B, which is at X_PC on it"),
        ("S", "sensor, <name>_optical_frame: x right, y down, z ahead"),
    )
    for k, (name, meaning) in enumerate(words):
        axis.text(-0.3, -0.85 - 0.2 * k, name, color=_INK, fontsize=11, weight="bold")
        axis.text(-0.1, -0.85 - 0.2 * k, meaning, color=_INK, fontsize=11)
    axis.set_title("Frames: X_WS = X_WP X_PC X_BS", fontsize=12)
    axis.set_aspect("equal")
    axis.set_xlim(-0.4, 2.75)
    axis.set_ylim(-1.5, 2.2)
    axis.axis("off")


def _pixels(axis: Any) -> None:
    """Draw the image with its pixels, the principal point and the shown pixel."""
    axis.imshow(_image(), interpolation="nearest")
    for k in range(LENS.width + 1):
        axis.axvline(k - 0.5, color="white", linewidth=0.6)
    for k in range(LENS.height + 1):
        axis.axhline(k - 0.5, color="white", linewidth=0.6)
    axis.plot(LENS.cx, LENS.cy, "+", color=_INK, markersize=13, markeredgewidth=2)
    center = f"(cx, cy) = ({LENS.cx:g}, {LENS.cy:g})"
    place = {"xytext": (0.0, 7.6), "arrowprops": {"arrowstyle": "-", "color": _INK}}
    axis.annotate(center, (LENS.cx, LENS.cy), color=_INK, **place)
    u, v = SHOWN
    axis.plot(u, v, "o", color=_AXES[2][1])
    line = {"arrowstyle": "-", "color": _INK}
    axis.annotate(f"centre of ({u}, {v})", (u, v), (8.4, 0.2), color=_INK, arrowprops=line)
    axis.set_xticks(range(0, LENS.width, 1))
    axis.set_yticks(range(0, LENS.height, 1))
    axis.xaxis.tick_top()
    axis.tick_params(labelsize=8, length=2)
    _arrow(axis, (-0.5, -1.6), (2.6, -1.6), _AXES[0][1])
    axis.text(2.8, -1.6, "u, along x", color=_AXES[0][1], va="center")
    _arrow(axis, (-1.5, -0.5), (-1.5, 2.6), _AXES[1][1])
    axis.text(-1.5, 2.8, "v,\nalong y", color=_AXES[1][1], ha="center", va="top")
    axis.set_xlabel("d = ((u - cx) / fx, (v - cy) / fy, 1)", family="monospace", fontsize=10)


def _depth(axis: Any) -> None:
    """Draw the shown ray in the plane that it spans with z: depth is along z."""
    d, t = shown_ray()
    side = float(np.hypot(d[0], d[1]))
    # The ball is cut by that plane in a circle.
    across = np.array([d[0], d[1]]) / side
    off = float(p_SB[:2] @ np.array([-across[1], across[0]]))
    middle, radius = (p_SB[2], float(p_SB[:2] @ across)), np.sqrt(RADIUS**2 - off**2)
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    axis.fill(middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle),
              facecolor="#f2994033", edgecolor="#f29940")  # fmt: skip
    for depth, name in ((CLIPPING.near, "near"), (CLIPPING.far, "far")):
        axis.plot([depth, depth], [-0.3, 0.75], color=_FAINT, linewidth=1.2)
        axis.text(depth, 0.8, name, color=_FAINT, ha="center")
    _arrow(axis, (0, 0), (2.75, 0), _AXES[2][1])
    axis.text(2.8, 0.0, "z", color=_AXES[2][1], va="center")
    axis.plot([0, t], [0, t * side], color=_INK, linewidth=1.8)
    axis.plot([t, t], [0, t * side], color=_INK, linewidth=0.9, linestyle=":")
    axis.plot(t, t * side, "o", color=_INK)
    length = t * float(np.linalg.norm(d))
    axis.text(0.72 * t, 0.72 * t * side + 0.12, f"ray: {length:.3f} m", color=_INK, ha="right")
    axis.annotate("", (0, -0.13), (t, -0.13), arrowprops={"arrowstyle": "<->", "color": _INK})
    axis.text(0.0, -0.27, f"depth z: {t:.3f} m", color=_INK)
    axis.plot(0, 0, "s", color=_INK)
    axis.text(-0.06, 0.05, "S", color=_INK, fontsize=12, weight="bold", ha="right")
    axis.set_title("Depth is z, not the length of the ray", fontsize=12)
    axis.set_aspect("equal")
    axis.set_xlim(-0.2, 2.95)
    axis.set_ylim(-0.42, 0.95)
    axis.axis("off")


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.camera_conventions", description=__doc__
    )
    parser.add_argument("--output", type=Path, default=_DOCS / _NAME)
    options = parser.parse_args(arguments)
    importlib.import_module("matplotlib").use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure = pyplot.figure(figsize=(11.6, 7.2))
    parts = {"width_ratios": (1.15, 1.0), "height_ratios": (1.55, 1.0)}
    edges = {"left": 0.01, "right": 0.97, "top": 0.9, "bottom": 0.03, "hspace": 0.3, "wspace": 0.2}
    grid = figure.add_gridspec(2, 2, **parts, **edges)
    _frames(figure.add_subplot(grid[:, 0]))
    _pixels(figure.add_subplot(grid[0, 1]))
    _depth(figure.add_subplot(grid[1, 1]))
    figure.savefig(options.output, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    main()

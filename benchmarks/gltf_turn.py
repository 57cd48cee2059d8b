"""Draw a letter of a glTF file as its markers, the page and a recording have it, side by side.

    python -m benchmarks.gltf_turn [--out docs/gltf_turn.png]

A node with the letter's scene is recorded; the markers are those of the recording. Needs Chromium:
apt-get install chromium.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
from typing import Any

from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import MarkerArray

from benchmarks.browser import free_port, open_page
from benchmarks.messages.processes import isolated, ROOT
from scene_graph_ros.replay.reader import RecordingReader

sys.path.insert(0, str(ROOT / "test" / "support"))
from chromium import find_chromium, REMEDY, Tab  # type: ignore[import-not-found]
from letter_gltf import FACES, letter_gltf, POINTS  # type: ignore[import-not-found]

__all__ = ["main"]

_SIZE = (1200, 500)
_CROP = slice(340, 860)
"""Pixels of a row around the page's middle, beside its panel, which is 300 wide."""
_FAINT = 30
"""Of three colours together: less is background."""
_MARGIN = 30
"""Pixels around the letter."""
_ELEVATION, _AZIMUTH = 25.8, -51.6
"""Degrees: from where a page looks at first."""
_SCENE = """
version: 1
sources: [{{name: shelf}}]
geometries:
  - {{name: letter, source: shelf, shape: {{type: mesh, file: {file}}},
     roles: {{illustration: {{phong: {{diffuse: [0.2, 0.5, 0.8]}}}}}}}}
"""


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gltf_turn", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "gltf_turn.png")
    options = parser.parse_args()
    if find_chromium() is None:
        raise SystemExit(REMEDY)
    with isolated() as isolation:
        folder = isolation.folder
        (folder / "letter.gltf").write_bytes(letter_gltf())
        port = free_port()
        scene = _SCENE.format(file=folder / "letter.gltf")
        node = isolation.start_node(
            scene, browser=True, browser_port=port, record=folder / "recording"
        )
        tab = Tab(*_SIZE)
        try:
            open_page(tab, port, isolation)
            live = _seen(tab)
            isolation.stop(node)
            page = folder / "page.html"
            told = isolation.start(
                "scene_graph_ros.replay", str(folder / "recording"), "--html", str(page)
            )
            told.wait()
            tab.open(page.as_uri())
            replayed = _seen(tab)
        finally:
            tab.close()
        corners = _marker(folder / "recording")
    _draw([("markers", corners), ("page", live), ("recording", replayed)], options.out)


def _seen(tab: Any) -> NDArray[np.uint8]:
    """Return the image of a page beside its panel, when it has the letter."""
    tab.wait_for("document.body.dataset.items === '1'")
    tab.value("new Promise((done) => setTimeout(done, 500))")
    picture: NDArray[np.uint8] = tab.picture()[:, _CROP, :3]
    is_seen = np.abs(picture.astype(int) - picture[0, 0]).sum(axis=2) > _FAINT
    rows, columns = np.flatnonzero(is_seen.any(axis=1)), np.flatnonzero(is_seen.any(axis=0))
    return picture[
        max(0, rows[0] - _MARGIN) : rows[-1] + _MARGIN,
        max(0, columns[0] - _MARGIN) : columns[-1] + _MARGIN,
    ]


def _marker(recording: Path) -> NDArray[np.float64]:
    """Return the corners (m, 3, 3) of the letter's marker."""
    for message in RecordingReader(recording):
        if message.topic.endswith("markers/illustration"):
            markers = deserialize_message(message.data, MarkerArray).markers
            if markers:
                points = [(p.x, p.y, p.z) for p in markers[0].points]
                return np.array(points).reshape(-1, 3, 3)
    raise SystemExit("the recording has no marker")


def _letter(axes: Any, corners: NDArray[np.float64], up: int) -> None:
    """Draw triangles (m, 3, 3) with one axis up, from where a page looks."""
    for _ in range(3):  # smaller ones, as they are sorted by their middles
        a, b, c = (corners[:, k] for k in range(3))
        d, e, f = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        four = [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        corners = np.concatenate([np.stack(t, axis=1) for t in four])
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    light = 0.65 + 0.35 * np.abs(n @ np.array([0.3, -0.5, 0.8]))
    colors = np.clip(light[:, None] * np.array([0.25, 0.55, 0.85]), 0.0, 1.0)
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors=colors))
    middle, half = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))), 0.55
    limits = {f"{x}lim": (m - half, m + half) for x, m in zip("xyz", middle, strict=True)}
    axes.set(**limits, xlabel="x", ylabel="y", zlabel="z")
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.view_init(elev=_ELEVATION, azim=_AZIMUTH, vertical_axis="xyz"[up])


def _draw(views: list[tuple[str, NDArray[Any]]], out: Path) -> None:
    figure = Figure(figsize=(14.0, 3.7), layout="constrained")
    first = figure.add_subplot(1, 4, 1, projection="3d")
    _letter(first, POINTS[FACES], 2)
    first.set_title("the file's numbers, not turned")
    for k, (name, what) in enumerate(views):
        if what.ndim == 3 and what.dtype == np.uint8:
            axes = figure.add_subplot(1, 4, k + 2)
            axes.imshow(what)
            axes.set_axis_off()
        else:
            axes = figure.add_subplot(1, 4, k + 2, projection="3d")
            _letter(axes, what, 2)
        axes.set_title(name)
    figure.savefig(out, dpi=80)


if __name__ == "__main__":
    main()

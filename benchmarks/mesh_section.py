"""Draw a section through a mesh, as its file has it and as a solid.

    python -m benchmarks.mesh_section [FILE] [--axis x] [--out docs/mesh_section.png]

The section is through the triangle that is deepest inside of the solid. Without a file it is the
torso of TIAGo in example-robot-data, which has a triangle farther inside than
other meshes of robots that were tried.
"""

from __future__ import annotations

import argparse
import importlib.util
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.sources import load_surface, surface_of
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = ["main"]

_DOCS = Path(__file__).parents[1] / "docs"
_FOLDER = "cmeel.prefix/share/example-robot-data/robots/tiago_description/meshes/torso"
_GRID = 240
_PART = 0.005
"""Relative to the size: the length of a line that is looked at as one."""
_HIDDEN = 1e-6
"""Relative to the size: a triangle with the solid this far in front of it and behind is hidden."""

FloatArray = NDArray[np.float64]
Solid = tuple[FloatArray, NDArray[np.int64]]
"""Vertices (v, 3) and triangles (m, 3)."""


def _default() -> Path:
    found = importlib.util.find_spec("cmeel")
    if found is None or found.origin is None:
        raise SystemExit("name a file, or: pip install example-robot-data")
    return Path(found.origin).parents[1] / _FOLDER / "torso_lift_collision.dae"


def _section(
    corners: FloatArray, axis: int, height: float
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return segments (k, 2, 3) where a plane cuts triangles (n, 3, 3), and which of them."""
    above = corners[:, :, axis] > height
    rows = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    segments = []
    for row in rows:
        points = []
        for k in range(3):
            a, b = corners[row, k], corners[row, (k + 1) % 3]
            if above[row, k] != above[row, (k + 1) % 3]:
                points.append(a + (height - a[axis]) / (b[axis] - a[axis]) * (b - a))
        segments.append(points)
    return np.array(segments).reshape(-1, 2, 3), rows


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--axis", choices="xyz", default="y")
    parser.add_argument("--out", type=Path, default=_DOCS / "mesh_section.png")
    options = parser.parse_args()
    path, axis = options.file or _default(), "xyz".index(options.axis)
    mesh = Mesh(path)
    vertices, triangles = load_surface(mesh)
    surface = surface_of(mesh)
    solid = surface.triangles[surface.is_solid]
    deepest, depth = _deepest(mesh, vertices[triangles].mean(axis=1))
    figure, before, after = _panels(vertices[triangles].reshape(-1, 3), axis)
    hidden = _draw_file(before, vertices[triangles], (surface.vertices, solid), axis, deepest)
    before.set_title(f"as the file has it: {len(triangles)} triangles; red: inside of the solid")
    after.set_title(f"as a solid: {len(solid)} triangles; grey: inside")
    _draw_solid(after, (surface.vertices, solid), axis, deepest)
    across = [k for k in range(3) if k != axis]
    for plot in (before, after):
        plot.plot(*deepest[across], "o", color="tab:orange", markersize=7)
        plot.set(xlabel=f"{'xyz'[across[0]]} (m)", ylabel=f"{'xyz'[across[1]]} (m)")
    told = f"{path.name}: {surface.report}\nthe dot is on a triangle of the file, and"
    figure.suptitle(f"{told} {1e3 * depth:.0f} mm inside of the solid", fontsize=11)
    figure.savefig(options.out, dpi=100)
    place = ", ".join(f"{x:.4g}" for x in deepest)
    print(f"{path.name}: {surface.report}")
    print(f"({place}), on a triangle of the file, is {1e3 * depth:.1f} mm inside of the solid")
    print(
        f"{hidden[0]} of {hidden[1]} triangles in the section are inside of the solid, or partly"
    )


def _deepest(mesh: Mesh, points: FloatArray) -> tuple[FloatArray, float]:
    """Return the point that is deepest inside of the solid, and how deep, in metres."""
    table = build_shape_table([mesh], [True])
    distances = distance_points(table, np.eye(4)[None].copy(), points, np.inf)[2]
    row = int(distances.argmin())
    return points[row], -float(distances[row])


def _panels(points: FloatArray, axis: int) -> tuple[Figure, Axes, Axes]:
    """Return a figure with two plots of the same place, beside each other where it is tall."""
    across = [k for k in range(3) if k != axis]
    lower, upper = points.min(axis=0)[across], points.max(axis=0)[across]
    spread = 0.04 * (upper - lower).max()
    width, height = upper - lower
    is_tall = height > 0.6 * width
    scale = min(5.0 / width, 6.0 / height) if is_tall else min(9.0 / width, 3.5 / height)
    size = (
        (2.0 * scale * width, scale * height) if is_tall else (scale * width, scale * height * 2)
    )
    figure = Figure(figsize=(max(size[0], 8.0) + 1.2, size[1] + 1.6), layout="constrained")
    before, after = figure.subplots(*((1, 2) if is_tall else (2, 1)), sharex=True, sharey=True)
    before.set(xlim=(lower[0] - spread, upper[0] + spread), aspect="equal")
    before.set(ylim=(lower[1] - spread, upper[1] + spread))
    after.set(aspect="equal")
    return figure, before, after


def _draw_file(
    plot: Axes, corners: FloatArray, solid: Solid, axis: int, through: FloatArray
) -> tuple[int, int]:
    """Draw triangles (n, 3, 3), hidden parts in red; return how many have some, of how many cut.

    Each is looked at on both sides, at the middles of the parts of its segment.
    """
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    segments, rows = _section(corners, axis, float(through[axis]))
    cut = corners[rows]
    normals = np.cross(cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    counts = np.ceil(np.linalg.norm(np.diff(segments, axis=1)[:, 0], axis=1) / (_PART * size))
    of = np.repeat(np.arange(len(segments)), np.maximum(counts, 1.0).astype(int))
    number = np.arange(len(of)) - np.searchsorted(of, of)
    t = (number[:, None] + np.array([0.0, 1.0])) / np.maximum(counts, 1.0)[of, None]
    start, end = segments[of, :1], segments[of, 1:]
    parts = start + t[:, :, None] * (end - start)
    step, middles = _HIDDEN * size * normals[of], parts.mean(axis=1)
    sides = [winding_numbers(middles + s * step, *solid) > 0 for s in (1, -1)]
    hidden = sides[0] & sides[1]
    flat = parts[:, :, [k for k in range(3) if k != axis]]
    plot.add_collection(LineCollection(flat[~hidden], colors="black", linewidths=1.2))
    plot.add_collection(LineCollection(flat[hidden], colors="red", linewidths=1.2))
    return len(np.unique(of[hidden])), len(rows)


def _draw_solid(plot: Axes, solid: Solid, axis: int, through: FloatArray) -> None:
    """Draw the inside, by winding numbers, and the boundary."""
    vertices, triangles = solid
    across = [k for k in range(3) if k != axis]
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    half = 0.5 * (upper - lower) / _GRID
    u, v = (np.linspace(lower[k] + half[k], upper[k] - half[k], _GRID) for k in across)
    grid = np.full((_GRID, _GRID, 3), through[axis])
    grid[:, :, across[0]], grid[:, :, across[1]] = u[None, :], v[:, None]
    inside = winding_numbers(grid.reshape(-1, 3), vertices, triangles) > 0
    image = np.where(inside.reshape(_GRID, _GRID), 0.8, 1.0)
    box = [bound[k] for k in across for bound in (lower, upper)]
    plot.imshow(image, extent=box, origin="lower", cmap="gray", vmin=0.0, vmax=1.0)
    outline = _section(vertices[triangles], axis, float(through[axis]))[0][:, :, across]
    plot.add_collection(LineCollection(outline, colors="tab:blue", linewidths=1.2))


if __name__ == "__main__":
    main()

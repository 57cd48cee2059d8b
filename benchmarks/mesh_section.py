"""Draw a section through a mesh, as its file has it and as a solid.

    python -m benchmarks.mesh_section [FILE] [--axis y] [--out docs/mesh_section.png]

Without a file it is the forearm of the UR5 in example-robot-data, whose bodies overlap and cross.
"""

from __future__ import annotations

import argparse
import importlib.util
from pathlib import Path

from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.sources import load_surface, surface_of

__all__ = ["main"]

_DOCS = Path(__file__).parents[1] / "docs"
_FOLDER = "cmeel.prefix/share/example-robot-data/robots/ur_description/meshes/ur5/visual"
_GRID = 240
_HIDDEN = 1e-6
"""Relative to the size: a triangle with the solid this far in front of it and behind is hidden."""

FloatArray = NDArray[np.float64]


def _default() -> Path:
    found = importlib.util.find_spec("cmeel")
    if found is None or found.origin is None:
        raise SystemExit("name a file, or: pip install example-robot-data")
    return Path(found.origin).parents[1] / _FOLDER / "forearm.dae"


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
    parser.add_argument("--axis", choices="xyz", default="x")
    parser.add_argument("--out", type=Path, default=_DOCS / "mesh_section.png")
    options = parser.parse_args()
    path, axis = options.file or _default(), "xyz".index(options.axis)
    mesh = Mesh(path)
    vertices, triangles = load_surface(mesh)
    surface = surface_of(mesh)
    solid = surface.triangles[surface.is_solid]
    corners = vertices[triangles]
    lower, upper = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    height = 0.5 * (lower + upper)[axis]
    across = [k for k in range(3) if k != axis]
    segments, rows = _section(corners, axis, float(height))
    cut = corners[rows]
    normals = np.cross(cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    step = _HIDDEN * (upper - lower).max() * normals
    middles = segments.mean(axis=1)
    sides = [winding_numbers(middles + s * step, surface.vertices, solid) > 0 for s in (1, -1)]
    hidden = sides[0] & sides[1]
    u, v = (np.linspace(lower[k], upper[k], _GRID) for k in across)
    grid = np.full((_GRID, _GRID, 3), height)
    grid[:, :, across[0]], grid[:, :, across[1]] = u[None, :], v[:, None]
    inside = winding_numbers(grid.reshape(-1, 3), surface.vertices, solid) > 0
    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    before, after = figure.subplots(1, 2, sharex=True, sharey=True)
    flat = segments[:, :, across]
    before.add_collection(LineCollection(flat[~hidden], colors="black", linewidths=1.0))
    before.add_collection(LineCollection(flat[hidden], colors="red", linewidths=1.0))
    before.set_title(f"as the file has it: {len(triangles)} triangles\nred: inside of the solid")
    outline = _section(surface.vertices[solid], axis, float(height))[0][:, :, across]
    box = (u[0], u[-1], v[0], v[-1])
    image = np.where(inside.reshape(_GRID, _GRID), 0.8, 1.0)
    after.imshow(image, extent=box, origin="lower", cmap="gray", vmin=0.0, vmax=1.0)
    after.add_collection(LineCollection(outline, colors="tab:blue", linewidths=1.0))
    after.set_title(f"as a solid: {len(solid)} triangles\ngrey: inside")
    for plot in (before, after):
        plot.set(aspect="equal", xlabel=f"{'xyz'[across[0]]} (m)")
    before.set_ylabel(f"{'xyz'[across[1]]} (m)")
    before.autoscale_view()
    figure.savefig(options.out, dpi=100)
    print(f"{path.name}: {surface.report}")
    print(f"{int(hidden.sum())} of {len(rows)} triangles in the section are inside of the solid")


if __name__ == "__main__":
    main()

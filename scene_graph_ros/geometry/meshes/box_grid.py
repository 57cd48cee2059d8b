"""A box as a grid of cells, for bodies that deform.

Each cell is divided into twelve tetrahedra around its centre, two on each side. All faces on the
same axis are cut along the same diagonal, so that neighbouring cells fit; and each tetrahedron
has a corner inside the box, so that no distance from the surface is lost between corners.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.tessellate.counts import MAX_ELEMENTS
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.shapes.box import Box

__all__ = ["grid_box"]

_PER_CELL = 12
_ENOUGH = 1e18  # cells along a side: their number would be refused anyway
# The corners of a cell as bits: 1 along x, 2 along y, 4 along z. Two triangles on each of the six
# sides, counter-clockwise seen from outside, cut from the corner with the fewest bits to the one
# with the most.
_SIDES = np.array([
    [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
    [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3],
    [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6],
])  # fmt: skip


def grid_box(shape: Box, resolution_hint: float) -> VolumeMesh:
    """Return a box in cells of the same size, no side of which is longer than the hint.

    ``resolution_hint`` is in m, above 0. Raises MeshError if there would be more than
    MAX_ELEMENTS tetrahedra.
    """
    size = np.array([shape.width, shape.depth, shape.height])
    counts = [math.ceil(min(side / resolution_hint, _ENOUGH)) for side in size.tolist()]
    total = _PER_CELL * math.prod(counts)
    if total > MAX_ELEMENTS:
        raise MeshError(
            f"resolution_hint {resolution_hint:g} m of {shape!r} asks for {total:.3g} tetrahedra;"
            f" more than {MAX_ELEMENTS} are refused: make it larger"
        )
    lines = [np.linspace(-0.5 * s, 0.5 * s, n + 1) for s, n in zip(size, counts, strict=True)]
    centres = [0.5 * (line[1:] + line[:-1]) for line in lines]
    vertices = np.concatenate([_product(lines), _product(centres)])
    return VolumeMesh.trusted(vertices, _tetrahedra(counts))


def _product(lines: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def _tetrahedra(counts: list[int]) -> NDArray[np.int64]:
    nodes = [n + 1 for n in counts]
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    corners = np.ravel_multi_index(
        tuple(np.moveaxis(cells[:, None, :] + bits[None], -1, 0)), tuple(nodes)
    )
    centre = math.prod(nodes) + np.arange(len(cells))
    sides = corners[:, _SIDES]
    # A triangle seen counter-clockwise from outside has the centre on its other side.
    inner = np.broadcast_to(centre[:, None, None], (*sides.shape[:2], 1))
    return np.concatenate([inner, sides], axis=2).reshape(-1, 4).astype(np.int64)

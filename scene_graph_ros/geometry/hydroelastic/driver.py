"""Contact surfaces of a list of pairs: the loop over pairs, and the loop over their polygons.

The first finds all polygons, each in the frame of one of its bodies, in scratch memory that is
kept. Then the sizes of all results are known, and the second loop places the polygons in the
world, divides them into triangles if asked to, and integrates pressure.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.cutting.polygons import POLYGON_CORNERS
from scene_graph_ros.geometry.hydroelastic.body_table import BodyKind
from scene_graph_ros.geometry.hydroelastic.clipping import (
    COUNT,
    FULL,
    MOVED_WIDTH,
    SURFACES,
    WIDTH,
    Work,
)
from scene_graph_ros.geometry.hydroelastic.element_table import ElementTable
from scene_graph_ros.geometry.hydroelastic.pairs import (
    half_space_and_surface,
    half_space_and_volume,
    volume_and_other,
)
from scene_graph_ros.geometry.hydroelastic.patches import ElementFields, Patches
from scene_graph_ros.geometry.hydroelastic.placing import (
    BEGIN,
    END,
    FLIPPED,
    FRAME,
    new_surface_memory,
    place_polygons,
    ROW_M,
    ROW_N,
    SURFACE_WIDTH,
)
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    norm,
    relative_pose,
)
from scene_graph_ros.geometry.tolerances import (
    CONTACT_RESOLUTION,
    CONTACT_TIE,
    PLACED_RESOLUTION,
)

__all__ = ["solve_surfaces"]

RIGID_SURFACE = int(BodyKind.RIGID_SURFACE)
COMPLIANT_VOLUME = int(BodyKind.COMPLIANT_VOLUME)
COMPLIANT_HALF_SPACE = int(BodyKind.COMPLIANT_HALF_SPACE)

_FIRST_CAPACITY = 4096


@inlined_kernel
def _add_pair(table, a, b, X_WA, X_WB, work):
    """Add the polygons of rows a and b; a is a volume or else a compliant half space.

    Poses are (R, p).

    Returns:
        whether they are in the frame of b, instead of a, and the width (m) too narrow to keep.

    """
    (R_WA, p_WA), (R_WB, p_WB) = X_WA, X_WB
    kind_A, kind_B = table.kind[a], table.kind[b]
    body_A, body_B = table.body[a], table.body[b]
    R_AB, p_AB = relative_pose(R_WA, p_WA, R_WB, p_WB)
    size = table.reach[body_A] + table.reach[body_B] + norm(p_AB)
    slack = CONTACT_TIE * size
    narrow = CONTACT_RESOLUTION * size + PLACED_RESOLUTION * max(norm(p_WA), norm(p_WB))
    if kind_A == COMPLIANT_HALF_SPACE:
        X_BA = relative_pose(R_WB, p_WB, R_WA, p_WA)
        slab, margin = table.element_start[body_A], table.margin[a]
        half_space_and_surface(table, slab, margin, body_B, X_BA, slack, narrow, work)
        return True, narrow
    if kind_B in (COMPLIANT_VOLUME, RIGID_SURFACE):
        is_rigid = kind_B == RIGID_SURFACE
        volume_and_other(table, body_A, body_B, is_rigid, (R_AB, p_AB), slack, narrow, work)
        return False, narrow
    slab, margin = -1, 0.0
    if kind_B == COMPLIANT_HALF_SPACE:
        slab, margin = table.element_start[body_B], table.margin[b]
    half_space_and_volume(table, body_A, slab, margin, (R_AB, p_AB), slack, narrow, work)
    return False, narrow


@lean_kernel
def _find_polygons(table, X_WG, pairs, begin, surfaces, narrow, work):
    """Add the polygons of pairs from ``begin`` on, and their surfaces.

    ``narrow`` is filled with the width, of each surface, of faces that are too narrow to keep.

    Returns:
        how many pairs are done: fewer than all where there was no more room for polygons;
        nothing is kept of the pair that failed.

    """
    counts = work.counts
    for k in range(begin, len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        kind_j = table.kind[j]
        flipped = table.kind[i] != COMPLIANT_VOLUME and (
            kind_j in (COMPLIANT_VOLUME, COMPLIANT_HALF_SPACE)
        )
        a, b = (j, i) if flipped else (i, j)
        X_WA = load_rotation(X_WG, a), load_translation(X_WG, a)
        X_WB = load_rotation(X_WG, b), load_translation(X_WG, b)
        before = counts[COUNT]
        in_B, too_narrow = _add_pair(table, a, b, X_WA, X_WB, work)
        if counts[FULL]:
            counts[COUNT] = before
            return k
        if counts[COUNT] > before:
            s = counts[SURFACES]
            surfaces[s, ROW_M], surfaces[s, ROW_N] = i, j
            surfaces[s, FRAME], surfaces[s, FLIPPED] = b if in_B else a, flipped
            surfaces[s, BEGIN], surfaces[s, END] = before, counts[COUNT]
            narrow[s] = too_narrow
            counts[SURFACES] = s + 1
    return len(pairs)


class _Scratch:
    """Memory of the first loop, kept from query to query by one thread at a time."""

    def __init__(self) -> None:
        self.work = Work(
            moved=np.empty(MOVED_WIDTH),
            buffer=np.empty((2, POLYGON_CORNERS, 3)),
            heights=np.empty(POLYGON_CORNERS),
            polygons=np.empty((_FIRST_CAPACITY, WIDTH)),
            labels=np.empty((_FIRST_CAPACITY, 3), np.int64),
            counts=np.zeros(3, np.int64),
        )

    def begin(self) -> None:
        """Forget all faces."""
        self.work.counts[:] = 0

    def grow(self) -> None:
        """Double the room for polygons."""
        work = self.work
        work.counts[FULL] = 0
        polygons, labels = (
            _twice(old, work.counts[COUNT]) for old in (work.polygons, work.labels)
        )
        self.work = work._replace(polygons=polygons, labels=labels)


def _twice(old: NDArray[Any], kept: int) -> NDArray[Any]:
    new = np.empty((2 * len(old), old.shape[1]), old.dtype)
    new[:kept] = old[:kept]
    return new


_free = deque([_Scratch()], maxlen=1)
"""Taken by who computes: others, and who comes after an interrupt, make their own."""
_answers = new_surface_memory()


def solve_surfaces(
    table: ElementTable, X_WG: NDArray[np.float64], pairs: NDArray[np.int64], triangles: bool
) -> Patches:
    """Compute the contact surfaces of pairs of kinds that have one.

    Args:
        table: of n rows.
        X_WG: (n, 4, 4).
        pairs: (m, 2) rows (M, N).
        triangles: whether polygons are to be divided.

    Returns:
        the surfaces that are not empty, in the order of the pairs.

    """
    try:
        scratch = _free.pop()
    except IndexError:
        scratch = _Scratch()
    patches = _solve(table, X_WG, pairs, triangles, scratch)
    _free.append(scratch)
    return patches


def _solve(
    table: ElementTable,
    X_WG: NDArray[np.float64],
    pairs: NDArray[np.int64],
    triangles: bool,
    scratch: _Scratch,
) -> Patches:
    scratch.begin()
    surfaces, narrow = np.empty((len(pairs), SURFACE_WIDTH), np.int64), np.empty(len(pairs))
    done = 0
    while done < len(pairs):
        done = _find_polygons(table, X_WG, pairs, done, surfaces, narrow, scratch.work)
        if scratch.work.counts[FULL]:
            scratch.grow()
    work = scratch.work
    found = work.counts[SURFACES]
    arrays = place_polygons(
        table.margin, X_WG, surfaces[:found], work.polygons, work.labels, triangles, _answers
    )
    of_elements = ElementFields(table.gradients, table.planes)
    return Patches(arrays, of_elements, X_WG[surfaces[:found, :2]], narrow[:found].copy())

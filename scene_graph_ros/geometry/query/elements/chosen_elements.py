"""Balls of clouds, prisms of fields and voxels, as rows of the scene's table."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.query.elements.scene import Clouds
from scene_graph_ros.geometry.tables.prism_slots import leave_slot, take_slot
from scene_graph_ros.geometry.tables.voxel_bits import PlacedVoxels

__all__ = ["MOST_PRISMS", "Elements", "chosen_elements"]

MOST_PRISMS = 4
"""So many are made rows at a time, so that many threads may do so."""


class Elements(NamedTuple):
    """Elements of clouds and fields, one for each of m pairs."""

    p_CP: NDArray[np.float64]
    """(m, 3) the centres of balls and voxels, and the prisms' origins, in their shapes' frames."""
    radii: NDArray[np.float64]
    """(m,) of balls; 0 of prisms."""
    indices: NDArray[np.int64]
    """(m,) which point each was as they were given, or which prism or voxel it is."""
    rows: NDArray[np.int64]
    """(m,) their rows: that of the point for balls."""


@contextlib.contextmanager
def chosen_elements(
    clouds: Clouds, which: NDArray[np.int64], places: NDArray[np.int64]
) -> Iterator[Elements]:
    """Give the elements at some places of some clouds and fields; their rows are ours until then.

    Places are those of ``FoundPairs``.
    """
    m, is_ball = len(which), which < clouds.num_clouds
    p_CP, radii, indices = np.zeros((m, 3)), np.zeros(m), places.copy()
    rows = np.full(m, clouds.table.point)
    for k in np.flatnonzero(is_ball).tolist():
        tree = clouds.table.clouds[which[k]].tree
        leaf, i = divmod(int(places[k]), tree.points.shape[2])
        p_CP[k], indices[k] = tree.points[leaf, :, i], tree.order[places[k]]
        radii[k] = tree.radii[leaf, i] if len(tree.radii) else tree.radius[1]
    elements = Elements(p_CP, radii, indices, rows)
    if is_ball.all():
        yield elements
        return
    first = len(clouds.ids) - clouds.table.own.grids
    for k in np.flatnonzero(which >= first).tolist():
        grid = clouds.table.fields[which[k] - clouds.num_clouds]
        assert isinstance(grid, PlacedVoxels)
        at = np.unravel_index(int(places[k]), tuple(grid.bits.counts[0]))
        p_CP[k] = (np.array(at) + 0.5) * grid.bits.numbers[0]
        rows[k] = clouds.table.point - (len(clouds.ids) - which[k])
    is_prism = ~is_ball & (which < first)
    if not is_prism.any():
        yield elements
        return
    with _prisms(clouds, which[is_prism], places[is_prism]) as (own, origins):
        rows[is_prism], p_CP[is_prism] = own, origins
        yield elements


@contextlib.contextmanager
def _prisms(
    clouds: Clouds, which: NDArray[np.int64], places: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float64]]]:
    """Give rows ``(k,)`` that are prisms, and their origins ``(k, 3)``."""
    from scene_graph_ros.geometry.query.elements.field_kernels import place_prisms

    table, slots = clouds.table, list[int]()
    try:
        slots.extend(take_slot() for _ in range(len(which)))
        rows = table.point - table.own.grids - table.own.slots + np.array(slots, np.int64)
        origins = np.empty((len(which), 3))
        place_prisms(
            table.held.places,
            which - clouds.num_clouds,
            np.ascontiguousarray(places),
            rows,
            origins,
        )
        yield rows, origins
    finally:
        for slot in slots:
            leave_slot(slot)

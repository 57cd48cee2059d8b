"""How many voxels all grids of a scene may have: requests that are small each add up."""

from __future__ import annotations

from typing import Any

from msg_adapters.errors import TooLargeError

__all__ = ["MOST_IN_SCENE", "check_voxels"]

MOST_IN_SCENE = 2**26
"""Voxels of all grids of a node's scene, a byte each."""


def check_voxels(inspector: Any) -> None:
    """Raise TooLargeError for more than MOST_IN_SCENE, as they were registered."""
    grids = inspector.get_all_voxel_grid_ids()
    total = sum(inspector.get_shape(grid).occupancy.size for grid in grids)
    if total > MOST_IN_SCENE:
        raise TooLargeError(
            f"{len(grids)} voxel grids would have {total} voxels together, and those of a scene"
            f" may have {MOST_IN_SCENE}"
        )

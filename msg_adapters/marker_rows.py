"""Rows of markers: the drawn items, with the plates that stand for half spaces in their places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.views.draw_list import Shown

__all__ = ["HALF_SPACE_EXTENT", "HALF_SPACE_THICKNESS", "MarkerRows", "marker_id"]

HALF_SPACE_EXTENT = 20.0
"""Metres. Edge length of the plate that stands for a half space."""

HALF_SPACE_THICKNESS = 1e-3
"""Metres. Thickness of that plate, whose upper side is the boundary: thin beside all else."""

_MAX_INT32 = 2**31 - 1


def marker_id(geometry_id: int) -> int:
    """Return the marker id of a geometry: its own id, folded into 31 bits."""
    return int(geometry_id) & _MAX_INT32


class MarkerRows(Shown):
    """The items that viewers of markers see; row i of all poses belongs to item i."""

    def place(self, rows: NDArray[np.int64], X_WG: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses of the markers of some rows, ascending, and take them as shown."""
        X_WM = super().place(rows, X_WG)
        if not len(self.listed.half_spaces):
            return X_WM
        # The plate of a half space hangs below its boundary.
        plates = np.isin(rows, self.listed.half_spaces)
        X_WM = X_WM.copy()
        X_WM[plates, :3, 3] -= 0.5 * HALF_SPACE_THICKNESS * X_WM[plates, :3, 2]
        return X_WM

"""The answer of every tessellator of a solid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Solid"]


class Solid(NamedTuple):
    """A shape in G as tetrahedra, and how deep its vertices lie.

    The vertices of the surface come first; each of them belongs to one of the triangles.
    """

    vertices: NDArray[np.float64]
    """(v, 3) metres."""
    tetrahedra: NDArray[np.int64]
    """(t, 4), positive, conforming, none with an extent of 0 at all its vertices."""
    triangles: NDArray[np.int64]
    """(s, 3) the surface, counter-clockwise from outside."""
    extent: NDArray[np.float64]
    """(v,): 1 where the shape is deepest, 0 on its surface, negative outside of it."""

    @property
    def surface_count(self) -> int:
        """The number of vertices on the surface."""
        return int(self.triangles.max()) + 1

    def surface(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return the surface alone: (k, 3) vertices and (s, 3) triangles."""
        return self.vertices[: self.surface_count], self.triangles

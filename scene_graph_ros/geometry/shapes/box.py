"""A box with its sides along the axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, symmetric_bounds

__all__ = ["Box"]


@dataclass(frozen=True, slots=True)
class Box(PrimitiveShape):
    """A box centred on the origin: ``width`` along x, ``depth`` along y, ``height`` along z."""

    kind: ClassVar[ShapeKind] = ShapeKind.BOX
    width: float
    depth: float
    height: float

    @property
    def size(self) -> NDArray[np.float64]:
        """The three lengths ``(3,)`` along x, y and z."""
        return np.array((self.width, self.depth, self.height))

    @classmethod
    def make_cube(cls, edge_size: float) -> Box:
        """Return a box with three equal sides."""
        return cls(edge_size, edge_size, edge_size)

    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners of the box around the shape."""
        return symmetric_bounds((0.5 * self.width, 0.5 * self.depth, 0.5 * self.height))

    def volume(self) -> float:
        """Return width times depth times height in m^3."""
        return self.width * self.depth * self.height

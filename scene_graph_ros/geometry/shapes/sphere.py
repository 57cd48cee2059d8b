"""A ball around the origin."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, symmetric_bounds

__all__ = ["Sphere"]


@dataclass(frozen=True, slots=True)
class Sphere(PrimitiveShape):
    """A ball of the given radius, centred on the origin of G; with radius 0 it is a point."""

    kind: ClassVar[ShapeKind] = ShapeKind.SPHERE
    may_be_point: ClassVar[bool] = True
    radius: float

    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners of the box around the shape."""
        return symmetric_bounds((self.radius, self.radius, self.radius))

    def volume(self) -> float:
        """Return 4/3 pi r^3 in m^3."""
        return 4.0 / 3.0 * math.pi * self.radius * self.radius * self.radius

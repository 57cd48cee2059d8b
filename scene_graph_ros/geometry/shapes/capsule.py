"""A segment along z, thickened."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, symmetric_bounds

__all__ = ["Capsule"]


@dataclass(frozen=True, slots=True)
class Capsule(PrimitiveShape):
    """All points within ``radius`` of a segment of ``length`` along z, centred on the origin."""

    kind: ClassVar[ShapeKind] = ShapeKind.CAPSULE
    radius: float
    length: float

    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners of the box around the shape."""
        return symmetric_bounds((self.radius, self.radius, 0.5 * self.length + self.radius))

    def volume(self) -> float:
        """Return that of the cylinder and of one ball in m^3."""
        return math.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius)

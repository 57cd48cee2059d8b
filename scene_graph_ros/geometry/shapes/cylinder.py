"""A cylinder along z."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, symmetric_bounds

__all__ = ["Cylinder"]


@dataclass(frozen=True, slots=True)
class Cylinder(PrimitiveShape):
    """A solid cylinder of ``length`` along z, centred on the origin."""

    kind: ClassVar[ShapeKind] = ShapeKind.CYLINDER
    radius: float
    length: float

    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners of the box around the shape."""
        return symmetric_bounds((self.radius, self.radius, 0.5 * self.length))

    def volume(self) -> float:
        """Return pi r^2 times the length in m^3."""
        return math.pi * self.radius**2 * self.length

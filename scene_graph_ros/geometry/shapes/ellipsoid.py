"""An ellipsoid with its axes along those of G."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, symmetric_bounds

__all__ = ["Ellipsoid"]


@dataclass(frozen=True, slots=True)
class Ellipsoid(PrimitiveShape):
    """The points with ``(x/a)^2 + (y/b)^2 + (z/c)^2 <= 1``: semi-axes ``a``, ``b``, ``c``."""

    kind: ClassVar[ShapeKind] = ShapeKind.ELLIPSOID
    a: float
    b: float
    c: float

    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners of the box around the shape."""
        return symmetric_bounds((self.a, self.b, self.c))

    def volume(self) -> float:
        """Return 4/3 pi a b c in m^3."""
        return 4.0 / 3.0 * math.pi * self.a * self.b * self.c

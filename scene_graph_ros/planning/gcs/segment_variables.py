"""The coordinates of a vertex's point: a region's control points, and its duration."""

from __future__ import annotations

from dataclasses import dataclass
import functools

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import Affine
from scene_graph_ros.trajectories.bernstein import differentiated

__all__ = ["SegmentVariables"]


@dataclass(frozen=True)
class SegmentVariables:
    """The coordinates (r_0, ..., r_order, h): rows of control points, then the duration.

    The segment is q(t) = r((t - t_0) / h), where r is the Bézier curve of the control points over
    [0, 1]. Of order 0 there is one point, which is waited at if there is a duration.
    """

    order: int
    num_positions: int
    has_duration: bool

    @property
    def size(self) -> int:
        """The number of coordinates."""
        return (self.order + 1) * self.num_positions + self.has_duration

    def control_points(self, x: np.ndarray) -> np.ndarray:
        """Return the control points ``(order + 1, n)`` in coordinates ``(size,)``."""
        count = self.order + 1
        return x[: count * self.num_positions].reshape(count, self.num_positions)

    def duration(self, x: np.ndarray) -> float:
        """Return the duration in coordinates ``(size,)``, s; 0 where there is none."""
        return float(x[-1]) if self.has_duration else 0.0

    @functools.lru_cache(maxsize=64)  # noqa: B019  a value of three numbers
    def _derivative(self, order: int) -> np.ndarray:
        """Return ``(order of r - order + 1, n, size)``: control points of a derivative of r."""
        weights = differentiated(np.eye(self.order + 1)[np.newaxis], order)[0]
        n = self.num_positions
        maps = np.zeros((len(weights), n, self.size))
        maps[:, :, : (self.order + 1) * n] = np.einsum("ij,kl->ikjl", weights, np.eye(n)).reshape(
            len(weights), n, -1
        )
        maps.setflags(write=False)
        return maps

    def path(self, key: int, index: int, order: int = 0) -> Affine:
        """Return a control point ``(n,)`` of a derivative of r, of the vertex with a number."""
        return Affine({key: self._derivative(order)[index]}, np.zeros(self.num_positions))

    def time(self, key: int) -> Affine:
        """Return the duration as an expression, of the vertex with a number."""
        row = np.zeros((1, self.size))
        row[0, -1] = 1.0
        return Affine({key: row}, np.zeros(1), True)

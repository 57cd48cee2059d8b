"""The interface of curves in time."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line

__all__ = ["Trajectory"]


@one_line("rows", "start_time", "end_time")
@runtime_checkable
class Trajectory(Protocol):
    """A curve in n dimensions from a start time to an end time, with derivatives of its kind."""

    @property
    def start_time(self) -> float:
        """When it begins, s."""

    @property
    def end_time(self) -> float:
        """When it ends, s."""

    @property
    def duration(self) -> float:
        """How long it takes, s."""

    @property
    def rows(self) -> int:
        """The dimension n."""

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time.

        Before the start and after the end it is that at the start and at the end.
        """

    def derivative(self, order: int = 1) -> Trajectory:
        """Return its derivative of an order from 0 on."""

    def reverse_time(self) -> Trajectory:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""

    def scale_time(self, factor: float) -> Trajectory:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""

    def shift_right(self, offset: float) -> Trajectory:
        """Return the curve later by ``offset``."""

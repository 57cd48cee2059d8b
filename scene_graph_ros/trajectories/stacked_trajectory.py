"""Curves over the same times, one below the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.trajectories.arguments import as_times, is_same_time
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.trajectory import Trajectory

__all__ = ["StackedTrajectory"]


@one_line()
@dataclass(frozen=True, eq=False)
class StackedTrajectory:
    """``parts`` over the same times: the rows of one, then those of the next.

    Raises TrajectoryError where there is none, and for other times.
    """

    parts: tuple[Trajectory, ...]

    def __post_init__(self) -> None:
        """Check that all have the same times."""
        given: Any = self.parts
        if isinstance(given, str) or not isinstance(given, Sequence) or not given:
            raise TrajectoryError(f"parts must be one curve or more, not {quoted(self.parts)}")
        for k, part in enumerate(self.parts):
            if not isinstance(part, Trajectory):
                raise TrajectoryError(f"parts[{k}] must be a curve, not {quoted(part)}")
            for name in ("start_time", "end_time"):
                own, first = getattr(part, name), getattr(self.parts[0], name)
                if not is_same_time(own, first):
                    raise TrajectoryError(
                        f"parts[{k}] has the {name} {own}, the first one {first}"
                    )
        object.__setattr__(self, "parts", tuple(self.parts))

    @property
    def start_time(self) -> float:
        """When all begin, s."""
        return self.parts[0].start_time

    @property
    def end_time(self) -> float:
        """When all end, s."""
        return self.parts[0].end_time

    @property
    def duration(self) -> float:
        """How long they take, s."""
        return self.end_time - self.start_time

    @property
    def rows(self) -> int:
        """The dimension n: that of all together."""
        return sum(part.rows for part in self.parts)

    def value(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the values ``(m, n)`` at times ``(m,)``, or ``(n,)`` at one time."""
        times = as_times(t)
        return np.concatenate([part.value(times) for part in self.parts], axis=-1)

    def derivative(self, order: int = 1) -> StackedTrajectory:
        """Return its derivative of an order from 0 on."""
        return self._each(lambda part: part.derivative(order))

    def reverse_time(self) -> StackedTrajectory:
        """Return the reversed curve r with ``r(start_time + end_time - t) = q(t)``."""
        return self._each(lambda part: part.reverse_time())

    def scale_time(self, factor: float) -> StackedTrajectory:
        """Return the slower curve r with ``r(factor * t) = q(t)``; the factor is positive."""
        return self._each(lambda part: part.scale_time(factor))

    def shift_right(self, offset: float) -> StackedTrajectory:
        """Return the curve later by ``offset``."""
        return self._each(lambda part: part.shift_right(offset))

    def _each(self, change: Callable[[Trajectory], Trajectory]) -> StackedTrajectory:
        return StackedTrajectory(tuple(change(part) for part in self.parts))

"""Velocities and numbers that are given to a filter of velocities, checked."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.velocities.errors import SafeVelocityError
from scene_graph_ros.planning.velocities.velocity_box import JointLimits

__all__ = ["VelocityArguments", "number_from"]

_HUGE = 1e3
"""Times its limit: a velocity beyond it is made shorter first, as its direction tells all."""


class VelocityArguments:
    """Checks velocities of a robot's positions."""

    def __init__(self, names: tuple[str, ...], limits: JointLimits) -> None:
        """Take the positions' names and limits."""
        self._names, self._limits = names, limits
        self._locked = ~limits.moves
        self._has_locked = bool(self._locked.any())
        moves = limits.moves
        self._inverse = np.where(moves, 1.0 / np.where(moves, limits.velocities, 1.0), 0.0)

    def velocity(self, name: str, value: ArrayLike) -> NDArray[np.float64]:
        """Return a velocity ``(nv,)``, shorter where one that is asked for is huge.

        Raises SafeVelocityError naming the argument and the position.
        """
        array = real_array(value, f"{name} must be numbers", SafeVelocityError)
        count = len(self._names)
        if array.shape != (count,):
            raise SafeVelocityError(f"{name} must have shape ({count},), not {array.shape}")
        if not np.isfinite(array).all():
            row = int(np.argmin(np.isfinite(array)))
            raise SafeVelocityError(
                f"{name} of position {self._names[row]!r} must be finite, not {array[row]}"
            )
        if self._has_locked and array[self._locked].any():
            row = int(np.flatnonzero(self._locked & (array != 0.0))[0])
            raise SafeVelocityError(
                f"{name} moves position {self._names[row]!r}, which has no limits or is not the"
                f" checker's: {array[row]:g}"
            )
        if name == "v":
            ratio = float(np.abs(array * self._inverse).max(initial=0.0))
            if ratio > _HUGE:
                array *= _HUGE / ratio
        return array


def number_from(name: str, value: object) -> float:
    """Return a number from 0 on. Raises SafeVelocityError naming it."""
    number = as_float(value)
    if number is None or not 0.0 <= number < math.inf:
        raise SafeVelocityError(f"{name} must be a finite number from 0 on, not {quoted(value)}")
    return number

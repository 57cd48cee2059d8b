"""The box of velocities that limits leave for a step, and how far a robot goes with them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel

__all__ = ["BOX_ROWS", "BoxLimits", "set_box", "set_motion"]

_ROUNDING = 1e-9
"""Of a tick: the rounding that may be added to the time in which a robot brakes."""


class BoxLimits(NamedTuple):
    """Limits of positions ``(nq,)``; a velocity's limit of 0 keeps a position where it is."""

    lower: np.ndarray
    upper: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray


_AT_LIMIT = 1e-12
"""rad or m: the way beyond a limit that is rounding."""

BOX_ROWS = 11


@inlined_kernel
def _steps(slowest, dt):
    """Return in how many ticks a robot rests, where a position takes so long (s) to do so."""
    return max(1.0, math.ceil(slowest / dt - _ROUNDING))


@inlined_kernel
def _within(limits, q, present, dt, count, i, low, high):
    """Return the part of an interval from which a robot that brakes in so many ticks may go on."""
    longest = dt * (1.0 + 0.5 * count)
    most = limits.accelerations[i] * (dt * count)
    # At once it goes v longest; evenly it goes (present - v) dt / 2 farther.
    above, below = max(limits.upper[i] - q[i], 0.0), min(limits.lower[i] - q[i], 0.0)
    drift, shorter = 0.5 * dt * present[i], longest - 0.5 * dt
    high = min(high, min(above / longest, (above - drift) / shorter))
    low = max(low, max(below / longest, (below - drift) / shorter))
    return max(low, -most), min(high, most)


@lean_kernel
def set_box(limits, q, present, dt, box, numbers):
    """Write a box of velocities, and the motion that they make.

    Rows of ``box`` ``(11, nq)``: the least and largest velocities, those of braking, how far a
    change during the step leads beside a motion, the largest ways; q and the end of a motion in
    the middle of the box; how far any other leads in all, and beside it, and the positions between
    which that is. ``numbers`` ``(3,)``: the way of a motion divided by its velocity (s), its time
    (s), and that of braking now (s). See ``velocity_box``.
    """
    n = len(q)
    slowest = 0.0
    for i in range(n):
        slowest = max(slowest, abs(present[i]) / limits.accelerations[i])
    ticks = _steps(slowest, dt)
    slowest = 0.0
    for i in range(n):
        braking = present[i] * ((ticks - 1.0) / ticks)
        change, most = limits.accelerations[i] * dt, limits.velocities[i]
        low = min(max(present[i] - change, -most), braking)
        high = max(min(present[i] + change, most), braking)
        box[0, i], box[1, i], box[2, i] = low, high, braking
        slowest = max(slowest, max(abs(low), abs(high)) / limits.accelerations[i])
    count, is_empty = _steps(slowest, dt), False
    for i in range(n):
        low, high = _within(limits, q, present, dt, count, i, box[0, i], box[1, i])
        is_empty = is_empty or low > high
    if is_empty:
        count = max(1.0, ticks - 1.0)
    longest = dt + 0.5 * dt * count
    for i in range(n):
        low, high = _within(limits, q, present, dt, count, i, box[0, i], box[1, i])
        if is_empty:
            low, high = min(low, box[2, i]), max(high, box[2, i])
        if limits.velocities[i] == 0.0:
            low = high = 0.0
        box[0, i], box[1, i] = low, high
        middle = 0.5 * (low + high)
        away = abs(present[i] - middle)
        half = max(max(0.5 * (high - low), away), abs(box[2, i] - middle))
        way, beside = middle * longest, half * longest + 0.5 * dt * away + half * dt
        box[3, i] = 0.5 * dt * min(limits.accelerations[i] * dt, abs(present[i]))
        box[4, i] = max(abs(low), abs(high)) * longest
        box[5, i], box[6, i] = q[i], q[i] + way
        changes = abs(way) + beside
        box[7, i], box[8, i], box[9, i] = changes, beside, q[i] - changes
        box[10, i] = q[i] + changes
    numbers[0], numbers[1], numbers[2] = longest, dt + dt * count, dt * ticks


@lean_kernel
def set_motion(limits, q, velocity, present, dt, motion, numbers):
    """Write the way of a step and the braking after it, and how far it may lead beside that.

    Of a velocity that changes evenly, the part along the new one leads along the same line, no
    farther than at once; the rest leads away from it by half of a step at most. Both are rows of
    ``motion`` ``(2, nq)``. ``numbers`` ``(3,)``: the time of braking (s), and 1 where the motion
    may leave the limits of positions, 1 where anything is beside it.
    """
    n = len(q)
    slowest, along, square = 0.0, 0.0, 0.0
    for i in range(n):
        slowest = max(slowest, abs(velocity[i]) / limits.accelerations[i])
        along += present[i] * velocity[i]
        square += velocity[i] * velocity[i]
    part = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    brake = dt * _steps(slowest, dt)
    leaves = beside = 0.0
    for i in range(n):
        way, drift = velocity[i] * (dt + 0.5 * brake), 0.5 * dt * (present[i] - part * velocity[i])
        end = q[i] + way
        # Beyond a limit already, it may lead no farther.
        if (
            max(end, end + drift) > max(limits.upper[i], q[i]) + _AT_LIMIT
            or min(end, end + drift) < min(limits.lower[i], q[i]) - _AT_LIMIT
        ):
            leaves = 1.0
        if drift != 0.0:
            beside = 1.0
        motion[0, i], motion[1, i] = way, abs(drift)
    numbers[0], numbers[1], numbers[2] = brake, leaves, beside

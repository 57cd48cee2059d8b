"""The velocities that limits of position, velocity and acceleration leave for the next step."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.velocities.errors import SafeVelocityError
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.trajectories.motion_limits import MotionLimits

__all__ = [
    "JointLimits",
    "VelocityBox",
    "joint_limits",
    "leaves_limits",
    "steps_to_rest",
    "velocity_box",
]

_ROUNDING = 1e-9
"""Of a tick: the rounding that may be added to the time in which a robot brakes."""


_AT_LIMIT = 1e-12
"""rad or m: the way beyond a limit that is rounding."""


class JointLimits(NamedTuple):
    """Limits of all positions ``(nq,)``; those that may not move have no velocity."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    velocities: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    """1 where a position may not move."""
    moves: NDArray[np.bool_]


class VelocityBox(NamedTuple):
    """The velocities from ``low`` to ``high`` ``(nq,)``, and the time and way of a motion."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    longest: float
    """s: the way of any motion with such a velocity, step and brake, divided by the velocity."""
    time: float
    """s: the time that it takes at most."""
    braking: NDArray[np.float64]
    """The velocity of a robot that brakes along its line."""
    brake_time: float
    """s: the time in which it does, a whole number of ticks."""


def joint_limits(tree: KinematicTree, limits: MotionLimits) -> JointLimits:
    """Return limits by position. Raises SafeVelocityError where these have no names."""
    if not limits.names:
        raise SafeVelocityError("limits must have the names of the positions that move")
    rows = np.array([tree.position_index(name) for name in limits.names], dtype=np.intp)
    velocities, accelerations = np.zeros(tree.num_positions), np.ones(tree.num_positions)
    velocities[rows], accelerations[rows] = limits.velocities, limits.accelerations
    moves = np.zeros(tree.num_positions, dtype=np.bool_)
    moves[rows] = True
    return JointLimits(tree.lower, tree.upper, velocities, accelerations, moves)


def steps_to_rest(speeds: NDArray[np.float64], limits: JointLimits, dt: float) -> int:
    """Return in how many ticks of dt (s) speeds ``(nq,)`` can come to rest, at least one."""
    return max(1, math.ceil(float((speeds / limits.accelerations).max(initial=0.0)) / dt
                            - _ROUNDING))  # fmt: skip


def velocity_box(
    limits: JointLimits, q: NDArray[np.float64], present: NDArray[np.float64], dt: float
) -> VelocityBox:
    """Return the velocities that a robot at q may have after dt (s), where it has ``present``.

    A velocity is within its limits, changes by no more than the acceleration's limit allows, and
    lets the robot brake along its line before a position's limit, at all times: whether the
    velocity changes at once or evenly. Where that leaves nothing, the box is that of velocities
    from which it comes to rest as soon as by braking now, and braking is in it.
    """
    ticks = steps_to_rest(np.abs(present), limits, dt)
    braking = present * ((ticks - 1) / ticks)
    change = limits.accelerations * dt
    low = np.maximum(present - change, -limits.velocities)
    high = np.minimum(present + change, limits.velocities)
    low, high = np.minimum(low, braking), np.maximum(high, braking)
    count = steps_to_rest(np.maximum(np.abs(low), np.abs(high)), limits, dt)
    inner_low, inner_high = _within_positions(limits, q, present, dt, count, low, high)
    if (inner_low > inner_high).any():
        count = max(1, ticks - 1)
        inner_low, inner_high = _within_positions(limits, q, present, dt, count, low, high)
        inner_low, inner_high = np.minimum(inner_low, braking), np.maximum(inner_high, braking)
    inner_low[~limits.moves] = inner_high[~limits.moves] = 0.0
    brake = dt * count
    return VelocityBox(inner_low, inner_high, dt + 0.5 * brake, dt + brake, braking, dt * ticks)


def _within_positions(
    limits: JointLimits,
    q: NDArray[np.float64],
    present: NDArray[np.float64],
    dt: float,
    count: int,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the part of a box from which a robot that brakes in so many ticks stays in limits."""
    longest = dt * (1.0 + 0.5 * count)
    most = limits.accelerations * (dt * count)
    # At once it goes v longest; evenly it goes (present - v) dt / 2 farther.
    above, below = np.maximum(limits.upper - q, 0.0), np.minimum(limits.lower - q, 0.0)
    drift, shorter = 0.5 * dt * present, longest - 0.5 * dt
    high = np.minimum(high, np.minimum(above / longest, (above - drift) / shorter))
    low = np.maximum(low, np.maximum(below / longest, (below - drift) / shorter))
    return np.maximum(low, -most), np.minimum(high, most)


def leaves_limits(
    limits: JointLimits,
    q: NDArray[np.float64],
    way: NDArray[np.float64],
    drift: NDArray[np.float64],
) -> bool:
    """Tell whether a way from q, and a drift beside it, may lead beyond a limit of a position.

    All ``(nq,)``. Beyond one already, it may lead no farther.
    """
    end = q + way
    above, below = np.maximum(end, end + drift), np.minimum(end, end + drift)
    return bool(
        (above > np.maximum(limits.upper, q) + _AT_LIMIT).any()
        or (below < np.minimum(limits.lower, q) - _AT_LIMIT).any()
    )

"""The velocities that limits of position, velocity and acceleration leave for the next step."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.velocities.box_kernels import (
    BOX_ROWS,
    BoxLimits,
    set_box,
    set_motion,
)
from scene_graph_ros.planning.velocities.errors import SafeVelocityError
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.trajectories.motion_limits import MotionLimits

__all__ = [
    "JointLimits",
    "Motion",
    "VelocityBox",
    "joint_limits",
    "motion_of",
    "steps_to_rest",
    "velocity_box",
]

_ROUNDING = 1e-9
"""Of a tick: the rounding that may be added to the time in which a robot brakes."""


class JointLimits(NamedTuple):
    """Limits of all positions ``(nq,)``; those that may not move have no velocity."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    velocities: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    """1 where a position may not move."""
    moves: NDArray[np.bool_]

    @property
    def table(self) -> BoxLimits:
        """As kernels read them."""
        return BoxLimits(self.lower, self.upper, self.velocities, self.accelerations)


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
    drift: NDArray[np.float64]
    """How far a velocity that changes evenly leads beside one that changes at once."""
    most: NDArray[np.float64]
    """How far any of the motions leads."""
    edge: NDArray[np.float64]
    """``(2, nq)``: the motion in the middle."""
    changes: NDArray[np.float64]
    """``(4, nq)``: how far any of them leads in all, and beside the one in the middle, and the
    least and largest positions."""


class Motion(NamedTuple):
    """A step and the braking after it, ``(nq,)``."""

    way: NDArray[np.float64]
    beside: NDArray[np.float64]
    """How far it may be beside the way at its end, where the velocity changes evenly."""
    brake: float
    """s: how long it brakes."""
    leaves_limits: bool
    """Whether it may lead beyond a limit of a position."""
    is_beside: bool


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
    box, numbers = np.empty((BOX_ROWS, len(q))), np.empty(3)
    set_box(limits.table, q, present, dt, box, numbers)
    longest, time, brake_time = numbers.tolist()
    return VelocityBox(
        box[0], box[1], longest, time, box[2], brake_time, box[3], box[4], box[5:7], box[7:]
    )


def motion_of(
    limits: JointLimits,
    q: NDArray[np.float64],
    velocity: NDArray[np.float64],
    present: NDArray[np.float64],
    dt: float,
) -> Motion:
    """Return the motion of a step of dt (s) with a velocity, and the braking after it."""
    rows, numbers = np.empty((2, len(q))), np.empty(3)
    set_motion(limits.table, q, velocity, present, dt, rows, numbers)
    brake, leaves, beside = numbers.tolist()
    return Motion(rows[0], rows[1], brake, leaves > 0.0, beside > 0.0)

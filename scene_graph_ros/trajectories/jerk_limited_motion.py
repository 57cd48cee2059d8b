"""The fastest motion along a path under limits of velocity, acceleration and jerk.

A path q(s) is followed as q(s(u(t))). First u is the time of a guess, in which speed changes
slowly; `fastest_rates` finds how fast u may pass. Then u is the time of that motion, once more.
The bounds are not on q, but on the quintics through its values at nodes evenly apart in u: these
are what is run, and where q bends too suddenly for a limit of jerk, they bend less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.derivatives_of import derivatives_of
from scene_graph_ros.trajectories.errors import RetimingError
from scene_graph_ros.trajectories.guessed_motion import guessed_motion, PathStates
from scene_graph_ros.trajectories.jerk_limited_kernels import fastest_rates, Rows
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.quintic_kernels import set_rows, set_times_and_jerks
from scene_graph_ros.trajectories.sampling import shortest_step
from scene_graph_ros.trajectories.straight_motion import straight_states

__all__ = ["fastest_states"]

Array = NDArray[np.float64]

_ROUNDS, _GAIN = 3, 0.99
"""How often u becomes the time of the motion that was found, and as what part of the duration
before the next one makes another round worth it."""

_TIGHTENINGS = 2
"""How often limits of jerk are tightened where the quintics exceed them."""

_STRICTER = 6
"""The same for motions that can't just be slowed down, as their ends move."""

_SLOWER = 1.004
"""Slowing all of a motion by less costs less than looking for another one."""

_HOPELESS = 1.05
"""Motions that are faster than the limits by more than this factor are none."""

_FINER = (1.0, 2.0, 4.0)
"""Nodes, in units of the usual number, until there is a motion: a path of long and very short
segments needs more than others."""

_FIRST, _ROUGH, _LAST = 1.0, 1e-2, 2e-3
"""Weights of the barrier: the first, and the last ones of the first round and of later ones."""

_AGAIN = 0.05
"""The first weight where a motion is known that is nearly the best."""


class _Ends(NamedTuple):
    """Which ends of a motion have rates that must not change."""

    moves: tuple[bool, bool]
    """Whether it has a speed there."""
    is_pinned: tuple[bool, bool]
    """Whether it has a speed or an acceleration there."""


def fastest_states(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    start: tuple[float, float] = (0.0, 0.0),
    end: tuple[float, float] = (0.0, 0.0),
    fineness: float = 1.0,
) -> tuple[PathStates, float]:
    """Return states of the fastest motion along a smooth path, and its factor.

    ``start`` and ``end`` are ds/dt and its derivative there. The factor is by how much the motion
    is too fast between two states, at least 1. Limits must have jerks. Raises RetimingError where
    there is none within the limits, which moving ends can ask for.
    """
    shortest = shortest_step(path, limits)
    if not (any(start) or any(end)):
        straight = straight_states(path, limits, shortest)
        if straight is not None:
            return straight, 1.0
    ends = _Ends((start[0] > 0.0, end[0] > 0.0), (any(start), any(end)))
    for finer in _FINER:
        states = guessed_motion(path, limits, start, end, finer * fineness, shortest)
        found = _fastest_near(states, path, limits, ends)
        if found is not None:
            return found
    raise RetimingError(
        "no motion begins and ends with these velocities and accelerations within the limits"
        " along the path"
    )


def _fastest_near(
    states: PathStates, path: PiecewisePolynomial, limits: MotionLimits, ends: _Ends
) -> tuple[PathStates, float] | None:
    """Return states of the fastest motion and its factor, from a guess; None if none is found."""
    for turn in range(_ROUNDS):
        before = float(states.times[-1])
        if turn:
            states = states.evened()
        nodes = _Nodes(path, states, limits, ends)
        nodes.find(_FIRST if turn == 0 else 2.0 * _AGAIN, _ROUGH if turn == 0 else _LAST)
        if nodes.too_fast > _HOPELESS:
            return None
        states = nodes.states()
        if turn and float(states.times[-1]) > _GAIN * before:
            break
    moves = any(ends.is_pinned)
    for _ in range(_STRICTER if moves else _TIGHTENINGS):
        if nodes.factor() <= (1.0 if moves else _SLOWER) or not nodes.tighten():
            break
        states = nodes.states()
    return states, nodes.factor()


class _Nodes:
    """Nodes evenly apart in u, a rate at each, and its bounds."""

    def __init__(
        self, path: PiecewisePolynomial, states: PathStates, limits: MotionLimits, ends: _Ends
    ) -> None:
        self.s, self.limits, self.ends = states.s, limits, ends
        self.step = float(states.times[-1]) / (len(states.s) - 1)
        # By u, which is 1 from node to node.
        self.speed, self.bend = self.step * states.speed, self.step**2 * states.acceleration
        self.values, first, second, _ = derivatives_of(path, states.s)
        speed, bend = self.speed[:, np.newaxis], self.bend[:, np.newaxis]
        self.first, self.second = first * speed, second * speed**2 + first * bend
        self.rows = self._rows()
        self.rates = np.ones(len(states.s) + 2)
        self.times, self.jerks = np.empty(len(states.s)), np.empty(len(states.s) - 1)
        self.excess = np.ones(len(states.s) - 1)

    def _rows(self) -> Rows:
        v, a, jerk = self.limits.velocities, self.limits.accelerations, self.limits.jerks
        assert jerk is not None
        limits = np.stack([v * self.step, a * self.step**2, jerk * self.step**3])
        points, joints = 2 * len(self.s) - 1, len(v)
        rows = Rows(np.empty(points), *np.empty((5, joints, points)))
        pinned = np.array(self.ends.is_pinned)
        set_rows(self.values, self.first, self.second, limits, pinned, rows)
        return rows

    def find(self, first: float, last: float) -> None:
        """Find rates."""
        # At rest s grows as the cube of time, and the rate is even.
        slopes = np.array([True, True])
        for end in range(2):
            if self.ends.is_pinned[end] and not self.ends.moves[end]:
                slopes[end] = False
        self.too_fast = fastest_rates(
            self.rows, self.rates, np.array(self.ends.is_pinned), slopes, first, last
        )
        self.times, self.jerks = np.empty(len(self.s)), np.empty(len(self.s) - 1)
        limits = np.array(self.limits.jerks)
        path = self.values, self.first, self.second
        if not set_times_and_jerks(self.rates, *path, self.step, limits, self.times, self.jerks):
            self.too_fast, self.jerks[:] = np.inf, np.inf

    def tighten(self) -> bool:
        """Find rates with less jerk where the quintics have too much; tell whether that helped."""
        before = self.rates.copy(), self.excess, self.times, self.jerks, self.too_fast
        cost = self.factor() * float(self.times[-1])
        self.excess = self.excess * np.maximum(self.jerks, 1.0)
        at_points = np.ones(2 * len(self.s) - 1)
        at_points[1::2] = self.excess
        at_points[0:-1:2] = self.excess
        at_points[2::2] = np.maximum(at_points[2::2], self.excess)
        rows, j2, j1, j0 = self.rows, *self.rows[3:]
        self.rows = rows._replace(j2=j2 * at_points, j1=j1 * at_points, j0=j0 * at_points)
        self.find(_FIRST if any(self.ends.is_pinned) else _AGAIN, _LAST)
        self.rows = rows
        if self.factor() * float(self.times[-1]) < cost:
            return True
        self.rates, self.excess, self.times, self.jerks, self.too_fast = before
        return False

    def states(self) -> PathStates:
        """Return the motion's states at the nodes."""
        c = self.rates
        b, slope = (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0, 0.5 * (c[2:] - c[:-2])
        speed = self.speed * np.sqrt(b) / self.step
        acceleration = (0.5 * self.speed * slope + self.bend * b) / self.step**2
        return PathStates(self.times, self.s, speed, acceleration)

    def factor(self) -> float:
        """Return by how much it is too fast, at least 1."""
        return max(float(self.jerks.max()) ** (1.0 / 3.0), self.too_fast, 1.0)

"""Proofs that a robot keeps a distance from obstacles that move, while it moves and then brakes.

Time runs from now to the moment in which the robot is at rest for sure. On each interval the
distance in its middle is more than the pair's points can come nearer from there to its ends:
conservative advancement (see ``edge_kernels``), here with two motions. The robot's is a straight
edge that is passed at one speed and then with an even deceleration; the obstacle's is a constant
twist, or a motion in any direction up to a speed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.geometry.spatial.vectors import scale
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.planning.edges.curve_kernels import point_on
from scene_graph_ros.planning.edges.motion_kernels import (
    place_twists,
    set_body_motions,
    set_pair_motions,
    speed_bounds,
)
from scene_graph_ros.planning.pairs.bodies import distance_at, place_bodies
from scene_graph_ros.planning.pairs.check_kernels import bounds_of, LOOSE, NO_PAIR
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["MOST_WAITING", "MovingBodies", "Profile", "closing_rates", "prove_moving"]

MOST_WAITING = 512
"""Intervals that wait; a motion that needs more is not proven."""

_MOST_LOOKS = 1024
"""Intervals that are looked at, of one motion."""

_SHORTEST = 1e-7
"""Of the motion's time: shorter intervals are not halved."""

_FINE = 1e-4
"""Of a distance: with a larger error its direction is too uncertain."""


class MovingBodies(NamedTuple):
    """The obstacles' bodies that move, where they are now and how they go on."""

    bodies: np.ndarray
    """``(m,)``: rows of the plan's bodies."""
    X_WG: np.ndarray
    """``(m, 3, 4)``."""
    origins: np.ndarray
    """``(m, 3)``: the origin of the frame whose twist it is, in W."""
    twists: np.ndarray
    """``(m, 6)``: angular and linear velocity of that frame in W, rad/s and m/s; zero where only
    a bound is known."""
    fastest: np.ndarray
    """``(m,)`` m/s: how fast any point is by its twist."""
    bounds: np.ndarray
    """``(m,)`` m/s: how fast any point is in a direction that is not known."""
    which: np.ndarray
    """``(p,)``: the row above of each pair that is looked at."""


class Profile(NamedTuple):
    """When the robot is where on its edge."""

    hold: float
    """s: how long it goes at one speed."""
    brake: float
    """s: how long it brakes after that, evenly."""
    end: float
    """s: until when the distance is to be kept."""
    lag: float
    """Of the edge: how far it may be behind this, because it is told at ticks."""


@inlined_kernel
def _part_of(profile, t):
    """Return the part of the edge behind the robot at a time, and its speed there, in 1/s."""
    hold, brake = profile[0], profile[1]
    whole = hold + 0.5 * brake
    if t <= hold:
        return t / whole, 1.0 / whole
    late = min(t - hold, brake)
    return (hold + late - 0.5 * late * late / brake) / whole, (1.0 - late / brake) / whole


@inlined_kernel
def _turned(turn, x, y, z):
    """Return a vector turned by a rotation vector (Rodrigues)."""
    wx, wy, wz = turn
    angle = math.sqrt(wx * wx + wy * wy + wz * wz)
    if angle == 0.0:
        return x, y, z
    ux, uy, uz = wx / angle, wy / angle, wz / angle
    sine, cosine = sine_cosine(angle)
    along = (ux * x + uy * y + uz * z) * (1.0 - cosine)
    return (
        x * cosine + (uy * z - uz * y) * sine + ux * along,
        y * cosine + (uz * x - ux * z) * sine + uy * along,
        z * cosine + (ux * y - uy * x) * sine + uz * along,
    )


@inlined_kernel
def _place_moving(bodies, moving, i, t, places, k):
    """Write where a body that moves is at a time, in lane k."""
    b, X, twist, origin = moving.bodies[i], moving.X_WG[i], moving.twists[i], moving.origins[i]
    turn = t * twist[0], t * twist[1], t * twist[2]
    out, center = places.X_WG[b], bodies.centers[b]
    for column in range(3):
        x, y, z = _turned(turn, X[0, column], X[1, column], X[2, column])
        out[column, k], out[4 + column, k], out[8 + column, k] = x, y, z
    x, y, z = X[0, 3] - origin[0], X[1, 3] - origin[1], X[2, 3] - origin[2]
    x, y, z = _turned(turn, x, y, z)
    out[3, k] = x + origin[0] + t * twist[3]
    out[7, k] = y + origin[1] + t * twist[4]
    out[11, k] = z + origin[2] + t * twist[5]
    for row in range(3):
        at = 4 * row
        total = out[at + 3, k]
        for column in range(3):
            total += out[at + column, k] * center[column]
        places.centers[b, row, k] = total


@inlined_kernel
def _obstacle_along(bodies, moving, i, t, places, k, n):
    """Return the speed of a moving body's centre along n, its spread, and the acceleration.

    The spread is that of the speeds of its points; the acceleration is the largest of any point.
    """
    b, twist, origin = moving.bodies[i], moving.twists[i], moving.origins[i]
    wx, wy, wz = twist[0], twist[1], twist[2]
    x = places.centers[b, 0, k] - origin[0] - t * twist[3]
    y = places.centers[b, 1, k] - origin[1] - t * twist[4]
    z = places.centers[b, 2, k] - origin[2] - t * twist[5]
    vx, vy, vz = twist[3] + wy * z - wz * y, twist[4] + wz * x - wx * z, twist[5] + wx * y - wy * x
    speed = n[0] * vx + n[1] * vy + n[2] * vz
    square = wx * wx + wy * wy + wz * wz
    if square == 0.0:
        return speed, 0.0, 0.0
    mx, my, mz = n[1] * wz - n[2] * wy, n[2] * wx - n[0] * wz, n[0] * wy - n[1] * wx
    spread = bodies.radii[b] * math.sqrt(mx * mx + my * my + mz * mz)
    reach = math.sqrt(x * x + y * y + z * z) + bodies.radii[b]
    return speed, spread, square * reach


@inlined_kernel
def _direction_slack(checked, p, phi, error):
    """Return the error of a normal as the direction of the distance, infinite where unknown.

    See ``pair_on_stretch``; bodies that are not convex have no such direction.
    """
    table, rows = borrowed_table(checked.held), checked.bodies.rows
    a, b = checked.pairs.bodies[p, 0], checked.pairs.bodies[p, 1]
    if not 0.0 < phi < math.inf or table.exact[rows[a]] or table.exact[rows[b]]:
        return math.inf
    return math.sqrt(8.0 * error / phi)


@merged_kernel
def _keeps(checked, moving, p, k, times, profile, tolerance, scratch):
    """Return 1 where a pair keeps its padding on an interval, 0 where that is open, -1 if not."""
    motions, _, places = scratch
    bodies, pairs = checked.bodies, checked.pairs
    low, middle, high = times
    i, a, b = moving.which[p], pairs.bodies[p, 0], pairs.bodies[p, 1]
    x, rate = _part_of(profile, middle)
    before, behind = x - _part_of(profile, low)[0], _part_of(profile, high)[0] - x
    way, bend = motions.ways[p], motions.bends[p]
    half = max(middle - low, high - middle)
    fixed = moving.bounds[i] * high + motions.margins[p] + tolerance
    need = pairs.paddings[p] + fixed
    lag = profile[3]
    moved = max(before + lag, behind) * way + (half * moving.fastest[i] if half > 0.0 else 0.0)
    dx = places.centers[a, 0, k] - places.centers[b, 0, k]
    dy = places.centers[a, 1, k] - places.centers[b, 1, k]
    dz = places.centers[a, 2, k] - places.centers[b, 2, k]
    balls = math.sqrt(dx * dx + dy * dy + dz * dz) - bodies.radii[a] - bodies.radii[b]
    if balls >= need + moved:
        return 1
    reach = max(need + moved, 0.0)
    phi, _, _, n, gap = distance_at(checked.held, bodies, pairs, p, k, places, reach, LOOSE)
    least, most = bounds_of(phi, gap, reach)
    if least >= need + moved:
        return 1
    if gap > _FINE * phi:
        phi, _, _, n, gap = distance_at(checked.held, bodies, pairs, p, k, places, reach, 0.0)
        least, most = bounds_of(phi, gap, reach)
        if least >= need + moved:
            return 1
    if most < need:
        return -1
    slack = _direction_slack(checked, p, phi, gap + motions.margins[p])
    if slack >= 1.0:
        return 0
    n = scale(-1.0 if pairs.swaps[p] else 1.0, n)
    forwards, backwards = speed_bounds(bodies, pairs, p, k, motions, places, n, slack)
    speed, spread, turning = _obstacle_along(bodies, moving, i, middle, places, k, n)
    spread += slack * moving.fastest[i]
    # The robot's place is concave in time: chords and tangents bound it on either side.
    first = rate * (high - middle) if forwards >= 0.0 else behind
    last = before if backwards >= 0.0 else rate * (middle - low)
    after = max(0.0, forwards * first + (spread + speed) * (high - middle))
    ahead = max(0.0, backwards * last + (spread - speed) * (middle - low))
    late, most = lag * max(0.0, backwards), max(before, behind) + lag
    after += late + 0.5 * (bend * most * most + turning * (high - middle) ** 2)
    ahead += late + 0.5 * (bend * most * most + turning * (middle - low) ** 2)
    return 1 if least - max(after, ahead) >= need else 0


@inlined_kernel
def _put(waiting, counts, low, high):
    """Put an interval on the stack; tell whether there was room."""
    if counts[0] >= MOST_WAITING:
        return False
    waiting[counts[0], 0], waiting[counts[0], 1] = low, high
    counts[0] += 1
    return True


@lean_kernel
def prove_moving(checked, moving, edge, profile, tolerance, scratch, waiting):
    """Return NO_PAIR where all pairs keep their paddings, else one that does not, or is open.

    ``checked`` has the pairs with obstacles that move alone. ``edge`` ``(2, nq)`` is passed as the
    profile says. ``waiting`` ``(MOST_WAITING + 1, 2)`` is scratch.
    """
    motions, stretches, places = scratch
    tree, bodies, pairs = checked.tree, checked.bodies, checked.pairs
    counts = stretches.counts
    set_body_motions(tree, bodies, checked.reaches, edge, motions)
    set_pair_motions(tree, bodies, pairs, checked.reaches, edge, motions)
    counts[0] = 0
    end = profile[2]
    for i in range(LANES):
        _put(waiting, counts, end * i / LANES, end * (i + 1) / LANES)
    looks = last_open = 0
    while counts[0] > 0:
        count = min(LANES, counts[0])
        looks += count
        if looks > _MOST_LOOKS:
            return last_open
        counts[0] -= count
        first = counts[0]
        for k in range(LANES):
            row = first + min(k, count - 1)
            stretches.low[k], stretches.high[k] = waiting[row, 0], waiting[row, 1]
            stretches.middle[k] = 0.5 * (waiting[row, 0] + waiting[row, 1])
            point_on(tree, edge, _part_of(profile, stretches.middle[k])[0], motions.q[k])
        place_bodies(tree, bodies, motions.q, 0, checked.X_WB, places)
        place_twists(tree, motions, places)
        for i in range(len(moving.bodies)):
            for k in range(LANES):
                _place_moving(bodies, moving, i, stretches.middle[k], places, k)
        for k in range(count):
            low, middle, high = stretches.low[k], stretches.middle[k], stretches.high[k]
            for p in range(len(pairs.bodies)):
                times = low, middle, high
                found = _keeps(checked, moving, p, k, times, profile, tolerance, scratch)
                if found == 1:
                    continue
                if found == -1 or high - low <= _SHORTEST * end:
                    return p
                if not (
                    _put(waiting, counts, low, middle) and _put(waiting, counts, middle, high)
                ):
                    return p
                break
    return NO_PAIR


@lean_kernel
def closing_rates(checked, moving, q, scratch, rates):
    """Write how fast obstacles that move change each pair's distance now, m/s: ``(p,)``.

    The robot stands at ``q`` ``(nq,)``; of a bound it is the worst that can be.
    """
    motions, _, places = scratch
    bodies, pairs = checked.bodies, checked.pairs
    for k in range(LANES):
        for i in range(len(q)):
            motions.q[k, i] = q[i]
    place_bodies(checked.tree, bodies, motions.q, 0, checked.X_WB, places)
    for i in range(len(moving.bodies)):
        _place_moving(bodies, moving, i, 0.0, places, 0)
    for p in range(len(pairs.bodies)):
        i = moving.which[p]
        twist, origin = moving.twists[i], moving.origins[i]
        _, p_WCa, p_WCb, n, _ = distance_at(
            checked.held, bodies, pairs, p, 0, places, math.inf, 0.0
        )
        # The point of the obstacle, and the normal out of it: both are in the scene's order.
        at = p_WCa if pairs.swaps[p] else p_WCb
        n = scale(-1.0 if pairs.swaps[p] else 1.0, n)
        x, y, z = at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]
        vx = twist[3] + twist[1] * z - twist[2] * y
        vy = twist[4] + twist[2] * x - twist[0] * z
        vz = twist[5] + twist[0] * y - twist[1] * x
        rates[p] = -(n[0] * vx + n[1] * vy + n[2] * vz) - moving.bounds[i]

"""How fast bodies move along an edge: bounds for the whole of it, and speeds at one place.

For all of an edge no point of a body can move farther than each joint's turn, times the largest
distance from its axis, and each joint's slide add up to. Where a distance is known, its direction
is, too: then the speed along that direction says how fast it shrinks at first, and a bound of the
acceleration how much faster later on. That is less where bodies pass by each other, or move apart
(compare Zhang and others, *Interactive Continuous Collision Detection for Non-Convex Polyhedra*,
2006, section 4, for motion bounds along a direction).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.planning.edges.curve_kernels import half_turn
from scene_graph_ros.robots.tree_kernels import (
    FLOATING,
    LANES,
    PLANAR,
    PRISMATIC,
    REVOLUTE,
    SMALL_ANGLE,
)

__all__ = [
    "Motions",
    "margin_of",
    "new_motions",
    "place_speeds",
    "place_twists",
    "set_body_motions",
    "set_pair_motions",
    "speed_bounds",
    "time_until",
    "used_up",
]

_ROUNDING = 1e-12
"""Metres that are kept free for what rounding moves links by, times their reach in metres."""

_SPEED_ROUNDING = 1e-13
"""Of a bound of a speed: what rounding may change a speed by."""


class Motions(NamedTuple):
    """How bodies move along an edge that is passed in a unit of time; scratch of one thread."""

    ways: np.ndarray
    """``(p,)`` m: how far any point of A can move relative to B, on all of the edge."""
    bends: np.ndarray
    """``(p,)`` m: the largest acceleration of such points; infinite for curved edges."""
    margins: np.ndarray
    """``(p,)`` m: what rounding is allowed."""
    own: np.ndarray
    """``(r, 3)``: way, bend and reach of each body of a robot, against what does not move."""
    rates: np.ndarray
    """``(j, 6)``: the turning and sliding of each joint, in its frame before it has moved."""
    twists: np.ndarray
    """``(j, 6, LANES)``: angular velocity, and velocity of what is at W's origin, in W."""
    joints: np.ndarray
    """``(j, 3)``: how far each turns and slides at most, and how far it is from its parent."""
    speeds: np.ndarray
    """``(r, LANES)`` m: how fast any point of a robot's body is in the middle of a stretch."""
    q: np.ndarray
    """``(LANES, nq)``: the configurations that are looked at."""


def new_motions(joints: int, positions: int, robots: int, pairs: int) -> Motions:
    """Return scratch for trees, bodies and pairs of this size."""
    return Motions(
        np.empty(pairs),
        np.empty(pairs),
        np.empty(pairs),
        np.empty((robots, 3)),
        np.zeros((joints, 6)),
        np.zeros((joints, 6, LANES)),
        np.empty((joints, 3)),
        np.empty((robots, LANES)),
        np.empty((LANES, positions)),
    )


@inlined_kernel
def _bounds_of_joint(tree, joint, edge):
    """Return a joint's turn and slide along an edge, and its largest offset.

    A Bézier curve's speed is nowhere larger than between two of its control points, times its
    degree.
    """
    degree = len(edge) - 1
    kind, s, factor = tree.kinds[joint], tree.starts[joint], tree.multipliers[joint]
    slide = turned = moved = 0.0
    for k in range(degree + 1):
        q = edge[k]
        if kind == PRISMATIC:
            slide = max(slide, abs(factor * q[s] + tree.offsets[joint]))
        elif kind == PLANAR:
            slide = max(slide, math.sqrt(q[s] ** 2 + q[s + 1] ** 2))
        elif kind == FLOATING:
            slide = max(slide, math.sqrt(q[s + 4] ** 2 + q[s + 5] ** 2 + q[s + 6] ** 2))
        if k == degree:
            break
        r = edge[k + 1]
        if kind == REVOLUTE:
            turned = max(turned, abs(factor * (r[s] - q[s])))
        elif kind == PRISMATIC:
            moved = max(moved, abs(factor * (r[s] - q[s])))
        elif kind == PLANAR:
            moved = max(moved, math.sqrt((r[s] - q[s]) ** 2 + (r[s + 1] - q[s + 1]) ** 2))
            turned = max(turned, abs(r[s + 2] - q[s + 2]))
        else:
            angle, _, _, _ = half_turn(q, r, s)
            turned = max(turned, 2.0 * angle)
            dx, dy, dz = r[s + 4] - q[s + 4], r[s + 5] - q[s + 5], r[s + 6] - q[s + 6]
            moved = max(moved, math.sqrt(dx * dx + dy * dy + dz * dz))
    return degree * turned, degree * moved, slide


@inlined_kernel
def _bounds_of_body(tree, joint, last, reach, joints):
    """Return the way and the acceleration of any point of a body, and how far out it may be.

    Relative to the joint ``last``; ``reach`` is the largest distance of the body's points from the
    origin of its own joint. Where all joints move at one speed, a joint that turns at w
    accelerates a point at r by w² r, and once more by 2 w times the speed that joints behind it
    give the point (centripetal and Coriolis acceleration).
    """
    way = bend = 0.0
    while joint != last:
        turned = joints[joint, 0]
        bend += turned * turned * reach + 2.0 * turned * way
        way += turned * reach + joints[joint, 1]
        reach += joints[joint, 2]
        joint = tree.parents[joint]
    return way, bend, reach


@inlined_kernel
def _set_rates(tree, edge, rates):
    """Write how each joint turns and slides along a straight edge."""
    q, r = edge[0], edge[1]
    for j in range(1, len(tree.kinds)):
        kind, s, factor = tree.kinds[j], tree.starts[j], tree.multipliers[j]
        for i in range(6):
            rates[j, i] = 0.0
        if kind == REVOLUTE:
            rates[j, 2] = factor * (r[s] - q[s])
        elif kind == PRISMATIC:
            rates[j, 5] = factor * (r[s] - q[s])
        elif kind == PLANAR:
            rates[j, 2] = r[s + 2] - q[s + 2]
            rates[j, 3], rates[j, 4] = r[s] - q[s], r[s + 1] - q[s + 1]
        else:
            angle, sign, size1, size2 = half_turn(q, r, s)
            scale = 2.0 * sign / (size1 * size2)
            if angle > SMALL_ANGLE:
                scale *= angle / sine_cosine(angle)[0]
            # The vector of the second quaternion times the first one's inverse.
            for i in range(3):
                m, n = s + 1 + (i + 1) % 3, s + 1 + (i + 2) % 3
                part = q[s] * r[s + 1 + i] - r[s] * q[s + 1 + i] - (r[m] * q[n] - r[n] * q[m])
                rates[j, i] = scale * part
                rates[j, 3 + i] = r[s + 4 + i] - q[s + 4 + i]


@inlined_kernel
def margin_of(reach):
    """Return the allowance for rounding, metres, of bodies that are so far out at most."""
    return _ROUNDING * (1.0 + reach)


@inlined_kernel
def set_body_motions(tree, bodies, reaches, edge, motions):
    """Write the bounds of joints and bodies on an edge ``(m, nq)``."""
    own, joints = motions.own, motions.joints
    for j in range(1, len(tree.kinds)):
        joints[j, 0], joints[j, 1], slide = _bounds_of_joint(tree, j, edge)
        X = tree.X_PJ[j]
        joints[j, 2] = slide + math.sqrt(X[0, 3] ** 2 + X[1, 3] ** 2 + X[2, 3] ** 2)
    for a in range(len(bodies.joints)):
        own[a, 0], own[a, 1], own[a, 2] = _bounds_of_body(
            tree, bodies.joints[a], 0, reaches[a], joints
        )


@inlined_kernel
def set_pair_motions(tree, bodies, pairs, reaches, edge, motions):
    """Write the bounds of pairs from those of their bodies in ``motions``."""
    own, joints = motions.own, motions.joints
    robots, is_straight = len(bodies.joints), len(edge) == 2
    for p in range(len(pairs.bodies)):
        a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
        way, bend, reach = own[a, 0], own[a, 1], own[a, 2]
        if b < robots:
            last = pairs.shared[p]
            way, bend, reach = _bounds_of_body(tree, bodies.joints[a], last, reaches[a], joints)
            way_B, bend_B, reach_B = _bounds_of_body(
                tree, bodies.joints[b], last, reaches[b], joints
            )
            way, bend, reach = way + way_B, bend + bend_B, max(reach, reach_B)
        motions.ways[p], motions.margins[p] = way, margin_of(reach)
        motions.bends[p] = bend * (1.0 + _SPEED_ROUNDING) if is_straight else math.inf
    if is_straight:
        _set_rates(tree, edge, motions.rates)


@inlined_kernel
def _rotate_before(tree, j, X_WP, x, y, z, k):
    """Return a vector in W that is given in a joint's frame before it has moved."""
    X = tree.X_PJ[j]
    px = X[0, 0] * x + X[0, 1] * y + X[0, 2] * z
    py = X[1, 0] * x + X[1, 1] * y + X[1, 2] * z
    pz = X[2, 0] * x + X[2, 1] * y + X[2, 2] * z
    return (
        X_WP[0, k] * px + X_WP[1, k] * py + X_WP[2, k] * pz,
        X_WP[4, k] * px + X_WP[5, k] * py + X_WP[6, k] * pz,
        X_WP[8, k] * px + X_WP[9, k] * py + X_WP[10, k] * pz,
    )


@inlined_kernel
def place_twists(tree, motions, places):
    """Write the twists of all joints where ``places`` has them, along a straight edge."""
    rates, twists = motions.rates, motions.twists
    for j in range(1, len(tree.kinds)):
        out, before = twists[j], twists[tree.parents[j]]
        X_WP, X_WJ = places.X_WJ[tree.parents[j]], places.X_WJ[j]
        rate = rates[j]
        for k in range(LANES):
            wx, wy, wz = _rotate_before(tree, j, X_WP, rate[0], rate[1], rate[2], k)
            vx, vy, vz = _rotate_before(tree, j, X_WP, rate[3], rate[4], rate[5], k)
            x, y, z = X_WJ[3, k], X_WJ[7, k], X_WJ[11, k]
            out[0, k], out[1, k], out[2, k] = (
                before[0, k] + wx,
                before[1, k] + wy,
                before[2, k] + wz,
            )
            out[3, k] = before[3, k] + vx - (wy * z - wz * y)
            out[4, k] = before[4, k] + vy - (wz * x - wx * z)
            out[5, k] = before[5, k] + vz - (wx * y - wy * x)


@inlined_kernel
def place_speeds(bodies, motions, places):
    """Write how fast points of robots' bodies are at most, along a straight edge."""
    for b in range(len(bodies.joints)):
        T, center, out = motions.twists[bodies.joints[b]], places.centers[b], motions.speeds[b]
        radius, rounding = bodies.radii[b], _SPEED_ROUNDING * motions.own[b, 0]
        for k in range(LANES):
            wx, wy, wz = T[0, k], T[1, k], T[2, k]
            x, y, z = center[0, k], center[1, k], center[2, k]
            vx, vy, vz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
            vx, vy, vz = T[3, k] + vx, T[4, k] + vy, T[5, k] + vz
            turning = radius * math.sqrt(wx * wx + wy * wy + wz * wz)
            out[k] = math.sqrt(vx * vx + vy * vy + vz * vz) + turning + rounding


@inlined_kernel
def _speed_of(bodies, b, joint, shared, twists, places, k, n):
    """Return the speed of a body's centre along n, and by how much that of its points differs.

    Relative to the joint ``shared``. The points are in the ball and in the box around the body.
    """
    T, S = twists[joint], twists[shared]
    wx, wy, wz = T[0, k] - S[0, k], T[1, k] - S[1, k], T[2, k] - S[2, k]
    vx, vy, vz = T[3, k] - S[3, k], T[4, k] - S[4, k], T[5, k] - S[5, k]
    x, y, z = places.centers[b, 0, k], places.centers[b, 1, k], places.centers[b, 2, k]
    vx, vy, vz = vx + (wy * z - wz * y), vy + (wz * x - wx * z), vz + (wx * y - wy * x)
    # A point at r from the centre is faster along n by r times this.
    mx, my, mz = n[1] * wz - n[2] * wy, n[2] * wx - n[0] * wz, n[0] * wy - n[1] * wx
    X, lower, upper = places.X_WG[b], bodies.lower[b], bodies.upper[b]
    in_box = 0.0
    for i in range(3):
        side = X[i, k] * mx + X[4 + i, k] * my + X[8 + i, k] * mz
        in_box += 0.5 * (upper[i] - lower[i]) * abs(side)
    in_ball = bodies.radii[b] * math.sqrt(mx * mx + my * my + mz * mz)
    return n[0] * vx + n[1] * vy + n[2] * vz, min(in_ball, in_box)


@inlined_kernel
def speed_bounds(bodies, pairs, p, k, motions, places, n, slack):
    """Return bounds of a pair's approach speed, forwards and backwards.

    ``n`` is a unit vector in W out of B into A, which differs from the direction of their distance
    by at most ``slack``.
    """
    a, b, shared = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.shared[p]
    speed, spread = _speed_of(bodies, a, bodies.joints[a], shared, motions.twists, places, k, n)
    if b < len(bodies.joints):
        speed_B, spread_B = _speed_of(
            bodies, b, bodies.joints[b], shared, motions.twists, places, k, n
        )
        speed, spread = speed - speed_B, spread + spread_B
    spread += (slack + _SPEED_ROUNDING) * motions.ways[p]
    return spread - speed, spread + speed


@inlined_kernel
def time_until(distance, speed, bend):
    """Return when so much is used up at most: ``speed t + bend t² / 2`` is the distance then."""
    root = math.sqrt(speed * speed + 2.0 * bend * distance)
    if speed >= 0.0:
        return 2.0 * distance / (speed + root) if root > 0.0 else math.inf
    return (root - speed) / bend if bend > 0.0 else math.inf


@inlined_kernel
def used_up(time, way, speed, bend):
    """Return the part of a distance that may be used up until then, by both bounds."""
    if bend == math.inf:
        return way * time
    return min(way * time, max(0.0, (speed + 0.5 * bend * time) * time))

"""How far bodies may move at most while each position changes by no more than some amount."""

from __future__ import annotations

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.planning.edges.motion_kernels import place_twists, set_pair_motions
from scene_graph_ros.planning.pairs.bodies import place_bodies
from scene_graph_ros.robots.tree_kernels import LANES, PLANAR, PRISMATIC, REVOLUTE

__all__ = ["pair_reaches", "set_influences"]

_OUTWARDS = 1.0 + 1e-12
"""Times bounds: far more than rounding takes off it."""


@inlined_kernel
def _set_joints(tree, low, high, changes, joints):
    """Write how far each joint turns and slides, and how far it is from its parent at most."""
    for j in range(1, len(tree.kinds)):
        kind, s, factor = tree.kinds[j], tree.starts[j], tree.multipliers[j]
        turned = moved = slide = 0.0
        if kind == REVOLUTE:
            turned = abs(factor) * changes[s]
        elif kind == PRISMATIC:
            moved = abs(factor) * changes[s]
            offset = tree.offsets[j]
            slide = max(abs(factor * low[s] + offset), abs(factor * high[s] + offset))
        elif kind == PLANAR:
            moved = math.sqrt(changes[s] ** 2 + changes[s + 1] ** 2)
            turned = changes[s + 2]
            x, y = max(abs(low[s]), abs(high[s])), max(abs(low[s + 1]), abs(high[s + 1]))
            slide = math.sqrt(x * x + y * y)
        X = tree.X_PJ[j]
        joints[j, 0], joints[j, 1] = turned, moved
        joints[j, 2] = slide + math.sqrt(X[0, 3] ** 2 + X[1, 3] ** 2 + X[2, 3] ** 2)


@inlined_kernel
def _reach_of(tree, joint, last, reach, joints):
    """Return the way and acceleration of any point of a body relative to the joint ``last``.

    That is along a straight edge that is passed in a unit of time; see ``motion_kernels``.
    """
    way = bend = 0.0
    while joint != last:
        turned = joints[joint, 0]
        bend += turned * turned * reach + 2.0 * turned * way
        way += turned * reach + joints[joint, 1]
        reach += joints[joint, 2]
        joint = tree.parents[joint]
    return way, bend


@lean_kernel
def pair_reaches(checked, low, high, changes, joints, ways):
    """Write how much nearer each pair may come, ``(p,)`` m.

    Positions are between ``low`` and ``high`` ``(nq,)``, and change by at most ``changes``
    ``(nq,)``. ``joints`` ``(j, 3)`` is scratch. No joint may float.
    """
    tree, bodies, pairs = checked.tree, checked.bodies, checked.pairs
    _set_joints(tree, low, high, changes, joints)
    robots = len(bodies.joints)
    for p in range(len(ways)):
        a, b, last = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.shared[p]
        if b >= robots:
            last = 0
        way, _ = _reach_of(tree, bodies.joints[a], last, checked.reaches[a], joints)
        if b < robots:
            other, _ = _reach_of(tree, bodies.joints[b], last, checked.reaches[b], joints)
            way += other
        ways[p] = way * _OUTWARDS


@inlined_kernel
def _speed_of(bodies, b, joint, last, twists, places):
    """Return the largest speed of any point of a body relative to a joint, in lane 0."""
    T, S, center = twists[joint], twists[last], places.centers[b]
    wx, wy, wz = T[0, 0] - S[0, 0], T[1, 0] - S[1, 0], T[2, 0] - S[2, 0]
    vx, vy, vz = T[3, 0] - S[3, 0], T[4, 0] - S[4, 0], T[5, 0] - S[5, 0]
    x, y, z = center[0, 0], center[1, 0], center[2, 0]
    vx, vy, vz = vx + (wy * z - wz * y), vy + (wz * x - wx * z), vz + (wx * y - wy * x)
    turning = bodies.radii[b] * math.sqrt(wx * wx + wy * wy + wz * wz)
    return math.sqrt(vx * vx + vy * vy + vz * vz) + turning


@inlined_kernel
def _moved(checked, a, last, joints, beside, scratch):
    """Return the way of any point of a body relative to a joint, along an edge or beside it.

    And how far it would if it went on as fast as at first.
    """
    motions, _, places = scratch
    tree, bodies, joint = checked.tree, checked.bodies, checked.bodies.joints[a]
    way, bend = _reach_of(tree, joint, last, checked.reaches[a], joints)
    more, _ = _reach_of(tree, joint, last, checked.reaches[a], beside)
    speed = _speed_of(bodies, a, joint, last, motions.twists, places)
    moved = min(way, speed + more + 0.5 * bend) * _OUTWARDS
    return moved, (speed + more) * _OUTWARDS


@lean_kernel
def set_influences(checked, none, edge, changes, rules, fastest, joints, influences, scratch):
    """Write up to which distance each pair matters, ``influences`` ``(p,)`` m.

    ``edge`` ``(2, nq)`` is that of a velocity; positions change by at most ``changes[0]``
    ``(nq,)`` in all, and are at most ``changes[1]`` beside it, from ``changes[2]`` to
    ``changes[3]``. ``rules`` are the distance to keep, m, for how many times as long the speed at
    first counts, and the time (s) of obstacles, whose points are at most ``fastest`` ``(b,)`` m/s
    fast. ``none`` is a table of no pairs, ``joints`` ``(2, j, 3)`` scratch.
    """
    motions, _, places = scratch
    tree, bodies, pairs = checked.tree, checked.bodies, checked.pairs
    keep, factor, seconds = rules
    q, robots = edge[0], len(bodies.joints)
    for k in range(LANES):
        for i in range(len(q)):
            motions.q[k, i] = q[i]
    for side in range(2):
        _set_joints(tree, changes[2], changes[3], changes[side], joints[side])
    place_bodies(tree, bodies, motions.q, 0, checked.X_WB, places)
    set_pair_motions(tree, bodies, none, checked.reaches, edge, motions)
    place_twists(tree, motions, places)
    for a in range(robots):
        moved, at_first = _moved(checked, a, 0, joints[0], joints[1], scratch)
        motions.own[a, 0] = max(moved, factor * at_first)
    for p in range(len(influences)):
        a, b, last = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.shared[p]
        if b >= robots:
            influences[p] = keep + motions.own[a, 0] + seconds * fastest[b]
        else:
            moved, at_first = _moved(checked, a, last, joints[0], joints[1], scratch)
            more, faster = _moved(checked, b, last, joints[0], joints[1], scratch)
            influences[p] = keep + max(moved + more, factor * (at_first + faster))

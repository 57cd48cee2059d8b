"""How far bodies may move at most while each position changes by no more than some amount."""

from __future__ import annotations

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.robots.tree_kernels import PLANAR, PRISMATIC, REVOLUTE

__all__ = ["pair_reaches"]


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
    """Return how far any point of a body moves relative to the joint ``last``."""
    way = 0.0
    while joint != last:
        way += joints[joint, 0] * reach + joints[joint, 1]
        reach += joints[joint, 2]
        joint = tree.parents[joint]
    return way


@lean_kernel
def pair_reaches(checked, low, high, changes, joints, ways):
    """Write how much nearer each pair may come, ``(p,)`` m; return the largest.

    Positions are between ``low`` and ``high`` ``(nq,)``, and change by at most ``changes``
    ``(nq,)``. ``joints`` ``(j, 3)`` is scratch. No joint may float.
    """
    tree, bodies, pairs = checked.tree, checked.bodies, checked.pairs
    _set_joints(tree, low, high, changes, joints)
    most, robots = 0.0, len(bodies.joints)
    for p in range(len(ways)):
        a, b, last = pairs.bodies[p, 0], pairs.bodies[p, 1], pairs.shared[p]
        if b >= robots:
            last = 0
        way = _reach_of(tree, bodies.joints[a], last, checked.reaches[a], joints)
        if b < robots:
            way += _reach_of(tree, bodies.joints[b], last, checked.reaches[b], joints)
        ways[p] = way
        most = max(most, way)
    return most

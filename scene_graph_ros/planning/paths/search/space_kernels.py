"""Distances of configurations, and ways between them, where some joints turn without an end."""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.spatial.elementary import arc_sine
from scene_graph_ros.planning.edges.curve_kernels import interpolate

__all__ = ["SpaceTable", "distance", "nearest", "walk"]


class SpaceTable(NamedTuple):
    """How positions are compared.

    The distance of two configurations is Euclidean in rad and m; of two quaternions, which must
    have length 1, it is the angle between them.
    """

    weights: np.ndarray
    """``(nq,)``: 0 for the entries of quaternions, else 1."""
    periods: np.ndarray
    """``(nq,)`` rad: a full turn that changes nothing, 0 where there is none."""
    quaternions: np.ndarray
    """``(k,)``: where quaternions begin."""


@inlined_kernel
def _way(a, b, period):
    """Return the difference from one position to another, the short way round."""
    way = b - a
    if period > 0.0:
        way -= period * math.floor(way / period + 0.5)
    return way


@inlined_kernel
def distance(space, a, b):
    """Return the distance of two configurations ``(nq,)``."""
    total = 0.0
    for i in range(len(a)):
        way = _way(a[i], b[i], space.periods[i])
        total += space.weights[i] * way * way
    for k in range(len(space.quaternions)):
        s = space.quaternions[k]
        same = opposite = 0.0
        for i in range(s, s + 4):
            same += (b[i] - a[i]) ** 2
            opposite += (b[i] + a[i]) ** 2
        angle = 4.0 * arc_sine(min(1.0, 0.5 * math.sqrt(min(same, opposite))))
        total += angle * angle
    return math.sqrt(total)


@inlined_kernel
def nearest(space, nodes, size, q):
    """Return the row of the nearest of the first ``size`` nodes ``(n, nq)``, and its distance."""
    best, least = 0, math.inf
    for i in range(size):
        far = distance(space, nodes[i], q)
        if far < least:
            best, least = i, far
    return best, least


@inlined_kernel
def walk(tree, space, a, b, t, aligned, out):
    """Write the configuration at t in [0, 1] on the short way from a to b; ``aligned`` is scratch.

    At 1 that is b itself, but for full turns.
    """
    for i in range(len(a)):
        aligned[i] = b[i]
        if space.periods[i] > 0.0:
            aligned[i] = a[i] + _way(a[i], b[i], space.periods[i])
    if t < 1.0:
        interpolate(tree, a, aligned, t, out)
    else:
        for i in range(len(a)):
            out[i] = aligned[i]

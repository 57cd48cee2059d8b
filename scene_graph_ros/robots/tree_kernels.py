"""Where the joints of a tree are, for eight configurations at a time, and how they move points.

One configuration is worked out as eight are, seven of them for nothing: so a configuration's
poses are the same bits whatever stands beside it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, store_lanes
from scene_graph_ros.geometry.spatial.elementary import sines_cosines

__all__ = [
    "FLOATING",
    "LANES",
    "PLANAR",
    "PRISMATIC",
    "REVOLUTE",
    "SMALL_ANGLE",
    "TreeTable",
    "compose_lanes",
    "joint_columns",
    "link_poses",
    "place_joints",
]

SMALL_ANGLE = 1e-4
"""Radians: half the angle between quaternions below which a turn is as a straight line, whose
weights are off by 2e-9 of it, while sines no longer tell them better."""

REVOLUTE = 0
PRISMATIC = 1
PLANAR = 2
FLOATING = 3


class TreeTable(NamedTuple):
    """The joints of a tree, parents before children; joint 0 is the base and does not move.

    A joint turns about, or slides along, the z axis of its frame J, which at position zero is at
    ``X_PJ`` in the frame of its parent joint. A planar joint slides along x and y and turns about
    z; a floating one has a unit quaternion (w, x, y, z) and a place.
    """

    kinds: np.ndarray
    """``(j,)``; that of the base has no meaning."""
    parents: np.ndarray
    """``(j,)`` rows; -1 for the base."""
    X_PJ: np.ndarray
    """``(j, 3, 4)``."""
    starts: np.ndarray
    """``(j,)``: the first of the joint's positions in a configuration."""
    velocity_starts: np.ndarray
    """``(j,)``: the first of its velocities."""
    multipliers: np.ndarray
    """``(j,)``: a joint with one position is at ``multiplier * position + offset``."""
    offsets: np.ndarray
    """``(j,)``."""
    joint_of_link: np.ndarray
    """``(l,)`` rows of joints."""
    X_JL: np.ndarray
    """``(l, 3, 4)``: links in the frames of their joints."""


@inlined_kernel
def compose_lanes(A, X, B):
    """Write ``A X`` to B for LANES poses A ``(12, LANES)``, rows of ``(3, 4)``, and one pose X."""
    for row in range(3):
        at = 4 * row * LANES
        a, b, c = load_lanes(A, at), load_lanes(A, at + LANES), load_lanes(A, at + 2 * LANES)
        d = load_lanes(A, at + 3 * LANES)
        for column in range(3):
            out = a * X[0, column] + b * X[1, column] + c * X[2, column]
            store_lanes(B, at + column * LANES, out)
        store_lanes(B, at + 3 * LANES, a * X[0, 3] + b * X[1, 3] + c * X[2, 3] + d)


@inlined_kernel
def _turn(B, sines, cosines):
    """Turn LANES poses about their z axes."""
    s, c = load_lanes(sines, 0), load_lanes(cosines, 0)
    for row in range(3):
        at = 4 * row * LANES
        x, y = load_lanes(B, at), load_lanes(B, at + LANES)
        store_lanes(B, at, x * c + y * s)
        store_lanes(B, at + LANES, y * c - x * s)


@inlined_kernel
def _slide(B, column, distances):
    """Move LANES poses along one of their axes."""
    d = load_lanes(distances, 0)
    for row in range(3):
        at, along = (4 * row + 3) * LANES, (4 * row + column) * LANES
        store_lanes(B, at, load_lanes(B, at) + load_lanes(B, along) * d)


@inlined_kernel
def _float(B, q, first, start, n, values):
    """Move LANES poses by a floating joint's quaternions and places; ``values`` is scratch."""
    for k in range(LANES):
        row = min(first + k, n - 1)
        w, x, y, z = q[row, start], q[row, start + 1], q[row, start + 2], q[row, start + 3]
        scale = max(abs(w), abs(x), abs(y), abs(z))
        w, x, y, z = w / scale, x / scale, y / scale, z / scale
        length = math.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w / length, x / length, y / length, z / length
        px, py, pz = q[row, start + 4], q[row, start + 5], q[row, start + 6]
        for i in range(3):
            a, b, c = B[4 * i, k], B[4 * i + 1, k], B[4 * i + 2, k]
            values[0] = (
                a * (1 - 2 * (y * y + z * z))
                + b * (2 * (x * y + w * z))
                + c * (2 * (x * z - w * y))
            )
            values[1] = (
                a * (2 * (x * y - w * z))
                + b * (1 - 2 * (x * x + z * z))
                + c * (2 * (y * z + w * x))
            )
            values[2] = (
                a * (2 * (x * z + w * y))
                + b * (2 * (y * z - w * x))
                + c * (1 - 2 * (x * x + y * y))
            )
            B[4 * i + 3, k] += a * px + b * py + c * pz
            B[4 * i, k], B[4 * i + 1, k], B[4 * i + 2, k] = values[0], values[1], values[2]


@inlined_kernel
def _gather(q, first, n, column, multiplier, offset, values):
    """Read one position of LANES configurations; past the last that is read again."""
    for k in range(LANES):
        values[k] = multiplier * q[min(first + k, n - 1), column] + offset


@inlined_kernel
def place_joints(tree, q, first, X_WB, X_WJ, work):
    """Write the poses of all joints, ``(j, 12, LANES)``, for configurations from ``first`` on."""
    n = len(q)
    for i in range(12):
        for k in range(LANES):
            X_WJ[0, i, k] = X_WB[i // 4, i % 4]
    angles, sines, cosines = work[0], work[1], work[2]
    for j in range(1, len(tree.kinds)):
        kind, start = tree.kinds[j], tree.starts[j]
        compose_lanes(X_WJ[tree.parents[j]], tree.X_PJ[j], X_WJ[j])
        if kind == REVOLUTE:
            _gather(q, first, n, start, tree.multipliers[j], tree.offsets[j], angles)
            sines_cosines(angles, sines, cosines)
            _turn(X_WJ[j], sines, cosines)
        elif kind == PRISMATIC:
            _gather(q, first, n, start, tree.multipliers[j], tree.offsets[j], angles)
            _slide(X_WJ[j], 2, angles)
        elif kind == PLANAR:
            for axis in range(2):
                _gather(q, first, n, start + axis, 1.0, 0.0, angles)
                _slide(X_WJ[j], axis, angles)
            _gather(q, first, n, start + 2, 1.0, 0.0, angles)
            sines_cosines(angles, sines, cosines)
            _turn(X_WJ[j], sines, cosines)
        else:
            _float(X_WJ[j], q, first, start, n, work[0])


@kernel
def link_poses(tree, q, X_WB, links, X_WL):
    """Write poses of ``links`` (rows) of a tree whose base is at ``X_WB`` ``(4, 4)``.

    ``q`` is ``(n, nq)``, finite, with quaternions that are not zero; ``X_WL`` is ``(n, l, 4, 4)``.
    """
    n = len(q)
    X_WJ, work = np.empty((len(tree.kinds), 12, LANES)), np.empty((3, LANES))
    X = np.empty((12, LANES))
    for first in range(0, n, LANES):
        place_joints(tree, q, first, X_WB, X_WJ, work)
        count = min(LANES, n - first)
        for i in range(len(links)):
            link = links[i]
            compose_lanes(X_WJ[tree.joint_of_link[link]], tree.X_JL[link], X)
            for k in range(count):
                out = X_WL[first + k, i]
                for row in range(3):
                    for column in range(4):
                        out[row, column] = X[4 * row + column, k]
                out[3, 0] = out[3, 1] = out[3, 2] = 0.0
                out[3, 3] = 1.0


@inlined_kernel
def _add_turn(J, column, axis, r, factor):
    """Add what a unit of turning about an axis does to a point at r from it."""
    ax, ay, az = axis
    rx, ry, rz = r[0], r[1], r[2]
    J[0, column] += factor * ax
    J[1, column] += factor * ay
    J[2, column] += factor * az
    J[3, column] += factor * (ay * rz - az * ry)
    J[4, column] += factor * (az * rx - ax * rz)
    J[5, column] += factor * (ax * ry - ay * rx)


@inlined_kernel
def _add_slide(J, column, axis, factor):
    """Add what a unit of sliding along an axis does to a point."""
    J[3, column] += factor * axis[0]
    J[4, column] += factor * axis[1]
    J[5, column] += factor * axis[2]


@kernel
def joint_columns(tree, q, X_WB, link, p_LQ, J):
    """Write the Jacobian ``(n, 6, nv)`` of a point Q of a link: turning, then sliding, in W.

    The columns belong to the velocities of the joints between link and base; all others are zero.
    A revolute joint's column is its axis, and that times the way to Q; a prismatic one's is zero,
    and its axis (Lynch and Park, *Modern Robotics*, 2017, section 5.1, for a point's velocity).
    """
    n = len(q)
    X_WJ, work = np.empty((len(tree.kinds), 12, LANES)), np.empty((3, LANES))
    X, X_before = np.empty((12, LANES)), np.empty((12, LANES))
    J[:] = 0.0
    for first in range(0, n, LANES):
        place_joints(tree, q, first, X_WB, X_WJ, work)
        compose_lanes(X_WJ[tree.joint_of_link[link]], tree.X_JL[link], X)
        joint = tree.joint_of_link[link]
        while joint > 0:
            kind, column = tree.kinds[joint], tree.velocity_starts[joint]
            # The axes along which it slides are those that it has before it turns.
            compose_lanes(X_WJ[tree.parents[joint]], tree.X_PJ[joint], X_before)
            for k in range(min(LANES, n - first)):
                r, out = work[0], J[first + k]
                for i in range(3):
                    Q = X[4 * i + 3, k]
                    for m in range(3):
                        Q += X[4 * i + m, k] * p_LQ[m]
                    r[i] = Q - X_WJ[joint, 4 * i + 3, k]
                factor = tree.multipliers[joint]
                for i in range(3):
                    axis = X_before[i, k], X_before[4 + i, k], X_before[8 + i, k]
                    if kind == FLOATING:
                        _add_turn(out, column + i, axis, r, 1.0)
                        _add_slide(out, column + 3 + i, axis, 1.0)
                    elif kind == PLANAR and i < 2:
                        _add_slide(out, column + i, axis, 1.0)
                    elif kind == PLANAR:
                        _add_turn(out, column + 2, axis, r, 1.0)
                    elif kind == PRISMATIC and i == 2:
                        _add_slide(out, column, axis, factor)
                    elif kind == REVOLUTE and i == 2:
                        _add_turn(out, column, axis, r, factor)
            joint = tree.parents[joint]

"""Random configurations of a robot."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.elementary import sines_and_cosines
from scene_graph_ros.robots.tree_joint import KinematicTreeError, PARTS, TreeJoint
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, REVOLUTE
from scene_graph_ros.robots.tree_layout import TreeLayout

__all__ = ["rotations", "sample"]


def sample(tree: TreeLayout, rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    """Answer `KinematicTree.sample`."""
    given: Any = rng
    if not isinstance(given, np.random.Generator):
        raise KinematicTreeError(
            f"rng must be a numpy.random.Generator, such as np.random.default_rng(0), not"
            f" {quoted(given)}"
        )
    count: Any = n
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 0:
        raise KinematicTreeError(f"n must be a whole number from 0 on, not {quoted(n)}")
    q = rng.random((int(count), tree.num_positions))
    for joint in tree.joints:
        if joint.mimics:
            continue
        start = tree.position_index(_first_name(joint))
        if joint.kind == FLOATING:
            q[:, start : start + 4] = rotations(q[:, start : start + 3])
        width = len(PARTS[joint.kind][0]) or 1
        for row in range(start + 4 * (joint.kind == FLOATING), start + width):
            is_angle = joint.kind == REVOLUTE or (joint.kind == PLANAR and row == start + 2)
            lower, upper = _range(tree, row, is_angle)
            q[:, row] = lower + (upper - lower) * q[:, row]
    return q


def _first_name(joint: TreeJoint) -> str:
    parts = PARTS[joint.kind][0]
    return f"{joint.name}.{parts[0]}" if parts else joint.name


def _range(tree: TreeLayout, row: int, is_angle: bool) -> tuple[float, float]:
    lower, upper = float(tree.lower[row]), float(tree.upper[row])
    if math.isfinite(lower) and math.isfinite(upper):
        return lower, upper
    if is_angle and lower == -math.inf and upper == math.inf:
        return -math.pi, math.pi
    raise KinematicTreeError(
        f"position {tree.position_names[row]!r} of robot {tree.name!r} is within [{lower:g},"
        f" {upper:g}]: nothing is drawn evenly from that. Remedy: give the joint limits"
    )


def rotations(u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions (w, x, y, z) ``(n, 4)``, even where ``u`` ``(n, 3)`` is within [0, 1).

    Shoemake's equation 1.
    """
    share, (a, b) = u[:, 0], np.ascontiguousarray(2.0 * math.pi * u[:, 1:].T)
    short, long = np.sqrt(1.0 - share), np.sqrt(share)
    (sin_a, cos_a), (sin_b, cos_b) = sines_and_cosines(a), sines_and_cosines(b)
    return np.stack([long * cos_b, short * sin_a, short * cos_a, long * sin_b], axis=1)

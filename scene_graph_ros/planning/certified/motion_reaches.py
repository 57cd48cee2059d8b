"""How far points of two bodies can move relative to each other, for each way of a position."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import PRISMATIC, REVOLUTE

__all__ = ["motion_reaches"]


def motion_reaches(
    plan: CheckerPlan, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``(p, nq)`` metres per rad or per m, for the positions between two bounds ``(nq,)``.

    Where positions differ by dq, no point of A is farther from where it was, relative to B, than
    the row of the pair times ``|dq|``. A joint that turns moves a point by no more than the turn
    times the point's distance from its axis, which is at most the sum of the offsets between them.
    As the proofs of edges have it, for boxes instead of edges.

    Raises CertificateError for joints that are neither revolute nor prismatic.
    """
    tree = plan.tree
    for joint in tree.joints:
        if joint.kind not in (REVOLUTE, PRISMATIC):
            raise CertificateError(
                f"joint {joint.name!r} is planar or floating; this proof is of revolute and"
                " prismatic joints"
            )
    outs = _outs(tree, lower, upper)
    robots, result = len(plan.bodies.joints), np.zeros((len(plan.pairs.bodies), len(lower)))
    for p, (bodies, shared) in enumerate(zip(plan.pairs.bodies, plan.pairs.shared, strict=True)):
        for body in bodies:
            if body < robots:
                row = int(plan.bodies.joints[body])
                _add_ways(tree, row, int(shared), float(plan.reaches[body]), outs, result[p])
    return result


def _outs(
    tree: KinematicTree, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> list[float]:
    """Return the largest distance of each joint of the table from its parent."""
    result = [0.0]
    for joint, start in zip(tree.joints, tree.table.starts[1:], strict=True):
        out = float(np.linalg.norm(joint.X_PJ[:3, 3]))
        if joint.kind == PRISMATIC:
            ends = joint.multiplier * np.array([lower[start], upper[start]]) + joint.offset
            out += float(np.abs(ends).max())
        result.append(out)
    return result


def _add_ways(
    tree: KinematicTree,
    row: int,
    last: int,
    reach: float,
    outs: list[float],
    ways: NDArray[np.float64],
) -> None:
    """Add the motion of a point of a body by each joint between its own and ``last``."""
    while row != last:
        joint = tree.joints[row - 1]
        factor = reach if joint.kind == REVOLUTE else 1.0
        ways[tree.table.starts[row]] += abs(joint.multiplier) * factor
        reach += outs[row]
        row = int(tree.table.parents[row])

"""Jog a robot's hand into everything around it: a filter of velocities keeps its distance.

    python examples/jog.py --output jog.png

A Panda's hand is asked for 0.3 m/s forwards, down into the table and to both sides, one after the
other; the joints' velocities follow from its Jacobian. Each millisecond `SafeVelocity` returns the
nearest velocity that is proven to keep 20 mm from everything. Above is the speed of the hand
along what is asked for, below the least distance of any pair.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning import (
    load_robot_diagram,
    SafeVelocity,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.trajectories import MotionLimits

SCENE = "config/scenes/panda_cell.yaml"
START = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
HAND = "panda_hand"
KEEP = 0.02
"""Metres."""
PERIOD = 0.001
"""Seconds."""
SPEED = 0.3
"""m/s."""
WAYS = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
"""In W; the robot looks along x."""
SECONDS = 1.5
"""For each of them."""
DAMPING = 1e-3


def joint_velocity(J: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the velocity of the joints ``(nv,)`` that moves the hand, without turning it."""
    twist = np.concatenate([np.zeros(3), SPEED * way])
    result: NDArray[np.float64] = J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(6), twist)
    return result


def drive(checker: SceneGraphCollisionChecker) -> NDArray[np.float64]:
    """Return moments (s), the hand's speed along its way (m/s), and the least distance (m)."""
    tree = checker.plan.tree
    limits = MotionLimits.of_tree(tree, accelerations=15.0)
    barrier = SafeVelocity(checker, KEEP, limits=limits)
    q, rows = START, []
    ticks = round(SECONDS / PERIOD)
    for tick in range(len(WAYS) * ticks):
        way = np.array(WAYS[tick // ticks])
        J = tree.jacobians(q, HAND)
        step = barrier.filter(q, joint_velocity(J, way), PERIOD)
        q = q + PERIOD * step.velocity
        distances = checker.calc_robot_clearance(q, 0.2).distances
        speed = float(way @ (J @ step.velocity)[3:])
        rows.append((tick * PERIOD, speed, distances.min(initial=0.2)))
    return np.array(rows)


def draw(rows: NDArray[np.float64], output: Path) -> None:
    """Write the picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 1, figsize=(9, 6), sharex=True, layout="constrained")
    moments, speeds, distances = rows.T
    axes[0].plot(moments, speeds, linewidth=1.0)
    axes[0].axhline(SPEED, color="0.6", linestyle=":")
    axes[0].set_ylabel("speed of the hand, m/s")
    axes[1].plot(moments, 1e3 * distances, linewidth=1.0)
    axes[1].axhline(1e3 * KEEP, color="0.6", linestyle=":")
    axes[1].set_ylabel("least distance, mm")
    axes[1].set_xlabel("time, s")
    figure.savefig(output, dpi=110)


def main() -> int:
    """Drive and draw; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("jog.png"), help="the picture")
    arguments = parser.parse_args()
    rows = drive(SceneGraphCollisionChecker(load_robot_diagram(SCENE)))
    ways = rows[:, 1].reshape(len(WAYS), -1).mean(axis=1)
    words = ", ".join(f"{speed:.2f}" for speed in ways)
    print(
        f"{len(rows)} ticks; the hand went along its ways by {words} m/s of {SPEED:.2f} m/s in the"
        f" mean, and nothing came nearer than {1e3 * rows[:, 2].min():.2f} mm of {1e3 * KEEP:.0f}."
    )
    draw(rows, arguments.output)
    print(f"Drawn to {arguments.output}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())

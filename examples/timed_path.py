"""How fast a planned path may be gone along: speeds and accelerations beside their limits.

    python examples/timed_path.py --output timed_path.png

A Panda's hand goes from one compartment of a shelf into the next, as in `plan_around_shelf.py`.
The path is rounded at its corners, timed and proven once more. Above are the joints' speeds, below
their accelerations, each as a share of its limit: at all times one of them is near its limit.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

import numpy as np
from numpy.typing import NDArray
from plan_around_shelf import GOAL, PADDING, SCENE, START

from scene_graph_ros.planning import (
    load_robot_diagram,
    plan_path,
    SceneGraphCollisionChecker,
    time_path,
    TimedPath,
)
from scene_graph_ros.planning.trajectories import MotionLimits

ACCELERATION = 5.0
"""rad/s^2, of each joint of the arm."""
JOINTS = 7
"""Of the arm; the fingers stay."""
MOMENTS = 1000
"""That are drawn."""


def shares(timed: TimedPath, limits: MotionLimits) -> tuple[NDArray[np.float64], ...]:
    """Return moments ``(t,)`` (s), and speeds and accelerations ``(t, 7)`` over their limits."""
    assert timed.trajectory is not None
    moments = np.linspace(0.0, timed.duration, MOMENTS)
    speeds, accelerations = (
        timed.trajectory.derivative(order).value(moments)[:, :JOINTS] for order in (1, 2)
    )
    return (
        moments,
        speeds / limits.velocities[:JOINTS],
        accelerations / limits.accelerations[:JOINTS],
    )


def draw(timed: TimedPath, limits: MotionLimits, output: Path) -> None:
    """Write the picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    moments, *both = shares(timed, limits)
    figure, axes = pyplot.subplots(2, 1, figsize=(10, 6), sharex=True, layout="constrained")
    for axis, values, what in zip(axes, both, ("speed", "acceleration"), strict=True):
        for joint, line in enumerate(values.T):
            axis.plot(moments, line, linewidth=1.0, label=f"joint {joint + 1}")
        axis.axhspan(1.0, 1.1, color="0.85")
        axis.axhspan(-1.1, -1.0, color="0.85")
        axis.set_ylim(-1.1, 1.1)
        axis.set_ylabel(f"{what} / its limit")
    lines, names = axes[0].get_legend_handles_labels()
    figure.legend(lines, names, loc="outside upper center", ncols=JOINTS, fontsize="small")
    axes[1].set_xlabel("time, s")
    figure.savefig(output, dpi=110)


def main() -> int:
    """Plan, time and draw; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="which of many paths")
    parser.add_argument("--output", type=Path, default=Path("timed_path.png"), help="the picture")
    arguments = parser.parse_args()
    robots = load_robot_diagram(SCENE)
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=PADDING)
    plan = plan_path(checker, START, GOAL, group="arm", seed=arguments.seed, timeout=30.0)
    if not plan.is_success:
        print(plan.reason)
        return 1
    limits = MotionLimits.of_tree(robots.tree, accelerations=ACCELERATION)
    timed = time_path(checker, plan.configurations, limits)
    if not timed.is_success:
        print(timed.reason)
        return 1
    _, speeds, accelerations = shares(timed, limits)
    fullest = np.maximum(np.abs(speeds).max(axis=1), np.abs(accelerations).max(axis=1))
    print(
        f"{timed.duration:.2f} s, {timed.rounded} corners rounded, {timed.stops} stops, proven to"
        f" keep {1e3 * (timed.least_clearance + PADDING):.1f} mm from everything. Shares of"
        f" limits: speeds up to {np.abs(speeds).max():.3f}, accelerations up to"
        f" {np.abs(accelerations).max():.3f}; the fuller of both is above 0.9"
        f" {np.mean(fullest > 0.9):.0%} of the time."
    )
    draw(timed, limits, arguments.output)
    print(f"Drawn to {arguments.output}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())

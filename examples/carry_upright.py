"""A Panda carries a cup from the table into a shelf without tilting it: planned, proven, drawn.

    python examples/carry_upright.py --output carry_upright.png

The scene is that of the demo; no node is started. The hand holds a cup. At no time of the motion
may its axis be more than an angle off the vertical, nor its rim below a height. The largest tilt
of samples of the motion is printed, and that of a motion without these constraints. The picture
shows the robot at the start, at the goal and on its way, and the way of its hand: red where
something is near, green where the nearest is 10 cm away.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
import sys
import time

import numpy as np
from plan_around_shelf import DEPTH, HAND, PADDING, SCENE

from scene_graph_ros.geometry import Cylinder, GeometryInstance, IllustrationProperties, Rgba
from scene_graph_ros.planning import (
    AngleBetweenVectorsConstraint,
    BodyShapeDescription,
    inverse_kinematics,
    load_robot_diagram,
    plan_trajectory,
    PoseTarget,
    PositionConstraint,
    SceneGraphCollisionChecker,
    TimedPath,
)
from scene_graph_ros.planning.trajectories import MotionLimits

CUP, LENGTH = 0.035, 0.1
"""Radius and height, m. Its axis is the hand's x axis."""
HOME = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
START, GOAL = ((0.45, -0.35, 0.62), 0.0), ((-0.05, 0.58, 0.95), 0.5 * math.pi)
"""Where the hand is, m, and the direction in which it points, rad from x: level, cup upright."""


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tilt", type=float, default=0.05, help="rad off the vertical at most")
    parser.add_argument("--seed", type=int, default=0, help="which of many motions")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds to look for one")
    parser.add_argument("--output", type=Path, default=Path("carry_upright.png"), help="picture")
    parser.add_argument("--no-picture", action="store_true", help="only print what was found")
    return parser.parse_args()


def add_cup(checker: SceneGraphCollisionChecker) -> None:
    """Put the cup between the fingers, for checks and for the picture."""
    X_HC = np.zeros((4, 4))
    X_HC[0, 2] = X_HC[1, 1] = X_HC[3, 3] = 1.0  # the cylinder's z is the hand's x
    X_HC[2, 0] = -1.0
    X_HC[2, 3] = DEPTH
    frame, shape = checker.get_body(HAND), Cylinder(CUP, LENGTH)
    names = frame.model_instance_name, frame.body_name
    checker.add_collision_shape("cup", BodyShapeDescription(shape, X_HC, *names))
    for finger in ("panda_leftfinger", "panda_rightfinger"):
        body = checker.get_body(finger)
        checker.set_collision_filtered_between(HAND, body.body_name, True)
    robots, looks = checker.model, IllustrationProperties()
    cup = GeometryInstance(X_HC, shape, "cup")
    looks.add_property("phong", "diffuse", Rgba(0.2, 0.45, 0.85))
    cup.set_illustration_properties(looks)
    source = robots.context.inspector().get_owning_source_id(frame.frame_id)
    robots.scene_graph.register_geometry(source, frame.frame_id, cup, context=robots.context)


def level(place: tuple[float, float, float], direction: float) -> PoseTarget:
    """Return the hand's target: it points along a direction, its x axis up."""
    c, s = math.cos(direction), math.sin(direction)
    X_WH = np.eye(4)
    X_WH[:3, :3] = np.array([[0.0, s, c], [0.0, -c, s], [1.0, 0.0, 0.0]])
    X_WH[:3, 3] = place
    return PoseTarget(HAND, X_WH)


def most_tilted(checker: SceneGraphCollisionChecker, motion: TimedPath) -> float:
    """Return the largest tilt of the cup at 2000 times of a motion, rad."""
    q = motion.trajectory.value(np.linspace(0.0, motion.duration, 2000))
    axes = checker.plan.tree.link_poses(q, [HAND])[:, 0, :3, 0]
    return float(np.arctan2(np.hypot(axes[:, 0], axes[:, 1]), axes[:, 2]).max())


def main() -> int:
    """Run the example; return the exit code."""
    arguments = parse_arguments()
    checker = SceneGraphCollisionChecker(load_robot_diagram(SCENE), env_collision_padding=PADDING)
    add_cup(checker)
    ends = []
    for each in (START, GOAL):
        found = inverse_kinematics(checker, level(*each), near=HOME, group="arm")
        if not found.is_success:
            print(found.reason)
            return 1
        ends.append(found.configurations[0])
    names = tuple(f"panda_joint{i}" for i in range(1, 8))
    limits = MotionLimits([2.175] * 4 + [2.61] * 3, [10.0] * 7, names, [200.0] * 7)
    constraints = [
        AngleBetweenVectorsConstraint(HAND, [0, 0, 1], [1, 0, 0], arguments.tilt),
        PositionConstraint(
            HAND,
            [-np.inf, -np.inf, 0.55],
            [np.inf, np.inf, np.inf],
            p_LQ=[0.5 * LENGTH, 0.0, DEPTH],
        ),
    ]
    how = {"group": "arm", "seed": arguments.seed, "timeout": arguments.timeout}
    # Kernels are loaded by first calls, which are not to be measured.
    plan_trajectory(checker, ends[0], ends[0], limits, **how, constraints=constraints)
    free = plan_trajectory(checker, *ends, limits, **how)
    begin = time.perf_counter()
    motion = plan_trajectory(checker, *ends, limits, **how, constraints=constraints)
    seconds = time.perf_counter() - begin
    if not motion.is_success:
        print(motion.reason)
        return 1
    print(
        f"A motion of {motion.duration:.2f} s, found in {1e3 * seconds:.0f} ms: proven to keep"
        f" {1e3 * (motion.least_clearance + PADDING):.1f} mm from everything, and the cup within"
        f" {arguments.tilt:g} rad of upright"
    )
    print(f"Largest tilt of 2000 samples: {most_tilted(checker, motion):.4f} rad")
    if free.is_success:
        tilt = most_tilted(checker, free)
        print(f"Without constraints: {free.duration:.2f} s, tilted by {tilt:.2f} rad")
    if not arguments.no_picture:
        from common.picture import Camera
        from common.plan_picture import draw_plan

        camera = Camera(eye=(-1.55, -1.5, 1.75), target=(0.13, 0.15, 0.72), field_of_view=40.0,
                        width=900, height=640)  # fmt: skip
        draw_plan(arguments.output, checker, motion.plan.configurations, camera)
        print(f"Picture: {arguments.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""A Panda moves along the fastest way through regions of its configurations, proven free.

    .venv/bin/python examples/panda_through_regions.py --output panda_through_regions.png

The scene is that of the demo; no node is started. A path is planned with some padding, regions
grow along it, and the fastest trajectory through these is found, with what none is better than.
It is then timed from rest to rest and proven free, piece by piece, with as much padding as can be.
The picture has the way of the hand twice: coloured by what the robot is proven to keep from all
else, and by the hand's speed.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
import time

import numpy as np
from numpy.typing import NDArray
from plan_around_shelf import SCENE

from scene_graph_ros.planning import (
    GcsTrajectoryOptimization,
    IrisZoOptions,
    load_robot_diagram,
    plan_path,
    plan_through_regions,
    regions_along,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.trajectories import (
    BezierCurve,
    CompositeTrajectory,
    MotionLimits,
    retime,
)

START = (-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.02)
GOAL = (1.095, 0.135, 0.27, -2.219, -0.321, 3.6, 0.785, 0.02)
"""Positions (rad, m): beside the table, and before the shelf with the hand between its boards."""
PADDING = 0.015
"""Metres that the robot keeps where path and regions are looked for."""
ACCELERATION = 5.0
"""rad/s^2, of each joint of the arm."""
PIECES = 100
"""Of each segment, that are proven by themselves."""
MOMENTS = 2000
"""At which it is asked how far the robot is."""
HAND, REACH = "panda_hand", 0.1
"""The link whose way is drawn, and how far (m) the tip of a hand is from its origin."""
ORDER = 3
BLUE, ORANGE = (0.1, 0.3, 0.9), (0.95, 0.45, 0.05)
RED, GREEN = (0.9, 0.0, 0.1), (0.0, 0.75, 0.1)
PADDINGS = np.linspace(0.0, 0.08, 33)
FAR = 0.08
"""Metres: paddings to prove pieces with, and a proven clearance that is green."""


def pieces_of(path: CompositeTrajectory) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends ``(m + 1,)`` of short pieces of a path, and their control points."""
    ends, curves = [path.start_time], []
    for segment in path.segments:
        assert isinstance(segment, BezierCurve)
        rest = segment
        for end in np.linspace(segment.start_time, segment.end_time, PIECES + 1)[1:-1]:
            piece, rest = rest.split(end)
            ends.append(end)
            curves.append(piece.control_points)
        ends.append(segment.end_time)
        curves.append(rest.control_points)
    return np.array(ends), np.array(curves)


def proven_clearances(
    checker: SceneGraphCollisionChecker, curves: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what pieces of a way are proven to keep from all but the robot, m.

    Each is proven with more and more padding; 0 where it is not proven free without any.
    """
    proven = np.zeros(len(curves))
    for padding in PADDINGS:
        checker.set_padding_all_robot_environment_pairs(float(padding))
        for k, measure in enumerate(checker.measure_edges(curves)):
            if measure.completely_free:
                proven[k] = padding + measure.least_clearance
    return proven


def hand_at(checker: SceneGraphCollisionChecker, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where the tip of the hand is, m."""
    X_WH = checker.model.tree.link_poses(q, [HAND])[0]
    return np.asarray(X_WH[:3, 3] + REACH * X_WH[:3, 2])


def draw(
    output: Path,
    path: CompositeTrajectory,
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    checker: SceneGraphCollisionChecker,
    proven: NDArray[np.float64],
    width: int,
) -> None:
    """Write the picture: twice the robot with the way of its hand, and what its colours say.

    ``ends`` are those of the pieces on the path, and when the robot is there, s.
    """
    from common.picture import Camera
    from common.plan_picture import trace_robot
    from PIL import Image, ImageDraw

    camera = Camera(
        eye=(2.1, -1.5, 1.75),
        target=(0.2, 0.22, 0.62),
        field_of_view=38.0,
        width=width,
        height=round(0.85 * width),
    )
    shown = path.value(np.linspace(path.start_time, path.end_time, 5))
    robot = trace_robot(checker, shown, camera)
    tips = np.array([hand_at(checker, q) for q in path.value(ends[0])])
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / np.diff(ends[1])
    both = Image.new("RGB", (2 * width, camera.height))
    for side, (values, most, colors, words) in enumerate(
        (
            (1e3 * proven, 1e3 * FAR, (RED, GREEN), "proven clearance: {:.1f} to {:.0f} mm"),
            (speeds, speeds.max(), (BLUE, ORANGE), "speed of the hand: {:.1f} to {:.1f} m/s"),
        )
    ):
        image = robot.copy()
        pen = ImageDraw.Draw(image)
        for k, value in enumerate(values):
            part = float(np.clip(value / most, 0.0, 1.0))
            color = tuple(
                int(255 * ((1.0 - part) * a + part * b)) for a, b in zip(*colors, strict=True)
            )
            line = [camera.project(tips[j]) for j in (k, k + 1)]
            pen.line(line, fill=color, width=max(2, width // 110))
        said = words.format(values.min(), values.max())
        pen.text((width // 40, width // 40), said, fill=(20, 20, 20), font_size=width // 28)
        both.paste(image, (side * width, 0))
    both.save(output)


def main(arguments: list[str] | None = None) -> int:
    """Plan, grow, solve, prove and draw; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("panda_through_regions.png"))
    parser.add_argument("--width", type=int, default=640, help="of each half, pixels")
    parser.add_argument("--no-picture", action="store_true", help="only print what was found")
    options = parser.parse_args(arguments)
    robots = load_robot_diagram(SCENE)
    padded = SceneGraphCollisionChecker(robots, env_collision_padding=PADDING)
    path = plan_path(padded, START, GOAL, group="arm", timeout=30.0)
    if not path.is_success:
        print(path.reason)
        return 1
    begin = time.perf_counter()
    regions = regions_along(padded, path.configurations, options=IrisZoOptions())
    growing = time.perf_counter() - begin
    limits = MotionLimits.of_tree(robots.tree, accelerations=ACCELERATION)
    checker = SceneGraphCollisionChecker(robots)
    begin = time.perf_counter()
    plan = plan_through_regions(
        [each.region for each in regions],
        START,
        GOAL,
        velocities=limits.velocities,
        order=ORDER,
        checker=checker,
    )
    solving = time.perf_counter() - begin
    if not plan.is_success or plan.trajectory is None:
        print(plan.reason)
        return 1
    print(
        f"{len(regions)} regions in {growing:.1f} s. The fastest way through them, with speeds"
        f" alone, takes {plan.trajectory.end_time:.3f} s, and none is more than"
        f" {plan.result.gap:.1e} s faster; found and proven in {1e3 * solving:.0f} ms."
    )
    way = GcsTrajectoryOptimization.normalize_segment_times(plan.trajectory)
    motion = retime(way.piecewise_polynomial(), limits)
    ends, curves = pieces_of(way)
    moments = np.linspace(0.0, motion.end_time, MOMENTS)
    at = np.interp(ends, motion.time_scaling.value(moments)[:, 0], moments)
    proven = proven_clearances(checker, curves)
    print(
        f"From rest to rest it takes {motion.end_time:.3f} s, and is proven to keep"
        f" {1e3 * proven.min():.1f} mm or more from everything."
    )
    if not options.no_picture:
        draw(options.output, way, (ends, at), checker, proven, options.width)
        print(f"Picture: {options.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

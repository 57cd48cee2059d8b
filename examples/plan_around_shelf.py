"""A Panda's hand goes from one compartment of a shelf into the next: planned, proven, drawn.

    python examples/plan_around_shelf.py --output plan.png
    python examples/plan_around_shelf.py --grasp --output plan_with_box.png

The scene is that of the demo; no node is started. With ``--grasp`` the hand holds a box, which has
to go round the boards, too; it is told how much of the path without it would collide. The picture
shows the robot at the start, at the goal and, as a ghost, on its way, and the way of its hand: red
where something is near, green where the nearest is 10 cm away.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
import time

import numpy as np

from scene_graph_ros.geometry import Box, GeometryInstance, IllustrationProperties, Rgba
from scene_graph_ros.planning import (
    BodyShapeDescription,
    load_robot_diagram,
    Plan,
    plan_path,
    SceneGraphCollisionChecker,
)

ROOT = Path(__file__).resolve().parent.parent
SCENE = ROOT / "config" / "scenes" / "panda_cell.yaml"
START = (1.07, 1.31, 0.81, -1.17, 2.78, 2.67, -1.38, 0.02)
GOAL = (1.37, 0.75, 0.17, -0.51, 2.53, 3.09, -0.12, 0.02)
"""Positions (rad, m) with the hand below and above the middle board."""
PADDING = 0.005
"""Metres that the robot keeps from all else."""
HAND = "panda_hand"
GRASPED, DEPTH = Box(0.05, 0.036, 0.16), 0.14
"""What is between the fingers, and how far (m) before the hand its centre is."""


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="which of many paths")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds to look for one")
    parser.add_argument("--output", type=Path, default=Path("plan.png"), help="the picture")
    parser.add_argument("--grasp", action="store_true", help="have the hand hold a box")
    parser.add_argument("--no-picture", action="store_true", help="only print what was found")
    return parser.parse_args()


def words(plan: Plan, seconds: float) -> str:
    """Return what can be said of a path in one sentence."""
    clearance = 1e3 * (plan.least_clearance + PADDING)
    return (
        f"{len(plan.configurations) - 1} edges of together {plan.length:.2f} rad, proven to keep"
        f" {clearance:.1f} mm from everything, found in {1e3 * seconds:.0f} ms"
        f" among {plan.edges} edges"
    )


def grasp(checker: SceneGraphCollisionChecker) -> None:
    """Add the box to what is checked, and to what is to be seen."""
    X_HB = np.eye(4)
    X_HB[2, 3] = DEPTH
    frame = checker.get_body(HAND)
    names = frame.model_instance_name, frame.body_name
    checker.add_collision_shape("grasp", BodyShapeDescription(GRASPED, X_HB, *names))
    robots = checker.model
    box = GeometryInstance(X_HB, GRASPED, "box")
    looks = IllustrationProperties()
    looks.add_property("phong", "diffuse", Rgba(0.85, 0.3, 0.2))
    box.set_illustration_properties(looks)
    source = robots.context.inspector().get_owning_source_id(frame.frame_id)
    robots.scene_graph.register_geometry(source, frame.frame_id, box, context=robots.context)


def hits(checker: SceneGraphCollisionChecker, plan: Plan) -> str:
    """Return how much of a path is not free any more."""
    ends = plan.configurations
    measures = checker.measure_edges(np.stack([ends[:-1], ends[1:]], axis=1))
    found = [each for each in measures if not each.completely_free]
    inspector = checker.snapshot.inspector
    names = {inspector.get_name(geometry) for each in found for geometry in each.pair or ()}
    return f"{len(found)} of {len(measures)} edges collide: {', '.join(sorted(names))}"


def main() -> int:
    """Run the example; return the exit code."""
    arguments = parse_arguments()
    robots = load_robot_diagram(SCENE)
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=PADDING)
    # Kernels are loaded by a first call, which is not to be measured.
    plan_path(checker, START, START)
    if arguments.grasp:
        alone = plan_path(checker, START, GOAL, group="arm", seed=arguments.seed)
        grasp(checker)
        print(f"With the box in the hand, on the path without it {hits(checker, alone)}")
    begin = time.perf_counter()
    plan = plan_path(
        checker, START, GOAL, group="arm", seed=arguments.seed, timeout=arguments.timeout
    )
    seconds = time.perf_counter() - begin
    if not plan.is_success:
        print(plan.reason)
        return 1
    print(words(plan, seconds))
    np.set_printoptions(precision=2, suppress=True)
    print(plan.configurations)
    if not arguments.no_picture:
        from common.plan_picture import draw_plan

        draw_plan(arguments.output, checker, plan.configurations)
        print(f"Picture: {arguments.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

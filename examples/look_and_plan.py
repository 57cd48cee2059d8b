"""A Panda sees what planning was not told of, plans around it, sees more, and plans again.

    python examples/look_and_plan.py --picture look_and_plan.png

Starts the node on a cell with a carton, a vase and a ball, of which planning knows nothing: they
have no proximity role. The camera at the robot's wrist sees them. Its images of depth fill a cloud
of points, without the robot and without the table, which is known. The action ``plan_path`` finds
a trajectory around what was seen so far, proven against every point. On its way the camera sees
more. Where the trajectory does not hold any more the robot stops and another one is planned from
there. At last the example asks, with a scene that has the things, how near the robot came to them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from demo import isolate, processes, ROOT
import numpy as np
from plan_in_the_world import make_ready, words

if TYPE_CHECKING:
    from common.looking_planner import LookingPlanner
    from common.plan_frames import Frames

SCENE = ROOT / "config" / "scenes" / "panda_looks.yaml"
JOINTS = [*(f"panda_joint{i}" for i in range(1, 8)), "panda_finger_joint1"]
START = (-0.679, 0.427, -0.022, -1.773, 0.011, 2.2, 0.08, 0.0)
"""rad and m: the hand points down, on the right side of the table."""
GOAL = (0.5, 0.42, 0.62)
"""m: where 0.1 m before the hand is to be, on the left side."""
HAND = "panda_hand"
PADDING = 0.01
"""m that the robot keeps from what it saw, beside the points' radii."""
THINGS = ("carton", "vase", "ball")
LONGEST = 1.3
"""m: no point of the robot is farther from a joint's axis, so none moves more per radian."""
SPEED = 0.15
"""Of the joints' velocities: a robot that looks where it goes goes slowly."""
MOST_PLANS = 8
VIEW = {
    "eye": (2.1, -0.9, 1.75),
    "target": (0.45, 0.0, 0.62),
    "field_of_view": 34.0,
    "width": 560,
    "height": 520,
}
"""Of pictures."""


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", type=Path, default=SCENE, help="scene file")
    parser.add_argument("--picture", type=Path, help="a file for what was to be seen (PNG)")
    parser.add_argument("--samples", type=int, default=24, help="rays for each of its pixels")
    parser.add_argument("--speed", type=float, default=SPEED, help="share of joint velocities")
    parser.add_argument("--page", action="store_true", help="serve the page, and say where")
    return parser.parse_args()


def nearest_to_things(scene: Path, moments: list[list[float]]) -> tuple[float, str]:
    """Return the least distance of the robot from the real things, m, and the nearest thing."""
    from scene_graph_ros.geometry import (
        CollisionFilterDeclaration,
        GeometrySet,
        ProximityProperties,
        SceneGraph,
    )
    from scene_graph_ros.planning import RobotDiagram
    from scene_graph_ros.scene_files import load_scene

    graph = SceneGraph()
    loaded = load_scene(scene).apply(graph)
    things, panda = loaded.sources["things"].source_id, loaded.sources["panda"]
    names = {loaded.geometries[f"things/world/{name}"]: name for name in THINGS}
    for geometry in names:
        graph.assign_role(things, geometry, ProximityProperties())
    robot = set(graph.model_inspector().get_geometries_for_source(panda.source_id))
    # Only the robot and the things are asked about.
    others = set(graph.model_inspector().get_all_geometry_ids()) - robot - names.keys()
    without = CollisionFilterDeclaration().exclude_within(GeometrySet(robot))
    without.exclude_between(GeometrySet(robot), GeometrySet(others))
    graph.collision_filter_manager().apply(without)
    tree, frames = RobotDiagram.of_scene(graph, loaded).tree, panda.robot.link_frames
    context = graph.create_default_context()
    query, best, q = graph.query_object(context), (np.inf, ""), np.array(START)
    # Where the robot was when it was measured last, and its distance then.
    measured, distance = q.copy(), -np.inf
    for moment in moments:
        q[: len(moment)] = moment  # the fingers stay where they are
        if distance - LONGEST * np.abs(q - measured).sum() >= best[0]:
            continue  # since then it can't have come nearer than it was before
        measured, distance = q.copy(), 0.3
        X_WL = tree.link_poses(q, list(frames))
        context.set_frame_poses(panda.source_id, dict(zip(frames.values(), X_WL, strict=True)))
        for pair in query.compute_signed_distance_pairwise_closest_points(distance):
            ids = {pair.id_A, pair.id_B}
            if ids & robot and ids & names.keys():
                (thing,) = ids & names.keys()
                distance = min(distance, pair.distance)
                best = min(best, (pair.distance, names[thing]))
    return best


def run(planner: LookingPlanner, arguments: argparse.Namespace, frames: Frames | None) -> int:
    """Look, plan and move until the goal is reached; return the exit code."""
    planner.wait_for_node()
    planner.tell_joints(JOINTS, START)
    planner.wait(lambda: planner.seen, "points that the camera saw")
    planner.look(1.0)
    print(f"The camera sees {planner.seen} points of things that planning was not told of.")
    for attempt in range(1, MOST_PLANS + 1):
        result, goal_id = planner.plan_to(HAND, GOAL, "arm", PADDING)
        print(f"Plan {attempt}: {words(result, PADDING)}.", flush=True)
        if frames is not None and planner.holds_now(goal_id):
            frames.take(planner, f"Plan {attempt}, of {planner.seen} points", stops=False)
        stopped = planner.follow(result, goal_id)
        if not stopped:
            break
        print(f"On the way it sees more, {planner.seen} points by now, and stops: {stopped}.")
    else:
        print(f"The goal was not reached with {MOST_PLANS} plans.")
        return 1
    if frames is not None:
        frames.take(planner, f"There, after {planner.seen} points", stops=False)
    print(f"The hand is at its goal, and {planner.seen} points are seen.")
    return 0


def main() -> int:
    """Run the example; return the exit code."""
    arguments = parse_arguments()
    make_ready("planning", "clouds", "cameras", "sensing")
    isolate()
    from common.looking_planner import LookingPlanner  # after the environment is set

    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={arguments.scene.resolve()}", "--log-level", "warn"),
        *("-p", "shutdown_timeout:=20.0"),
    ]
    if arguments.page:
        node += ["-p", "browser:=true"]
        print("In a browser, while this runs: http://127.0.0.1:8780", flush=True)
    frames = None
    if arguments.picture is not None:
        from common.picture import Camera
        from common.plan_frames import Frames

        frames = Frames(arguments.samples, Camera(**VIEW))
    with processes({"scene graph node": node}) as running:
        planner = LookingPlanner(arguments.speed)
        try:
            code = run(planner, arguments, frames)
        finally:
            planner.close()
    near, thing = nearest_to_things(arguments.scene, planner.moments)
    print(f"On all its way the robot came no nearer than {1e3 * near:.0f} mm to them ({thing}).")
    if frames is not None and not code:
        frames.draw(arguments.picture)
        print(f"Picture: {arguments.picture}")
    return code or int(near <= 0.0) or int(any(p.returncode for p in running.values()))


if __name__ == "__main__":
    sys.exit(main())

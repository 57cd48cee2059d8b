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
from dataclasses import replace
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


class RealThings:
    """The scene with the things that planning does not know; it asks how near the robot came."""

    def __init__(self, scene: Path) -> None:
        from scene_graph_ros.geometry import (
            CollisionFilterDeclaration,
            GeometrySet,
            ProximityProperties,
            SceneGraph,
        )
        from scene_graph_ros.planning import RobotDiagram
        from scene_graph_ros.scene_files import load_scene

        graph, described = SceneGraph(), load_scene(scene)
        # Nobody looks at the robot's links.
        robots = [each.model_copy(update={"visual": False}) for each in described.spec.robots]
        spec = described.spec.model_copy(update={"robots": robots})
        loaded = replace(described, spec=spec).apply(graph)
        things, panda = loaded.sources["things"].source_id, loaded.sources["panda"]
        self.names = {loaded.geometries[f"things/world/{name}"]: name for name in THINGS}
        for geometry in self.names:
            graph.assign_role(things, geometry, ProximityProperties())
        self.robot = set(graph.model_inspector().get_geometries_for_source(panda.source_id))
        # Only the robot and the things are asked about.
        known = self.robot | self.names.keys()
        others = set(graph.model_inspector().get_all_geometry_ids()) - known
        without = CollisionFilterDeclaration().exclude_within(GeometrySet(self.robot))
        without.exclude_between(GeometrySet(self.robot), GeometrySet(others))
        graph.collision_filter_manager().apply(without)
        self.source, self.frames = panda.source_id, panda.robot.link_frames
        self.tree = RobotDiagram.of_scene(graph, loaded).tree
        self.context = graph.create_default_context()
        self.query = graph.query_object(self.context)

    def nearest(self, moments: list[list[float]]) -> tuple[float, str]:
        """Return the least distance of the robot, m, and the nearest thing."""
        best, q = (np.inf, ""), np.array(START)
        # Where the robot was when it was measured last, and its distance then.
        measured, distance = q.copy(), -np.inf
        for moment in moments:
            q[: len(moment)] = moment  # the fingers stay where they are
            if distance - LONGEST * np.abs(q - measured).sum() >= best[0]:
                continue  # since then it can't have come nearer than it was before
            measured, distance = q.copy(), 0.3
            X_WL = self.tree.link_poses(q, list(self.frames))
            poses = dict(zip(self.frames.values(), X_WL, strict=True))
            self.context.set_frame_poses(self.source, poses)
            for pair in self.query.compute_signed_distance_pairwise_closest_points(distance):
                ids = {pair.id_A, pair.id_B}
                if ids & self.robot and ids & self.names.keys():
                    (thing,) = ids & self.names.keys()
                    distance = min(distance, pair.distance)
                    best = min(best, (pair.distance, self.names[thing]))
        return best


def run(planner: LookingPlanner, arguments: argparse.Namespace, frames: Frames | None) -> int:
    """Look, plan and move until the goal is reached; return the exit code."""
    planner.wait_for_node()
    planner.tell_joints(JOINTS, START)
    planner.wait(lambda: planner.seen, "points that the camera saw")
    planner.look(0.3)  # some images
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
    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={arguments.scene.resolve()}", "--log-level", "warn"),
        *("-p", "shutdown_timeout:=20.0"),
    ]
    if arguments.page:
        node += ["-p", "browser:=true"]
        print("In a browser, while this runs: http://127.0.0.1:8780", flush=True)
    frames = None
    with processes({"scene graph node": node}) as running:
        # After the environment is set, and while the node starts.
        from common.looking_planner import LookingPlanner

        if arguments.picture is not None:
            from common.picture import Camera
            from common.plan_frames import Frames

            frames = Frames(arguments.samples, Camera(**VIEW))
        planner = LookingPlanner(arguments.speed)
        try:
            code = run(planner, arguments, frames)
        finally:
            planner.close()
    near, thing = RealThings(arguments.scene).nearest(planner.moments)
    print(f"On all its way the robot came no nearer than {1e3 * near:.0f} mm to them ({thing}).")
    if frames is not None and not code:
        frames.draw(arguments.picture)
        print(f"Picture: {arguments.picture}")
    return code or int(near <= 0.0) or int(any(p.returncode for p in running.values()))


if __name__ == "__main__":
    sys.exit(main())

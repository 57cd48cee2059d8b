"""A Panda with a box in its hand plans in a live world, meets a ball, plans again, and moves.

    python examples/plan_in_the_world.py --picture plan_in_the_world.png

Starts the node on the demo's cell and tells it where the robot's joints are: its hand is in the
lower compartment of the shelf. The hand grasps a box, by the service ``attach_frame``. The action
``plan_path`` finds a trajectory around the board into the compartment above. Then a ball is moved
to where the hand would come by. The node says by itself that the trajectory does not hold any
more, and which two things meet when. The next one leads around the ball, and the robot executes
it: its joint states are what a controller would make of the trajectory, and the world's contacts
tell whether robot or box touched anything. At last it lets go of the box.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import subprocess
import sys
from typing import Any, TYPE_CHECKING

from demo import isolate, processes
from plan_around_shelf import DEPTH, GOAL, GRASPED, HAND, SCENE, START

if TYPE_CHECKING:
    from common.plan_frames import Frames
    from common.world_planner import WorldPlanner

JOINTS = [*(f"panda_joint{i}" for i in range(1, 8)), "panda_finger_joint1"]
FINGERS = ("panda_leftfinger", "panda_rightfinger")
PADDING = 0.005
"""Metres that robot and box keep from all else."""
ACCELERATION = 5.0
"""rad/s^2, of each joint; velocities are those of the URDF."""
BOX, BALL = "box", "ball"


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", type=Path, default=SCENE, help="scene file")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds to look for a path")
    parser.add_argument("--picture", type=Path, help="a file for what was to be seen (PNG)")
    parser.add_argument("--samples", type=int, default=24, help="rays for each of its pixels")
    return parser.parse_args()


def make_ready(*groups: str) -> None:
    """Compile groups of kernels, once: else the node would do it while it is asked."""
    from scene_graph_ros.geometry.compiled.readiness import is_ready

    for group in groups:
        if not is_ready(group):
            subprocess.run([sys.executable, "-m", "scene_graph_ros.warmup", group], check=True)


def words(result: Any, padding: float = PADDING) -> str:
    """Return what can be said of a trajectory in one sentence."""
    edges = len(result.path.positions) // len(result.path.names) - 1
    last = result.trajectory.points[-1].time_from_start
    kept = 1e3 * (result.trajectory_clearance + padding)
    return (
        f"{edges} edge{'' if edges == 1 else 's'} of together {result.length:.2f} rad in"
        f" {last.sec + 1e-9 * last.nanosec:.2f} s, proven to keep {kept:.1f} mm from everything,"
        f" after {1e3 * result.seconds:.0f} ms"
    )


def place(point: Any) -> str:
    """Return coordinates as words."""
    return f"({point.x:.2f}, {point.y:.2f}, {point.z:.2f})"


def goal_request() -> Any:
    """Return what is asked of the action, but for the time that it may take."""
    from scene_graph_msgs.action import PlanPath
    from scene_graph_msgs.msg import RobotConfigurations

    return PlanPath.Goal(
        start=RobotConfigurations(names=JOINTS, positions=list(START)),
        goals=RobotConfigurations(names=JOINTS, positions=list(GOAL)),
        group="arm",
        environment_padding=PADDING,
    )


def put_in_the_way(planner: WorldPlanner) -> Any:
    """Move the ball to the middle of those places on the way that leave start and goal free."""
    from scene_graph_msgs.msg import RobotConfigurations

    way = planner.wait(lambda: planner.way, "the way of the hand")
    ends = RobotConfigurations(names=JOINTS, positions=[*START, *GOAL])
    is_free = planner.leave_free(f"objects/{BALL}", way, ends, PADDING)
    places = [point for point, free in zip(way, is_free, strict=True) if free]
    if not places:
        raise SystemExit("Wherever the ball is on the way, start or goal are not free")
    point = places[len(places) // 2]
    planner.put_object(BALL, point)
    return point


def run(planner: WorldPlanner, seconds: float, frames: Frames | None) -> int:
    """Grasp, plan, block, plan again and move; return the exit code."""
    planner.wait_for_node()
    planner.tell_joints(JOINTS, START)
    size = GRASPED.width, GRASPED.depth, GRASPED.height
    planner.grasp_box(BOX, size, HAND, DEPTH, FINGERS)
    print(f"The hand has grasped a box of {100 * max(size):g} cm.", flush=True)
    goal_id = b""
    for attempt in ("A path", "Another path"):
        result, goal_id = planner.plan(goal_request(), seconds, ACCELERATION)
        if result.status.code or result.failure:
            print(f"No path: {result.status.message}{result.reason}")
            return 1
        print(f"{attempt}: {words(result)}.", flush=True)
        planner.wait_for_holds(goal_id, holds=True)
        print("It holds in the world as it is.")
        if frames is not None:
            frames.take(planner, attempt, stops=False)
        if attempt == "A path":
            point = put_in_the_way(planner)
            print(f"The ball is moved to where the hand would come by, at {place(point)} m.")
            stopped = planner.wait_for_holds(goal_id, holds=False)
            print(f"The path does not hold any more: {stopped.reason}.", flush=True)
            if frames is not None:
                frames.take(planner, "A ball is in its way", stops=True)
    count, pairs = planner.execute(result.trajectory, BOX)
    met = ", ".join(sorted(pairs)) or "nothing"
    print(f"Robot and box have moved along it, in {count} joint states, and touched {met}.")
    print(f"The hand lets go of the box at {place(planner.let_go(BOX))} m.")
    return int(bool(pairs))


def main() -> int:
    """Run the example; return the exit code."""
    arguments = parse_arguments()
    make_ready("planning")
    isolate()
    from common.plan_frames import Frames  # after the environment is set: these start DDS
    from common.world_planner import WorldPlanner

    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={arguments.scene.resolve()}", "--log-level", "warn"),
        *("-p", "shutdown_timeout:=20.0"),  # a busy machine may take its time
    ]
    frames = Frames(arguments.samples) if arguments.picture is not None else None
    with processes({"scene graph node": node}) as running:
        planner = WorldPlanner(with_pictures=frames is not None)
        try:
            code = run(planner, arguments.timeout, frames)
        finally:
            planner.close()
    if frames is not None and not code:
        frames.draw(arguments.picture)
        print(f"Picture: {arguments.picture}")
    return code or int(any(process.returncode for process in running.values()))


if __name__ == "__main__":
    sys.exit(main())

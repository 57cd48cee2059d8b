"""A Panda asks the node for the fastest way through regions, and moves there and back.

    python examples/regions_in_the_world.py --picture regions_in_the_world.png

Starts the node on the demo's cell and tells it where the robot's joints are. A goal of the action
``plan_path`` names the planner "regions": the node looks for a path, grows convex regions along
it, finds the fastest trajectory through these with what none is better than, and proves what a
controller runs. The robot executes it, and the world's contacts tell whether it touched anything.
The way back goes through the same regions, which need not grow again. Markers show the hand's way
from red to green by what is proven to be kept, and above it from blue to orange by its speed.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from demo import isolate, processes
from panda_through_regions import ACCELERATION, GOAL, PADDING, START
from plan_around_shelf import SCENE
from plan_in_the_world import JOINTS, make_ready

if TYPE_CHECKING:
    from common.plan_frames import Frames
    from common.world_planner import WorldPlanner


def request(start: tuple[float, ...], goal: tuple[float, ...], regions: str) -> Any:
    """Return what is asked of the action; without regions they grow along a path."""
    from scene_graph_msgs.action import PlanPath
    from scene_graph_msgs.msg import RegionTrajectoryOptions, RobotConfigurations

    return PlanPath.Goal(
        start=RobotConfigurations(names=JOINTS, positions=list(start)),
        goals=RobotConfigurations(names=JOINTS, positions=list(goal)),
        group="arm",
        planner="regions",
        regions=RegionTrajectoryOptions(text=regions, growth_padding=PADDING, search=True),
    )


def words(result: Any) -> str:
    """Return what can be said of a trajectory."""
    way, last = result.through_regions, result.trajectory.points[-1].time_from_start
    grown = " that grew" if way.grown else ""
    return (
        f"{len(way.regions)} regions{grown}, with speeds alone limited {way.cost:.3f} s, and none"
        f" is more than {way.gap:.1e} s faster; from rest to rest"
        f" {last.sec + 1e-9 * last.nanosec:.3f} s, after {result.seconds:.2f} s"
    )


def run(planner: WorldPlanner, seconds: float, frames: Frames | None) -> int:
    """Plan, move, and plan back; return the exit code."""
    planner.wait_for_node()
    planner.tell_joints(JOINTS, START)
    regions, pairs = "", set()
    for title, ends in (("There", (START, GOAL)), ("And back", (GOAL, START))):
        result, goal_id = planner.plan(request(*ends, regions), seconds, ACCELERATION)
        if result.status.code or result.failure:
            print(f"No trajectory: {result.status.message}{result.reason}")
            return 1
        print(f"{title}: {words(result)}.", flush=True)
        regions = regions or result.through_regions.grown
        planner.wait_for_holds(goal_id, holds=True)
        if frames is not None and title == "There":
            frames.take(planner, "Proven clearance, and speed above it", stops=False)
        count, touched = planner.execute(result.trajectory, "panda")
        pairs |= touched
        met = ", ".join(sorted(touched)) or "nothing"
        print(f"The robot has moved along it, in {count} joint states, and touched {met}.")
    return int(bool(pairs))


def main() -> int:
    """Run the example; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds for each way")
    parser.add_argument("--picture", type=Path, help="a file for what was to be seen (PNG)")
    parser.add_argument("--samples", type=int, default=24, help="rays for each of its pixels")
    arguments = parser.parse_args()
    make_ready("planning", "convex")
    isolate()
    from common.picture import Camera
    from common.plan_frames import Frames  # after the environment is set: these start DDS
    from common.world_planner import WorldPlanner

    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={SCENE.resolve()}", "--log-level", "warn"),
        *("-p", "shutdown_timeout:=20.0"),  # a busy machine may take its time
    ]
    camera = Camera(
        eye=(2.1, -1.5, 1.75), target=(0.2, 0.22, 0.62), field_of_view=38.0, width=720, height=600
    )
    frames = Frames(arguments.samples, camera) if arguments.picture is not None else None
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

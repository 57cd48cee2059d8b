"""A Panda picks a can from the table, carries it over to the other side and lets go of it.

    python examples/pick_and_carry.py --picture pick_and_carry.png

Starts the node on the demo's cell. The can is an object of that scene, whose source says
``claim: first``: the program asks for it, and gets its handle. The arm goes where its fingers
have the can between them, closes them, and has the hand carry the can (``attach_frame``). The can
is 5 mm above the table; so that it may be put down, this pair gets a padding of its own
(``set_padding``). Every motion is planned from where the robot's joint states have it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
from typing import Any

from demo import isolate, processes
from plan_around_shelf import SCENE
from plan_in_the_world import FINGERS, make_ready

ARM = [f"panda_joint{i}" for i in range(1, 8)]
HOME = (0.0, -0.5, 0.0, -2.2, 0.0, 1.7, 0.785)
OPEN, CLOSED = 0.04, 0.035
"""Metres: where a finger is. The can has a radius of 35 mm."""
CAN, TABLE = "objects/can/can", "cell/world/table_top"
THERE = (0.45, 0.4)
"""Where on the table the can is put, metres."""
PADDING = 0.003
"""Metres that everything keeps, but for the can and the table."""


class Task:
    """The user's own part: what the robot is to do, one step after another."""

    def __init__(self, planner: Any, frames: Any) -> None:
        self.planner, self.frames = planner, frames
        self.source = planner.claim("objects")
        self.finger = OPEN
        planner.tell_joints([*ARM, "panda_finger_joint1"], [*HOME, self.finger])

    def run(self) -> None:
        """Pick, carry, place."""
        can = self.where("objects/can")
        self.reach(can.x, can.y, can.z, "To the can")
        self.move_fingers(CLOSED)
        grasp = {"frame": "can", "link": "panda_hand", "touch_links": FINGERS}
        self.planner.ask("AttachFrame", source=self.source, **grasp)
        self.pad(-0.001)
        self.reach(*THERE, can.z, "With the can")
        self.move_fingers(OPEN)
        self.planner.ask("DetachFrame", source=self.source, frame="can")
        self.pad(float("nan"))
        there = self.where("objects/can")
        self.reach(there.x, there.y, there.z + 0.15, "Away")
        print(f"The can is at ({there.x:.3f}, {there.y:.3f}, {there.z:.3f}) m.")

    def reach(self, x: float, y: float, z: float, title: str) -> None:
        """Bring the place between the fingers above a point, and tell what was touched."""
        result = self.planner.reach("panda_hand", (x, y, z + 0.05), "arm", PADDING)
        if self.frames is not None:
            self.frames.take(self.planner, title, stops=False)
        count, pairs = self.planner.execute(result.trajectory, "objects")
        met = ", ".join(sorted(pairs)) or "nothing"
        print(f"{title}: {count} joint states, and touched {met}.", flush=True)

    def move_fingers(self, position: float) -> None:
        """Open or close the hand."""
        self.finger = position
        self.planner.tell_joints(["panda_finger_joint1"], [position])
        self.planner.wait_for_joints()

    def pad(self, padding: float) -> None:
        """Set the padding of can and table, metres; NaN: as all else."""
        pair = {"frames_a": [CAN], "frames_b": [TABLE], "paddings": [padding]}
        self.planner.ask("SetPadding", source=self.source, **pair)

    def where(self, frame: str) -> Any:
        """Return the position of a frame in the world."""
        return self.planner.ask("GetPoseInWorld", frames=[frame]).poses[0].position


def main() -> int:
    """Run the example; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, help="a file for what was to be seen (PNG)")
    parser.add_argument("--samples", type=int, default=24, help="rays for each of its pixels")
    arguments = parser.parse_args()
    make_ready("planning")
    isolate()
    from common.picture import Camera
    from common.plan_frames import Frames  # after the environment is set: these start DDS
    from common.world_planner import WorldPlanner

    camera = Camera(
        eye=(1.9, -1.3, 1.5), target=(0.35, 0.1, 0.6), field_of_view=38.0, width=560, height=560
    )
    frames = Frames(arguments.samples, camera) if arguments.picture is not None else None
    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args", "-p", f"scene:={SCENE}"),
        *("--log-level", "warn", "-p", "shutdown_timeout:=20.0"),
    ]
    with processes({"scene graph node": node}) as running:
        planner = WorldPlanner(with_pictures=frames is not None)
        try:
            planner.wait_for_node()
            Task(planner, frames).run()
        finally:
            planner.close()
    if frames is not None:
        frames.draw(arguments.picture)
        print(f"Picture: {arguments.picture}")
    return int(any(process.returncode for process in running.values()))


if __name__ == "__main__":
    sys.exit(main())

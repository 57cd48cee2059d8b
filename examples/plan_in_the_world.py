"""A Panda plans in a live world, a ball is put in its way, and it plans again.

    python examples/plan_in_the_world.py

Starts the node on the demo's cell, tells it where the robot's joints are, and asks its action
``plan_path`` for a path over the table. Then a ball is put where the tool would come by. The node
says by itself that the path does not hold any more, and which two things meet where. The next one
leads around.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
import subprocess
import sys
import time
from typing import Any

from demo import DISCOVERY_SECONDS, isolate, processes, ROOT

SCENE = ROOT / "config" / "scenes" / "panda_cell.yaml"
ARM = [f"panda_joint{i}" for i in range(1, 8)]
START = (-0.7, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8)
GOAL = (0.7, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8)
"""Positions (rad) with the hand over the right and the left half of the table."""
PADDING = 0.01
"""Metres that the robot keeps from all else."""


def make_ready() -> None:
    """Compile the kernels of planning, once: else the node would do it while it is asked."""
    from scene_graph_ros.geometry.compiled.readiness import is_ready

    if not is_ready("planning"):
        subprocess.run([sys.executable, "-m", "scene_graph_ros.warmup", "planning"], check=True)


class Planner:
    """Talks to the node."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.action import ActionClient
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from sensor_msgs.msg import JointState, MultiDOFJointState
        from visualization_msgs.msg import MarkerArray

        from scene_graph_msgs.action import PlanPath
        from scene_graph_msgs.msg import PlanHolds

        rclpy.init()
        self.node = rclpy.create_node("planner")
        self.joints = self.node.create_publisher(JointState, "joint_states", 10)
        self.objects = self.node.create_publisher(MultiDOFJointState, "objects/poses", 10)
        self.action = ActionClient(self.node, PlanPath, "/scene_graph/plan_path")
        self.holds: list[Any] = []
        self.way: list[Any] = []
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic, take in (
            (PlanHolds, "plan_holds", self.holds.append),
            (MarkerArray, "markers/plan", self._take_way),
        ):
            self.node.create_subscription(kind, f"/scene_graph/{topic}", take, kept)

    def _take_way(self, message: Any) -> None:
        for marker in message.markers:
            if marker.ns == "plan/way" and marker.points:
                self.way = marker.points

    def wait(self, condition: Callable[[], Any], what: str) -> Any:
        """Take messages until a condition is met, and return what it says."""
        import rclpy

        end = time.monotonic() + DISCOVERY_SECONDS
        while not (value := condition()):
            rclpy.spin_once(self.node, timeout_sec=0.1)
            if time.monotonic() > end:
                raise SystemExit(f"{what} did not come within {DISCOVERY_SECONDS:g} s")
        return value

    def wait_for_node(self) -> None:
        """Wait until the node offers the action, and listens to both robot and objects."""

        def is_there() -> bool:
            heard = (p.get_subscription_count() for p in (self.joints, self.objects))
            return self.action.server_is_ready() and all(heard)

        self.wait(is_there, "the node")

    def tell_joints(self) -> None:
        """Say where the arm is."""
        from sensor_msgs.msg import JointState

        message = JointState(name=ARM, position=list(START))
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.joints.publish(message)

    def put_ball(self, point: Any) -> None:
        """Put the ball somewhere, as a tracker of objects would tell."""
        from geometry_msgs.msg import Quaternion, Transform, Vector3
        from sensor_msgs.msg import MultiDOFJointState

        place = Vector3(x=point.x, y=point.y, z=point.z)
        pose = Transform(translation=place, rotation=Quaternion(w=1.0))
        message = MultiDOFJointState(joint_names=["ball"], transforms=[pose])
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.objects.publish(message)

    def plan(self, seconds: float) -> tuple[Any, bytes]:
        """Ask for a path; return the result and the goal's id."""
        from rclpy.duration import Duration

        from scene_graph_msgs.action import PlanPath
        from scene_graph_msgs.msg import RobotConfigurations

        goal = PlanPath.Goal(
            start=RobotConfigurations(names=ARM, positions=list(START)),
            goals=RobotConfigurations(names=ARM, positions=list(GOAL)),
            group="arm",
            environment_padding=PADDING,
            timeout=Duration(seconds=seconds).to_msg(),
        )
        sent = self.action.send_goal_async(goal)
        handle = self.wait(lambda: sent.done() and sent.result(), "the goal's acceptance")
        future = handle.get_result_async()
        answer = self.wait(lambda: future.done() and future.result(), "the result")
        return answer.result, bytes(handle.goal_id.uuid)

    def wait_for_holds(self, goal_id: bytes, *, holds: bool) -> Any:
        """Wait until the node says of a path that it holds, or that it does not."""

        def newest() -> Any:
            said = [m for m in self.holds if bytes(m.goal_id.uuid) == goal_id]
            return said[-1] if said and said[-1].holds == holds else None

        return self.wait(newest, "whether the path holds")

    def close(self) -> None:
        """End."""
        import rclpy

        self.action.destroy()
        self.node.destroy_node()
        rclpy.shutdown()


def words(result: Any) -> str:
    """Return what can be said of a path in one sentence."""
    edges = len(result.path.positions) // len(result.path.names) - 1
    return (
        f"{edges} edge{'' if edges == 1 else 's'} of together {result.length:.2f} rad, proven to"
        f" keep {1e3 * (result.least_clearance + PADDING):.1f} mm from everything, after"
        f" {1e3 * result.seconds:.0f} ms"
    )


def run(planner: Planner, seconds: float) -> int:
    """Plan, block and plan again; return the exit code."""
    planner.wait_for_node()
    planner.tell_joints()
    goal_id = b""
    for attempt in ("A path", "Another path"):
        result, goal_id = planner.plan(seconds)
        if result.status.code or result.failure:
            print(f"No path: {result.status.message}{result.reason}")
            return 1
        print(f"{attempt}: {words(result)}.", flush=True)
        planner.wait_for_holds(goal_id, holds=True)
        print("It holds in the world as it is.")
        if attempt == "A path":
            way = planner.wait(lambda: planner.way, "the way of the tool")
            point = way[len(way) // 2]
            planner.put_ball(point)
            place = f"({point.x:.2f}, {point.y:.2f}, {point.z:.2f})"
            print(f"The ball is put where the tool would come by, at {place} m.")
            stopped = planner.wait_for_holds(goal_id, holds=False)
            print(f"The path does not hold any more: {stopped.reason}.", flush=True)
    return 0


def main() -> int:
    """Run the example; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", type=Path, default=SCENE, help="scene file")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds to look for a path")
    arguments = parser.parse_args()
    make_ready()
    isolate()
    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={arguments.scene.resolve()}", "--log-level", "warn"),
        *("-p", "shutdown_timeout:=20.0"),  # a busy machine may take its time
    ]
    with processes({"scene graph node": node}) as running:
        planner = Planner()
        try:
            code = run(planner, arguments.timeout)
        finally:
            planner.close()
    return code or int(any(process.returncode for process in running.values()))


if __name__ == "__main__":
    sys.exit(main())

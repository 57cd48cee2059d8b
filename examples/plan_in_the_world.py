"""A Panda plans in a live world, a ball is put in its way, it plans again, and moves.

    python examples/plan_in_the_world.py

Starts the node on the demo's cell, tells it where the robot's joints are, and asks its action
``plan_path`` for a trajectory over the table. Then a ball is put where the tool would come by. The
node says by itself that it does not hold any more, and which two things meet when. The next one
leads around, and the robot executes it: its joint states are what a controller would make of the
trajectory, and the world's contacts tell whether it touched anything.
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
ACCELERATION = 5.0
"""rad/s^2, of each joint; velocities are those of the URDF."""
RATE = 100.0
"""Joint states per second."""


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
        from scene_graph_msgs.msg import ContactArray, PlanHolds

        rclpy.init()
        self.node = rclpy.create_node("planner")
        self.joints = self.node.create_publisher(JointState, "joint_states", 10)
        self.objects = self.node.create_publisher(MultiDOFJointState, "objects/poses", 10)
        self.action = ActionClient(self.node, PlanPath, "/scene_graph/plan_path")
        self.holds: list[Any] = []
        self.way: list[Any] = []
        self.contacts: list[Any] = []
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic, take in (
            (PlanHolds, "plan_holds", self.holds.append),
            (MarkerArray, "markers/plan", self._take_way),
        ):
            self.node.create_subscription(kind, f"/scene_graph/{topic}", take, kept)
        self.node.create_subscription(
            ContactArray, "/scene_graph/contacts", self.contacts.append, 100
        )

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

    def tell_joints(self, names: list[str], positions: list[float]) -> None:
        """Say where joints are."""
        from sensor_msgs.msg import JointState

        message = JointState(name=names, position=positions)
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
        from scene_graph_msgs.msg import MotionLimits, RobotConfigurations

        goal = PlanPath.Goal(
            start=RobotConfigurations(names=ARM, positions=list(START)),
            goals=RobotConfigurations(names=ARM, positions=list(GOAL)),
            group="arm",
            environment_padding=PADDING,
            timeout=Duration(seconds=seconds).to_msg(),
            with_trajectory=True,
            limits=MotionLimits(max_acceleration=ACCELERATION),
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

    def execute(self, message: Any) -> tuple[int, set[str]]:
        """Move as a controller would; return how many joint states, and whom the robot touched."""
        import rclpy

        from msg_adapters.trajectories import joint_trajectory_from_msg

        names, points = joint_trajectory_from_msg(message)
        trajectory = points.trajectory()
        self.contacts.clear()
        self.wait(lambda: self.contacts, "contacts")
        before, _ = touched(self.contacts)
        count, begin = 0, time.monotonic()
        while (seconds := count / RATE) < trajectory.duration + 1.0 / RATE:
            rclpy.spin_once(self.node, timeout_sec=0.0)
            if time.monotonic() - begin >= seconds:
                self.tell_joints(list(names), trajectory.value(seconds).tolist())
                count += 1
        last = self.node.get_clock().now().nanoseconds
        goal = trajectory.value(trajectory.end_time).tolist()
        self.tell_joints(list(names), goal)
        self.wait(lambda: touched(self.contacts)[1] >= last, "the contacts at the goal")
        return count, touched(self.contacts)[0] - before

    def close(self) -> None:
        """End."""
        import rclpy

        self.action.destroy()
        self.node.destroy_node()
        rclpy.shutdown()


def touched(messages: list[Any]) -> tuple[set[str], int]:
    """Return the pairs in contact that the robot is in, and the newest stamp, ns."""
    pairs, stamp = set(), 0
    for message in messages:
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        for point in message.points:
            both = point.geometry_a, point.geometry_b
            if any(each.source == "panda" for each in both):
                pairs.add(" and ".join(f"{each.frame}/{each.name}" for each in both))
    return pairs, stamp


def words(result: Any) -> str:
    """Return what can be said of a trajectory in one sentence."""
    edges = len(result.path.positions) // len(result.path.names) - 1
    last = result.trajectory.points[-1].time_from_start
    kept = 1e3 * (result.trajectory_clearance + PADDING)
    return (
        f"{edges} edge{'' if edges == 1 else 's'} of together {result.length:.2f} rad in"
        f" {last.sec + 1e-9 * last.nanosec:.2f} s, proven to keep {kept:.1f} mm from everything,"
        f" after {1e3 * result.seconds:.0f} ms"
    )


def run(planner: Planner, seconds: float) -> int:
    """Plan, block, plan again and move; return the exit code."""
    planner.wait_for_node()
    planner.tell_joints(ARM, list(START))
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
    count, pairs = planner.execute(result.trajectory)
    met = ", ".join(sorted(pairs)) or "nothing"
    print(f"The robot has moved along it, in {count} joint states, and touched {met}.")
    return int(bool(pairs))


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

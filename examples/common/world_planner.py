"""A client of the node: tells it joints and objects, has it grasp, and asks for paths."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import time
from typing import Any

from demo import DISCOVERY_SECONDS
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
import rclpy
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState, MultiDOFJointState
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs import srv
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import (
    ContactArray,
    FrameDescription,
    GeometryDescription,
    MotionLimits,
    PlanHolds,
    PoseGoal,
    Property,
    QueryOptions,
    RobotConfigurations,
    RoleProperties,
    Shape,
    WhatIf,
)

NODE = "/scene_graph"
ROBOT, HAND = "panda", "panda_hand"
RATE = 100.0
"""Joint states per second."""
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class WorldPlanner:
    """Talks to the node; what it can't do ends the program with the node's reason."""

    def __init__(self, *, with_pictures: bool, with_contacts: bool = True) -> None:
        """Listen to plans, and to what is to be seen and to contacts where they are wanted.

        The node computes what somebody listens to.
        """
        rclpy.init()
        self.node = rclpy.create_node("planner")
        self.joints = self.node.create_publisher(JointState, "joint_states", 10)
        self.objects = self.node.create_publisher(MultiDOFJointState, "objects/poses", 10)
        self.action = ActionClient(self.node, PlanPath, f"{NODE}/plan_path")
        self.holds: list[PlanHolds] = []
        self.way: list[Point] = []
        self.contacts: list[ContactArray] = []
        self.markers: dict[tuple[str, int], Marker] = {}
        """What is to be seen, where pictures are wanted: of the path, and of the world."""
        self._sources: dict[str, Any] = {}
        self._positions: dict[str, float] = {}
        self.node.create_timer(0.1, self._tell)  # as a robot's driver does: a plan begins there
        subscribe = self.node.create_subscription
        subscribe(PlanHolds, f"{NODE}/plan_holds", self.holds.append, KEPT)
        subscribe(MarkerArray, f"{NODE}/markers/plan", self._take_markers, KEPT)
        if with_contacts:
            subscribe(ContactArray, f"{NODE}/contacts", self.contacts.append, 100)
        if with_pictures:
            subscribe(MarkerArray, f"{NODE}/markers/illustration", self._take_markers, KEPT)

    def close(self) -> None:
        """End."""
        self.action.destroy()
        self.node.destroy_node()
        rclpy.shutdown()

    def _take_markers(self, message: MarkerArray) -> None:
        for marker in message.markers:
            if marker.action == Marker.ADD:
                self.markers[marker.ns, marker.id] = marker
            elif marker.action == Marker.DELETE:
                self.markers.pop((marker.ns, marker.id), None)
            else:
                self.markers.clear()
            if marker.ns == "plan/way" and marker.points:
                self.way = list(marker.points)

    def wait(self, condition: Callable[[], Any], what: str) -> Any:
        """Take messages until a condition is met, and return what it says."""
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

    def ask(self, service: str, **fields: Any) -> Any:
        """Call a service and return its answer."""
        kind = getattr(srv, service)
        name = "".join(f"_{c.lower()}" if c.isupper() else c for c in service).removeprefix("_")
        client = self.node.create_client(kind, f"{NODE}/{name}")
        self.wait(client.service_is_ready, name)
        future = client.call_async(kind.Request(**fields))
        answer = self.wait(lambda: future.done() and future.result(), f"an answer of {name}")
        self.node.destroy_client(client)
        if answer.status.code:
            raise SystemExit(f"{name}: {answer.status.message}")
        return answer

    def tell_joints(self, names: Sequence[str], positions: Sequence[float]) -> None:
        """Publish positions of joints, now and again until there are others."""
        self._positions.update(zip(names, positions, strict=True))
        self._tell()

    def _tell(self) -> None:
        if not self._positions:
            return
        names, positions = list(self._positions), list(self._positions.values())
        message = JointState(name=names, position=positions)
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.joints.publish(message)

    def wait_for_joints(self) -> None:
        """Wait until the node has the joints where they were told to be by now."""
        options = QueryOptions(
            minimal_stamp=self.node.get_clock().now().to_msg(),
            minimal_stamp_sources=[f"{ROBOT}/{joint}" for joint in self._positions],
            timeout=Duration(seconds=5.0).to_msg(),
        )
        self.ask("GetPoseInWorld", frames=[f"{ROBOT}/{HAND}"], options=options)

    def claim(self, source: str) -> Any:
        """Return the handle of a source of the scene that says claim: first."""
        return self.ask("RegisterSource", name=source).source

    def put_object(self, name: str, point: Point) -> None:
        """Put an object somewhere, as a tracker of objects would tell."""
        place = Vector3(x=point.x, y=point.y, z=point.z)
        pose = Transform(translation=place, rotation=Quaternion(w=1.0))
        message = MultiDOFJointState(joint_names=[name], transforms=[pose])
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.objects.publish(message)

    def grasp_box(
        self, name: str, size: Sequence[float], link: str, depth: float, fingers: Iterable[str]
    ) -> None:
        """Register a box, and have a link carry it ``depth`` (m) before itself."""
        source = self.ask("RegisterSource", name=name).source
        self._sources[name] = source
        self.ask("RegisterFrame", source=source, frames=[FrameDescription(name=name)])
        red = Property(group="phong", name="diffuse", type=Property.RGBA)
        red.doubles = [0.85, 0.3, 0.2, 1.0]
        box = GeometryDescription(
            name=name,
            shape=Shape(kind=Shape.BOX, dimensions=list(size)),
            pose=Pose(orientation=Quaternion(w=1.0)),
            roles=[
                RoleProperties(role=RoleProperties.PROXIMITY),
                RoleProperties(role=RoleProperties.ILLUSTRATION, properties=[red]),
            ],
        )
        self.ask("RegisterGeometry", source=source, frame=name, geometries=[box])
        held = Pose(position=Point(z=depth), orientation=Quaternion(w=1.0))
        touch = list(fingers)
        grasp = {"link": link, "touch_links": touch, "with_pose": True, "pose": held}
        self.ask("AttachFrame", source=source, frame=name, **grasp)

    def let_go(self, name: str) -> Point:
        """Have the link let go of what it carries; return where that stays."""
        return self.ask("DetachFrame", source=self._sources[name], frame=name).pose.position

    def leave_free(
        self, name: str, points: Sequence[Point], q: RobotConfigurations, padding: float
    ) -> list[bool]:
        """Tell for each point whether all rows of q are free when an object is there."""
        poses = [float(v) for p in points for v in (p.x, p.y, p.z, 0.0, 0.0, 0.0, 1.0)]
        options = QueryOptions(what_if=WhatIf(frames=[name], poses=poses))
        fields = {"options": options, "configurations": q, "environment_padding": padding}
        outcomes = self.ask("CheckConfigurations", **fields).outcomes
        rows = len(outcomes) // len(points)
        free = srv.CheckConfigurations.Response.FREE
        return [
            all(o == free for o in outcomes[k : k + rows]) for k in range(0, len(outcomes), rows)
        ]

    def plan(
        self, goal: PlanPath.Goal, seconds: float, acceleration: float, speed: float = 1.0
    ) -> tuple[Any, bytes]:
        """Ask for a path and a trajectory along it; return the result and the goal's id.

        ``speed`` is the part of the joints' velocities that is used. It begins where the joints
        were told to be: topics and goals come in any order.
        """
        self.wait_for_joints()
        goal.timeout = Duration(seconds=seconds).to_msg()
        goal.with_trajectory = True
        goal.limits = MotionLimits(max_acceleration=acceleration, velocity_scaling=speed)
        sent = self.action.send_goal_async(goal)
        handle = self.wait(lambda: sent.done() and sent.result(), "the goal's acceptance")
        future = handle.get_result_async()
        answer = self.wait(lambda: future.done() and future.result(), "the result")
        return answer.result, bytes(handle.goal_id.uuid)

    def reach(self, link: str, point: Sequence[float], group: str, padding: float) -> Any:
        """Plan a trajectory that brings what is 0.1 m before a link, pointing down, to a point."""
        result, goal_id = self.plan(pointing_down(link, point, group, padding), 60.0, 5.0)
        if result.status.code or result.failure:
            raise SystemExit(f"no plan: {result.status.message}{result.reason}")
        self.wait_for_holds(goal_id, holds=True)
        return result

    def wait_for_holds(self, goal_id: bytes, *, holds: bool) -> PlanHolds:
        """Wait until the node says of a path that it holds, or that it does not."""

        def newest() -> Any:
            said = [m for m in self.holds if bytes(m.goal_id.uuid) == goal_id]
            return said[-1] if said and said[-1].holds == holds else None

        return self.wait(newest, "whether the path holds")

    def execute(self, message: Any, carried: str) -> tuple[int, set[str]]:
        """Move as a controller would; return how many joint states, and what touched what."""
        names, points = joint_trajectory_from_msg(message)
        trajectory = points.trajectory()
        self.contacts.clear()
        self.wait(lambda: self.contacts, "contacts")
        movers = (ROBOT, carried)
        before, _ = touched(self.contacts, movers)
        count, begin = 0, time.monotonic()
        while (seconds := count / RATE) < trajectory.duration + 1.0 / RATE:
            rclpy.spin_once(self.node, timeout_sec=max(begin + seconds - time.monotonic(), 0.0))
            if time.monotonic() >= begin + seconds:
                self.tell_joints(names, trajectory.value(seconds).tolist())
                count += 1
        last = self.node.get_clock().now().nanoseconds
        self.tell_joints(names, trajectory.value(trajectory.end_time).tolist())
        self.wait(lambda: touched(self.contacts, movers)[1] >= last, "the contacts at the goal")
        return count, touched(self.contacts, movers)[0] - before


def pointing_down(link: str, point: Sequence[float], group: str, padding: float) -> PlanPath.Goal:
    """Return a request for a path that ends with what is 0.1 m before a link at a point."""
    x, y, z = point
    pose = Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=1.0, w=0.0))
    tool = Pose(position=Point(z=0.1), orientation=Quaternion(w=1.0))
    return PlanPath.Goal(
        pose_goals=[PoseGoal(link=link, tool=tool, pose=pose)],
        group=group,
        environment_padding=padding,
    )


def touched(messages: Sequence[Any], sources: Sequence[str]) -> tuple[set[str], int]:
    """Return the pairs in contact that are of some sources, and the newest stamp, ns."""
    pairs, stamp = set(), 0
    for message in messages:
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        for point in message.points:
            both = point.geometry_a, point.geometry_b
            if any(each.source in sources for each in both):
                pairs.add(" and ".join(f"{each.frame}/{each.name}" for each in both))
    return pairs, stamp

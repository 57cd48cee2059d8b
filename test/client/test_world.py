"""The client of the node: what a script asks, tells and is told, with a real node."""

import threading

import numpy as np
import pytest
import rclpy
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from scene_graph_msgs.msg import LinkConstraint
from scene_graph_ros import planning
from scene_graph_ros.client import box, World, WorldError


def test_objects_move_and_touch(world):
    """The first pose is not lost; contacts have names, the deepest first; distances are right."""
    world.move("objects", {"ball": (0.0, 1.9, 0.0)})
    # The ball's centre is 0.05 before the wall's face, so it is 0.05 deep.
    world.connection.wait(lambda: len(world.contacts()), "the contact")
    (contact,) = world.contacts()
    assert {contact.A, contact.B} == {"objects/ball/ball", "cell/world/wall"}
    assert contact.depth == pytest.approx(0.05, abs=1e-9)
    assert "objects/ball/ball" in str(world.contacts())
    assert world.has_collisions()
    assert not world.has_collisions({"objects/ball": (0, 0, 3)})
    (far,) = world.distances(10.0, {"objects/ball": (0, 1.0, 0)})[:1]
    assert far.distance == pytest.approx(far.distance)
    assert world.distance("ball", "wall").distance == pytest.approx(-0.05, abs=1e-9)
    assert world.pose("objects/ball")[:3, 3].tolist() == [0.0, 1.9, 0.0]
    assert world.pose("wall")[:3, 3].tolist() == [0.0, 2.0, 0.0]
    world.move("objects", {"ball": (0.0, 0.0, 3.0)})
    world.connection.wait(lambda: not len(world.contacts()), "the end of the contact")


def test_tables_name_what_is_there(world):
    """Geometries with where they are, and sources with their topics."""
    table = world.geometries()
    rows = {row.name: row for row in table if row.source == "cell"}
    assert (rows["wall"].x, rows["wall"].y, rows["wall"].frame) == (0.0, 2.0, "world")
    assert world.sources()["objects"] == "/lab/objects/poses"
    assert list(table.to_pandas(["name", "y"]).columns) == ["name", "y"]


class Controller:
    """Takes trajectories and goes where they end at once, as fast robots do in simulation."""

    def __init__(self, world):
        self.node = world.connection.node
        self.states = self.node.create_publisher(JointState, "joint_states", 10)
        self.moves = True
        self.messages = []
        self.node.create_subscription(JointTrajectory, "trajectory", self.take, 10)
        self.at = {"shoulder": 0.0, "elbow": 0.0}

    def take(self, message):
        self.messages.append(message)
        if self.moves:
            self.at.update(zip(message.joint_names, message.points[-1].positions, strict=True))
        self.tell()

    def tell(self):
        stamp = self.node.get_clock().now().to_msg()
        message = JointState(name=list(self.at), position=list(self.at.values()))
        message.header.stamp = stamp
        self.states.publish(message)


def test_a_plan_is_found_and_executed(world):
    """From joint states to a path, its trajectory, and the robot's arrival."""
    controller = Controller(world)
    world.move_joints(controller.at)
    said = []
    plan = world.plan({"shoulder": 1.0, "elbow": -0.5}, watch=lambda *what: said.append(what))
    assert plan.is_success, plan.reason
    assert plan.names == ("arm/shoulder", "arm/elbow")
    assert plan.path[-1].tolist() == pytest.approx([1.0, -0.5])
    assert plan.duration > 0.0
    execution = world.execute(plan, "trajectory")
    shares = []
    execution.wait(watch=shares.append)
    assert execution.progress == 1.0
    assert controller.at == pytest.approx({"shoulder": 1.0, "elbow": -0.5})
    assert shares == sorted(shares)
    execution.close()
    # One that stays where it is is named; and one that is stopped is told where to hold.
    controller.moves = False
    end = np.array([np.cos(1.0), np.sin(1.0)])
    world.connection.wait(
        lambda: np.allclose(world.pose("arm/upper")[:2, 0], end, atol=1e-9), "the arm's report"
    )
    back = world.plan({"shoulder": 0.0, "elbow": 0.0})
    waiting = world.execute(back, "trajectory")
    # It tells its joints when it has the trajectory, and stays.
    world.connection.wait(lambda: max(waiting.distances.values()) < 2.0, "the joints")
    with pytest.raises(WorldError, match=r"joint 'shoulder' is 1 from its end, and may be 0.01"):
        waiting.wait(timeout=0.0)
    waiting.stop()
    waiting.wait()
    world.connection.wait(lambda: len(controller.messages) == 3, "the trajectory that holds")
    (point,) = controller.messages[-1].points
    assert list(point.positions) == pytest.approx([1.0, -0.5])
    assert list(point.velocities) == [0.0, 0.0]


def test_what_has_no_plan_says_why(world):
    """The wall is in the way of a straight arm: the pair and how deep."""
    world.move_joints({"shoulder": 0.0, "elbow": 0.0})
    world.source("block").add_geometry("block", box(0.2, 0.2, 1.0), (0.0, 0.9, 0.0))
    plan = world.plan({"shoulder": np.pi / 2, "elbow": 0.0})
    assert not plan.is_success
    assert "block/world/block" in plan.reason
    assert "reason=" in repr(plan)
    with pytest.raises(WorldError, match="no trajectory to execute"):
        world.execute(plan, "trajectory")
    with pytest.raises(WorldError, match=r"UNKNOWN_NAME.*'wrist'"):
        world.plan({"wrist": 1.0})
    with pytest.raises(ValueError, match="give goal"):
        world.plan()


def test_a_plan_holds_constraints(world):
    """The lower link stays in a box on all edges; one that the goal violates is named."""

    def planned(*constraints):
        while True:  # A node that is slow to load its planning takes the report for an old one.
            world.move_joints({"shoulder": 0.0, "elbow": 0.0})
            try:
                return world.plan(goal, constraints=constraints)
            except WorldError as error:
                if error.code != "STALE":
                    raise

    goal = {"shoulder": 0.6, "elbow": -1.2}
    wide = planning.PositionConstraint("lower", [-9.0, -1.0, -1.0], [9.0, 1.0, 1.0])
    level = planning.AngleBetweenVectorsConstraint("lower", [0, 0, 1], [0, 0, 1], 0.1)
    turned = planning.OrientationConstraint("lower", np.eye(3), 1.0)
    plan = planned(wide, level, turned)
    assert plan.is_success, plan.reason
    never = planned(planning.OrientationConstraint("lower", np.eye(3), 0.3))
    assert not never.is_success
    assert "constraint 0 (OrientationConstraint on 'arm/lower')" in never.reason
    one = LinkConstraint(type=LinkConstraint.ORIENTATION, link="lower", theta_bound=0.3)
    one.orientation.w = one.tool.w = 1.0
    assert planned(one).reason == never.reason
    with pytest.raises(ValueError, match=r"constraints must be .*PositionConstraint.*, not str"):
        planned("level")


def test_positions_that_the_node_does_not_take_are_told(world):
    """Joints that there are not, and positions that are none."""
    with pytest.raises(WorldError, match=r"UNKNOWN_NAME.*'arm/wrist'"):
        world.move_joints({"wrist": 1.0})
    with pytest.raises(WorldError, match="the scene has arm"):
        world.move_joints({"shoulder": 1.0}, robot="leg")
    world.connection.timeout, before = 0.5, world.connection.timeout
    with pytest.raises(WorldError, match=r"STALE.*'arm/shoulder'"):
        world.move_joints({"shoulder": float("nan")})
    world.connection.timeout = before


def test_what_is_grasped_moves_along(world):
    """A link carries a frame of a source of this program's, until it lets go."""
    world.move_joints({"shoulder": 0.0, "elbow": 0.0})
    source = world.source("hand")
    source.add_frame("cup", (1.2, 0.0, 0.0))
    source.add_geometry("cup", box(0.05, 0.05, 0.05), frame="cup", color=(0, 0, 1))
    X_LF = source.attach("cup", "lower", (0.55, 0.0, 0.0))
    assert X_LF[:3, 3].tolist() == [0.55, 0.0, 0.0]
    world.move_joints({"shoulder": np.pi / 2, "elbow": 0.0})
    assert np.allclose(world.pose("hand/cup")[:3, 3], (0.0, 1.15, 0.0), atol=1e-9)
    assert np.allclose(source.detach("cup")[:3, 3], (0.0, 1.15, 0.0), atol=1e-9)
    with pytest.raises(WorldError, match=r"NAME_CONFLICT.*Remedy") as caught:
        world.source("hand")
    assert caught.value.code == "NAME_CONFLICT"
    source.remove()


def test_pictures_are_arrays(world):
    """The ball is red in the middle of what the camera above sees, 2.9 m away."""
    world.move("objects", {"ball": (0.0, 0.0, 3.0)})
    color, depth = world.picture("above"), world.picture("above", "depth")
    assert (color.shape, color.dtype, depth.shape) == ((30, 40, 3), np.uint8, (30, 40))
    red, green, blue = color[15, 20].tolist()
    assert red > 100 > max(green, blue)
    # The pixel's ray is half a pixel off the axis: the ball's surface is a little farther there.
    assert 2.9 < depth[15, 20] < 2.95
    with pytest.raises(WorldError, match="'below'"):
        world.picture("below")


def test_calls_inside_of_callbacks_do_not_deadlock(cell):
    """A program's own node gives context and namespace; its executor may be the one that calls."""
    context = rclpy.context.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("script", namespace="/lab", context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    world, answers, done = World(node, name="geometry", timeout=60.0), [], threading.Event()

    def ask():
        answers.append(world.has_collisions())
        done.set()

    node.create_timer(0.01, ask)
    while not done.is_set():
        executor.spin_once(timeout_sec=1.0)
    assert answers
    world.close()
    executor.shutdown()
    node.destroy_node()
    assert context.ok()
    context.shutdown()


def test_who_is_not_there_is_named_with_who_is(cell):
    """The node's name, the domain and the nodes that there are."""
    with World(name="geometry", namespace="/lab", timeout=60.0) as there:
        there.wait_until_ready()
    with World(timeout=5.0) as world:
        world.connection.wait(
            lambda: "/lab/geometry" in world.connection.absence(0.0), "the other node", 60.0
        )
        with pytest.raises(
            WorldError, match=r"no node /scene_graph .*there is /lab/geometry.*Rem"
        ):
            world.wait_until_ready(timeout=0.0)


def test_an_answer_that_is_faster_than_the_question_counts(world, monkeypatch):
    """A goal that is accepted before rclpy has noted that it was sent is not lost."""
    from rclpy.action import client as action_client

    world.move_joints({"shoulder": 0.0, "elbow": 0.0})
    planner = world._planner
    action = planner._ready_action()
    threads = []
    send = action.send_goal_async
    monkeypatch.setattr(
        action,
        "send_goal_async",
        lambda *given, **named: (
            threads.append(threading.current_thread()) or send(*given, **named)
        ),
    )
    assert isinstance(action, action_client.ActionClient)
    assert world.plan({"shoulder": 0.2}).is_success
    # In the thread that takes messages none can be taken in between.
    assert threads == [world.connection._thread]

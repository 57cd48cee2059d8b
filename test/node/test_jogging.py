"""A Panda in its cell that is jogged through the node: it keeps its distance, and brakes."""

from __future__ import annotations

from contextlib import contextmanager

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from node_harness import diagnostics_values, wait_until
import numpy as np
import pytest
from std_msgs.msg import Float64MultiArray
from velocity_robot import VelocityRobot
from workspace_messages import message_class, WORKSPACE_VARIABLES

from scene_graph_msgs.msg import JogStatus
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

SCENE = "config/scenes/panda_cell.yaml"
KEEP, RATE = 0.03, 100.0
# The gain brakes long before the acceleration has to: periods of 0.1 s keep the distance, too.
ACCELERATION, LONGEST = 20.0, 0.1
ARM = tuple(f"panda_joint{k}" for k in range(1, 8))
NAMES = (*ARM, "panda_finger_joint1")
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02]
TOPICS = ("/scene_graph/jog_velocities", "/scene_graph/jog_status")
PARAMETERS = {
    "scene": SCENE,
    "jog": "panda/arm",
    "jog_link": "panda_hand",
    "jog_keep": KEEP,
    "jog_acceleration": ACCELERATION,
    # A busy machine is no reason to brake here.
    "jog_timeout": 1.0,
    "jog_max_state_age": 1.0,
    "diagnostics_rate": 20.0,
}


@pytest.fixture(scope="module")
def joint_jog():
    """Return the class of commands of joints."""
    return message_class("control_msgs", "JointJog")


@pytest.fixture(scope="module")
def node(start_node, joint_jog):
    """A node that jogs the arm of a Panda."""
    return start_node(PARAMETERS, extra_environment=WORKSPACE_VARIABLES, fresh=True)


@pytest.fixture(scope="module")
def status(client, node):
    """What the node says of each tick."""
    return client.listen(JogStatus, "jog_status", 1000)


@pytest.fixture
def start_robot(client, node, status):
    """Return a function that has a robot be where it starts, until it is idle at the end."""

    @contextmanager
    def start():
        robot = VelocityRobot(client, NAMES, START, slice(0, 7))
        yield robot
        wait_until(
            lambda: status.newest is None or status.newest.state == JogStatus.IDLE, "idleness"
        )
        wait_until(lambda: robot.is_at_rest, "rest, by both topics")
        robot.close()

    return start


@pytest.fixture
def robot(start_robot):
    """The robot, where it starts."""
    with start_robot() as robot:
        yield robot


@pytest.fixture(scope="module")
def twists(client, node):
    """Ask for velocities of the hand, in m/s."""
    publisher = client.publisher(TwistStamped, "/scene_graph/delta_twist_cmds")

    def ask(frame="world", **linear):
        message = TwistStamped()
        message.header.frame_id, message.header.stamp = frame, client.now()
        for axis, value in linear.items():
            setattr(message.twist.linear, axis, value)
        publisher.publish(message)

    return ask


@pytest.fixture(scope="module")
def joints(client, node, joint_jog):
    """Ask for velocities of joints, in rad/s."""
    publisher = client.publisher(joint_jog, "/scene_graph/delta_joint_cmds")

    def ask(names, velocities, **fields):
        message = joint_jog(joint_names=names, velocities=velocities, **fields)
        message.header.stamp = client.now()
        publisher.publish(message)

    return ask


@pytest.fixture(scope="module")
def clearance():
    """Return the least distance of a configuration's pairs, as the checker says it."""
    checker = SceneGraphCollisionChecker(load_robot_diagram(SCENE))
    assert checker.plan.tree.position_names == NAMES
    return lambda q: checker.calc_robot_clearance(q, 0.2).distances.min(initial=0.2)


def asked_until(ask, condition, what):
    """Ask again and again until a condition holds."""

    def asked():
        ask()
        return condition()

    return wait_until(asked, what)


def newest(status, client):
    """Return the newest status that is later than this call."""
    now = client.now()
    later = (now.sec, now.nanosec)
    return status.wait_for(
        lambda m: (m.header.stamp.sec, m.header.stamp.nanosec) > later, "a status"
    )


def test_a_hand_that_is_pushed_into_the_table_stays_above_it(
    start_robot, twists, status, clearance
):
    """It comes near, keeps its distance all the way, and may leave.

    What a velocity causes is proven for a period of the node. Where the machine had the node wait
    for longer than the gain makes up for, the robot is pushed again.
    """
    for _ in range(10):
        with start_robot() as robot:
            down = asked_until(
                lambda: twists(z=-0.3),
                lambda: (
                    (m := status.newest)
                    and m.state == JogStatus.HELD
                    and len(m.active_a)
                    and m.nearest_distance < KEEP + 0.002
                    and m
                ),
                "the table in the way",
            )
            lowest = len(robot.passed)
            asked_until(
                lambda: twists(z=0.2),
                lambda: clearance(robot.q) > KEEP + 0.05,
                "the hand above the table",
            )
        if robot.longest_period <= LONGEST:
            break
    else:
        pytest.fail(f"ten times the node waited, at last for {robot.longest_period} s")
    assert down.names == [f"panda/{name}" for name in ARM]
    assert "panda" in down.nearest_a.frame + down.nearest_b.frame + down.nearest_a.source
    assert min(down.active_distances) >= KEEP - 0.002
    assert (down.proven_until.sec, down.proven_until.nanosec) > (
        down.header.stamp.sec,
        down.header.stamp.nanosec,
    )
    assert lowest > 20
    least = min(clearance(q) for q in robot.passed)
    assert KEEP - 0.002 <= least < KEEP + 0.01
    changes = np.abs(np.diff(robot.commands, axis=0))
    assert changes.max() <= ACCELERATION / RATE + 1e-9


def test_joints_follow_where_nothing_is_in_the_way(robot, joints, status):
    """What is asked for is sent, after the acceleration; other joints stay."""
    message = asked_until(
        lambda: joints(["panda_joint1", "panda/panda_joint7"], [0.25, -0.5]),
        lambda: (m := status.newest) and m.state == JogStatus.FOLLOWING and m.asked[0] and m,
        "the velocities",
    )
    assert list(message.velocities) == [0.25, 0.0, 0.0, 0.0, 0.0, 0.0, -0.5]
    assert robot.q[1:6] == pytest.approx(START[1:6], abs=1e-12)


def test_a_twist_in_the_frame_of_a_link_is_turned(robot, twists, status, clearance):
    """Along the hand's own z axis, which looks down: the arm goes down."""
    before = clearance(robot.q)
    asked_until(
        lambda: twists(frame="panda_hand", z=0.1),
        lambda: clearance(robot.q) < before - 0.02,
        "the hand farther down",
    )


def test_without_commands_it_brakes_and_then_is_quiet(client, robot, joints, status):
    """The last command is rest; then nothing is sent."""
    asked_until(
        lambda: joints(["panda_joint1"], [0.25]),
        lambda: robot.commands and robot.commands[-1][0] == 0.25,
        "a velocity",
    )
    idle = status.wait_for_newest(lambda m: m.state == JogStatus.IDLE, "rest")
    assert not any(idle.velocities)
    wait_until(lambda: not robot.commands[-1].any(), "rest")
    count = len(robot.commands)
    client.call("ListEffects")
    assert len(robot.commands) == count


def test_a_robot_that_is_not_heard_brakes_along_its_line(robot, joints, status):
    """While commands go on: the reason names the age, and it goes on when it is heard."""
    ask = lambda: joints(["panda_joint1", "panda_joint2"], [-0.25, -0.125])  # noqa: E731
    asked_until(ask, lambda: robot.commands and robot.commands[-1][0] == -0.25, "a velocity")
    robot.is_silent = True
    count = len(robot.commands)
    message = asked_until(
        ask,
        lambda: (
            (m := status.newest)
            and m.state == JogStatus.BRAKING
            and "s old" in m.reason
            and not any(m.velocities)
            and m
        ),
        "rest",
    )
    assert "the positions of panda are" in message.reason
    assert "jog_max_state_age is 1 s" in message.reason
    for velocity in robot.commands[count:]:
        assert velocity[1] == pytest.approx(0.5 * velocity[0], abs=1e-12)
    robot.is_silent = False
    asked_until(ask, lambda: status.newest.state == JogStatus.FOLLOWING, "more")


def test_commands_that_mean_nothing_are_refused_by_name(client, robot, twists, joints, status):
    """Names, frames and numbers: the message is told, in diagnostics, too, and nothing moves."""
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    cases = (
        (lambda: twists(x=float("nan")), "twist.linear.x must be a finite number, not nan"),
        (lambda: twists(frame="moon", x=0.1), "header.frame_id: no robot has a link 'moon'"),
        (lambda: joints(["panda_joint9"], [0.1]), "joint_names[0]: no robot has a position"),
        (lambda: joints(["panda_finger_joint1"], [0.1]), "is none of the joints that are jogged"),
        (lambda: joints(["panda_joint2"] * 2, [0.1] * 2), "'panda_joint2' is there twice"),
        (lambda: joints(["panda_joint2"], [0.1, 0.2]), "velocities has 2 numbers for 1 names"),
        (
            lambda: joints(["panda_joint2"], [float("inf")]),
            "velocities[0] of 'panda_joint2' must be a finite number, not inf",
        ),
        (
            lambda: joints(["panda_joint2"], [0.1], displacements=[0.1]),
            "displacements has 1 numbers, and must be empty",
        ),
        (lambda: joints([], [], duration=-1.0), "duration must be a number from 0 on, not -1.0"),
    )
    for ask, words in cases:
        asked_until(
            ask,
            lambda words=words: (
                words
                in diagnostics_values(diagnostics.newest or DiagnosticArray(), "effect: jog").get(
                    "last refused", ""
                )
            ),
            words,
        )
    assert not any(command.any() for command in robot.commands)
    client.forget(diagnostics)


def test_nothing_of_it_is_there_unless_a_parameter_asks(client, node, start_node, tmp_path):
    """No topic, and no effect that is on; a robot that is not there is told, and ends nothing."""
    scene = tmp_path / "empty.yaml"
    scene.write_text("version: 1\nsources:\n  - name: cell\n")
    assert node.stop() == 0
    other = start_node({"scene": scene})
    wait_until(lambda: not client.topics() & set(TOPICS), "topics that are gone")
    effect = next(e for e in client.call("ListEffects").effects if e.name == "jog")
    assert not effect.is_on
    assert "the parameter jog" in effect.reason
    assert other.stop() == 0
    start_node({"scene": scene, "jog": "panda", "diagnostics_rate": 20.0})
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    diagnostics.wait_for(
        lambda m: any(
            s.name.endswith("effect: jog") and "no robot to plan for" in s.message
            for s in m.status
        ),
        "the reason",
    )
    velocities = client.listen(Float64MultiArray, "jog_velocities")
    assert client.call("ListEffects").status.code == 0
    assert velocities.count == 0

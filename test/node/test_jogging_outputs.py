"""Jogging that sends trajectories of one point, beside sources that have to be heard."""

from __future__ import annotations

from geometry_msgs.msg import Transform
from node_harness import wait_until
import numpy as np
import pytest
from sensor_msgs.msg import JointState, MultiDOFJointState
from trajectory_msgs.msg import JointTrajectory
from workspace_messages import message_class, WORKSPACE_VARIABLES

from msg_adapters.stamps import stamp_from_msg, stamp_to_msg
from scene_graph_msgs.msg import JogStatus

ARM = [f"panda_joint{k}" for k in range(1, 8)]
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02]
PERIOD = 0.01
DELAY = 300_000_000
"""How old (ns) the positions are that the robot tells: it has heard all points of that time."""

PARAMETERS = {
    "scene": "config/scenes/panda_cell.yaml",
    "jog": "panda/arm",
    "jog_output": "trajectory",
    "jog_keep": 0.03,
    "jog_acceleration": 4.0,
    "jog_timeout": 1.0,
    "jog_max_state_age": 1.0,
    "jog_max_pose_age": 2.0,
    "jog_obstacle_speed": 0.05,
}


class PositionRobot:
    """Is where points say at their times; and a ball that is heard, unless it is silent."""

    def __init__(self, client):
        """Tell where both are, every ten milliseconds."""
        self._client, self.is_silent = client, True
        self.points = []
        self._times, self._passed = [0], [START]
        self._states = client.publisher(JointState, "/joint_states")
        self._poses = client.publisher(MultiDOFJointState, "/objects/poses")
        self._subscription = client.node.create_subscription(
            JointTrajectory, "/scene_graph/jog_velocities", self._take, 100
        )
        self._timer = client.node.create_timer(PERIOD, self._tell)

    def close(self):
        """End."""
        self._client.run(lambda: self._client.node.destroy_timer(self._timer), "timer")
        for each in (self._subscription, self._states, self._poses):
            self._client.destroy(each)

    def _take(self, message):
        self.points.append(message)
        (point,) = message.points
        if not len(point.positions):
            return
        begin = stamp_from_msg(message.header.stamp)
        if begin > self._times[-1]:
            # It has waited there until then.
            self._times.append(begin)
            self._passed.append(self._passed[-1])
        self._times.append(begin + point.time_from_start.nanosec)
        self._passed.append([*point.positions, START[7]])

    def _tell(self):
        stamp = stamp_from_msg(self._client.now()) - DELAY
        times = np.array(self._times) - stamp
        q = [float(np.interp(0.0, times, passed)) for passed in zip(*self._passed, strict=True)]
        state = JointState(name=[*ARM, "panda_finger_joint1"], position=q)
        state.header.stamp = stamp_to_msg(stamp)
        self._states.publish(state)
        if self.is_silent:
            return
        ball = Transform()
        ball.translation.x, ball.translation.y, ball.translation.z = 0.62, 0.32, 0.53
        poses = MultiDOFJointState(joint_names=["ball"], transforms=[ball])
        poses.header.stamp, poses.header.frame_id = self._client.now(), "world"
        self._poses.publish(poses)


@pytest.fixture(scope="module")
def node(start_node):
    """A node that jogs the arm of a Panda by points."""
    message_class("control_msgs", "JointJog")
    return start_node(PARAMETERS, extra_environment=WORKSPACE_VARIABLES, fresh=True)


@pytest.fixture(scope="module")
def ask(client, node):
    """Ask for a velocity of the first joint."""
    kind = message_class("control_msgs", "JointJog")
    publisher = client.publisher(kind, "/scene_graph/delta_joint_cmds")

    def publish():
        message = kind(joint_names=["panda_joint1"], velocities=[0.25])
        message.header.stamp = client.now()
        publisher.publish(message)

    return publish


def test_points_that_wait_for_the_surroundings_and_end_at_rest(client, node, ask):
    """No motion until the objects are heard, nor when they are silent; zero is the last point."""
    status, robot = client.listen(JogStatus, "jog_status", 1000), PositionRobot(client)

    def state(kind, words=""):
        def holds():
            ask()
            newest = status.newest
            return newest and newest.state == kind and words in newest.reason and newest

        return wait_until(holds, words or "the state")

    state(JogStatus.BRAKING, "nobody has said where objects is, and jog_max_pose_age is 2 s")
    assert not any(v for message in robot.points for v in message.points[0].velocities)
    robot.is_silent = False
    state(JogStatus.FOLLOWING)
    wait_until(lambda: ask() or robot.points[-1].points[0].velocities[0] == 0.25, "full speed")
    last, newest = robot.points[-2:]
    assert list(newest.joint_names) == ARM and len(newest.points) == 1
    point = newest.points[0]
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (0, 10_000_000)
    assert list(point.velocities[1:]) == [0.0] * 6
    assert list(point.positions[1:]) == pytest.approx(START[1:7], abs=1e-9)
    # A point is a period ahead of where the robot is by then.
    assert 0.0 < point.positions[0] < 2.0
    assert point.positions[0] >= last.points[0].positions[0]

    robot.is_silent = True
    message = state(JogStatus.BRAKING, "the poses of objects are")
    assert "jog_max_pose_age is 2 s" in message.reason
    wait_until(lambda: ask() or not any(robot.points[-1].points[0].velocities), "rest")

    robot.is_silent = False
    state(JogStatus.FOLLOWING)
    wait_until(lambda: ask() or robot.points[-1].points[0].velocities[0] == 0.25, "full speed")
    assert node.stop() == 0
    wait_until(lambda: not any(robot.points[-1].points[0].velocities), "zero at the end")
    assert len(robot.points[-1].points[0].velocities) == 7
    robot.close()

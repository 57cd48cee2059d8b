"""Goals of the action that plans paths, as clients send them."""

from __future__ import annotations

from geometry_msgs.msg import Quaternion, Transform, Vector3
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState, MultiDOFJointState
from spinning import wait_until

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import RobotConfigurations

__all__ = ["Planner", "Sent", "at", "post_publisher", "rail_publisher"]


def at(*rails):
    """Return configurations of the ball on the rail of `sliding_robots.rail_scene`."""
    return RobotConfigurations(names=["rail"], positions=list(map(float, rails)))


def rail_publisher(client):
    """Return a function that publishes where that ball is."""
    publisher = client.publisher(JointState, "/joint_states")

    def publish(rail):
        message = JointState(name=["rail"], position=[float(rail)])
        message.header.stamp = client.now()
        publisher.publish(message)

    return publish


def post_publisher(client):
    """Return a function that puts the post in its way somewhere else."""
    publisher = client.publisher(MultiDOFJointState, "/around/poses")

    def put(x):
        pose = Transform(translation=Vector3(x=float(x)), rotation=Quaternion(w=1.0))
        message = MultiDOFJointState(joint_names=["post"], transforms=[pose])
        message.header.stamp = client.now()
        publisher.publish(message)

    return put


class Planner:
    """A client of the action, used in the thread that spins it.

    Elsewhere rclpy 7 may take a response before it has noted that it waits for one, and drop it.
    """

    def __init__(self, client):
        self.run = client.run
        self._client = ActionClient(client.node, PlanPath, "/scene_graph/plan_path")
        wait_until(self._client.server_is_ready, "the action")

    def send(self, goal, take):
        """Send a goal; return the future of its acceptance."""
        return self.run(lambda: self._client.send_goal_async(goal, take), "sending a goal")

    def destroy(self):
        """End it."""
        self.run(self._client.destroy, "the end of the action's client")


class Sent:
    """A goal that was sent, and what came back."""

    def __init__(self, action, **fields):
        self.feedback = []
        self._run = action.run
        goal = PlanPath.Goal(**fields)
        future = action.send(goal, lambda m: self.feedback.append(m.feedback))
        wait_until(future.done, "the goal's acceptance")
        self.handle = future.result()
        assert self.handle.accepted
        self._result = self._run(self.handle.get_result_async, "asking for the result")

    def wait_for(self, state, ahead=0):
        """Wait for feedback."""
        wait_until(
            lambda: any((f.state, f.ahead) == (state, ahead) for f in list(self.feedback)),
            f"feedback {state}",
        )

    def cancel(self):
        """Ask for its end; return the response."""
        future = self._run(self.handle.cancel_goal_async, "asking for its end")
        wait_until(future.done, "the answer to cancelling")
        return future.result()

    def end(self):
        """Wait for the result; return it and the status."""
        wait_until(self._result.done, "the result")
        return self._result.result().result, self._result.result().status

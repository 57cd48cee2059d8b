"""Recordings of robots that are described by a topic, later again, and stand on a moving base."""

from __future__ import annotations

from nav_msgs.msg import Odometry
from node_harness import wait_until
from rclpy.qos import DurabilityPolicy, QoSProfile
from recordings import counted, replay
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import String

from msg_adapters.poses import multi_dof_joint_state_to_msg
from msg_adapters.stamps import stamp_from_msg, stamp_to_msg
from scene_graph_msgs.msg import ContactArray, QueryOptions, Status
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy

BALL = '<collision><geometry><sphere radius="0.3"/></geometry></collision>'
LIMIT = '<limit lower="-3" upper="3" velocity="1"/>'


def urdf(height, more=""):
    """Return a robot with an arm at a height, and a planar sled."""
    return (
        f'<robot name="r"><link name="base">{BALL}</link><link name="arm">{BALL}</link>'
        f'<link name="sled">{BALL}</link>{more}'
        f'<joint name="arm_j" type="prismatic"><origin xyz="0 0 {height}"/><axis xyz="1 0 0"/>'
        f'<parent link="base"/><child link="arm"/>{LIMIT}</joint>'
        '<joint name="sled_j" type="planar"><axis xyz="0 0 1"/><origin xyz="0 0.5 0"/>'
        '<parent link="base"/><child link="sled"/></joint></robot>'
    )


TOOL = (
    f'<link name="tool">{BALL}</link><joint name="tool_j" type="fixed">'
    '<origin xyz="0.4 0 0"/><parent link="arm"/><child link="tool"/></joint>'
)
SCENE = """
version: 1
robots:
  - name: r
    urdf: {topic: /robot_description}
    base: {topic: /odom}
"""


def test_descriptions_are_replayed_with_all_that_moved_then(start_node, client, domain, tmp_path):
    """Contacts of the replay are those that went out, before and after the robot was another."""
    scene, folder = tmp_path / "scene.yaml", tmp_path / "bag"
    scene.write_text(SCENE)
    node = start_node({"scene": scene, "record": folder})
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    description = client.node.create_publisher(String, "/robot_description", latched)

    def has(link):
        answer = client.call("GetPoseInWorld", frames=[f"r/{link}"])
        return answer.status.code == Status.OK

    def send(k):
        now = stamp_from_msg(client.now())
        arm = JointState(name=["arm_j"], position=[0.05 * k])
        arm.header.stamp = stamp_to_msg(now - 20_000_000)
        joints.publish(arm)
        at = Odometry(child_frame_id="base")
        at.header.frame_id, at.header.stamp = "odom", stamp_to_msg(now - 50_000_000)
        at.pose.pose.position.x = 0.1 * k
        base.publish(at)
        X = pose_from_xyz_rpy((0.02 * k, 0.0, 0.0), (0.0, 0.0, 0.1 * k))
        sled.publish(multi_dof_joint_state_to_msg(["sled_j"], X[None], stamp_ns=now, frame_id=""))
        options = QueryOptions(minimal_stamp=at.header.stamp, minimal_stamp_sources=["/r"])
        options.timeout.sec = 1
        answer = client.call("GetPoseInWorld", frames=["r/arm"], options=options)
        # A reader that is new may not hear the first messages.
        return answer.status.code == Status.OK and answer.poses[0].position.x == 0.1 * k + 0.05 * k

    def move(steps):
        for k in steps:
            wait_until(lambda k=k: send(k), "the robot, moved")

    description.publish(String(data=urdf(0.25)))
    wait_until(lambda: has("arm"), "the robot")
    heard = client.listen(ContactArray, "contacts")
    joints = client.publisher(JointState, "/joint_states")
    base = client.publisher(Odometry, "/odom")
    sled = client.publisher(MultiDOFJointState, "/multi_dof_joint_states")
    move(range(1, 6))
    description.publish(String(data=urdf(0.3, TOOL)))
    wait_until(lambda: has("tool"), "the robot with a tool")
    move(range(6, 11))
    wait_until(lambda: heard.newest is not None and len(heard.newest.points) > 1, "contacts")
    assert node.stop() == 0
    client.forget(heard)
    for publisher in (description, joints, base, sled):
        client.run(lambda p=publisher: client.node.destroy_publisher(p), "the end of a publisher")
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    inputs, edits, updates, equal, _, different = counted(said)
    assert (edits, different) == (2, 0), said
    assert inputs >= 30
    assert equal >= updates > 10

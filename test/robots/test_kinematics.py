"""Forward kinematics of joint states against products of matrices."""

import gc
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from robots import find_robot, ROBOTS, URDF_ONLY

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.robots.robot_parts import JointType
from scene_graph_ros.robots.tree_kernels import link_poses
from scene_graph_ros.scene_files import JointStateError, Kinematics, load_urdf

ROUNDING = 1e-13  # products of some ten rotations, in m for robots of about 1 m


def motion(joint, q):
    """Return the pose of a joint's child at position q relative to where it is at zero."""
    X = np.eye(4)
    x, y, z = joint.axis
    if joint.type is JointType.PRISMATIC:
        X[:3, 3] = q * np.array(joint.axis)
    elif joint.type is not JointType.FIXED:
        # Rodrigues' formula: R = I + sin(q) K + (1 - cos(q)) K^2.
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        X[:3, :3] += math.sin(q) * K + (1.0 - math.cos(q)) * K @ K
    return X


def composed_poses(robot, positions):
    """Return each link's pose by walking the tree and multiplying 4x4 matrices."""
    poses = {robot.root: np.eye(4)}
    for joint in robot.joints.values():
        q = positions.get(joint.name, 0.0)
        poses[joint.child] = poses[joint.parent] @ joint.X_PC @ motion(joint, q)
    return poses


def with_mimics(robot, positions):
    """Return positions of all joints, following mimicry to the joint that is moved."""

    def position(joint):
        if joint.name in positions or joint.mimic is None:
            return positions.get(joint.name, 0.0)
        leader = robot.joints[joint.mimic.joint]
        return joint.mimic.multiplier * position(leader) + joint.mimic.offset

    return {joint.name: position(joint) for joint in robot.positioned_joints()}


@pytest.mark.parametrize("name", [*ROBOTS, *URDF_ONLY])
def test_link_poses_of_real_robots(name):
    """Every link of every robot is where the product of its joints' matrices puts it."""
    robot, _ = find_robot(name)
    kinematics = Kinematics(robot)
    rng = np.random.default_rng(7)
    for _ in range(3):
        free = [j.name for j in robot.positioned_joints() if j.mimic is None]
        q = rng.uniform(-1.5, 1.5, len(free))
        links, X_WL = kinematics.link_poses(free, q)
        positions = with_mimics(robot, dict(zip(free, q, strict=True)))
        expected = composed_poses(robot, positions)
        assert kinematics.positions == pytest.approx(positions, abs=1e-15)
        assert links == tuple(robot.links)
        np.testing.assert_allclose(X_WL, [expected[n] for n in links], atol=ROUNDING)


def planar_arm():
    """Return an arm in the xy-plane: links of 2 m and 1 m, a sliding tip and a jaw that mimics."""
    return load_urdf(
        """<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/>
        <link name="tip"/><link name="jaw"/><link name="nail"/>
        <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
          <axis xyz="0 0 1"/></joint>
        <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
          <origin xyz="2 0 0"/><axis xyz="0 0 2"/></joint>
        <joint name="slide" type="prismatic"><parent link="lower"/><child link="tip"/>
          <origin xyz="1 0 0"/><axis xyz="1 0 0"/></joint>
        <joint name="jaw" type="prismatic"><parent link="lower"/><child link="jaw"/>
          <axis xyz="0 1 0"/><mimic joint="slide" multiplier="-3" offset="0.5"/></joint>
        <joint name="nail" type="prismatic"><parent link="base"/><child link="nail"/>
          <axis xyz="0 0 1"/><mimic joint="jaw" multiplier="2"/></joint></robot>"""
    )


def position_of(kinematics, link, names=(), positions=()):
    """Return where a link's origin is, in m."""
    links, X = kinematics.link_poses(names, positions)
    return X[links.index(link), :3, 3]


def test_planar_arm_by_trigonometry():
    """Shoulder 90 degrees, elbow -90, slide 0.25: the tip is at (1.25, 2)."""
    kinematics = Kinematics(planar_arm())
    names = ("shoulder", "elbow", "slide")
    tip = position_of(kinematics, "tip", names, (math.pi / 2, -math.pi / 2, 0.25))
    np.testing.assert_allclose(tip, [1.25, 2.0, 0.0], atol=1e-15)
    # jaw = -3 * 0.25 + 0.5 = -0.25 along y of the lower link, whose axes are again the world's;
    # nail = 2 * jaw = -0.5 along z.
    np.testing.assert_allclose(position_of(kinematics, "jaw"), [0.0, 1.75, 0.0], atol=1e-15)
    np.testing.assert_allclose(position_of(kinematics, "nail"), [0.0, 0.0, -0.5], atol=1e-15)


def test_mimicking_joints_start_at_their_offset():
    """At zero, the jaw is at its offset 0.5 and the nail at twice that."""
    assert Kinematics(planar_arm()).positions["jaw"] == 0.5
    assert Kinematics(planar_arm()).positions["nail"] == 1.0


def test_base_pose_moves_all_links():
    """With the root 3 m up and turned by 180 degrees about z, x becomes -x."""
    X_PB = np.diag([-1.0, -1.0, 1.0, 1.0])
    X_PB[2, 3] = 3.0
    kinematics = Kinematics(planar_arm(), X_PB=X_PB)
    np.testing.assert_allclose(position_of(kinematics, "tip"), [-3.0, 0.0, 3.0], atol=1e-15)
    kinematics.X_PB = np.eye(4)
    np.testing.assert_allclose(position_of(kinematics, "tip"), [3.0, 0.0, 0.0], atol=1e-15)


def test_base_pose_moves_every_branch_at_the_root():
    """Links without joints, and all joints of the root, are placed in P, whatever came before."""
    kinematics = Kinematics(loose_robot())
    kinematics.link_poses()
    X_PB = np.diag([-1.0, -1.0, 1.0, 1.0])
    X_PB[:3, 3] = [0.5, 0.0, 2.0]
    kinematics.X_PB = X_PB
    links, X_PL = kinematics.link_poses()
    assert links == ("a", "b", "c")
    np.testing.assert_allclose(
        X_PL[:, :3, 3], [[0.5, 0, 2], [0.5, 0, 3], [-0.5, 0, 2]], atol=1e-15
    )


def test_robots_of_one_model_move_each_for_itself():
    """What one remembers is not the other's, nor gone with it."""
    robot = planar_arm()
    one, other = Kinematics(robot), Kinematics(robot, X_PB=np.diag([-1.0, -1.0, 1.0, 1.0]))
    tip = position_of(other, "tip")
    one.link_poses(("elbow",), (1.0,))
    del one
    gc.collect()
    np.testing.assert_array_equal(position_of(other, "tip"), tip)


def test_kernel_of_joint_states_is_the_one_that_is_compiled_beforehand():
    """It takes arrays that may be written to, as the tree's own; for others it is another one."""
    kinematics = Kinematics(find_robot("panda")[0], X_PB=as_pose(np.eye(4), "X_PB"))
    kinematics.link_poses([], [])
    arrays = [x for signature in link_poses.signatures for x in signature if hasattr(x, "ndim")]
    assert arrays
    assert all(array.mutable for array in arrays)


def test_bad_base_pose_is_refused():
    """A base pose that is not rigid is refused with the robot's name."""
    with pytest.raises(InvalidPoseError, match="X_PB of robot 'arm'"):
        Kinematics(planar_arm(), X_PB=2.0 * np.eye(4))


def test_joints_not_named_keep_their_position():
    """A message about one joint moves only it, and those that mimic it."""
    kinematics = Kinematics(planar_arm())
    kinematics.update(("shoulder", "slide"), (0.3, 0.1))
    kinematics.update(("elbow",), (0.7,))
    before = {"shoulder": 0.3, "elbow": 0.7, "slide": 0.1}
    assert kinematics.positions == pytest.approx({**before, "jaw": 0.2, "nail": 0.4})


def test_named_mimicking_joint_goes_where_it_says():
    """A measured position overrules the rule, and what mimics that joint follows it."""
    kinematics = Kinematics(planar_arm())
    kinematics.update(("slide", "jaw"), (0.1, 0.9))
    assert kinematics.positions["jaw"] == 0.9
    assert kinematics.positions["nail"] == 1.8
    kinematics.update(("slide",), (0.2,))
    assert kinematics.positions["jaw"] == pytest.approx(-0.1)


def test_unknown_joints_are_reported_and_the_rest_moves():
    """Joints of other robots on the same topic are named; their values don't matter."""
    kinematics = Kinematics(planar_arm())
    kinematics.update(("wheel", "elbow", "lid"), (math.nan, 0.4, 1.0))
    assert kinematics.unknown_joints == ("wheel", "lid")
    assert kinematics.positions["elbow"] == 0.4
    kinematics.update(("elbow",), (0.5,))
    assert kinematics.unknown_joints == ()


@pytest.mark.parametrize(
    ("names", "positions", "message"),
    [
        (("elbow", "slide"), (0.1, math.nan), "position of joint 'slide' must be finite, got nan"),
        (("elbow",), (math.inf,), "position of joint 'elbow' must be finite, got inf"),
        (("elbow", "slide"), (0.1,), r"2 joint names with positions of shape \(1,\)"),
        (("elbow", "elbow"), (0.1, 0.2), "joint 'elbow' is named twice"),
    ],
)
def test_refused_messages_move_nothing(names, positions, message):
    """What is wrong with joint states is named, and the robot stays where it was."""
    kinematics = Kinematics(planar_arm())
    kinematics.update(("elbow", "slide"), (0.5, 0.6))
    before = kinematics.positions
    with pytest.raises(JointStateError, match=f"robot 'arm': .*{message}"):
        kinematics.link_poses(names, positions)
    assert kinematics.positions == before
    np.testing.assert_allclose(position_of(kinematics, "tip")[2], 0.0)


def test_links_in_the_order_asked():
    """Only the links asked for are returned, in that order; an unknown one is refused."""
    kinematics = Kinematics(planar_arm(), links=("tip", "base"))
    links, X = kinematics.link_poses()
    assert links == ("tip", "base")
    np.testing.assert_allclose(X[:, 0, 3], [3.0, 0.0])
    with pytest.raises(KeyError, match="robot 'arm' has no link 'tpi'; did you mean 'tip'"):
        Kinematics(planar_arm(), links=("tpi",))


def test_returned_poses_are_the_callers():
    """Poses returned earlier don't change when the robot moves on."""
    kinematics = Kinematics(planar_arm())
    _, first = kinematics.link_poses(("elbow",), (0.1,))
    copy = first.copy()
    kinematics.link_poses(("elbow",), (1.1,))
    np.testing.assert_array_equal(first, copy)


def loose_robot():
    """Return a robot with a floating and a planar joint; the plane is the floor."""
    return load_urdf(
        """<robot name="loose"><link name="a"/><link name="b"/><link name="c"/>
        <joint name="free" type="floating"><parent link="a"/><child link="b"/>
          <origin xyz="0 0 1"/></joint>
        <joint name="floor" type="planar"><parent link="a"/><child link="c"/>
          <origin xyz="1 0 0"/><axis xyz="0 0 1"/></joint></robot>"""
    )


def test_floating_and_planar_joints_are_set_by_pose():
    """A pose is relative to the joint's origin; the robot's other joints stay."""
    kinematics = Kinematics(loose_robot())
    X = np.eye(4)
    X[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    X[:3, 3] = [0.5, 0.25, 0.0]
    kinematics.set_joint_pose("floor", X)
    X_up = X.copy()
    X_up[2, 3] = 2.0
    kinematics.set_joint_pose("free", X_up)
    links, poses = kinematics.link_poses()
    expected = X.copy()
    expected[:3, 3] = [1.5, 0.25, 0.0]
    np.testing.assert_allclose(poses[links.index("c")], expected, atol=1e-15)
    expected[:3, 3] = [0.5, 0.25, 3.0]
    np.testing.assert_allclose(poses[links.index("b")], expected, atol=1e-15)


def test_planar_joint_stays_in_its_plane():
    """A pose that lifts or tilts a planar joint is refused with by how much."""
    kinematics = Kinematics(loose_robot())
    X = np.eye(4)
    X[2, 3] = 0.125
    with pytest.raises(JointStateError, match=r"'floor' is planar .* by 0\.125 m"):
        kinematics.set_joint_pose("floor", X)
    with pytest.raises(JointStateError, match="no planar or floating joint 'elbow'"):
        kinematics.set_joint_pose("elbow", np.eye(4))


@settings(deadline=None)
@given(
    q=st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3),
    order=st.permutations(range(3)),
    cut=st.integers(0, 3),
)
def test_order_and_splitting_of_messages_do_not_matter(q, order, cut):
    """Joints in any order, in one message or two, end in the same poses."""
    names = ("shoulder", "elbow", "slide")
    whole, parts = Kinematics(planar_arm()), Kinematics(planar_arm())
    _, expected = whole.link_poses(names, q)
    shuffled = [(names[i], q[i]) for i in order]
    for part in (shuffled[:cut], shuffled[cut:]):
        parts.update([name for name, _ in part], [value for _, value in part])
    np.testing.assert_array_equal(parts.link_poses()[1], expected)

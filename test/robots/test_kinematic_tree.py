"""Poses and Jacobians of batches, against pinocchio, trigonometry, 50 digits and differences."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from pinocchio_model import build_model
import pytest
from robots import find_robot, ROBOTS, URDF_ONLY
from small_trees import ARM, arm, LOOSE

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.robots import KinematicTreeError
from scene_graph_ros.robots.tree_of_model import tree_of_model
from scene_graph_ros.scene_files import load_kinematic_tree, load_urdf


def configurations(tree, count, seed=3):
    """Return random configurations, quaternions of any length among them."""
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (count, tree.num_positions))


def pinocchio_poses(built, tree, robot, q):
    """Return the poses and Jacobians of all links by pinocchio; linear rows come last here."""
    pin, model = built.pinocchio, built.model
    data = model.createData()
    positions = pin.neutral(model)
    for name, start in built.q_start.items():
        joint, multiplier, offset = robot.joints[name], 1.0, 0.0
        while joint.mimic is not None:
            offset += multiplier * joint.mimic.offset
            multiplier *= joint.mimic.multiplier
            joint = robot.joints[joint.mimic.joint]
        positions[start] = multiplier * q[tree.position_index(joint.name)] + offset
    pin.forwardKinematics(model, data, positions)
    return {
        link: data.oMi[built.joint_of_link[link]].homogeneous @ built.X_JL[link]
        for link in robot.links
    }


@pytest.mark.parametrize("name", [*ROBOTS, *URDF_ONLY])
def test_links_of_real_robots_are_where_pinocchio_puts_them(name):
    """Within 1e-14 of the robot's size, joints that mimic included."""
    robot, semantics = find_robot(name)
    tree = robot.kinematic_tree(semantics)
    built = build_model(robot)
    q = configurations(tree, 11)
    X_WL = tree.link_poses(q)
    size = max(1.0, np.abs(X_WL[..., :3, 3]).max())
    for i in (0, 5, 10):
        expected = pinocchio_poses(built, tree, robot, q[i])
        np.testing.assert_allclose(
            X_WL[i], [expected[n] for n in tree.link_names], rtol=0.0, atol=1e-14 * size
        )
    assert tree.link_names == tuple(robot.links)
    assert set(tree.groups) == set(semantics.groups if semantics else ())


@pytest.mark.parametrize("name", [*ROBOTS, *URDF_ONLY])
def test_jacobians_of_real_robots_are_those_of_pinocchio(name):
    """Of points of the last links, each joint for itself."""
    robot, _ = find_robot(name)
    tree, built = tree_of_model(robot, follows=False), build_model(robot)
    pin, model = built.pinocchio, built.model
    q = configurations(tree, 2)[1]
    positions = pin.neutral(model)
    for joint, start in built.q_start.items():
        positions[start] = q[tree.position_index(joint)]
    for link in tuple(robot.links)[-3:]:
        p_LQ = np.array([0.1, -0.2, 0.3])
        X_JQ = built.X_JL[link].copy()
        X_JQ[:3, 3] = (built.X_JL[link] @ [*p_LQ, 1.0])[:3]
        joint = built.joint_of_link[link]
        frame = model.addFrame(
            pin.Frame(f"{link} Q", joint, 0, pin.SE3(X_JQ), pin.FrameType.OP_FRAME)
        )
        data = model.createData()
        theirs = pin.computeFrameJacobian(
            model, data, positions, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        ours = tree.jacobians(q, link, p_LQ)
        for column, joint_name in enumerate(tree.velocity_names):
            row = model.joints[model.getJointId(joint_name)].idx_v
            np.testing.assert_allclose(
                ours[:, column], np.roll(theirs[:, row], 3), rtol=0.0, atol=1e-14
            )


def test_an_arm_by_trigonometry():
    """Shoulder 90 degrees, elbow -90, slide 0.25: the tip is at (1.25, 2)."""
    tree = arm()
    assert tree.position_names == tree.velocity_names == ("shoulder", "elbow", "slide")
    assert set(tree.joint_names) == {"shoulder", "elbow", "slide", "jaw", "nail"}
    q = [math.pi / 2, -math.pi / 2, 0.25]
    X = tree.link_poses(q, ["tip", "jaw", "nail"])
    expected = [[1.25, 2.0, 0.0], [0.0, 1.75, 0.0], [0.0, 0.0, -0.5]]
    np.testing.assert_allclose(X[:, :3, 3], expected, atol=1e-15)
    # The tip turns about the shoulder at (0, 0), the elbow at (0, 2), and slides along x.
    J = tree.jacobians(q, "tip")
    np.testing.assert_allclose(J[2], [1.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(J[3:5], [[-2.0, 0.0, 1.0], [1.25, 1.25, 0.0]], atol=1e-15)
    # The nail goes down by 2 * 3 m for each m of the slide that its leader follows.
    np.testing.assert_allclose(tree.jacobians(q, "nail")[5], [0.0, 0.0, -6.0])


LINES = """<robot name="lines"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="e"/>
  <joint name="free" type="floating"><parent link="a"/><child link="b"/>
    <origin xyz="0 0 1" rpy="0.3 -0.2 0.9"/></joint>
  <joint name="floor" type="planar"><parent link="b"/><child link="c"/>
    <origin xyz="1 0 0" rpy="0.1 0.5 0"/><axis xyz="0 0 1"/></joint>
  <joint name="hinge" type="continuous"><parent link="c"/><child link="d"/>
    <origin xyz="0.2 0 0.3" rpy="0 1 0"/><axis xyz="1 0 0"/></joint>
  <joint name="slide" type="prismatic"><parent link="d"/><child link="e"/>
    <origin xyz="0 0.4 0" rpy="1 0 0"/><axis xyz="0 1 0"/><limit lower="-9" upper="9"/>
    <mimic joint="hinge" multiplier="-2" offset="0.3"/></joint></robot>"""


def pinocchio_of_lines():
    """Return pinocchio and its model of the same, with joints of its own for each kind."""
    pin = pytest.importorskip("pinocchio", reason="it is what this is held to")
    model = pin.Model()
    places = (
        ("free", pin.JointModelFreeFlyer(), [0.0, 0.0, 1.0], [0.3, -0.2, 0.9]),
        ("floor", pin.JointModelPlanar(), [1.0, 0.0, 0.0], [0.1, 0.5, 0.0]),
        ("hinge", pin.JointModelRX(), [0.2, 0.0, 0.3], [0.0, 1.0, 0.0]),
        ("slide", pin.JointModelPY(), [0.0, 0.4, 0.0], [1.0, 0.0, 0.0]),
    )
    for parent, (name, kind, xyz, rpy) in enumerate(places):
        X = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz))
        model.addJoint(parent, kind, X, name)
    return pin, pin.transformJointIntoMimic(model, 3, 4, -2.0, 0.3)


def test_floating_planar_and_mimicking_joints_are_those_of_pinocchio():
    """Poses and Jacobians; its velocities of the first two are in the frame that moves."""
    pin, model = pinocchio_of_lines()
    tree, p_LQ = load_kinematic_tree(LINES), np.array([0.1, -0.2, 0.3])
    assert tree.num_velocities == model.nv == 10
    frame = model.addFrame(pin.Frame("Q", 4, 0, pin.SE3(np.eye(3), p_LQ), pin.FrameType.OP_FRAME))
    data = model.createData()
    for q in configurations(tree, 20):
        q[:4] /= np.linalg.norm(q[:4])
        theta = q[9]
        turn = [np.cos(theta), np.sin(theta)]
        positions = np.array([*q[4:7], *q[1:4], q[0], *q[7:9], *turn, q[10]])
        theirs = pin.computeFrameJacobian(
            model, data, positions, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        pin.framesForwardKinematics(model, data, positions)
        (X,) = tree.link_poses(q, ["e"])
        np.testing.assert_allclose(X, data.oMi[4].homogeneous, rtol=0.0, atol=1e-14)
        R = pin.Quaternion(*q[:4]).toRotationMatrix()
        to_theirs = np.zeros((10, 10))
        to_theirs[:3, 3:6] = to_theirs[3:6, :3] = R.T
        to_theirs[6:8, 6:8] = [turn, [-turn[1], turn[0]]]
        to_theirs[8, 8] = to_theirs[9, 9] = 1.0
        expected = np.roll(theirs @ to_theirs, 3, axis=0)
        np.testing.assert_allclose(tree.jacobians(q, "e", p_LQ), expected, rtol=0.0, atol=4e-14)


@pytest.mark.parametrize("text", [ARM, LOOSE])
def test_jacobians_are_the_derivatives_of_poses(text):
    """Against central differences in each position, by way of the map from rates to v."""
    tree = load_kinematic_tree(text, floating_base="root")
    p_LQ, step = np.array([0.3, 0.2, -0.1]), 1e-6
    for q in configurations(tree, 3):
        for link in tree.link_names:
            rates = tree.jacobians(q, link, p_LQ) @ tree.velocity_map(q)
            for column in range(tree.num_positions):
                ends = np.tile(q, (2, 1))
                ends[:, column] += (-step, step)
                before, after = tree.link_poses(ends, [link])[:, 0]
                (X,) = tree.link_poses(q, [link])
                slope = (after - before) / (2.0 * step)
                spin = slope[:3, :3] @ X[:3, :3].T
                omega = [spin[2, 1], spin[0, 2], spin[1, 0]]
                expected = [*omega, *(slope @ [*p_LQ, 1.0])[:3]]
                np.testing.assert_allclose(rates[:, column], expected, atol=1e-7)


def test_floating_and_planar_joints():
    """A floating joint's quaternion has w first; a plane's normal is its axis."""
    tree = load_kinematic_tree(LOOSE)
    parts = ("qw", "qx", "qy", "qz", "x", "y", "z")
    assert tree.position_names[:7] == tuple(f"free.{part}" for part in parts)
    assert tree.position_names[7:] == ("floor.x", "floor.y", "floor.theta")
    assert tree.velocity_names[:3] == ("free.wx", "free.wy", "free.wz")
    assert (tree.num_positions, tree.num_velocities) == (10, 9)
    robot = load_urdf(LOOSE)
    rest = tree.zero_configuration()
    at_rest = tree.link_poses(rest)
    np.testing.assert_allclose(at_rest[1], robot.joints["free"].X_PC, atol=1e-15)
    expected = robot.joints["free"].X_PC @ robot.joints["floor"].X_PC
    np.testing.assert_allclose(at_rest[2], expected, atol=1e-15)
    # A quarter turn about x, of a quaternion of length 3, then 5 m along what was z.
    q = rest.copy()
    q[:7] = [3 * math.sqrt(0.5), 3 * math.sqrt(0.5), 0, 0, 0, 0, 5.0]
    X = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 5.0], [0, 0, 0, 1]])
    expected = robot.joints["free"].X_PC @ X
    np.testing.assert_allclose(tree.link_poses(q, ["b"])[0], expected, atol=1e-15)
    # In its plane the way is as long as x and y say, and along the normal it is nothing.
    q = rest.copy()
    q[7:] = 3.0, 4.0, 0.7
    normal = np.array([0.48, 0.6, 0.64])
    move = np.linalg.inv(at_rest[2]) @ tree.link_poses(q, ["c"])[0]
    assert np.linalg.norm(move[:3, 3]) == pytest.approx(5.0, abs=1e-14)
    assert normal @ move[:3, 3] == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(move[:3, :3] @ normal, normal, atol=1e-15)
    assert np.trace(move[:3, :3]) == pytest.approx(1.0 + 2.0 * math.cos(0.7), abs=1e-14)


@settings(deadline=None)
@given(count=st.integers(1, 20), seed=st.integers(0, 2**16))
def test_a_configuration_has_the_same_bits_in_any_batch(count, seed):
    """Whatever stands beside it, and alone."""
    tree = load_kinematic_tree(LOOSE)
    q = configurations(tree, count, seed)
    X_WL, J = tree.link_poses(q), tree.jacobians(q, "c")
    row = seed % count
    np.testing.assert_array_equal(tree.link_poses(q[row]), X_WL[row])
    np.testing.assert_array_equal(tree.jacobians(q[row], "c"), J[row])


def test_no_configuration_and_no_joint():
    """Batches of none, and robots that do not move."""
    tree = arm()
    assert tree.link_poses(np.empty((0, 3))).shape == (0, 6, 4, 4)
    assert tree.jacobians(np.empty((0, 3)), "tip").shape == (0, 6, 3)
    stone = load_kinematic_tree('<robot name="stone"><link name="only"/></robot>')
    np.testing.assert_array_equal(stone.link_poses(np.empty(0)), [np.eye(4)])
    assert stone.jacobians(np.empty((2, 0)), "only").shape == (2, 6, 0)


def test_sixty_joints_in_a_row():
    """All at 6 degrees: a closed ring of links, the last of which ends where the first begins."""
    links = "".join(f'<link name="l{i}"/>' for i in range(61))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        '<origin xyz="1 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3"/></joint>'
        for i in range(60)
    )
    tree = load_kinematic_tree(f'<robot name="ring">{links}{joints}</robot>')
    X = tree.link_poses(np.full(60, math.radians(6.0)), ["l60"])[0]
    np.testing.assert_allclose(X, np.eye(4), atol=60 * 1e-14)


def test_a_base_pose_moves_everything():
    """And is checked as poses are."""
    X_WB = np.diag([-1.0, -1.0, 1.0, 1.0])
    X_WB[2, 3] = 3.0
    np.testing.assert_allclose(
        arm().at(X_WB).link_poses(np.zeros(3), ["tip"])[0, :3, 3], [-3.0, 0.0, 3.0]
    )
    with pytest.raises(InvalidPoseError, match="X_WB of robot 'arm'"):
        arm().at(2.0 * np.eye(4))


def test_a_hand_on_an_arm():
    """What is attached comes after, under its prefix, where its root link is put."""
    X_LB = np.eye(4)
    X_LB[:3, 3] = 0.0, 0.0, 0.5
    tree = arm().attached(arm(), "tip", X_LB, prefix="hand_")
    assert tree.position_names[3:] == ("hand_shoulder", "hand_elbow", "hand_slide")
    q = configurations(tree, 4)
    X_Wtip = arm().link_poses(q[:, :3], ["tip"])[:, 0]
    X_Btip = arm().link_poses(q[:, 3:], ["tip"])[:, 0]
    np.testing.assert_allclose(
        tree.link_poses(q, ["hand_tip"])[:, 0], X_Wtip @ X_LB @ X_Btip, atol=1e-14
    )
    # Its jaw follows its own slide.
    X_Bjaw = arm().link_poses(q[:, 3:], ["jaw"])[:, 0]
    np.testing.assert_allclose(
        tree.link_poses(q, ["hand_jaw"])[:, 0], X_Wtip @ X_LB @ X_Bjaw, atol=1e-14
    )
    with pytest.raises(KinematicTreeError, match="robot 'arm' has two joints 'shoulder'"):
        arm().attached(arm(), "tip")

"""Configurations for many poses at once: reached, nearest, the same alone, and how near if not."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, SLIDE

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.planning import (
    inverse_kinematics_of_poses,
    InverseKinematicsError,
    load_robot_diagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.ik.tool_chain import ToolChain
from scene_graph_ros.robots import KinematicTreeError
from scene_graph_ros.scene_files import load_kinematic_tree, resolve_resource

ROBOTS = "package://example-robot-data/robots"
ARMS = [
    ("panda_description/urdf/panda.urdf", "panda_hand"),
    ("ur_description/urdf/ur5_robot.urdf", "tool0"),
    ("tiago_description/robots/tiago.urdf", "arm_tool_link"),
    ("z1_description/urdf/z1.urdf", "link06"),
]


def arm(path):
    """Return the tree of a robot of example-robot-data."""
    return load_kinematic_tree(resolve_resource(f"{ROBOTS}/{path}"))


def chain(joints, scale=1.0, limit=2.8):
    """Return a robot of joints ``(kind, xyz, rpy, axis, more)``, one after the other."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for i, (kind, xyz, rpy, axis, more) in enumerate(joints):
        most = limit * (scale if kind == "prismatic" else 1.0)
        bound = f'<limit lower="{-most}" upper="{most}" velocity="1" effort="1"/>'
        words = [" ".join(map(str, v)) for v in (np.array(xyz) * scale, rpy, axis)]
        parts.append(
            f'<link name="l{i + 1}"/><joint name="j{i + 1}" type="{kind}">'
            f'<parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{words[0]}" rpy="{words[1]}"/><axis xyz="{words[2]}"/>'
            f"{bound if kind in ('revolute', 'prismatic') else ''}{more}</joint>"
        )
    return load_kinematic_tree("".join([*parts, "</robot>"]))


def random_chain(rng, kinds, scale=1.0, limit=2.8):
    """Return a robot whose frames and axes are random."""
    return chain(
        [
            (kind, rng.uniform(-0.3, 0.3, 3), rng.uniform(-2, 2, 3), rng.normal(size=3), "")
            for kind in kinds
        ],
        scale,
        limit,
    )


def random_configurations(tree, rng, m):
    """Return configurations within limits, and within 3 rad or m."""
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    return rng.uniform(lower, upper, (m, tree.num_positions))


def off(tree, link, X_WTs, q):
    """Return how far tools are off, m and rad, by the tree's own products of matrices."""
    X = tree.link_poses(q, [link])[:, 0]
    turned = np.linalg.norm(X[:, :3, :3] - X_WTs[:, :3, :3], axis=(1, 2)) / math.sqrt(8.0)
    return np.linalg.norm(X[:, :3, 3] - X_WTs[:, :3, 3], axis=1), 2.0 * np.arcsin(turned)


def assert_reached(tree, link, X_WTs, found, most=1e-9):
    """All are, within limits, and as exactly as is said."""
    assert found.is_success.all(), np.flatnonzero(~found.is_success)
    q = found.configurations
    assert ((q >= tree.lower) & (q <= tree.upper)).all()
    ways, turns = off(tree, link, X_WTs, q)
    assert ways.max() <= most and turns.max() <= 1e-9
    assert found.position_errors.max() <= 1e-9 and found.rotation_errors.max() <= 1e-9


@pytest.mark.parametrize(("path", "link"), ARMS)
def test_random_poses_of_arms_are_reached(path, link):
    """Of six and seven axes, and seven on a column that slides."""
    tree = arm(path)
    q = random_configurations(tree, np.random.default_rng(7), 300)
    X_WTs = tree.link_poses(q, [link])[:, 0]
    assert_reached(tree, link, X_WTs, inverse_kinematics_of_poses(tree, link, X_WTs))


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e5])
def test_the_size_of_an_arm_does_not_matter(scale):
    """A thousandth of a millimetre, and a hundred kilometres: 1e-9 m is what is asked for."""
    rng = np.random.default_rng(2)
    tree = random_chain(rng, ["revolute", "prismatic", *["revolute"] * 5], scale)
    X_WTs = tree.link_poses(random_configurations(tree, rng, 50) * [1, scale, *[1] * 5], ["l7"])
    found = inverse_kinematics_of_poses(tree, "l7", X_WTs[:, 0])
    assert_reached(tree, "l7", X_WTs[:, 0], found)


def test_far_from_the_origin_poses_are_those_of_the_base():
    """A thousand kilometres away coordinates are known to 1e-10 m; 1e-9 is still reached."""
    X_WB = pose_from_xyz_rpy((1e6, -1e6, 1e6), (0.3, 0.2, 0.1))
    tree = arm(ARMS[1][0]).at(X_WB)
    q = random_configurations(tree, np.random.default_rng(3), 50)
    X_WTs = tree.link_poses(q, ["tool0"])[:, 0]
    found = inverse_kinematics_of_poses(tree, "tool0", X_WTs)
    assert_reached(tree, "tool0", X_WTs, found, most=1e-9)


@pytest.mark.parametrize("columns", [[2], [4], [2, 4]])
def test_singular_poses_are_reached(columns):
    """A UR5 that is stretched (elbow at 0), or whose wrist's axes are parallel."""
    tree = arm(ARMS[1][0])
    q = np.random.default_rng(4).uniform(-2.0, 2.0, (60, 6))
    q[:, columns] = 0.0
    X_WTs = tree.link_poses(q, ["tool0"])[:, 0]
    assert_reached(tree, "tool0", X_WTs, inverse_kinematics_of_poses(tree, "tool0", X_WTs))


def test_corners_of_the_limits_are_reached():
    """Each joint of a Panda is at one of its limits."""
    tree = arm(ARMS[0][0])
    at_upper = np.random.default_rng(5).random((60, tree.num_positions)) < 0.5
    X_WTs = tree.link_poses(np.where(at_upper, tree.upper, tree.lower), ["panda_hand"])[:, 0]
    found = inverse_kinematics_of_poses(tree, "panda_hand", X_WTs)
    assert_reached(tree, "panda_hand", X_WTs, found)


KINDS = st.sampled_from(["revolute", "prismatic", "continuous", "revolute"])


@settings(max_examples=25)
@given(kinds=st.lists(KINDS, min_size=1, max_size=9), seed=st.integers(0, 1000))
def test_random_chains_reach_nearly_all_that_they_can(kinds, seed):
    """Of 20 poses at most two are left, and those are told as they are."""
    rng = np.random.default_rng(seed)
    tree, link = random_chain(rng, kinds), f"l{len(kinds)}"
    X_WTs = tree.link_poses(random_configurations(tree, rng, 20), [link])[:, 0]
    found = inverse_kinematics_of_poses(tree, link, X_WTs)
    assert found.num_reached >= 18
    q = found.configurations
    assert ((q >= tree.lower) & (q <= tree.upper)).all()
    ways, turns = off(tree, link, X_WTs, q)
    np.testing.assert_allclose(found.position_errors, ways, atol=1e-13, rtol=1e-9)
    np.testing.assert_allclose(found.rotation_errors, turns, atol=1e-13, rtol=1e-6)


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


NEAR = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])


@pytest.mark.parametrize("options", [{}, {"near": NEAR}, {"tries": 3}])
def test_a_pose_has_the_same_answer_whatever_is_beside_it(cell, options):
    """Alone, in another order, and among more than are worked on together: to the last bit."""
    tree = cell.plan.tree
    q = random_configurations(tree, np.random.default_rng(6), 1100)
    X_WTs = tree.link_poses(q, ["panda_hand"])[:, 0]
    X_WTs[::50, :3, 3] *= 3.0  # some are too far
    all_of_them = inverse_kinematics_of_poses(cell, "panda_hand", X_WTs, **options)
    rows = np.array([1099, 0, 7, 50, 512, 1023, 1024])
    some = inverse_kinematics_of_poses(cell, "panda_hand", X_WTs[rows], **options)
    for name in ("is_success", "configurations", "position_errors", "rotation_errors"):
        expected = getattr(all_of_them, name)[rows]
        np.testing.assert_array_equal(getattr(some, name), expected)
        for k in (0, 3):
            one = inverse_kinematics_of_poses(cell, "panda_hand", X_WTs[rows[[k]]], **options)
            np.testing.assert_array_equal(getattr(one, name), expected[[k]])


def test_answers_are_free_of_collisions(cell):
    """Of a Panda among what stands around it, where some are not when nothing is checked."""
    tree = cell.plan.tree
    q = random_configurations(tree, np.random.default_rng(8), 3000)
    q = q[cell.check_configs_collision_free(q)][:400]
    X_WTs = tree.link_poses(q, ["panda_hand"])[:, 0]
    found = inverse_kinematics_of_poses(cell, "panda_hand", X_WTs, group="arm", near=NEAR)
    assert found.num_reached >= 396
    assert cell.check_configs_collision_free(found.configurations[found.is_success]).all()
    assert (found.configurations[:, 7] == 0.02).all()
    alone = inverse_kinematics_of_poses(tree, "panda_hand", X_WTs, group="arm", near=NEAR)
    assert not cell.check_configs_collision_free(alone.configurations).all()


def test_what_collides_everywhere_is_told_by_its_errors(tmp_path):
    """The ball on its rail is to be where another one is, and where it is not."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    X_WTs = np.array([pose_from_xyz_rpy((x, 0.0, 0.0)) for x in (1.0, 0.2)])
    found = inverse_kinematics_of_poses(checker, "ball", X_WTs)
    assert found.is_success.tolist() == [False, True]
    assert found.position_errors.max() <= 1e-9
    np.testing.assert_allclose(found.configurations[:, 0], [1.0, 0.2], atol=1e-9)


ELBOW = [
    ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1), ""),
    ("revolute", (2, 0, 0), (0, 0, 0), (0, 0, 1), ""),
    ("fixed", (1, 0, 0), (0, 0, 0), (0, 0, 1), ""),
]


def test_the_nearest_elbow_is_chosen():
    """To (2, 1), pointing along y, leads elbow 90 degrees; mirrored it points along (4, -3)."""
    tree = chain(ELBOW)
    one = pose_from_xyz_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2))
    found = inverse_kinematics_of_poses(tree, "l3", one[np.newaxis])
    np.testing.assert_allclose(found.configurations, [[0.0, math.pi / 2]], atol=1e-9)
    mirrored = 2.0 * math.atan2(1.0, 2.0) - math.pi / 2
    other = pose_from_xyz_rpy((2.0, 1.0, 0.0), (0.0, 0.0, mirrored))
    both = inverse_kinematics_of_poses(tree, "l3", np.array([one, other]))
    expected = [[0.0, math.pi / 2], [2.0 * math.atan2(1.0, 2.0), -math.pi / 2]]
    np.testing.assert_allclose(both.configurations, expected, atol=1e-9)


def test_the_answer_is_the_nearest_to_each_ones_own_configuration():
    """Of a UR5, up to 0.1 rad away in each joint: no farther than the one that it was made of."""
    tree, rng = arm(ARMS[1][0]), np.random.default_rng(9)
    q = rng.uniform(-2.0, 2.0, (40, 6))
    near = q + rng.uniform(-0.1, 0.1, q.shape)
    X_WTs = tree.link_poses(q, ["tool0"])[:, 0]
    found = inverse_kinematics_of_poses(tree, "tool0", X_WTs, near=near)
    assert_reached(tree, "tool0", X_WTs, found)
    way = np.linalg.norm(found.configurations - near, axis=1)
    assert (way <= np.linalg.norm(q - near, axis=1) + 1e-8).all()


def test_what_the_pose_leaves_free_is_used_to_be_near():
    """A rail under an arm of one joint: the pose says all but how the first two joints share."""
    slide = ("prismatic", (0, 0, 0), (0, 0, 0), (1, 0, 0), "")
    tree = chain([slide, slide, ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1), "")])
    X_WTs = np.array([pose_from_xyz_rpy((1.4, 0.0, 0.0), (0.0, 0.0, 0.3))])
    found = inverse_kinematics_of_poses(tree, "l3", X_WTs, near=[0.6, 0.2, 0.0])
    # 0.8 m of 1.4 are there; the nearest way adds as much to both.
    np.testing.assert_allclose(found.configurations, [[0.9, 0.5, 0.3]], atol=2e-3)
    assert found.position_errors[0] <= 1e-9


def test_whole_turns_are_taken_off():
    """A joint without limits ends within half a turn of near, one with limits within them."""
    turning = ("continuous", (0, 0, 0), (0, 0, 0), (0, 0, 1), "")
    free, bounded = chain([turning]), chain([("revolute", *turning[1:])], limit=7.0)
    X_WTs = np.array([pose_from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.5))])
    for tree, near, expected in (
        (free, 100.0, 0.5 + 32.0 * math.pi),
        (free, -3.0, 0.5 - 2.0 * math.pi),
        (bounded, 6.9, 0.5 + 2.0 * math.pi),
        (bounded, -6.9, 0.5 - 2.0 * math.pi),
    ):
        found = inverse_kinematics_of_poses(tree, "l1", X_WTs, near=[near])
        np.testing.assert_allclose(found.configurations, [[expected]], atol=1e-9)


def test_followers_turn_with_their_leader():
    """A finger of three joints, each of which turns half as far as the one before, and back."""
    follow = '<mimic joint="j1" multiplier="{}" offset="0.1"/>'
    tree = chain(
        [
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1), ""),
            ("revolute", (1, 0, 0), (0, 0, 0), (0, 0, 1), follow.format(0.5)),
            ("revolute", (1, 0, 0), (0.3, 0, 0), (0, 0, 1), follow.format(-0.25)),
        ]
    )
    q = np.linspace(-2.0, 2.0, 20)[:, np.newaxis]
    X_WTs = tree.link_poses(q, ["l3"])[:, 0]
    found = inverse_kinematics_of_poses(tree, "l3", X_WTs)
    assert found.is_success.all()
    np.testing.assert_allclose(found.configurations, q, atol=1e-8)


def test_drones_and_carts_are_put_anywhere(tmp_path):
    """Floating and planar joints, also far away; a drone's quaternion has length 1."""
    rng = np.random.default_rng(11)
    X_WTs = np.array(
        [pose_from_xyz_rpy(p, r) for p, r in zip(*rng.uniform(-3, 3, (2, 30, 3)), strict=True)]
    )
    X_WTs[0, :3, 3] = 1e4
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE)).plan.tree
    found = inverse_kinematics_of_poses(drone, "body", X_WTs)
    assert_reached(drone, "body", X_WTs, found)
    np.testing.assert_allclose(np.linalg.norm(found.configurations[:, :4], axis=1), 1.0)
    cart = chain([("planar", (1, 2, 0.5), (0.2, 0.1, 0), (0, 0, 1), "")])
    q = rng.uniform(-3.0, 3.0, (30, 3))
    X_WTs = cart.link_poses(q, ["l1"])[:, 0]
    found = inverse_kinematics_of_poses(cart, "l1", X_WTs)
    np.testing.assert_allclose(found.configurations, q, atol=1e-8)


def random_quaternions(rng, count):
    """Return some of length 1."""
    Q = rng.normal(size=(count, 4))
    return Q / np.linalg.norm(Q, axis=1)[:, np.newaxis]


def test_turns_of_a_floating_joint_are_told_by_its_name(tmp_path):
    """Four of them are its quaternion, up to the sign of that."""
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE)).plan.tree
    rng, q = np.random.default_rng(5), np.repeat([drone.zero_configuration()], 200, axis=0)
    chain_of = ToolChain.of(drone, "body", np.eye(4), np.ones(7, dtype=bool), q[0])
    names = ["free.x", "free.y", "free.z", *["free"] * 4]
    assert chain_of.names(drone.position_names) == names
    q[:, :4] = random_quaternions(rng, 200)
    x = chain_of.coordinates(q)
    np.testing.assert_allclose(chain_of.configurations(x, q), q, atol=1e-15)
    assert (np.abs(np.sin(x[:, 4])) <= np.sqrt(0.5)).all()
    other = x + rng.normal(size=x.shape)
    there = chain_of.configurations(other, q)
    again = np.array([chain_of.regular(each) for each in other])
    np.testing.assert_allclose(chain_of.configurations(again, q), there, atol=1e-15)
    angles = 2.0 * np.arccos((q[:, :4] * there[:, :4]).sum(axis=1).clip(-1.0, 1.0))
    np.testing.assert_allclose(chain_of.changes(x, other)[:, 3], angles, atol=1e-7)


@pytest.mark.parametrize("is_near", [False, True])
def test_a_drone_may_turn_any_way(tmp_path, is_near):
    """Quarter turns about two axes, where three angles have two axes that are one."""
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE)).plan.tree
    steep = 0.5 * np.pi * np.array([1.0, -1.0, 1.0 - 1e-9])
    rng = np.random.default_rng(3)
    X_WTs = np.array(
        [
            pose_from_xyz_rpy(rng.normal(size=3), (a, pitch, b))
            for pitch in steep
            for a, b in 0.5 * np.pi * rng.integers(-4, 5, (40, 2))
            + rng.choice([0.0, 0.3], (40, 2))
        ]
    )
    near = None
    if is_near:
        near = np.repeat(drone.zero_configuration()[np.newaxis], len(X_WTs), axis=0)
        near[:, :4] = random_quaternions(rng, len(X_WTs))
    found = inverse_kinematics_of_poses(drone, "body", X_WTs, near=near)
    assert_reached(drone, "body", X_WTs, found)
    if is_near:
        # Of the two quaternions that are one turn, the nearer one.
        assert ((found.configurations * near)[:, :4].sum(axis=1) >= 0.0).all()


@pytest.mark.parametrize("near", [None, [0.3, -0.2]])
def test_what_is_out_of_reach_comes_as_near_as_it_can(near):
    """Stretched towards a point at distance d >= 3 m the tool is d - 3 off, and not turned."""
    tree = chain(ELBOW)
    angles, far = np.linspace(-2.5, 2.5, 11), np.linspace(3.1, 9.0, 11)
    X_WTs = np.array(
        [
            pose_from_xyz_rpy((d * math.cos(a), d * math.sin(a), 0.0), (0.0, 0.0, a))
            for a, d in zip(angles, far, strict=True)
        ]
    )
    found = inverse_kinematics_of_poses(tree, "l3", X_WTs, near=near)
    assert not found.is_success.any()
    np.testing.assert_allclose(found.position_errors, far - 3.0, rtol=1e-9)
    assert found.rotation_errors.max() <= 1e-6
    np.testing.assert_allclose(found.configurations[:, 0], angles, atol=1e-4)


def test_what_stays_may_differ_from_pose_to_pose():
    """The column of a Tiago is where each one's own configuration says; only the arm moves."""
    path, link = ARMS[2]
    arm_joints = "".join(f'<joint name="arm_{i}_joint"/>' for i in range(1, 8))
    tree = load_kinematic_tree(
        resolve_resource(f"{ROBOTS}/{path}"),
        f'<robot name="tiago"><group name="arm">{arm_joints}</group></robot>',
    )
    rng = np.random.default_rng(12)
    q = random_configurations(tree, rng, 40)
    lift = tree.position_index("torso_lift_joint")
    q[:, lift] = np.repeat([0.05, 0.2], 20)
    X_WTs = tree.link_poses(q, [link])[:, 0]
    near = np.clip(q + rng.normal(scale=0.1, size=q.shape), tree.lower, tree.upper)
    near[:, lift] = q[:, lift]
    found = inverse_kinematics_of_poses(tree, link, X_WTs, near=near, group="arm")
    assert_reached(tree, link, X_WTs, found)
    stays = np.setdiff1d(np.arange(tree.num_positions), tree.group_positions("arm"))
    np.testing.assert_array_equal(found.configurations[:, stays], near[:, stays])


def test_no_poses_no_joints_and_bad_arguments():
    """With the name of the argument."""
    tree = chain(ELBOW)
    assert inverse_kinematics_of_poses(tree, "l3", np.empty((0, 4, 4))).num_poses == 0
    base = inverse_kinematics_of_poses(tree, "l0", np.array([np.eye(4), np.eye(4)]))
    assert base.is_success.all()
    moved = inverse_kinematics_of_poses(tree, "l0", [pose_from_xyz_rpy((0.0, 3.0, 4.0))])
    assert not moved.is_success[0] and moved.position_errors[0] == pytest.approx(5.0)
    ask = [np.eye(4)]
    with pytest.raises(InvalidPoseError, match=r"X_WTs\[1\]"):
        inverse_kinematics_of_poses(tree, "l3", [np.eye(4), np.full((4, 4), math.nan)])
    with pytest.raises(InvalidPoseError, match="X_LT"):
        inverse_kinematics_of_poses(tree, "l3", ask, X_LT=np.zeros((4, 4)))
    for field, value in (("tries", 0), ("tries", 1.5), ("seed", -1), ("seed", "x")):
        with pytest.raises(InverseKinematicsError, match=f"{field} must be a whole number"):
            inverse_kinematics_of_poses(tree, "l3", ask, **{field: value})
    with pytest.raises(InverseKinematicsError, match=r"near must have shape \(nq,\) or \(1, nq\)"):
        inverse_kinematics_of_poses(tree, "l3", ask, near=np.zeros((2, 2)))
    with pytest.raises(KinematicTreeError, match="must be finite"):
        inverse_kinematics_of_poses(tree, "l3", ask, near=[math.nan, 0.0])
    with pytest.raises(KinematicTreeError, match="no link 'top'"):
        inverse_kinematics_of_poses(tree, "top", ask)
    with pytest.raises(KinematicTreeError, match="has no group 'arm'"):
        inverse_kinematics_of_poses(tree, "l3", ask, group="arm")

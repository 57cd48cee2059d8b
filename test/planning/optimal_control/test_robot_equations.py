"""Equations of motion: against pinocchio, and what joints that mimic and slide in a plane do."""

import numpy as np
import pinocchio
import pytest
from robots import find_robot, ROBOTS, URDF_ONLY

from scene_graph_ros.planning.optimal_control.robot_equations import RobotEquations
from scene_graph_ros.robots import tree_inertias
from scene_graph_ros.robots.tree_of_model import tree_of_model
from scene_graph_ros.scene_files import load_urdf
from scene_graph_ros.scene_files.packages import resolve_resource

GRAVITY = (0.3, -0.2, -9.7)

SLEDGE = """<robot name="sledge"><link name="floor"/>
  <link name="sledge"><inertial><origin xyz="0.2 0.1 0.3"/><mass value="3"/>
    <inertia ixx="1" ixy="0.1" ixz="0" iyy="2" iyz="0" izz="2.5"/></inertial></link>
  <link name="box"><inertial><mass value="1.5"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="slide" type="planar"><parent link="floor"/><child link="sledge"/>
    <origin xyz="0.1 0 0.4" rpy="0.2 0.3 0"/><axis xyz="0 0.6 0.8"/></joint>
  <joint name="turn" type="continuous"><parent link="sledge"/><child link="box"/>
    <origin xyz="0.5 0 0"/><axis xyz="1 0 0"/></joint></robot>"""


def numbers(*values):
    """Return what CasADi computed as arrays."""
    arrays = [np.array(value) for value in values]
    return arrays[0] if len(arrays) == 1 else arrays


def equations(robot, **options):
    """Return the equations of a robot."""
    tree = tree_of_model(robot, **options)
    return RobotEquations(tree_inertias(robot, tree), GRAVITY)


@pytest.mark.parametrize("name", ["ur5", "double_pendulum", "z1"])
def test_arms_move_as_pinocchio_says(name):
    """Inverse dynamics, mass matrix, bias and forward dynamics, at random states."""
    robot, _ = find_robot(name)
    ours = equations(robot, follows=False)
    tree = ours.inertias.tree
    path = ROBOTS[name][0] if name in ROBOTS else URDF_ONLY[name]
    model = pinocchio.buildModelFromUrdf(
        str(resolve_resource(f"package://example-robot-data/robots/{path}"))
    )
    model.gravity.linear = np.array(GRAVITY)
    data = model.createData()
    order = [tree.position_index(joint) for joint in model.names[1:]]
    rng = np.random.default_rng(0)
    for _ in range(3):
        q, v, a = rng.uniform(-2.0, 2.0, (3, len(order)))
        at = q[order]
        turned = [
            part
            for k, angle in enumerate(at, start=1)
            for part in ([np.cos(angle), np.sin(angle)] if model.joints[k].nq == 2 else [angle])
        ]
        theirs = np.array(turned)
        wanted = pinocchio.rnea(model, data, theirs, v[order], a[order])
        size = 1e-12 * max(1.0, abs(wanted).max())
        found = numbers(ours.inverse_dynamics(q, v, a)).ravel()
        np.testing.assert_allclose(found[order], wanted, atol=size)
        M = pinocchio.crba(model, data, theirs)
        M = np.triu(M) + np.triu(M, 1).T
        np.testing.assert_allclose(
            numbers(ours.mass_matrix(q))[np.ix_(order, order)], M, atol=size
        )
        moved = pinocchio.aba(model, data, theirs, v[order], a[order])
        found = numbers(ours.forward_dynamics(q, v, a)).ravel()
        np.testing.assert_allclose(found[order], moved, rtol=1e-9, atol=1e-9)


def test_a_floating_robot_moves_as_pinocchio_says():
    """Its velocity is in the world's axes, pinocchio's in the body's: the same forces move it."""
    robot, _ = find_robot("anymal_b")
    ours = equations(robot, floating_base="base")
    tree = ours.inertias.tree
    file = resolve_resource(f"package://example-robot-data/robots/{ROBOTS['anymal_b'][0]}")
    model = pinocchio.buildModelFromUrdf(str(file), pinocchio.JointModelFreeFlyer())
    model.gravity.linear = np.array(GRAVITY)
    data = model.createData()
    order = [tree.position_index(joint) for joint in model.names[2:]]
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.0, 1.0, tree.num_positions)
    v, a = rng.uniform(-1.0, 1.0, (2, tree.num_velocities))
    w, x, y, z = q[:4] / np.linalg.norm(q[:4])
    R = pinocchio.Quaternion(w, x, y, z).matrix()
    legs = [k - 1 for k in order]

    def local(twist):
        return np.concatenate([R.T @ twist[3:6], R.T @ twist[:3], twist[legs]])

    theirs = np.array([*q[4:7], x, y, z, w, *q[order]])
    rate = local(a)
    rate[:3] -= np.cross(R.T @ v[:3], R.T @ v[3:6])
    wanted = pinocchio.rnea(model, data, theirs, local(v), rate)
    found = numbers(ours.inverse_dynamics(q, v, a)).ravel()
    np.testing.assert_allclose(found[:3], R @ wanted[3:6], atol=1e-10)
    np.testing.assert_allclose(found[3:6], R @ wanted[:3], atol=1e-10)
    np.testing.assert_allclose(found[legs], wanted[6:], atol=1e-10)
    back = numbers(ours.forward_dynamics(q, v, found)).ravel()
    np.testing.assert_allclose(back, a, atol=1e-9)
    # The quaternion's rate keeps its length, and gives the angular velocity again.
    rates = numbers(ours.position_rates(q, v)).ravel()
    np.testing.assert_allclose(tree.velocity_map(q) @ rates, v, atol=1e-13)
    assert abs(rates[:4] @ q[:4]) < 1e-15


def test_what_follows_a_joint_is_carried_by_it():
    """With T from positions to those without mimicry, the mass matrix is T' M T."""
    robot, _ = find_robot("panda")
    ours, free = equations(robot), equations(robot, follows=False)
    tree, all_joints = ours.inertias.tree, free.inertias.tree
    T = np.zeros((all_joints.num_positions, tree.num_positions))
    for joint in tree.joints:
        column = tree.position_index(joint.mimics or joint.name)
        T[all_joints.position_index(joint.name), column] = joint.multiplier
    q, v, a = np.random.default_rng(1).uniform(-1.0, 1.0, (3, tree.num_positions))
    M = T.T @ numbers(free.mass_matrix(T @ q)) @ T
    np.testing.assert_allclose(numbers(ours.mass_matrix(q)), M, atol=1e-13)
    wanted = T.T @ numbers(free.inverse_dynamics(T @ q, T @ v, T @ a))
    np.testing.assert_allclose(numbers(ours.inverse_dynamics(q, v, a)), wanted, atol=1e-12)


def test_a_sledge_that_nobody_pushes_keeps_its_energy():
    """Power is what gravity does: the energy of a planar joint and a hinge changes by nothing."""
    ours = equations(load_urdf(SLEDGE))
    inertias = ours.inertias

    def energy(q, v):
        height = inertias.centre_of_mass(q) @ np.array(GRAVITY)
        return 0.5 * v @ numbers(ours.mass_matrix(q)) @ v - inertias.total_mass * height

    q, v = np.random.default_rng(3).uniform(-1.0, 1.0, (2, 4))
    push = np.array([0.3, -0.4, 0.2, 0.1])
    a = numbers(ours.forward_dynamics(q, v, push)).ravel()
    h = 1e-5
    change = energy(q + h * v + 0.5 * h * h * a, v + h * a)
    change -= energy(q - h * v + 0.5 * h * h * a, v - h * a)
    assert change / (2.0 * h) == pytest.approx(push @ v, abs=1e-8)

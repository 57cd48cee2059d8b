"""Masses of robots: against pinocchio's own reader."""

import numpy as np
import pinocchio
import pytest
from robots import find_robot, ROBOTS

from scene_graph_ros.robots import KinematicTreeError, tree_inertias
from scene_graph_ros.scene_files import load_urdf
from scene_graph_ros.scene_files.packages import resolve_resource


@pytest.mark.parametrize("name", ["talos", "panda", "anymal_b"])
def test_the_centre_of_mass_is_pinocchios(name):
    """Pinocchio reads the same file by itself and puts the same mass at the same place."""
    robot, _ = find_robot(name)
    tree = robot.kinematic_tree(floating_base="base")
    file = resolve_resource(f"package://example-robot-data/robots/{ROBOTS[name][0]}")
    # With a base that floats: masses fixed to the world are left out there.
    model = pinocchio.buildModelFromUrdf(str(file), pinocchio.JointModelFreeFlyer())
    ours = np.random.default_rng(5).uniform(-1.0, 1.0, tree.num_positions)
    ours[:4] /= np.linalg.norm(ours[:4])
    positions = dict(zip(tree.position_names, ours, strict=True))
    for joint in tree.joints:
        if joint.mimics:
            positions[joint.name] = joint.multiplier * positions[joint.mimics] + joint.offset
    theirs = pinocchio.neutral(model)
    theirs[:7] = [*ours[4:7], *ours[1:4], ours[0]]
    for k, joint in enumerate(model.names[2:], start=2):
        angle, at = positions[joint], model.joints[k].idx_q
        turns = model.joints[k].nq == 2
        theirs[at : at + model.joints[k].nq] = [np.cos(angle), np.sin(angle)] if turns else angle
    wanted = pinocchio.centerOfMass(model, model.createData(), theirs)
    inertias = tree_inertias(robot, tree)
    np.testing.assert_allclose(inertias.centre_of_mass(ours), wanted, atol=1e-12)
    many = inertias.centre_of_mass([ours, ours])
    np.testing.assert_allclose(many, [wanted, wanted], atol=1e-12)
    assert inertias.total_mass == pytest.approx(pinocchio.computeTotalMass(model), rel=1e-12)


def test_a_robot_without_masses_has_no_centre():
    """The message says whose links weigh nothing."""
    robot = load_urdf('<robot name="light"><link name="a"/></robot>')
    tree = robot.kinematic_tree()
    with pytest.raises(KinematicTreeError, match="no link of robot 'light' has a mass"):
        tree_inertias(robot, tree).centre_of_mass([])

"""How fast points go along directions, by chains of joints, against Jacobians of points."""

import numpy as np
import pytest
from robots import find_robot

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.robots.joint_chains import add_rates, AXIS, place_axes
from scene_graph_ros.robots.tree_kernels import LANES, place_joints
from scene_graph_ros.robots.tree_of_model import tree_of_model
from scene_graph_ros.scene_files import load_kinematic_tree

# Planar and floating joints, turned axes, one that mimics another twice as fast, a bare base.
MIXED = """<robot name="mixed"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="e"/><link name="f"/>
  <joint name="free" type="floating"><parent link="a"/><child link="b"/>
    <origin xyz="0 0 1" rpy="0.3 -0.2 0.9"/></joint>
  <joint name="floor" type="planar"><parent link="b"/><child link="c"/>
    <origin xyz="1 0 0" rpy="0.1 0.5 0"/><axis xyz="0.48 0.6 0.64"/></joint>
  <joint name="turn" type="continuous"><parent link="c"/><child link="d"/>
    <origin xyz="0.3 0.2 0" rpy="0.7 0 0.4"/><axis xyz="0.6 0 0.8"/></joint>
  <joint name="slide" type="prismatic"><parent link="d"/><child link="e"/>
    <origin xyz="0 0.4 0"/><axis xyz="1 0 0"/><limit lower="-9" upper="9"/></joint>
  <joint name="twice" type="continuous"><parent link="e"/><child link="f"/>
    <origin xyz="0.1 0 0.2"/><axis xyz="0 1 0"/><mimic joint="turn" multiplier="-2"/></joint>
</robot>"""


@kernel
def _rates(tree, chains, q, X_WB, X_WJ, work, joint, k, p, n, axes, scratch, gradient):
    place_joints(tree, q, 0, X_WB, X_WJ, work)
    place_axes(tree, chains, X_WJ, k, axes)
    add_rates(chains, axes, joint, p, n, -0.5, scratch, gradient)


@pytest.mark.parametrize("source", [MIXED, "panda", "baxter"])
def test_rates_are_those_of_jacobians(source):
    """For each link: n . J v of a point fixed to it, times what is asked, added to what is there.

    Jacobians of points are held to pinocchio's elsewhere.
    """
    tree = load_kinematic_tree(MIXED) if source == MIXED else tree_of_model(*find_robot(source))
    rng = np.random.default_rng(4)
    q = rng.uniform(-1.0, 1.0, (LANES, tree.num_positions))
    X_WJ, work = np.empty((len(tree.table.kinds), 12, LANES)), np.empty((3, LANES))
    axes, scratch = np.empty(AXIS * len(tree.chains.joints)), np.empty(LANES)
    X_WL = tree.link_poses(q)
    for row, link in enumerate(tree.link_names):
        k, p_LQ, n = row % LANES, rng.normal(size=3), rng.normal(size=3)
        X = X_WL[k, row]
        p_WQ = X[:3, :3] @ p_LQ + X[:3, 3]
        gradient = np.ones(tree.num_velocities)
        _rates(
            tree.table,
            tree.chains,
            q,
            tree.X_WB,
            X_WJ,
            work,
            tree.joint_of_link[row],
            k,
            tuple(p_WQ),
            tuple(n),
            axes,
            scratch,
            gradient,
        )
        expected = 1.0 - 0.5 * (n @ tree.jacobians(q[k], link, p_LQ)[3:])
        np.testing.assert_allclose(gradient, expected, atol=1e-13)


def test_of_a_tree_without_joints_there_are_no_chains():
    """The base's chain is empty."""
    tree = load_kinematic_tree('<robot name="stone"><link name="a"/></robot>')
    assert len(tree.chains.joints) == 0 and tree.chains.counts.tolist() == [0]

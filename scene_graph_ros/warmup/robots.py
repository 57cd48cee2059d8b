"""Calls that compile the kernels of robots: of joint states, and of planning."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import REVOLUTE

__all__ = ["place_links", "plan"]


def _one_joint() -> KinematicTree:
    joint = TreeJoint("joint", REVOLUTE, 0, np.eye(4))
    return KinematicTree("warm_up", (joint,), ("link",), (1,), np.eye(4)[np.newaxis])


def place_links() -> None:
    """Ask where a robot's link is, as joint states do."""
    _one_joint().link_poses(np.zeros(1))


def _check_many(q: np.ndarray) -> None:
    """Ask for as many balls as a tree is worth."""
    from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
    from scene_graph_ros.planning.pairs.static_tree import FEWEST

    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    frame = scene_graph.register_frame(source, GeometryFrame("link"))
    for k in range(FEWEST + 1):
        X_WG = np.eye(4)
        X_WG[0, 3] = 3.0 * k
        ball = GeometryInstance(X_WG, Sphere(1.0), str(k))
        ball.set_proximity_properties(ProximityProperties())
        if k:
            scene_graph.register_anchored_geometry(source, ball)
        else:
            scene_graph.register_geometry(source, frame, ball)
    context = scene_graph.create_default_context()
    frames = MappingProxyType({"link": frame})
    checker = SceneGraphCollisionChecker(RobotDiagram(scene_graph, context, _one_joint(), frames))
    checker.check_configs_collision_free(q)


def plan() -> None:
    """Ask a robot of one link whether it touches a ball, and for paths, cliques and walks."""
    from scene_graph_ros.planning import (
        MaxCliqueSolverViaBranchAndBound,
        plan_path,
        plan_trajectory,
        PoseTarget,
        PositionConstraint,
        RobotDiagram,
        SafeVelocity,
        SceneGraphCollisionChecker,
        thin_trajectory,
        time_path,
        ZmpPlanner,
    )
    from scene_graph_ros.planning.regions.hit_and_run import walked
    from scene_graph_ros.trajectories import MotionLimits, PiecewisePolynomial

    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    frame = scene_graph.register_frame(source, GeometryFrame("link"))
    X_WG = np.eye(4)
    X_WG[0, 3] = 3.0
    still = GeometryInstance(X_WG, Sphere(1.0), "still")
    moving = GeometryInstance(np.eye(4), Sphere(1.0), "moving")
    thrown = GeometryInstance(X_WG, Sphere(0.5), "thrown")
    for ball in (still, moving, thrown):
        ball.set_proximity_properties(ProximityProperties())
    scene_graph.register_anchored_geometry(source, still)
    scene_graph.register_geometry(source, frame, moving)
    other = scene_graph.register_frame(source, GeometryFrame("other"))
    scene_graph.register_geometry(source, other, thrown)
    context = scene_graph.create_default_context()
    frames = MappingProxyType({"link": frame})
    checker = SceneGraphCollisionChecker(RobotDiagram(scene_graph, context, _one_joint(), frames))
    q = np.zeros((2, 1))
    checker.check_configs_collision_free(q)
    _check_many(q)
    checker.calc_robot_clearance(q[0], 2.0)
    checker.measure_edges(q[np.newaxis])
    plan_path(checker, [0.0], [1.0])
    plan_path(checker, [0.0], PoseTarget("link", np.eye(4)))
    box = PositionConstraint("link", np.full(3, -1.0), np.ones(3))
    plan_path(checker, [0.0], [1.0], constraints=[box])
    sides = np.array([[1.0], [-1.0]])
    walked(sides, np.ones(2), q, 1, np.eye(1), np.random.default_rng(0))
    MaxCliqueSolverViaBranchAndBound().solve_max_clique(np.ones((3, 3)))
    loose = MotionLimits(np.ones(1), np.ones(1), ("joint",))
    time_path(checker, [[0.0], [0.5], [0.0]], loose, deviation=0.1)
    soft = MotionLimits(np.ones(1), np.ones(1), ("joint",), jerks=np.ones(1))
    timed = time_path(checker, [[0.0], [0.5]], soft, start_velocity=[0.1])
    thin_trajectory(checker, timed, soft, 4)
    barrier = SafeVelocity(checker, keep=1.5, limits=loose)
    barrier.filter([0.0], [0.1], 0.1)
    barrier.filter([0.0], [0.1], 0.1, [0.0], {other: 1.0})
    plan_trajectory(checker, [0.0], [1.0], soft, constraints=[box])
    zmp = PiecewisePolynomial.first_order_hold([0.0, 1.0], [[0.0, 0.0], [1.0, 0.0]])
    ZmpPlanner().plan(zmp, np.zeros(4), 1.0)

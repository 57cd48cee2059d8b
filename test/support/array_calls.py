"""Calls of public functions of robots, planning and trajectories with small arrays."""

from __future__ import annotations

import numpy as np
from robot_scenes import SLIDE

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.planning import (
    inverse_kinematics_of_poses,
    LinearDistanceAndInterpolationProvider,
    load_robot_diagram,
    MaxCliqueSolverViaMip,
    plan_path,
    plan_straight,
    RationalForwardKinematics,
    region_around,
    RobotDiagram,
    RobotDiagramBuilder,
    SafeVelocity,
    SceneGraphCollisionChecker,
    time_path,
    visibility_graph,
    ZmpPlanner,
)
from scene_graph_ros.robots import Kinematics
from scene_graph_ros.trajectories import (
    BezierCurve,
    ExponentialPlusPiecewisePolynomial,
    MotionLimits,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    TrajectoryPoints,
)

__all__ = ["CALLS", "Rails"]

TURNED = [[0.0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 0, 1]]
Q1, Q2 = [1.0, 2], [3.0, 5]
SOME = [Q1, Q2, [0.0, 7]]
EDGES = [[Q1, Q2], [Q2, Q1]]
T = [0.0, 1, 2]

AT_2 = [[1.0, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""A pose at x = 2."""


class Rails:
    """Two balls on rails, a checker of them, and a post."""

    def __init__(self, folder):
        self.urdf = folder / "slide.urdf"
        self.urdf.write_text(SLIDE)
        robots = [f"  - {{name: {name}, urdf: slide.urdf}}\n" for name in ("left", "right")]
        scene = folder / "two.yaml"
        scene.write_text("version: 1\nrobots:\n" + "".join(robots))
        self.model = load_robot_diagram(scene)
        self.checker = SceneGraphCollisionChecker(self.model)
        self.tree = self.model.tree
        builder = RobotDiagramBuilder()
        self.robot = builder.add_robot("one", self.urdf)
        self.one = builder.build().tree
        self.free = self.checker.clone()
        self.free.set_collision_filtered_with_all_bodies("left/ball")
        self.limits = MotionLimits.of_tree(
            self.tree, velocities=dict.fromkeys(self.tree.position_names, 1.0), accelerations=2.0
        )
        self.zmp = self.walk([0.0, 0, 0, 0])

    @staticmethod
    def walk(x0, Qy=None, R=None):
        """Return a planner of a walk."""
        path = PiecewisePolynomial.first_order_hold(T, [[0.0, 0], [1, 0], [1, 1]])
        planner = ZmpPlanner()
        planner.plan(path, x0, 1.0, Qy=Qy, R=R)
        return planner

    def based(self, X_WB):
        """Return where the links of a robot are that was put elsewhere."""
        builder = RobotDiagramBuilder()
        robots = {"r": builder.add_robot("r", self.urdf)}
        graph, context = builder.scene_graph, builder.scene_graph.create_default_context()
        diagram = RobotDiagram.of_robots(robots, graph, context, bases={"r": X_WB})
        return diagram.tree.link_poses([1.0])

    def guessed(self, initial_guess):
        """Return a solver's guess that was set."""
        solver = MaxCliqueSolverViaMip()
        solver.set_initial_guess(initial_guess)
        return solver.get_initial_guess()

    def updated(self, positions):
        """Return a configuration that was set."""
        kinematics = Kinematics(self.robot.model)
        kinematics.update(["rail"], positions)
        return kinematics.configuration

    @staticmethod
    def exponential(K, A, alpha):
        """Return a curve of two segments."""
        polynomial = PiecewisePolynomial.first_order_hold(T, SOME)
        return ExponentialPlusPiecewisePolynomial.of_matrices(K, A, alpha, polynomial)

    @staticmethod
    def parameterized():
        """Return a path by its time scaling."""
        scaling = PiecewisePolynomial.first_order_hold(T, [[0.0], [1], [2]])
        return PathParameterizedTrajectory(BezierCurve(0, 2, SOME), scaling)

    def context(self):
        return self.checker.model_context(0)

    def added(self, method, X_AG):
        """Return where a shape is that was added to a copy of the checker."""
        copy = self.checker.clone()
        method = getattr(copy, method)
        method("group", copy.bodies[0], Sphere(0.2), X_AG)
        return copy.get_all_added_collision_shapes()["group"][0].pose_in_body

    def changed(self, method, matrix, result):
        """Return a matrix of a copy of the checker that was set."""
        copy = self.checker.clone()
        getattr(copy, method)(matrix)
        return getattr(copy, result)()

    def provider(self, distance_weights):
        provider = LinearDistanceAndInterpolationProvider(self.tree, distance_weights)
        return provider.distance_weights


def of_checker(name, **more):
    """Return a call of a checker's method."""
    return lambda w, **arrays: getattr(w.checker, name)(**arrays, **more)


def in_context(name, **more):
    """Return a call of a checker's method about a context."""
    return lambda w, **arrays: getattr(w.checker, name)(w.context(), **arrays, **more)


def of_tree(name, **more):
    """Return a call of a tree's method."""
    return lambda w, **arrays: getattr(w.tree, name)(**arrays, **more)


ONE = {"q": Q1}
EDGE = {"q1": Q1, "q2": Q2}
CALLS = {
    "CollisionChecker.add_collision_shape_to_body": (
        lambda w, X_AG: w.added("add_collision_shape_to_body", X_AG),
        {"X_AG": TURNED},
    ),
    "CollisionChecker.add_collision_shape_to_frame": (
        lambda w, X_AG: w.added("add_collision_shape_to_frame", X_AG),
        {"X_AG": TURNED},
    ),
    "LinearDistanceAndInterpolationProvider.__init__": (
        Rails.provider,
        {"distance_weights": [2.0, 3]},
    ),
    **{
        f"CollisionChecker.{name}": (in_context(name), arrays)
        for name, arrays in {
            "check_context_config_collision_free": ONE,
            "check_context_edge_collision_free": EDGE,
            "classify_context_body_collisions": ONE,
            "measure_context_edge": EDGE,
            "measure_context_edge_collision_free": EDGE,
        }.items()
    },
    "CollisionChecker.update_context_positions": (
        lambda w, q: w.checker.update_context_positions(w.context(), q).q,
        ONE,
    ),
    "CollisionChecker.update_positions": (lambda w, q: w.checker.update_positions(q).q, ONE),
    "CollisionCheckerContext.set_positions": (
        lambda w, q: (w.context().set_positions(q), w.context().q)[1],
        ONE,
    ),
    "CollisionChecker.calc_context_robot_clearance": (
        in_context("calc_context_robot_clearance", influence_distance=9.0),
        ONE,
    ),
    "SceneGraphCollisionChecker.calc_robot_clearance": (
        of_checker("calc_robot_clearance", influence_distance=9.0),
        ONE,
    ),
    "SceneGraphCollisionChecker.calc_robot_clearances": (
        of_checker("calc_robot_clearances", influence_distance=9.0),
        {"configurations": SOME},
    ),
    "SceneGraphCollisionChecker.calc_clearance_columns": (
        of_checker("calc_clearance_columns", influence_distance=9.0),
        {"configurations": SOME},
    ),
    "SceneGraphCollisionChecker.calc_pair_depth": (
        lambda w, q: w.checker.calc_pair_depth(q, w.checker.find_colliding_pair([2.0, 2.0])),
        {"q": [2.0, 2]},
    ),
    **{
        f"CollisionChecker.{name}": (of_checker(name), EDGE)
        for name in (
            *("check_edge_collision_free", "check_edge_collision_free_parallel"),
            *("measure_edge", "measure_edge_collision_free"),
            "measure_edge_collision_free_parallel",
        )
    },
    "CollisionChecker.check_edges_by_samples": (
        of_checker("check_edges_by_samples"),
        {"edges": EDGES},
    ),
    "CollisionChecker.measure_edges_collision_free": (
        of_checker("measure_edges_collision_free"),
        {"edges": EDGES},
    ),
    **{
        f"CollisionChecker.{name}": (of_checker(name), EDGE)
        for name in ("compute_configuration_distance", "samples", "way")
    },
    "CollisionChecker.interpolate_between_configurations": (
        of_checker("interpolate_between_configurations", ratio=0.25),
        EDGE,
    ),
    "DistanceAndInterpolationProvider.compute_configuration_distance": (
        lambda w, q1, q2: (
            w.checker.distance_and_interpolation_provider.compute_configuration_distance(q1, q2)
        ),
        EDGE,
    ),
    "DistanceAndInterpolationProvider.interpolate_between_configurations": (
        lambda w, q1, q2: (
            w.checker.distance_and_interpolation_provider.interpolate_between_configurations(
                q1, q2, 0.25
            )
        ),
        EDGE,
    ),
    "CollisionChecker.set_padding_matrix": (
        lambda w, collision_padding: w.changed(
            "set_padding_matrix", collision_padding, "get_padding_matrix"
        ),
        {"collision_padding": [[0.0, 0, 0], [0, 0, 2], [0, 2, 0]]},
    ),
    **{
        f"SceneGraphCollisionChecker.{name}": (of_checker(name), {array: values})
        for name, array, values in (
            ("check_config_collision_free", "q", Q1),
            ("check_configs_collision_free", "configurations", SOME),
            ("checked_configurations", "configurations", SOME),
            ("classify_body_collisions", "q", Q1),
            ("find_colliding_pair", "q", Q1),
            ("find_collisions", "configurations", SOME),
            ("check_edges_collision_free", "edges", EDGES),
            ("edge_statuses", "edges", EDGES),
            ("measure_edges", "edges", EDGES),
        )
    },
    "SceneGraphCollisionChecker.check_edge": (of_checker("check_edge"), EDGE),
    "RobotDiagramBuilder.add_robot": (
        lambda w, X_WB: RobotDiagramBuilder().add_robot("r", w.urdf, X_WB=X_WB).X_WB,
        {"X_WB": TURNED},
    ),
    "inverse_kinematics_of_poses": (
        lambda w, X_WTs, X_LT, near: (
            inverse_kinematics_of_poses(w.free, "left/ball", X_WTs, X_LT, near).configurations
        ),
        {"X_WTs": [AT_2, AT_2], "X_LT": np.eye(4).tolist(), "near": Q1},
    ),
    "plan_straight": (
        lambda w, start, X_WTs, X_LT: (
            plan_straight(w.free, start, X_WTs, "left/ball", X_LT).configurations
        ),
        {"start": Q1, "X_WTs": [AT_2], "X_LT": np.eye(4).tolist()},
    ),
    "SafeVelocity.filter": (
        lambda w, q, v, present: (
            SafeVelocity(w.free, limits=w.limits).filter(q, v, 0.5, present).velocity
        ),
        {"q": Q1, "v": [1.0, 0], "present": [0.0, 1]},
    ),
    "SafeVelocity.brake": (
        lambda w, present: SafeVelocity(w.free, limits=w.limits).brake(0.5, present),
        {"present": [0.0, 1]},
    ),
    "plan_path": (
        lambda w, start, goal: plan_path(w.free, start, goal).configurations,
        {"start": Q1, "goal": Q2},
    ),
    "time_path": (
        lambda w, path: time_path(w.free, path, w.limits).duration,
        {"path": [[1.0, 2], [1, 3]]},
    ),
    "visibility_graph": (
        lambda w, points: visibility_graph(w.free, points).toarray(),
        {"points": SOME},
    ),
    "TreeLayout.checked_configurations": (of_tree("checked_configurations"), {"q": SOME}),
    "KinematicTree.interpolate": (of_tree("interpolate", t=0.5), EDGE),
    "KinematicTree.at": (lambda w, X_WB: w.tree.at(X_WB).X_WB, {"X_WB": TURNED}),
    "KinematicTree.attached": (
        lambda w, X_LB: w.one.attached(w.one, "ball", X_LB, prefix="b_").link_poses([1.0, 2]),
        {"X_LB": TURNED},
    ),
    "KinematicTree.jacobians": (
        lambda w, q, p_LQ: w.tree.jacobians(q, "left/ball", p_LQ),
        {"q": Q1, "p_LQ": [1.0, 2, 3]},
    ),
    "KinematicTree.link_poses": (of_tree("link_poses"), {"q": SOME}),
    "KinematicTree.velocity_map": (of_tree("velocity_map"), ONE),
    "ZmpPlanner.comdd_to_cop": (
        lambda w, x, u: w.zmp.comdd_to_cop(x, u),
        {"x": [0.0, 1, 2, 3], "u": Q1},
    ),
    "ZmpPlanner.compute_optimal_comdd": (
        lambda w, x: w.zmp.compute_optimal_comdd(0.5, x),
        {"x": [0.0, 1, 2, 3]},
    ),
    "ZmpPlanner.compute_optimal_cost": (
        lambda w, x: w.zmp.compute_optimal_cost(0.5, x),
        {"x": [0.0, 1, 2, 3]},
    ),
    "Kinematics.__init__": (
        lambda w, X_PB: Kinematics(w.robot.model, X_PB=X_PB).X_PB,
        {"X_PB": TURNED},
    ),
    "Kinematics.link_poses": (
        lambda w, positions: Kinematics(w.robot.model).link_poses(["rail"], positions),
        {"positions": [2.0]},
    ),
    "Kinematics.update": (Rails.updated, {"positions": [2.0]}),
    "CollisionChecker.set_collision_filter_matrix": (
        lambda w, filter_matrix: w.changed(
            "set_collision_filter_matrix", filter_matrix, "get_filtered_collision_matrix"
        ),
        {"filter_matrix": [[-1.0, 0, 0], [0, -1, 1], [0, 1, -1]]},
    ),
    "RobotDiagram.query": (
        lambda w, q: w.model.query(q).snapshot.X_WG,
        {"q": [1.0, 3.0]},
    ),
    "RobotDiagram.of_robots": (
        lambda w, bases: w.based(bases),
        {"bases": TURNED},
    ),
    "MotionLimits.of_tree": (
        lambda w, positions: MotionLimits.of_tree(
            w.one, velocities={"rail": 1.0}, accelerations=2.0, positions=positions
        ),
        {"positions": [0]},
    ),
    "TrajectoryPoints.of_curve": (
        lambda w, nanoseconds: (
            TrajectoryPoints.of_curve(BezierCurve(0, 2, SOME), nanoseconds).nanoseconds
        ),
        {"nanoseconds": T},
    ),
    "MaxCliqueSolverViaMip.set_initial_guess": (Rails.guessed, {"initial_guess": T}),
    "MaxCliqueSolverViaMip.__init__": (
        lambda w, initial_guess: MaxCliqueSolverViaMip(initial_guess).get_initial_guess(),
        {"initial_guess": T},
    ),
    "RationalForwardKinematics.__init__": (
        lambda w, q_star: RationalForwardKinematics(w.tree, q_star).q_star,
        {"q_star": Q1},
    ),
    "RationalForwardKinematics.compute_s_value": (
        lambda w, q: RationalForwardKinematics(w.tree).compute_s_value(q),
        {"q": SOME},
    ),
    "RationalForwardKinematics.compute_q_value": (
        lambda w, s: RationalForwardKinematics(w.tree).compute_q_value(s),
        {"s": SOME},
    ),
    "RationalForwardKinematics.compute_q_jacobian": (
        lambda w, s: RationalForwardKinematics(w.tree).compute_q_jacobian(s),
        {"s": SOME},
    ),
    "ExponentialPlusPiecewisePolynomial.of_matrices": (
        lambda w, K, A, alpha: w.exponential(K, A, alpha).value(0.5),
        {"K": [[1.0, 0], [0, 1]], "A": [[1.0, 0], [0, 2]], "alpha": [[1.0, 2], [3, 4]]},
    ),
    "ExponentialPlusPiecewisePolynomial.value": (
        lambda w, t: w.exponential(np.eye(2), np.eye(2), np.eye(2)).value(t),
        {"t": T},
    ),
    "PathParameterizedTrajectory.value": (
        lambda w, t: w.parameterized().value(t),
        {"t": T},
    ),
    "PathParameterizedTrajectory.eval_derivative": (
        lambda w, t: w.parameterized().eval_derivative(t, 1),
        {"t": T},
    ),
    "ZmpPlanner.plan": (
        lambda w, x0, Qy, R: w.walk(x0, Qy, R).compute_optimal_cost(0.5, [0.0, 1, 2, 3]),
        {"x0": [0.0, 1, 2, 3], "Qy": [[1.0, 0], [0, 1]], "R": [[1.0, 0], [0, 1]]},
    ),
    "region_around": (lambda w, seed: region_around(w.free, seed).region.b, {"seed": Q1}),
}

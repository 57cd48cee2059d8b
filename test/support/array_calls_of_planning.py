"""Calls of more public functions of planning and robots with small arrays."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.planning import (
    AngleBetweenVectorsConstraint,
    build_roadmap,
    compute_collision_avoidance_displacement,
    CspaceFreeBox,
    CspaceFreePolytope,
    DirectCollocation,
    DirectCollocationConstraint,
    DofMask,
    Dynamics,
    inverse_kinematics,
    iris_in_configuration_space,
    KinematicTrajectoryOptimization,
    MaxCliqueSolverViaMip,
    measure_constraints,
    NonlinearProgram,
    OrientationConstraint,
    plan_through_regions,
    plan_trajectory,
    PoseTarget,
    PositionConstraint,
    regions_along,
    regions_around,
    RobotClearance,
    RobotCollisionType,
    time_curve,
    time_path,
)
from scene_graph_ros.robots import Kinematics, tree_inertias
from scene_graph_ros.scene_files import load_urdf
from scene_graph_ros.trajectories import BezierCurve, MotionLimits

__all__ = ["CALLS", "INFINITE", "REFUSALS_ONLY"]

INFINITE = {"ub", "deviation", "jacobian", "lower", "upper", "of_x", "of_u"} | {
    *("full_array", "selected_values", "p_FQ_upper"),  # limits may be
}
"""Arguments that may be infinite, as what is beyond all floats is."""

Q1, Q2 = [1.0, 2], [3.0, 5]
PATH_OF_3 = [[1.0, 2, 3], [4, 5, 6]]
PATH = [[1.0, 2], [1, 3], [2, 3]]
TURNED = [[0.0, -1, 0, 3], [1, 0, 0, 4], [0, 0, 1, 0], [0, 0, 0, 1]]
BOUNDS = {"lb": [-1.0, -2], "ub": [3.0, 4]}
HEAVY = """<robot name="heavy"><link name="base"/><link name="ball">
  <inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link><joint name="free" type="{kind}"><parent link="base"/><child link="ball"/>
  <axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>"""


def _bounds_of(constraints):
    """Return the bounds of constraints, and what they are about."""
    some = constraints if isinstance(constraints, list) else [constraints]
    return [[each.lower, each.upper, each.knots] for each in some]


def _curve(name, **more):
    """Return a call of what adds to a program of a curve."""
    return lambda w, **arrays: _bounds_of(
        getattr(KinematicTrajectoryOptimization(2, 5), name)(**arrays, **more)
    )


def _program(name, **more):
    """Return a call of what adds to a program."""

    def call(w, **arrays):
        prog = NonlinearProgram()
        x = prog.new_variables(2, "x")
        expressions = [x] if name == "add_constraint_for_each" else x
        return _bounds_of(getattr(prog, name)(expressions, **arrays, **more))

    return call


def _guess(w, values):
    prog = NonlinearProgram()
    x = prog.new_variables(2, "x")
    prog.set_initial_guess(x, values)
    return prog.initial_guess


def _cart():
    return Dynamics(lambda x, u, t, p: [x[1], p[0] * u[0]], 2, 1, parameters=[2.0])


def _moved(w, f, of_x, of_u):
    found = Dynamics(lambda *_: f, 2, 1, jacobian=lambda *_: (of_x, of_u))
    return found(Q1, [3.0]), found.linearized(Q1, [3.0])


def _knots(w, lb, ub):
    trajectory = DirectCollocation(_cart(), 3, 0.1, 0.2)
    made = trajectory.add_constraint_to_all_knot_points(trajectory.state(), lb, ub)
    return _bounds_of(made)


def _heavy(w, kind):
    path = w.urdf.parent / f"{kind}.urdf"
    path.write_text(HEAVY.format(kind=kind))
    return load_urdf(path)


def _inertias(model):
    return tree_inertias(model, model.kinematic_tree())


def _limits(w):
    """Return limits of all positions, of jerk, too."""
    names = w.tree.position_names
    velocities = dict.fromkeys(names, 9.0)
    return MotionLimits.of_tree(w.tree, velocities=velocities, accelerations=9.0, jerks=50.0)


def _timed(**more):
    """Return a call of ``time_path`` with some of its options."""
    return lambda w, **arrays: time_path(w.free, PATH, _limits(w), **arrays, **more).duration


def _duration(w, start, goal, start_velocity, start_acceleration):
    rates = {"start_velocity": start_velocity, "start_acceleration": start_acceleration}
    return plan_trajectory(w.free, start, goal, _limits(w), **rates).duration


def _placed(w, X_JcC):
    kinematics = Kinematics(_heavy(w, "floating"))
    kinematics.set_joint_pose("free", X_JcC)
    return kinematics.configuration


def _appended(w, jacobian):
    table = RobotClearance(2)
    table.append(0, 1, RobotCollisionType.SELF_COLLISION, 0.5, jacobian)
    return table.jacobians


def _efforts(w, **arrays):
    """Return the bounds of a robot's effort along a line."""
    problem = KinematicTrajectoryOptimization(1, 5)
    dynamics = Dynamics.of_robot(load_urdf(HEAVY.format(kind="prismatic")))
    return _bounds_of(problem.add_effort_bounds_at_normalized_times(dynamics, **arrays))


MASK = DofMask([True, False, True])

CALLS = {
    "KinematicCurve.add_effort_bounds_at_normalized_times": (
        _efforts,
        {"s": [0.0, 1], "lb": [-1.0], "ub": [2.0]},
    ),
    "DofMask.get_from_array": (
        lambda w, full_array: MASK.get_from_array(full_array),
        {"full_array": PATH_OF_3},
    ),
    "DofMask.set_in_array": (
        lambda w, **arrays: MASK.set_in_array(**arrays),
        {"selected_values": [[7.0, 8], [9, 1]], "full_array": PATH_OF_3},
    ),
    "compute_collision_avoidance_displacement": (
        lambda w, q: compute_collision_avoidance_displacement(w.checker, q, 0.0, 1.0),
        {"q": Q1},
    ),
    **{
        f"KinematicCurve.add_{name}_bounds": (_curve(f"add_{name}_bounds"), BOUNDS)
        for name in ("position", "velocity", "acceleration", "jerk")
    },
    **{
        f"KinematicCurve.add_path_{name}_constraint": (
            _curve(f"add_path_{name}_constraint", s=0.5),
            BOUNDS,
        )
        for name in ("position", "velocity", "acceleration")
    },
    "NonlinearProgram.add_constraint": (
        _program("add_constraint"),
        {**BOUNDS, "knots": [[1.0, 2], [3, 4]]},
    ),
    "NonlinearProgram.add_constraint_for_each": (
        _program("add_constraint_for_each", label="x"),
        {**BOUNDS, "knots": [[1.0, 2]]},
    ),
    "NonlinearProgram.rows_of": (
        lambda w, lb, ub: NonlinearProgram().rows_of([0.0, 1.0], lb, ub)[1:],
        BOUNDS,
    ),
    "NonlinearProgram.set_initial_guess": (_guess, {"values": Q1}),
    "MultipleShooting.add_constraint_to_all_knot_points": (_knots, BOUNDS),
    "Dynamics.__init__": (
        lambda w, parameters: Dynamics(
            lambda x, u, t, p: [p[0] * x[0], p[1] * u[0]], 2, 1, parameters=parameters
        )(Q1, [3.0]),
        {"parameters": [2.0, 3]},
    ),
    "Dynamics.__call__": (
        _moved,
        {"f": Q2, "of_x": [[0.0, 1], [2, 3]], "of_u": [[4.0], [5.0]]},
    ),
    "MaxCliqueSolverViaMip.solve_max_clique": (
        lambda w, adjacency_matrix: MaxCliqueSolverViaMip().solve_max_clique(adjacency_matrix),
        {"adjacency_matrix": [[0.0, 1, 0], [1, 0, 0], [0, 0, 0]]},
    ),
    "Dynamics.linearized": (
        lambda w, x, u, p: _cart().linearized(x, u, p=p),
        {"x": Q1, "u": [3.0], "p": [4.0]},
    ),
    "Dynamics.of_robot": (
        lambda w, gravity: Dynamics.of_robot(_heavy(w, "prismatic"), gravity=gravity)(Q1, [3.0]),
        {"gravity": [0.0, 0, -9]},
    ),
    "DirectCollocationConstraint.jacobian": (
        lambda w, **arrays: DirectCollocationConstraint(_cart()).jacobian(0.1, **arrays),
        {"state": Q1, "next_state": Q2, "input": [3.0], "next_input": [4.0]},
    ),
    "Kinematics.set_joint_pose": (_placed, {"X_JcC": TURNED}),
    "RobotClearance.append": (_appended, {"jacobian": Q1}),
    "TreeInertias.centre_of_mass": (
        lambda w, q: _inertias(_heavy(w, "prismatic")).centre_of_mass(q),
        {"q": [[1.0], [2.0]]},
    ),
    "inverse_kinematics": (
        lambda w, near: (
            inverse_kinematics(w.free, PoseTarget("left/ball", np.eye(4)), near=near).nearest
        ),
        {"near": Q1},
    ),
    "AngleBetweenVectorsConstraint": (
        lambda w, **arrays: AngleBetweenVectorsConstraint("l", angle_upper=1.0, **arrays).b_L,
        {"a_A": [0.0, 1, 2], "b_L": [0.0, 0, 2]},
    ),
    "OrientationConstraint": (
        lambda w, R_AT, R_LT: OrientationConstraint("l", R_AT, 1.0, R_LT).R_LT,
        {"R_AT": np.eye(3).tolist(), "R_LT": [[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]},
    ),
    "PositionConstraint": (
        lambda w, **arrays: PositionConstraint("l", **arrays).p_FQ_upper,
        {
            "p_FQ_lower": [0.0, 1, 2],
            "p_FQ_upper": [1.0, 2, 3],
            "p_LQ": [0.0, 1, 2],
            "X_AF": np.eye(4).tolist(),
        },
    ),
    "measure_constraints": (
        lambda w, edges: [
            each.status.value
            for each in measure_constraints(
                w.free, edges, [PositionConstraint("left/ball", np.full(3, -9.0), np.full(3, 9.0))]
            )
        ],
        {"edges": [[Q1, Q2]]},
    ),
    "plan_trajectory": (
        _duration,
        {
            "start": Q1,
            "goal": Q2,
            "start_velocity": [0.0, 1],
            "start_acceleration": [0.0, 1],
        },
    ),
    "time_path": (
        _timed(),
        {
            "deviation": [1.0, 2],
            "through": [1.0],
            "at_rest": [1.0],
            "start_velocity": [0.0, 1],
            "start_acceleration": [0.0, 1],
            "end_velocity": [1.0, 0],
            "end_acceleration": [1.0, 0],
        },
    ),
}

C, D = [[1.0, 0], [-1, 0], [0, 1], [0, -1]], [2.0, -1, 3, -2]
BOX = {"q_box_lower": Q1, "q_box_upper": Q2}
FACES = {"C": C, "d": D}


def _of_first_pair(kind, name):
    """Return a call of a method about a pair."""

    def call(w, **arrays):
        search = kind(w.checker)
        return getattr(search, name)(search.geometry_pairs[0], **arrays)

    return call


REFUSALS_ONLY = {
    "CspaceFreeBox.certify_by_distances": (
        lambda w, **box: CspaceFreeBox(w.checker).certify_by_distances(**box),
        BOX,
    ),
    "CspaceFreeBox.find_pair_certificate": (
        _of_first_pair(CspaceFreeBox, "find_pair_certificate"),
        BOX,
    ),
    "CspaceFreeBox.find_separation_certificate_given_box": (
        lambda w, **box: CspaceFreeBox(w.checker).find_separation_certificate_given_box(**box),
        BOX,
    ),
    "CspaceFreePolytope.__init__": (
        lambda w, q_star: CspaceFreePolytope(w.checker, q_star),
        {"q_star": Q1},
    ),
    "CspaceFreePolytope.binary_search": (
        lambda w, **faces: CspaceFreePolytope(w.checker).binary_search(**faces),
        {**FACES, "s_center": Q1},
    ),
    "CspaceFreePolytope.certify_by_distances": (
        lambda w, **faces: CspaceFreePolytope(w.checker).certify_by_distances(**faces),
        FACES,
    ),
    "CspaceFreePolytope.find_pair_certificate": (
        _of_first_pair(CspaceFreePolytope, "find_pair_certificate"),
        FACES,
    ),
    "CspaceFreePolytope.make_is_geometry_separable_program": (
        _of_first_pair(CspaceFreePolytope, "make_is_geometry_separable_program"),
        FACES,
    ),
    "CspaceFreePolytope.find_separation_certificate_given_polytope": (
        lambda w, **faces: CspaceFreePolytope(
            w.checker
        ).find_separation_certificate_given_polytope(**faces),
        FACES,
    ),
    "CspaceFreePolytope.search_with_bilinear_alternation": (
        lambda w, **faces: CspaceFreePolytope(w.checker).search_with_bilinear_alternation(**faces),
        {"C_init": C, "d_init": D},
    ),
    "build_roadmap": (lambda w, q: build_roadmap(w.free, q, 3), {"q": Q1}),
    "iris_in_configuration_space": (
        lambda w, sample: iris_in_configuration_space(w.checker, sample),
        {"sample": Q1},
    ),
    "plan_through_regions": (
        lambda w, **arrays: plan_through_regions(None, checker=w.free, **arrays),
        {"start": Q1, "goal": Q2, "velocities": [1.0, 1]},
    ),
    "regions_along": (lambda w, path: regions_along(w.free, path), {"path": PATH}),
    "regions_around": (lambda w, seeds: regions_around(w.free, seeds), {"seeds": PATH}),
    "time_curve": (
        lambda w, at: time_curve(w.free, BezierCurve(0, 2, PATH), w.limits, at=at),
        {"at": Q1},
    ),
}
"""Those that take seconds where they take what they are given."""

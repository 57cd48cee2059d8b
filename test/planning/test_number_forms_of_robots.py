"""Robots, planning and trajectories take arrays in every form, or refuse them in our words."""

from functools import partial

from array_arguments import array_arguments
from array_calls import CALLS, Rails
from form_checks import check_forms
import pytest

MODULES = (
    "scene_graph_ros.planning",
    "scene_graph_ros.trajectories",
    "scene_graph_ros.robots",
)
FEW = ("C", "Fortran", "negative strides", "read-only", "unaligned", ">f4", "i8", "list")
"""Forms that are tried of what takes long."""
SLOW = {"plan_path", "time_path", "visibility_graph", "ZmpPlanner.plan"}
CASES = [(name, argument) for name, (_, arrays) in CALLS.items() for argument in arrays]


@pytest.fixture(scope="module", name="rails")
def _rails(tmp_path_factory):
    return Rails(tmp_path_factory.mktemp("rails"))


@pytest.mark.parametrize(("name", "argument"), CASES)
@pytest.mark.filterwarnings("ignore:the matrix subclass")
@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
def test_every_form_of_an_array_is_the_same_or_refused(rails, name, argument):
    """The result is that of the plain array; what is no real number raises an error of ours."""
    call, arrays = CALLS[name]
    check_forms(partial(call, rails), arrays, argument, FEW if name in SLOW else None)


UNTRIED = {
    "answered by others, or by nobody": (
        *("CollisionChecker.calc_robot_clearance", "CollisionChecker.check_config_collision_free"),
        *("CollisionChecker.check_configs_collision_free", "CollisionChecker.measure_edges"),
        *("CollisionChecker.check_edges_collision_free", "Trajectory.value"),
        "CollisionChecker.classify_body_collisions",
        *("UnimplementedCollisionChecker.calc_robot_clearance", "RobotClearance.append"),
        "UnimplementedCollisionChecker.check_configs_collision_free",
        "UnimplementedCollisionChecker.classify_body_collisions",
        *("UnimplementedCollisionChecker.measure_edges", "TreeLayout.is_certainly_within"),
        "ZmpPlanner.compute_optimal_co_mdd",  # compute_optimal_comdd
    ),
    "needs a robot of another kind": (
        *("Kinematics.set_joint_pose", "TreeInertias.centre_of_mass"),
    ),
    "needs OMPL": ("OmplSpace.__init__", "OmplSpace.state"),
    "makes a program for CasADi, whose tests are in optimal_control": (
        *("Dynamics.__init__", "Dynamics.linearized", "Dynamics.of_robot"),
        *("KinematicCurve.add_acceleration_bounds", "KinematicCurve.add_jerk_bounds"),
        *("KinematicCurve.add_path_acceleration_constraint", "NonlinearProgram.rows_of"),
        *("KinematicCurve.add_path_position_constraint", "KinematicCurve.add_position_bounds"),
        *("KinematicCurve.add_path_velocity_constraint", "KinematicCurve.add_velocity_bounds"),
        *("MultipleShooting.add_constraint_to_all_knot_points", "NonlinearProgram.add_constraint"),
        *("NonlinearProgram.add_constraint_for_each", "NonlinearProgram.set_initial_guess"),
    ),
    "takes seconds": (
        *("CspaceFreeBox.certify_by_distances", "CspaceFreeBox.find_pair_certificate"),
        "CspaceFreeBox.find_separation_certificate_given_box",
        *("CspaceFreePolytope.__init__", "CspaceFreePolytope.binary_search"),
        *("CspaceFreePolytope.certify_by_distances", "CspaceFreePolytope.find_pair_certificate"),
        "CspaceFreePolytope.find_separation_certificate_given_polytope",
        *("CspaceFreePolytope.search_with_bilinear_alternation", "IrisZoOptions.__init__"),
        *("build_roadmap", "inverse_kinematics", "iris_in_configuration_space", "time_curve"),
        *("plan_through_regions", "regions_along", "regions_around"),
    ),
}
"""Functions that take arrays and are not in the table, by the reason."""


def test_each_public_function_of_arrays_is_in_the_table():
    """Or it is named above with the reason why not."""
    untried = {name for names in UNTRIED.values() for name in names}
    known = array_arguments(*MODULES)
    assert {each for each in known if each not in CASES and each[0] not in untried} == set()
    assert untried <= {name for name, _ in known}
    assert untried.isdisjoint(CALLS)

"""Robots, planning and trajectories take arrays in every form, or refuse them in our words."""

from functools import partial

from array_arguments import array_arguments
import array_calls
import array_calls_of_curves
import array_calls_of_planning
from form_checks import check_forms, check_refusals
import pytest

MODULES = (
    "scene_graph_ros.planning",
    "scene_graph_ros.trajectories",
    "scene_graph_ros.robots",
)
FEW = ("C", "Fortran", "negative strides", "read-only", "unaligned", ">f4", "i8", "list")
"""Forms that are tried of what takes long."""
SLOW = {"plan_path", "time_path", "visibility_graph", "ZmpPlanner.plan"}
CASES = {
    (name, argument): (call, arrays)
    for calls in (array_calls, array_calls_of_curves, array_calls_of_planning)
    for name, (call, arrays) in calls.CALLS.items()
    for argument in arrays
}
REFUSED = {
    (name, argument): (call, arrays)
    for name, (call, arrays) in array_calls_of_planning.REFUSALS_ONLY.items()
    for argument in arrays
}
"""They take seconds where they take an array: only that they refuse what is none is tried."""


@pytest.fixture(scope="module", name="rails")
def _rails(tmp_path_factory):
    return array_calls.Rails(tmp_path_factory.mktemp("rails"))


@pytest.mark.parametrize(("name", "argument"), CASES)
@pytest.mark.filterwarnings("ignore:the matrix subclass")
@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
def test_every_form_of_an_array_is_the_same_or_refused(rails, name, argument):
    """The result is that of the plain array; what is no real number raises an error of ours."""
    call, arrays = CASES[name, argument]
    numbers = {"beyond float64"} if argument in array_calls_of_planning.INFINITE else set()
    if name == "ExponentialPlusPiecewisePolynomial.__init__":
        numbers.add("complex")
    forms = FEW if name in SLOW else None
    check_forms(partial(call, rails), arrays, argument, forms, numbers)


@pytest.mark.parametrize(("name", "argument"), REFUSED)
@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
def test_what_is_no_array_of_numbers_is_refused(rails, name, argument):
    """Before anything that takes long begins."""
    call, arrays = REFUSED[name, argument]
    check_refusals(partial(call, rails), arrays, argument)


UNTRIED = {
    "answered by others, or by nobody": (
        *("CollisionChecker.calc_robot_clearance", "CollisionChecker.check_config_collision_free"),
        *("CollisionChecker.check_configs_collision_free", "CollisionChecker.measure_edges"),
        *("CollisionChecker.check_edges_collision_free", "Trajectory.value"),
        "CollisionChecker.classify_body_collisions",
        "UnimplementedCollisionChecker.calc_robot_clearance",
        "UnimplementedCollisionChecker.check_configs_collision_free",
        "UnimplementedCollisionChecker.classify_body_collisions",
        *("UnimplementedCollisionChecker.measure_edges", "TreeLayout.is_certainly_within"),
        "ZmpPlanner.compute_optimal_co_mdd",  # compute_optimal_comdd
    ),
    "needs OMPL": ("OmplSpace.__init__", "OmplSpace.state"),
    "asked where it is used": ("IrisZoOptions.__init__",),
}
"""Functions that take arrays and are not in the tables, by the reason."""


def test_each_public_function_of_arrays_is_in_a_table():
    """Or it is named above with the reason why not."""
    untried = {name for names in UNTRIED.values() for name in names}
    known, tried = array_arguments(*MODULES), CASES.keys() | REFUSED.keys()
    assert {each for each in known if each not in tried and each[0] not in untried} == set()
    assert untried <= {name for name, _ in known}
    assert untried.isdisjoint(name for name, _ in tried)

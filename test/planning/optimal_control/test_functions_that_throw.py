"""What a function of one's own raises ends the call that asked it, and nothing else."""

import threading

import numpy as np
import pytest
from robot_scenes import ARM, BALL, diagram, POSTS, SLIDE

from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid
from scene_graph_ros.planning import (
    iris_in_configuration_space,
    iris_in_configuration_space_from_clique_cover,
    iris_zo,
    IrisFromCliqueCoverOptions,
    IrisNpOptions,
    IrisZoOptions,
    MaxCliqueSolverBase,
    MinCliqueCoverSolverViaGreedy,
    plan_path,
    PlanFailure,
    SceneGraphCollisionChecker,
)

DOMAIN = HPolyhedron.make_box([-0.3, -0.3], [0.3, 0.3])


class OwnError(Exception):
    """What nobody else raises."""


class Throwing(MaxCliqueSolverBase):
    """Finds nothing."""

    def _do_solve_max_clique(self, adjacency):
        raise OwnError("no clique")


def throwing(*arguments, **named):
    """Raise."""
    raise OwnError("not now")


@pytest.fixture(name="arm")
def two_joints(tmp_path):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path, ARM, POSTS))


def test_constraints_of_regions(arm):
    """Of all kinds of regions; the same region is found afterwards as before."""
    ball = Hyperellipsoid.make_hypersphere(0.01, [0.0, 0.0])
    few = {"num_particles": 100, "max_iterations": 1, "epsilon": 0.1, "mixing_steps": 5}
    before, count = iris_zo(arm, ball, DOMAIN, IrisZoOptions(**few)), threading.active_count()
    zo = IrisZoOptions(**few, additional_constraints=throwing)
    with pytest.raises(OwnError, match="not now"):
        iris_zo(arm, ball, DOMAIN, zo)
    options = IrisNpOptions(additional_constraints=throwing)
    with pytest.raises(OwnError, match="not now"):
        iris_in_configuration_space(arm, [0.0, 0.0], options, domain=DOMAIN)
    cover = IrisFromCliqueCoverOptions(iris_options=zo)
    with pytest.raises(OwnError, match="not now"):
        iris_in_configuration_space_from_clique_cover(arm, cover, domain=DOMAIN)
    assert threading.active_count() == count
    again = iris_zo(arm, ball, DOMAIN, IrisZoOptions(**few))
    np.testing.assert_array_equal(again.A, before.A)
    np.testing.assert_array_equal(again.b, before.b)


def test_solvers_of_cliques(arm):
    """Asked by a cover of a graph, and by one of configurations."""
    graph = np.ones((4, 4), dtype=bool)
    with pytest.raises(OwnError, match="no clique"):
        MinCliqueCoverSolverViaGreedy(Throwing()).solve_min_clique_cover(graph)
    with pytest.raises(OwnError, match="no clique"):
        iris_in_configuration_space_from_clique_cover(
            arm, domain=DOMAIN, max_clique_solver=Throwing()
        )


def test_who_watches_a_plan_and_operations_on_contexts(tmp_path):
    """No thread goes on searching, and the next plan is found."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    count = threading.active_count()
    with pytest.raises(OwnError, match="not now"):
        plan_path(checker, [0.0], [2.0], watch=throwing)
    with pytest.raises(OwnError, match="not now"):
        checker.perform_operation_against_all_model_contexts(throwing)
    late = plan_path(checker, [0.0], [2.0], timeout=0.1)
    assert late.failure is PlanFailure.TIMEOUT
    assert threading.active_count() == count
    assert plan_path(checker, [0.0], [0.5]).is_success

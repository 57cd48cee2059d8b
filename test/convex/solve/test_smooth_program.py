"""Programs that IPOPT solves: closed forms, dependent equations, cones, and what has no answer."""

import numpy as np
import pytest

from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.convex.solve.smooth_program import SmoothProgram

pytest.importorskip("casadi")


def nearest_to(p, kind="squares"):
    """Return a program whose cost is a function of y - p."""
    program = SmoothProgram(len(p))
    program.add_cost(kind, np.eye(len(p)), -np.asarray(p, float), 1.0, 1.0)
    return program


@pytest.mark.parametrize("kind", ["squares", "norm", "norm_inf"])
def test_the_nearest_point_of_a_plane_is_found_in_each_norm(kind):
    """Of x + y = 2, (1, 1) is nearest to the origin in all three."""
    program = nearest_to([0.0, 0.0], kind)
    program.add_equations(np.ones((1, 2)), np.array([-2.0]))
    x, is_optimal = program.solve(np.array([2.0, 0.5]))
    assert is_optimal
    assert np.allclose(x, 1.0, atol=1e-6)


def test_equations_that_depend_on_others_are_left_out():
    """Five, of rank two: without room for anything, still solved."""
    rows = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    M = np.vstack([rows, rows.sum(axis=0), rows[0] * 1e3, rows[1] - rows[0]])
    program = nearest_to([0.0, 0.0, 0.0])
    program.add_equations(M, M @ -np.array([1.0, 2.0, 3.0]))
    x, is_optimal = program.solve(np.zeros(3))
    assert is_optimal
    # x + y = 3, y + z = 5: (t, 3 - t, 2 + t), shortest where 3 t = 1.
    assert np.allclose(x, [1.0 / 3.0, 8.0 / 3.0, 7.0 / 3.0], atol=1e-7)


def test_cones_and_expressions_are_kept():
    """A disc of radius 1, and the hyperbola x y = 1/4 beside it: closed forms."""
    program = nearest_to([3.0, 4.0])
    disc = np.vstack([np.zeros(2), np.eye(2)])
    program.add_cone(Cone.SECOND_ORDER, disc, np.eye(3)[0])
    x, is_optimal = program.solve(np.zeros(2))
    assert is_optimal
    assert np.allclose(x, [0.6, 0.8], atol=1e-6)
    program = nearest_to([0.0, 0.0])
    y = program.at(np.eye(2), np.zeros(2))
    program.add_expressions(y[0] * y[1] - 0.25, np.array([True]))
    program.add_least(np.eye(2), np.zeros(2))
    x, is_optimal = program.solve(np.array([2.0, 0.5]))
    assert is_optimal
    assert np.allclose(x, 0.5, atol=1e-6)


def test_quotients_and_exponentials_have_their_optima():
    """Of 1 / h + h the least is at 1, of e^x - 2 x at log 2, of e^x <= z the least z at x = 1."""
    program = SmoothProgram(1)
    program.add_cost("quotient", np.array([[1.0], [0.0]]), np.array([0.0, 1.0]), 1.0, 1.0)
    program.add_cost("sum", np.eye(1), np.zeros(1), 1.0, 1.0)
    assert program.solve(np.array([3.0]))[0] == pytest.approx(1.0, abs=1e-7)
    program = SmoothProgram(1)
    program.add_cost("exponential", np.eye(1), np.zeros(1), 1.0, 1.0)
    program.add_cost("sum", -2.0 * np.eye(1), np.zeros(1), 1.0, 1.0)
    assert program.solve(np.zeros(1))[0] == pytest.approx(np.log(2.0), abs=1e-7)
    program = SmoothProgram(2)
    rows = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    program.add_cone(Cone.EXPONENTIAL, rows, np.array([0.0, 1.0, 0.0]))
    program.add_least(np.array([[1.0, 0.0]]), np.array([-1.0]))
    program.add_cost("sum", np.array([[0.0, 1.0]]), np.zeros(1), 1.0, 1.0)
    x, is_optimal = program.solve(np.array([1.5, 9.0]))
    assert is_optimal
    assert np.allclose(x, [1.0, np.e], atol=1e-6)


def test_what_has_no_point_is_no_optimum():
    """X >= 1 and x <= -1; and without variables all is said."""
    program = nearest_to([0.0])
    program.add_least(np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0]))
    assert not program.solve(np.zeros(1))[1]
    assert SmoothProgram(0).solve(np.zeros(0))[1]


@pytest.mark.parametrize(("failing", "expected"), [(None, 1e-6), (1e-6, 1e-5), (1e-5, 1e-4)])
def test_norms_as_sharp_as_a_search_ends_well_at(monkeypatch, failing, expected):
    """Searches at sharp norms from the start fail; then norms become sharper in turn.

    |y - p| with p on the edge of y <= p: rounded by s, its derivative there is 0.
    """
    program = nearest_to([0.25], "norm")
    program.add_least(np.array([[-1.0]]), np.array([0.25]))
    run, asked = SmoothProgram._run, []

    def some_fail(self, how, start, smoothed, told):
        point, is_solved, told = run(self, how, start, smoothed, told)
        asked.append((how, smoothed))
        fails = how == "near" or smoothed == failing
        return (point + 1.0 if fails else point), is_solved and not fails, told

    monkeypatch.setattr(SmoothProgram, "_run", some_fail)
    point, is_optimal = program.solve(np.array([-1.0]), is_near=True)
    assert is_optimal
    np.testing.assert_allclose(point, [0.25], atol=1e-4)
    steps = [smoothed for how, smoothed in asked if how == "again"]
    assert steps == sorted(steps, reverse=True)
    assert [s for s in steps if s != failing][-1] == expected
    if failing is not None:
        assert steps[-1] == failing


def test_no_sharpness_at_which_a_search_ends_well():
    """A search that ends at rough norms alone has no local optimum."""
    program = nearest_to([0.25], "norm")
    rough = program._run("rough", np.array([-1.0]), 1e-3, {})
    assert rough[1]
    program._run = lambda how, *_: rough if how == "rough" else (rough[0], False, rough[2])
    assert not program.solve(np.array([-1.0]))[1]

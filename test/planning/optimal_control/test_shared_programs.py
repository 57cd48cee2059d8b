"""Several trajectory optimizations in one program: what couples them, and whose times are told."""

import casadi as ca
import numpy as np
import pytest

from scene_graph_ros.planning import (
    DirectCollocation,
    DirectTranscription,
    Dynamics,
    SolverOptions,
    TrajectoryOptimizationError,
)

DOUBLE = Dynamics(lambda x, u, t, p: [x[1], u[0]], 2, 1)
SINGLE = Dynamics(lambda x, u, t, p: u, 1, 1)


def test_two_carts_meet_where_it_costs_both_least():
    """From 0 and 3 at rest to rest after 1 s and 2 s: the cost of a way d in T is 12 d^2 / T^3.

    12 z^2 + 12 (3 - z)^2 / 8 is least at z = 1 / 3.
    """
    first = DirectCollocation(DOUBLE, 11, 0.1, 0.1)
    second = DirectCollocation(DOUBLE, 21, 0.05, 0.5, prog=first.prog())
    assert second.prog() is first.prog()
    prog = first.prog()
    for made, start in ((first, 0.0), (second, 3.0)):
        prog.add_constraint(made.initial_state() == ca.DM([start, 0.0]))
        prog.add_constraint(made.final_state()[1] == 0.0)
        made.add_running_cost(made.input()[0] ** 2)
    second.add_duration_bounds(2.0, 2.0)
    prog.add_constraint(first.final_state()[0] == second.final_state()[0])
    mine = first.solve()
    assert mine.is_success, mine.reason
    other = second.result_of(mine.program_result)
    for each, end in ((mine, 1.0), (other, 2.0)):
        assert each.sample_times[-1] == pytest.approx(end, abs=1e-8)
        assert each.states[-1, 0] == pytest.approx(1.0 / 3.0, abs=1e-6)
    # The inputs of both optima are lines in time, which collocation has exactly.
    assert mine.cost == pytest.approx(12.0 / 9.0 + 12.0 * (8.0 / 3.0) ** 2 / 8.0, rel=1e-6)
    # Each by itself, to the place that both found, costs as much in sum.
    alone = []
    for start, end, samples in ((0.0, 1.0, 11), (3.0, 2.0, 21)):
        made = DirectCollocation(DOUBLE, samples, end / (samples - 1), end / (samples - 1))
        made.prog().add_constraint(made.initial_state() == ca.DM([start, 0.0]))
        made.prog().add_constraint(made.final_state() == ca.DM([1.0 / 3.0, 0.0]))
        made.add_running_cost(made.input()[0] ** 2)
        alone.append(made.solve().cost)
    assert mine.cost == pytest.approx(sum(alone), rel=1e-6)


def test_transcriptions_of_other_sizes_share_a_program():
    """One of a state with steps of its own ends where the other one does."""
    first = DirectCollocation(DOUBLE, 6, 0.2, 0.2)
    second = DirectTranscription(SINGLE, 4, 0.5, prog=first.prog())
    prog = first.prog()
    prog.add_constraint(first.initial_state() == 0.0)
    prog.add_constraint(first.final_state() == ca.DM([1.0, 0.0]))
    prog.add_constraint(second.initial_state() == 4.0)
    prog.add_constraint(second.final_state() == first.final_state()[0])
    for made in (first, second):
        made.add_running_cost(made.input()[0] ** 2)
    found = second.solve()
    assert found.is_success, found.reason
    # The shortest way from 4 to 1 in 1.5 s is at a constant speed.
    np.testing.assert_allclose(found.states[:, 0], [4.0, 3.0, 2.0, 1.0], atol=1e-7)
    assert first.result_of(found.program_result).states[-1, 0] == pytest.approx(1.0, abs=1e-7)


def test_times_of_violations_are_those_of_ones_own_knots():
    """What can't be is in the second one: only its result says when."""
    first = DirectCollocation(DOUBLE, 3, 0.1, 0.1)
    second = DirectCollocation(DOUBLE, 9, 0.25, 0.25, prog=first.prog())
    second.add_constraint_to_all_knot_points(second.state()[0] ** 2 <= -1.0, label="never")
    found = first.solve(SolverOptions(restarts=0))
    assert not found.is_success
    own = second.result_of(found.program_result)
    never = [v for v in own.violations if v.label == "never"]
    assert {v.knots[0] for v in never} == set(range(9))
    assert all(v.time == pytest.approx(0.25 * v.knots[0]) for v in never)
    assert all(v.time is None for v in found.violations if v.label == "never")
    assert "at t = " in own.reason
    assert "at t = " not in found.reason


def test_what_is_no_program_is_refused():
    """And a placeholder of the other one, which is none of this one's knots."""
    with pytest.raises(TrajectoryOptimizationError, match=r"another's prog\(\), not 3"):
        DirectCollocation(DOUBLE, 3, 0.1, 0.1, prog=3)
    first = DirectCollocation(DOUBLE, 3, 0.1, 0.1)
    second = DirectCollocation(DOUBLE, 3, 0.1, 0.1, prog=first.prog())
    with pytest.raises(TrajectoryOptimizationError, match=r"input\(\) is a placeholder"):
        second.add_running_cost(first.input()[0] ** 2)

"""TOPP-RA and Ruckig as retimers: what they find is within limits, and proven free, or refused."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from robot_scenes import CART, CORNER, diagram, POST, SLIDE
import ruckig

from scene_graph_ros.planning import (
    load_robot_diagram,
    MissingRetimerError,
    plan_path,
    RuckigRetimer,
    SceneGraphCollisionChecker,
    time_curve,
    time_path,
    TimingFailure,
    ToppraRetimer,
)
from scene_graph_ros.planning.trajectories import (
    BezierCurve,
    find_excess,
    MotionLimits,
    PiecewisePolynomial,
    retime,
    Retimer,
    TrajectoryError,
)
from scene_graph_ros.trajectories.retimers import retimer_libraries, toppra_retimer

SHELF = (
    (1.07, 1.31, 0.81, -1.17, 2.78, 2.67, -1.38, 0.02),
    (1.37, 0.75, 0.17, -0.51, 2.53, 3.09, -0.12, 0.02),
)
"""Positions (rad, m) of a Panda with its hand below and above a board."""

RETIMERS = ["toppra", "ruckig"]


@pytest.fixture(scope="module")
def shelf():
    """A Panda in its cell, and a proven path around a board, with corners."""
    robots = load_robot_diagram("config/scenes/panda_cell.yaml")
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=0.005)
    path = plan_path(checker, *SHELF, group="arm").configurations
    assert len(path) > 3
    return checker, path, robots.tree.group_positions("arm")


def cart(folder, x, y, **limits):
    """Return the checker of the ball on rails among a post, and its limits."""
    robots = diagram(folder, CART, POST.format(x=x, y=y))
    return SceneGraphCollisionChecker(robots), MotionLimits.of_tree(
        robots.tree, accelerations=2.0, **limits
    )


@pytest.mark.parametrize("retimer", RETIMERS)
@pytest.mark.parametrize("jerk", [None, 50.0])
def test_a_panda_is_within_limits_and_free_at_all_times(shelf, retimer, jerk):
    """At 20 000 times by differences of positions, and at 4000 by checks of configurations."""
    checker, path, moving = shelf
    tree = checker.model.tree
    limits = MotionLimits.of_tree(tree, accelerations=5.0, positions=moving, jerks=jerk)
    timed = time_path(checker, path, limits, retimer=retimer)
    assert timed.is_success, timed.reason
    assert timed.least_clearance > 0.0
    np.testing.assert_array_equal(timed.points.positions[[0, -1]], path[[0, -1]])
    t = np.linspace(0.0, timed.duration, 20_001)
    rates = timed.trajectory.value(t)[:, moving]
    np.testing.assert_array_equal(timed.points.velocities[[0, -1]], np.zeros((2, path.shape[1])))
    kept = [limits.velocities, limits.accelerations]
    for most in kept if jerk is None else [*kept, limits.jerks]:
        # Rounding of positions, 4e-16, in steps of 1.5e-4 s: 1e-4 of jerk.
        rates = np.diff(rates, axis=0) / t[1]
        assert 0.5 < np.abs(rates / most).max() < 1.0 + 1e-4
    along = timed.trajectory.value(np.linspace(0.0, timed.duration, 4001))
    assert checker.check_configs_collision_free(along).all()
    # It rests at each corner, or rounds them.
    corners = len(path) - 2
    stops = corners if retimer == "ruckig" else 0
    assert (timed.stops, timed.rounded) == (stops, corners - stops)


def test_toppra_takes_as_long_as_ours(shelf):
    """More stretches are faster, and near to what is exact along straight edges.

    Stretches are equal parts of an edge, and 16 suffice where edges are long.
    """
    checker, _, moving = shelf
    path = plan_path(checker, *SHELF, group="arm", least_saving=0.05).configurations
    limits = MotionLimits.of_tree(checker.model.tree, accelerations=5.0, positions=moving)
    ours = time_path(checker, path, limits).duration
    found = [
        time_path(checker, path, limits, retimer=ToppraRetimer(n)).duration / ours - 1.0
        for n in (16, 64)
    ]
    assert 0.0 < found[1] < found[0] < 0.03
    assert found[1] < 0.01
    soft = MotionLimits(limits.velocities, limits.accelerations, limits.names, [50.0] * 7)
    ours, theirs = (
        time_path(checker, path, soft, retimer=retimer).duration
        for retimer in ("time_optimal", "toppra")
    )
    # Theirs is the mean over a rise time.
    assert 0.98 * ours <= theirs <= 1.1 * ours


@pytest.mark.parametrize("retimer", RETIMERS)
@pytest.mark.parametrize("way", [6.0, 1.0, 1e-3, 1e-6])
def test_straight_ways_take_as_long_as_they_must(tmp_path, retimer, way):
    """Speeding up at a and going on at v: way / v + v / a, or 2 sqrt(way / a) on short ways."""
    robots = diagram(tmp_path, SLIDE)
    checker, v, a = SceneGraphCollisionChecker(robots), 1.5, 4.0
    least = 2.0 * np.sqrt(way / a) if way < v * v / a else way / v + v / a
    limits = MotionLimits([v], [a], robots.tree.position_names)
    timed = time_path(checker, [[-1.0], [way - 1.0]], limits, retimer=retimer)
    assert timed.is_success, timed.reason
    assert least * (1.0 - 1e-9) <= timed.duration
    assert timed.duration <= least * (1.02 if retimer == "toppra" else 1.0 + 1e-5)


def test_ruckig_is_as_fast_as_it_is_by_itself(tmp_path):
    """Along two ways at a right angle each joint moves alone: twice Ruckig's own time for one."""
    checker, limits = cart(tmp_path, -0.5, 0.5, jerks=10.0)
    timed = time_path(checker, CORNER, limits, retimer=RuckigRetimer())
    assert timed.is_success, timed.reason
    asked = ruckig.InputParameter(1)
    asked.target_position, asked.max_velocity = [1.0], [1.0]
    asked.max_acceleration, asked.max_jerk = [2.0], [10.0]
    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(asked, found)
    assert timed.duration == pytest.approx(2.0 * found.duration, rel=1e-6)
    assert timed.stops == 1
    middle = timed.trajectory.derivative().value(0.5 * timed.duration)
    np.testing.assert_allclose(middle, 0.0, atol=1e-6)
    # Limits of ours along a slope: the slower joint's velocity, the other one's acceleration.
    slope = MotionLimits([1.0, 0.1], [0.5, 2.0], limits.names)
    timed = time_path(checker, [[0.0, 0.0], [1.0, 0.5]], slope, retimer="ruckig")
    # s' <= min(1, 0.1 / 0.5), s'' <= min(0.5, 4): 1 / 0.2 + 0.2 / 0.5.
    assert timed.duration == pytest.approx(5.4, rel=1e-6)


def test_a_rise_time_is_kept(tmp_path):
    """Accelerations do not jump: with a mean over 0.1 s, and a rest of it at the corner."""
    checker, limits = cart(tmp_path, -0.5, 0.5)
    timed = time_path(checker, CORNER, limits, retimer="ruckig", rise_time=0.1)
    assert timed.is_success, timed.reason
    assert timed.duration == pytest.approx(2.0 * (1.0 / 1.0 + 1.0 / 2.0 + 0.1), rel=1e-6)
    a = timed.trajectory.derivative(2)
    ends, begins = a.control_points[:-1, -1], a.control_points[1:, 0]
    np.testing.assert_allclose(ends, begins, atol=1e-6)


def test_a_spline_that_leaves_the_proven_path_is_refused(tmp_path, shelf):
    """It swings out into a ball; in another scene there is room for it. A Panda's hits a gem."""
    along = ToppraRetimer(along="spline")
    room, limits = cart(tmp_path, 0.7, 0.3)
    timed = time_path(room, CORNER, limits, retimer=along)
    assert timed.is_success, timed.reason
    assert (timed.stops, timed.rounded) == (0, 0)
    way = timed.trajectory.value(np.linspace(0.0, timed.duration, 2001))
    lowest = way[np.argmin(way[:, 1])]
    assert lowest[1] < -0.05
    hit, _ = cart(tmp_path, lowest[0], lowest[1] - 0.19)
    assert not hit.check_config_collision_free(lowest)
    refused = time_path(hit, CORNER, limits, retimer=along)
    assert refused.failure is TimingFailure.NOT_FREE
    assert "post" in refused.reason
    assert refused.trajectory is None and refused.points is None
    assert time_path(hit, CORNER, limits, retimer="toppra").is_success
    checker, path, moving = shelf
    limits = MotionLimits.of_tree(checker.model.tree, accelerations=5.0, positions=moving)
    refused = time_path(checker, path, limits, retimer=along)
    assert refused.failure is TimingFailure.NOT_FREE, refused.reason


def test_curves_are_retimed(tmp_path):
    """TOPP-RA goes along a curve; Ruckig along straight ones only, and says so."""
    checker, limits = cart(tmp_path, 0.2, 0.8)
    curve = BezierCurve(0.0, 1.0, [[0.0, 0.0], [0.7, 0.0], [1.0, 0.3], [1.0, 1.0]])
    ours, theirs = (
        time_curve(checker, curve, limits, at=[0.0, 0.0], **which)
        for which in ({"grid_points": 100}, {"retimer": ToppraRetimer(100)})
    )
    assert theirs.is_success, theirs.reason
    assert theirs.duration == pytest.approx(ours.duration, rel=0.01)
    assert find_excess(theirs.trajectory, limits) is None
    with pytest.raises(TrajectoryError, match=r"'ruckig' goes along straight ways.*'toppra'"):
        time_curve(checker, curve, limits, at=[0.0, 0.0], retimer="ruckig")
    line = PiecewisePolynomial.first_order_hold([0.0, 1.0, 2.0], CORNER)
    straight = time_curve(checker, line, limits, at=[0.0, 0.0], retimer="ruckig")
    assert straight.is_success, straight.reason
    assert straight.stops == 1


class Halved(Retimer):
    """A retimer of one's own: as fast as may be, and then half as fast."""

    def motion(self, path, limits):
        """Return it."""
        return retime(path, limits).scale_time(2.0)


class Careless(Retimer):
    """One that is four times as fast as may be."""

    def motion(self, path, limits):
        """Return it."""
        return retime(path, limits).scale_time(0.25)


def test_a_retimer_of_ones_own_is_checked_as_well(tmp_path):
    """What keeps limits is taken as it is; what is too fast is slowed down until it keeps them."""
    checker, limits = cart(tmp_path, -0.5, 0.5)
    way = [[0.0, 0.0], [2.0, 0.0]]
    # Two metres at 1 m/s and 2 m/s^2: 2 / 1 + 1 / 2 s.
    for retimer, seconds in ((Halved(), 5.0), (Careless(), 2.5)):
        timed = time_path(checker, way, limits, retimer=retimer)
        assert timed.is_success, timed.reason
        assert timed.duration == pytest.approx(seconds, rel=1e-6)
        assert find_excess(timed.trajectory, limits) is None


def test_what_a_retimer_does_not_find_is_told(tmp_path, monkeypatch):
    """A status with its reason, not an exception, and no trajectory."""
    checker, limits = cart(tmp_path, -0.5, 0.5)

    class Fails:
        problem_data = SimpleNamespace(return_code="uncontrollable")

        def __init__(self, *arguments, **options):
            pass

        def compute_parameterization(self, start, end):
            return None, None, None

    library = retimer_libraries.get_toppra()._replace(algorithm=SimpleNamespace(TOPPRA=Fails))
    monkeypatch.setattr(toppra_retimer, "get_toppra", lambda: library)
    timed = time_path(checker, CORNER, limits, retimer="toppra")
    assert timed.failure is TimingFailure.NOT_RETIMED
    assert timed.reason == "TOPP-RA found no speeds along the path: uncontrollable"
    assert timed.trajectory is None
    monkeypatch.setattr(
        ruckig.Ruckig, "calculate", lambda *_: ruckig.Result.ErrorSynchronizationCalculation
    )
    timed = time_path(checker, CORNER, limits, retimer="ruckig")
    assert timed.failure is TimingFailure.NOT_RETIMED
    assert "ErrorSynchronizationCalculation" in timed.reason


@pytest.mark.parametrize(("name", "module"), [("toppra", "toppra.algorithm"), ("ruckig",) * 2])
def test_a_retimer_that_is_missing_is_named(tmp_path, monkeypatch, name, module):
    """The error says what to install, before anything is computed."""
    checker, limits = cart(tmp_path, -0.5, 0.5)
    get = getattr(retimer_libraries, f"get_{name}")
    get.cache_clear()
    monkeypatch.setitem(sys.modules, module, None)
    try:
        with pytest.raises(MissingRetimerError, match=f"pip install {name}"):
            time_path(checker, CORNER, limits, retimer=name)
        assert time_path(checker, CORNER, limits).is_success
    finally:
        get.cache_clear()


def test_retimers_are_imported_when_they_are_asked_for():
    """Naming them is not asking for them."""
    code = (
        "import sys\nfrom scene_graph_ros.planning import RuckigRetimer, ToppraRetimer\n"
        "ToppraRetimer(), RuckigRetimer()\nprint({'toppra', 'ruckig'} & set(sys.modules))"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "set()"


def test_what_makes_no_sense_is_refused(tmp_path):
    """Errors name the argument, and what there is instead."""
    checker, limits = cart(tmp_path, -0.5, 0.5)
    for retimer in ("topra", 3, None, RuckigRetimer):
        with pytest.raises(TrajectoryError, match=r"retimer must be one of .*'toppra', 'ruckig'"):
            time_path(checker, CORNER, limits, retimer=retimer)
    with pytest.raises(TrajectoryError, match=r"ToppraRetimer\(grid_points=...\)"):
        time_path(checker, CORNER, limits, retimer="toppra", grid_points=20)
    for arguments, words in (
        ({"grid_points": 0}, "grid_points"),
        ({"along": "arc"}, "along must"),
    ):
        with pytest.raises(TrajectoryError, match=words):
            ToppraRetimer(**arguments)

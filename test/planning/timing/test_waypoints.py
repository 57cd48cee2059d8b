"""Trajectories along waypoints of all kinds: as fast as they may be, however they are given."""

from itertools import pairwise

import hypothesis
from hypothesis import strategies
import numpy as np
import pytest
from robot_scenes import CART, CORNER, diagram, POST

from scene_graph_ros.planning import SceneGraphCollisionChecker, time_path, TimingFailure
from scene_graph_ros.planning.trajectories import find_excess, MotionLimits, TrajectoryError

V, A, JERK = 1.0, 2.0, 20.0
LIMITS = [None, [JERK] * 2]


@pytest.fixture(scope="module")
def checker(tmp_path_factory):
    """A ball on two rails, x from -1 to 3 and y from -1 to 1, with nothing near."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=9.0, y=9.0))
    return SceneGraphCollisionChecker(robots)


def limits(jerks=None):
    """Return those of the rails."""
    return MotionLimits([V, V], [A, A], ("x", "y"), jerks)


def duration(checker, path, jerks=None, **options):
    """Return how long a path takes; its trajectory is within all limits at all times."""
    timed = time_path(checker, path, limits(jerks), **options)
    assert timed.is_success, timed.reason
    assert find_excess(timed.trajectory, limits(jerks)) is None
    np.testing.assert_allclose(timed.points.positions[[0, -1]], np.asarray(path)[[0, -1]])
    return timed.duration


def distance(q, path):
    """Return the largest distance, entry by entry, of configurations from a path's edges."""
    best = np.full(len(q), np.inf)
    for a, b in pairwise(path):
        way = b - a
        t = np.clip((q - a) @ way / (way @ way), 0.0, 1.0)[:, np.newaxis]
        best = np.minimum(best, np.abs(q - a - t * way).max(axis=1))
    return best.max()


def along(timed, count=4001):
    """Return configurations on a trajectory."""
    return timed.trajectory.value(np.linspace(0.0, timed.duration, count))


@pytest.mark.parametrize("jerks", LIMITS)
@pytest.mark.parametrize("count", [2, 100, 1000])
@pytest.mark.parametrize("rounding", ["exact", "float32", "4 digits"])
def test_points_on_a_line_take_as_long_as_its_ends(checker, jerks, count, rounding):
    """1.7 / v + v / a, and a / j more where accelerations rise; a nanosecond for each point."""
    path = np.linspace([0.1234, -0.7], [1.8234, 0.15], count)
    if rounding == "float32":
        path = path.astype(np.float32).astype(np.float64)
    elif rounding == "4 digits":
        path = path.round(4)
    least = np.ptp(path[:, 0]) / V + V / A + (0.0 if jerks is None else A / JERK)
    found = time_path(checker, path, limits(jerks))
    assert found.is_success, found.reason
    assert found.stops == 0
    spare = 1e-9 * (len(found.points.nanoseconds) + 20)
    assert least - 1e-9 <= found.duration <= least + spare


@pytest.mark.parametrize("jerks", LIMITS)
def test_more_points_of_a_path_with_corners_cost_nothing(checker, jerks):
    """Points between its corners are none themselves, also where they are rounded."""
    corners = np.array([[-0.9, -0.9], [1.0, -0.5], [1.2, 0.7], [-0.5, 0.9]])
    alone = duration(checker, corners, jerks)
    for count in (10, 300):
        t = np.linspace(0.0, 1.0, count, endpoint=False)[:, np.newaxis]
        edges = [(1.0 - t) * a + t * b for a, b in pairwise(corners)]
        dense = np.concatenate([*edges, corners[-1:]])
        for path in (dense, dense.astype(np.float32).astype(float), dense.round(4)):
            assert duration(checker, path, jerks) == pytest.approx(alone, rel=1e-3)


@pytest.mark.parametrize("jerks", LIMITS)
def test_more_points_of_a_curve_cost_nothing(checker, jerks):
    """Even ones and uneven ones, doubles and floats."""
    rng = np.random.default_rng(0)

    def curve(t):
        return np.stack([1.0 + 1.5 * np.sin(3.0 * t), 0.8 * np.cos(4.0 * t)], axis=1)

    once = duration(checker, curve(np.linspace(0.0, 2.0, 400)), jerks)
    for t in (
        np.linspace(0.0, 2.0, 800),
        np.linspace(0.0, 2.0, 3000),
        np.sort(np.r_[0.0, 2.0, rng.uniform(0.0, 2.0, 700)]),
    ):
        assert duration(checker, curve(t), jerks) <= 1.01 * once
        rounded = curve(t).astype(np.float32).astype(np.float64)
        assert duration(checker, rounded, jerks) <= 1.01 * once


@pytest.mark.parametrize("jerks", LIMITS)
def test_where_a_path_turns_back_it_is_reached_with_rest(checker, jerks):
    """0, 1, 0 takes twice 1 / v + v / a (and a / j), and is at 1 in between."""
    path = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    timed = time_path(checker, path, limits(jerks))
    rises = 0.0 if jerks is None else A / JERK
    assert timed.duration == pytest.approx(2.0 * (1.0 / V + V / A + rises), rel=1e-6)
    assert timed.stops == 1
    assert along(timed)[:, 0].max() == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("jerks", LIMITS)
def test_a_deviation_is_kept_and_a_smaller_one_takes_longer(checker, jerks):
    """Up to a rest at the corner, without any; not much longer than that, however small."""
    durations = []
    for deviation in (None, 0.05, 0.01, 0.0):
        timed = time_path(checker, CORNER, limits(jerks), deviation=deviation)
        assert timed.is_success, timed.reason
        if deviation is not None:
            assert distance(along(timed), CORNER) <= deviation + 1e-9
        durations.append(timed.duration)
    rest = durations.pop()
    assert durations == sorted(durations)
    assert durations[-1] <= 1.05 * rest
    one_joint = time_path(checker, CORNER, limits(jerks), deviation=[0.3, 0.01])
    away = CORNER[1] - along(one_joint)
    assert np.abs(away[along(one_joint)[:, 0] > 1.0 - 0.01][:, 1]).size


@pytest.mark.parametrize("jerks", LIMITS)
def test_rows_are_passed_exactly_or_rested_at(checker, jerks):
    """Through a corner it goes on; at rest it takes as long as both edges by themselves."""
    through = time_path(checker, CORNER, limits(jerks), through=[1])
    assert through.is_success, through.reason
    assert through.stops == 0
    nearest = np.abs(along(through, 200_001) - CORNER[1]).max(axis=1).min()
    assert nearest < 2e-5
    rest = time_path(checker, CORNER, limits(jerks), at_rest=[1])
    rises = 0.0 if jerks is None else A / JERK
    assert rest.stops == 1
    assert rest.duration == pytest.approx(2.0 * (1.0 / V + V / A + rises), rel=1e-6)
    at = np.flatnonzero((rest.points.positions == CORNER[1]).all(axis=1))
    assert not rest.points.velocities[at].any()
    # Also where there is no corner at all.
    line = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    halves = time_path(checker, line, limits(jerks), at_rest=[1])
    assert halves.duration == pytest.approx(rest.duration, rel=1e-6)


def test_it_begins_and_ends_as_it_is_told_to(checker):
    """Braking from v takes v / (2 a) more than from rest: 1 m at v, 0.5 s less at each end."""
    line = np.array([[0.0, 0.0], [1.0, 0.0]])
    moving = {"start_velocity": [V, 0.0], "end_velocity": [V, 0.0]}
    timed = time_path(checker, line, limits(), **moving)
    assert timed.duration == pytest.approx(1.0 / V, rel=1e-6)
    np.testing.assert_array_equal(timed.points.velocities[[0, -1]], [[V, 0.0], [V, 0.0]])
    half = time_path(checker, line, limits(), start_velocity=[0.5 * V, 0.0])
    # From v / 2 to v in v / (2 a) over 3 v^2 / (8 a), then on, then down in v / a.
    up, down = 3.0 * V**2 / (8.0 * A), V**2 / (2.0 * A)
    expected = 0.5 * V / A + (1.0 - up - down) / V + V / A
    assert half.duration == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    "rates",
    [
        {"start_velocity": [0.5, 0.0]},
        {"start_velocity": [0.5, 0.1]},
        {"start_velocity": [0.5, 0.0], "start_acceleration": [0.5, 0.0]},
        {"end_velocity": [0.0, 0.5], "end_acceleration": [0.0, -0.5]},
        {"start_velocity": [V, 0.0], "end_velocity": [0.0, V]},
    ],
)
def test_motions_with_limits_of_jerk_begin_and_end_as_they_are_told_to(checker, rates):
    """Within all limits; and where the direction is that of the edge, sooner than from rest."""
    from_rest = duration(checker, CORNER, LIMITS[1])
    timed = time_path(checker, CORNER, limits(LIMITS[1]), **rates)
    assert timed.is_success, timed.reason
    assert find_excess(timed.trajectory, limits(LIMITS[1])) is None
    for name, rows in (
        ("velocity", timed.points.velocities),
        ("acceleration", timed.points.accelerations),
    ):
        for end, row in (("start", 0), ("end", -1)):
            wanted = rates.get(f"{end}_{name}", [0.0, 0.0])
            np.testing.assert_allclose(rows[row], wanted, atol=1e-12)
    if "start_velocity" not in rates or rates["start_velocity"][1] == 0.0:
        assert timed.duration < from_rest


@pytest.mark.parametrize("jerks", LIMITS)
def test_what_can_t_be_braked_has_a_reason(checker, jerks):
    """1 cm is too short from v to rest: it takes v^2 / (2 a), 25 cm."""
    short = np.array([[0.0, 0.0], [0.01, 0.0]])
    timed = time_path(checker, short, limits(jerks), start_velocity=[V, 0.0])
    assert timed.failure is TimingFailure.NOT_RETIMED
    assert "velocit" in timed.reason


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"deviation": -1.0}, "deviation must be one number from 0 on"),
        ({"deviation": [0.1]}, "deviation must be one number"),
        ({"through": [3]}, "through must be rows of the path, 0 to 2"),
        ({"at_rest": [-1]}, "at_rest must be rows of the path"),
        ({"start_velocity": [1.5, 0.0]}, "start_velocity of 'x' is 1.5, beyond its limit 1"),
        ({"end_velocity": [np.nan, 0.0]}, "end_velocity must be finite numbers"),
        ({"start_acceleration": [1.0, 0.0]}, "start_acceleration needs limits of jerk"),
    ],
)
def test_options_that_make_no_sense_are_named(checker, options, words):
    """By argument and value."""
    with pytest.raises(TrajectoryError, match=words):
        time_path(checker, CORNER, limits(), **options)


@hypothesis.settings(max_examples=40, deadline=None)
@hypothesis.given(
    seed=strategies.integers(0, 10**6),
    count=strategies.sampled_from([2, 3, 5, 20, 80]),
    kind=strategies.sampled_from(["random", "walk", "twice", "float32", "digits", "tiny", "back"]),
    jerk=strategies.sampled_from([None, 5.0, 500.0]),
)
def test_any_waypoints_have_a_trajectory(checker, seed, count, kind, jerk):
    """Within all limits at all times, from end to end, and never absurdly long."""
    rng = np.random.default_rng(seed)
    path = rng.uniform([-0.9, -0.9], [2.9, 0.9], (count, 2))
    if kind == "walk":
        path = path[0] * 0.1 + np.cumsum(rng.normal(0.0, 0.01, (count, 2)), axis=0)
    elif kind == "twice":
        path = np.repeat(path, 2, axis=0)
    elif kind == "float32":
        path = path.astype(np.float32).astype(np.float64)
    elif kind == "digits":
        path = path.round(4)
    elif kind == "tiny":
        path = path[0] + 1e-7 * path
    elif kind == "back":
        path = np.concatenate([path, path[-2::-1]])
    most = limits(None if jerk is None else [jerk] * 2)
    timed = time_path(checker, path, most)
    assert timed.is_success, timed.reason
    assert find_excess(timed.trajectory, most) is None
    np.testing.assert_array_equal(timed.points.positions[[0, -1]], path[[0, -1]])
    # No edge takes longer than from rest to rest: L / v + v / a + a / j, or less than that.
    edges = np.abs(np.diff(path, axis=0)).max(axis=1)
    rises = 0.0 if jerk is None else min(A / jerk, (4.0 * edges.max() / jerk) ** (1.0 / 3.0) * 4.0)
    moves = np.count_nonzero(edges)
    assert timed.duration <= 1.3 * (edges.sum() / V + moves * (V / A + rises)) + 1e-5


UNEVEN = """
-14.25463 -0.45693  -14.24807 -0.45305  -14.32251 -0.15733  -14.81652 -2.92204
-14.82302 -2.91914  -14.80578 -2.91220  -15.17081 -2.21614  -15.17171 -2.21712
-14.65276 -2.05342  -14.65276 -2.05337  -14.65253 -2.05375  -14.65245 -2.05370
-14.41891 -1.82035  -4.62031 1.71961    -4.62037 1.71943    -5.01487 1.98011
-6.37409 -0.18971   -6.37411 -0.19243   -6.37444 -0.19250   -6.39266 -0.19550
-6.39283 -0.19559   -6.39285 -0.19557   -6.39368 -0.19759   -0.49175 -17.23572
-0.49170 -17.23557  -0.47516 -17.21520  -0.47126 -17.21833
"""
"""Waypoints from 5e-5 to 18 apart."""


@pytest.mark.parametrize("scale", [0.08, 1e-3, 1e-6])
def test_long_and_very_short_edges_have_a_motion(checker, scale):
    """Limits are as large as the path: the same motion, at any scale."""
    path = scale * (np.fromstring(UNEVEN, sep=" ").reshape(-1, 2) + np.array([8.0, 9.0]))
    own = MotionLimits(
        [1.823 * scale, 0.62 * scale],
        [0.2333 * scale, 10.84 * scale],
        ("x", "y"),
        [60.75 * scale, 196.8 * scale],
    )
    timed = time_path(checker, path, own)
    assert timed.is_success, timed.reason
    assert find_excess(timed.trajectory, own) is None
    assert timed.duration < 120.0

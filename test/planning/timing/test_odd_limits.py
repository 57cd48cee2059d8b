"""Limits and waypoints of all sizes: what rounding may not do, and options that are kept."""

from fractions import Fraction
from itertools import pairwise
import math

import numpy as np
import pytest
from robot_scenes import diagram

from scene_graph_ros.planning import SceneGraphCollisionChecker, time_path, TimingFailure
from scene_graph_ros.planning.trajectories import find_excess, MotionLimits, TrajectoryError

JOINT = """<link name="l{i}"/><joint name="j{i}" type="prismatic"><parent link="{parent}"/>
  <child link="l{i}"/><axis xyz="{axis}"/><limit lower="-99" upper="99" velocity="1"/></joint>"""
AXES = "1 0 0", "0 1 0", "0 0 1", "1 0 0"
STAGE = "".join(
    JOINT.format(i=i, parent="base" if i == 0 else f"l{i - 1}", axis=axis)
    for i, axis in enumerate(AXES)
)


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    """Four slides with nothing on them."""
    robot = f'<robot name="stage"><link name="base"/>{STAGE}</robot>'
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("stage"), robot))


def limits(v, a, jerks=None):
    """Return those of the four slides."""
    names = tuple(f"j{i}" for i in range(4))
    each = [np.broadcast_to(own, 4) for own in (v, a) if own is not None]
    return MotionLimits(*each, names, None if jerks is None else np.broadcast_to(jerks, 4))


def exact_ratios(points, most):
    """Return the largest rates of the quintics or cubics through points, by their limits.

    In fractions, at 17 places of each: control points of doubles are not these polynomials.
    """
    worst, times = 0.0, points.nanoseconds.tolist()
    given = [points.positions, points.velocities]
    if points.accelerations is not None:
        given.append(points.accelerations)
    for k, column in np.ndindex(len(times) - 1, points.positions.shape[1]):
        h = Fraction(times[k + 1] - times[k], 10**9)
        ends = [[Fraction(each[row, column]) for each in given] for row in (k, k + 1)]
        for side in ends:
            for order in range(1, len(side)):
                side[order] *= h**order
        (q0, v0, *a0), (q1, v1, *a1) = ends
        d, c = q1 - q0, [0, v0]
        if not a0:
            c += [3 * d - 2 * v0 - v1, v0 + v1 - 2 * d]
        else:
            b0, b1 = a0[0] / 2, a1[0] / 2
            c += [b0, 10 * d - 6 * v0 - 4 * v1 - 3 * b0 + b1]
            c += [-15 * d + 8 * v0 + 7 * v1 + 3 * b0 - 2 * b1, 6 * d - 3 * (v0 + v1) - b0 + b1]
        kinds = most.velocities, most.accelerations, most.jerks
        for order, most_of in enumerate(kinds, 1):
            c = [power * each for power, each in enumerate(c)][1:]
            if most_of is None:
                continue
            for place in range(17):
                value = sum(each * Fraction(place, 16) ** power for power, each in enumerate(c))
                worst = max(worst, abs(float(value / h**order)) / most_of[column])
    return worst


def with_rests(path, most):
    """Return the duration from rest to rest along each edge, by the seven phases of a way of 1."""
    total = 0.0
    for a, b in pairwise(path):
        with np.errstate(divide="ignore"):
            v, acc = (
                (each / np.abs(b - a)).min() for each in (most.velocities, most.accelerations)
            )
            jerk = math.inf if most.jerks is None else (most.jerks / np.abs(b - a)).min()
        acc = min(acc, math.sqrt(v * jerk))
        # Speed v takes v / acc + acc / jerk; where it is never reached, the peak solves that.
        if v * (v / acc + acc / jerk) > 1.0:
            acc = min(acc, (jerk * jerk / 2.0) ** (1.0 / 3.0))
            rise = acc / jerk
            v = 0.5 * acc * (math.sqrt(rise * rise + 4.0 / acc) - rise)
        total += 1.0 / v + v / acc + acc / jerk
    return total


@pytest.mark.parametrize(
    ("v", "a", "jerk"),
    [
        (1.44e-4, 1.66e-3, 1.3e4),
        (5754.0, 5.1e-10, 1.1e6),
        (1e-3, 1e-3, 1e9),
        (10.0, 1e-5, None),
        (1e-4, 1e3, None),
    ],
)
def test_rounding_of_positions_is_no_acceleration(stage, v, a, jerk):
    """Far from zero, where a rise in acceleration is short and its limit is small."""
    path = np.array([[-1.885, 0.3282, 0.0, 0.0], [-2.586, 0.4006, 0.0, 0.0],
                     [-1.885, 0.3282, 0.0, 0.0]])  # fmt: skip
    most = limits(v, a, jerk)
    timed = time_path(stage, path, most)
    assert timed.is_success, timed.reason
    assert exact_ratios(timed.points, most) <= 1.0 + 1e-9
    assert find_excess(timed.trajectory, most) is None
    assert timed.duration == pytest.approx(with_rests(path, most), rel=1e-3)


@pytest.mark.parametrize("jerks", [None, 1e9])
def test_a_position_that_stays_has_no_part(stage, jerks):
    """Its limits may be as small as they like, and it stays exactly where it is."""
    path = np.array([[90.123, 0.0, 0.7, 0.1], [90.123, 0.4, 0.7, 0.2], [90.123, 0.4, 0.7, 0.3]])
    whole = time_path(stage, path, limits(1.0, 2.0, jerks))
    small = limits([1e-9, 1.0, 1e-9, 1.0], [1e-9, 2.0, 1e-9, 2.0], jerks)
    timed = time_path(stage, path, small)
    assert timed.duration == whole.duration
    assert (timed.points.positions[:, [0, 2]] == path[0, [0, 2]]).all()
    assert not timed.points.velocities[:, [0, 2]].any()


def far_from(q, path, deviation):
    """Return whether some configurations are farther than that from all edges of a path."""
    near = np.zeros(len(q), dtype=bool)
    for a, b in pairwise(path):
        way = b - a
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(q - a - deviation) / way, (q - a + deviation) / way])
        low = np.where(
            way == 0.0, np.where(np.abs(q - a) <= deviation, 0.0, 2.0), ends.min(axis=0)
        )
        high = np.where(way == 0.0, 1.0, ends.max(axis=0))
        near |= np.maximum(low.max(axis=1), 0.0) <= np.minimum(high.min(axis=1), 1.0)
    return not near.all()


@pytest.mark.parametrize("options", [{}, {"rise_time": 0.3}, {"retimer": "toppra"}])
@pytest.mark.parametrize("jerks", [None, [6.8, 112.0, 200.0, 200.0]])
@pytest.mark.parametrize("deviation", [0.0, 0.0065, [0.3, 0.02, 0.1, 1.0]])
def test_a_deviation_is_kept_whatever_else_is_asked(stage, options, jerks, deviation):
    """Along random ways, by each method, also where each moment is the mean of a while."""
    pytest.importorskip("toppra")
    most = limits([4.9, 0.15, 1.2, 1.0], [0.32, 0.57, 27.7, 1.0], jerks)
    for seed in range(6):
        path = np.random.default_rng(seed).normal(0.0, 2.0, (4 + seed, 4)).round(3)
        timed = time_path(stage, path, most, deviation=deviation, **options)
        assert timed.is_success, timed.reason
        q = timed.trajectory.value(np.linspace(0.0, timed.duration, 20_001))
        assert not far_from(q, path, np.add(deviation, 2e-9))


@pytest.mark.parametrize("options", [{"rise_time": 0.5}, {"retimer": "toppra"}])
def test_what_is_passed_exactly_is_no_mean(stage, options):
    """It rests there, where each moment is the mean of the moments around."""
    pytest.importorskip("toppra")
    path = np.array([[0.0, 0.0, 0.0, 0.0], [2.4, 0.6, 0.0, 0.0], [0.0, 1.2, 0.0, 0.0],
                     [2.4, 1.8, 0.0, 0.0], [0.0, 2.4, 0.0, 0.0]])  # fmt: skip
    jerks = None if "rise_time" in options else [515.0, 1.2, 979.0, 1.0]
    most = limits([7.9, 1.5, 0.7, 1.0], [0.3, 28.9, 5.3, 1.0], jerks)
    timed = time_path(stage, path, most, through=[3], **options)
    assert timed.is_success, timed.reason
    away = np.abs(timed.points.positions - path[3]).max(axis=1)
    at = int(np.argmin(away))
    assert away[at] <= 1e-9
    assert np.abs(timed.points.velocities[at]).max() <= 1e-9


@pytest.mark.parametrize("jerks", [None, 50.0])
def test_a_motion_that_begins_moving_can_t_stay(stage, jerks):
    """Where all waypoints are one."""
    path = np.repeat([[0.3, 0.1, 0.2, 0.0]], 4, axis=0)
    velocity = [0.0, -0.2, 0.0, 0.0]
    for end in ("start", "end"):
        timed = time_path(stage, path, limits(1.0, 2.0, jerks), **{f"{end}_velocity": velocity})
        assert timed.failure is TimingFailure.NOT_RETIMED
        where = "at 0 s" if end == "start" else "at the end"
        words = f"the path leads nowhere; {where} the velocity of 'j1' is -0.2, of at most 1, and"
        assert timed.reason.startswith(words)


@pytest.mark.parametrize("jerks", [None, 50.0])
def test_the_joint_that_can_t_stop_is_named(stage, jerks):
    """With its rates and limits, and when."""
    path = np.array([[0.0, 0.0, 0.0, 0.0], [0.01, 0.02, 0.0, 0.0]])
    timed = time_path(stage, path, limits(1.0, [2.0, 4.0, 2.0, 2.0], jerks),
                      start_velocity=[0.45, 0.9, 0.0, 0.0])  # fmt: skip
    assert timed.failure is TimingFailure.NOT_RETIMED
    assert "; at 0 s the velocity of 'j0' is 0.45, of at most 1" in timed.reason
    assert "its acceleration 0, of at most 2" in timed.reason


@pytest.mark.parametrize("bend", [1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("jerk", [0.8, 351.0])
def test_a_point_beside_a_line_is_passed_nearly_as_fast_as_on_it(stage, bend, jerk):
    """Where accelerations alone limit the motion: velocities are never reached."""
    ends = np.array([[0.2748, 0.1747, -0.0497, 0.1182], [-0.0474, -0.0502, -0.121, 0.0695]])
    middle = (2.0 * ends[0] + ends[1]) / 3.0
    middle[3] += bend
    most = limits(45.0, 0.081, jerk)
    straight = time_path(stage, ends, most).duration
    path = np.array([ends[0], middle, ends[1]])
    assert time_path(stage, path, most, through=[1]).duration <= 1.08 * straight


@pytest.mark.parametrize("jerks", [None, [1.9, 1.3, 10.0, 10.0], [500.0, 0.5, 50.0, 1.0]])
def test_no_way_takes_longer_than_with_rests_at_all_its_points(stage, jerks):
    """Also where limits are uneven, and turns sharp."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        path = np.cumsum(rng.normal(0.0, 0.02, (3 + 4 * seed, 4)), axis=0)
        most = limits(10.0 ** rng.uniform(-1, 2, 4), 10.0 ** rng.uniform(-2, 2, 4), jerks)
        timed = time_path(stage, path, most)
        assert timed.is_success, timed.reason
        assert seed > 2 or exact_ratios(timed.points, most) <= 1.0 + 1e-9
        assert timed.duration <= 1.002 * with_rests(path, most) + 1e-5


@pytest.mark.parametrize("jerks", [None, 1.0, 1e15])
def test_what_takes_too_long_names_its_joint(stage, jerks):
    """1 m at 1e-10 m/s; another one would be there at once. Rises may vanish beside that."""
    most = limits([1e-10, 1.0, 1.0, 1.0], 1.0, jerks)
    back = np.array([[0.0, 0.0, 0.0, 0.0], [0.5, 2.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    with pytest.raises(TrajectoryError, match="more than 1e\\+09 s: 'j0' moves by 1, with vel"):
        time_path(stage, back, most)
    words = "more than 1e\\+09 s: 'j0' moves by 1, with velocities up to 1e-10, acc.* 1e\\+10 s"
    path = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 0.0, 0.0]])
    with pytest.raises(TrajectoryError, match=words):
        time_path(stage, path, most)


def test_a_retimer_whose_motion_takes_too_long_is_not_believed(stage):
    """It is made slower until limits of jerk hold, where ours takes a second and a half."""
    pytest.importorskip("toppra")
    path = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 1e-9, 0.0, 0.0]])
    most = limits([1.0, 1e5, 1.0, 1.0], [4.0, 1e8, 1.0, 1.0], [1e3, 1e-9, 1.0, 1.0])
    ours = time_path(stage, path, most)
    assert ours.is_success and ours.duration < 1e3
    theirs = time_path(stage, path, most, retimer="toppra")
    assert theirs.failure is TimingFailure.NOT_RETIMED
    assert theirs.reason.startswith("the retimer's motion would take ")
    assert f"where {ours.duration:.6g} s are enough" in theirs.reason


@pytest.mark.parametrize("jerks", [None, 5000.0, 50.0, 10.0])
@pytest.mark.parametrize("end", ["start", "end"])
def test_a_motion_begins_and_ends_in_any_direction(stage, jerks, end):
    """Along the path, against it, and anywhere else, also speeding up; and not much longer."""
    most = limits(2.0, 5.0, jerks)
    for seed in range(16):
        rng = np.random.default_rng(seed)
        path = np.cumsum(rng.normal(0.0, 0.7, (2 + seed % 4, 4)), axis=0)
        edge = path[1] - path[0] if end == "start" else path[-1] - path[-2]
        across = rng.uniform(-1.8, 1.8, 4)
        velocity = (0.4 * edge / np.abs(edge).max(), -1.5 * edge / np.abs(edge).max(), across)
        rates = {f"{end}_velocity": velocity[seed % 3]}
        if jerks is not None and seed % 3 == 2:
            rates[f"{end}_acceleration"] = rng.uniform(-2.0, 2.0, 4)
        # Room for what speeds up at first, or last.
        rates[f"{end}_velocity"] *= 0.5 if jerks == 10.0 else 1.0
        timed = time_path(stage, path, most, **rates)
        assert timed.is_success, timed.reason
        assert seed > 2 or exact_ratios(timed.points, most) <= 1.0 + 1e-9
        assert find_excess(timed.trajectory, most) is None
        at, points = (0, -1)[end == "end"], timed.points
        np.testing.assert_array_equal(points.velocities[at], rates[f"{end}_velocity"])
        if f"{end}_acceleration" in rates:
            np.testing.assert_array_equal(points.accelerations[at], rates[f"{end}_acceleration"])
        np.testing.assert_array_equal(points.positions[[0, -1]], path[[0, -1]])
        slow = 0.0 if jerks is None else 4.0 * math.sqrt(2.0 / jerks)
        assert timed.duration <= 2.0 * with_rests(path, most) + 2.0 * (2.0 / 5.0 + slow)


def test_a_stop_leads_off_its_path_only_where_it_may(stage):
    """Not with a deviation; nor beyond the end, in line with the path."""
    path, most = np.array([[0.0, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0]]), limits(2.0, 5.0, 50.0)
    away = {"start_velocity": [0.0, -1.5, 0.0, 0.0]}
    assert time_path(stage, path, most, **away).is_success
    kept = time_path(stage, path, most, deviation=0.01, **away)
    assert not kept.is_success
    assert "'j1'" in kept.reason
    beyond = time_path(stage, path, most, start_velocity=[1.9, 0.0, 0.0, 0.0])
    assert beyond.failure is TimingFailure.NOT_RETIMED
    # Along a path that is long enough it stops on it.
    long = time_path(stage, 8.0 * path, most, deviation=0.0, start_velocity=[1.9, 0.0, 0.0, 0.0])
    assert long.is_success, long.reason


@pytest.mark.parametrize("rounding", [np.float64, np.float32])
@pytest.mark.parametrize("jerks", [None, 10.0])
def test_points_on_an_edge_are_no_ends_of_it(stage, rounding, jerks):
    """A motion stops beyond the first of them, and goes on from there."""
    ends = np.array([[0.0, 0.1, 0.0, 0.0], [3.0, 1.1, 0.3, 0.0], [3.0, 1.1, 1.3, 0.7]])
    t = np.linspace(0.0, 1.0, 101)[:, np.newaxis]
    path = np.concatenate([ends[0] + t * (ends[1] - ends[0]), ends[2:]]).astype(rounding)
    most, velocity = limits(2.0, 2.5, jerks), 0.6 * (ends[1] - ends[0])
    timed = time_path(stage, path.astype(float), most, start_velocity=velocity)
    assert timed.is_success, timed.reason
    assert timed.duration <= with_rests(ends, most) + 1.0
    # It never goes back.
    assert timed.points.velocities[:, 0].min() >= -1e-9


def test_nowhere_to_go_fast(stage):
    """Two points that differ by rounding, and a velocity: no number is infinite."""
    path = np.array([[50.0, 0.0, 0.0, 0.0], [np.nextafter(50.0, 51.0), 0.0, 0.0, 0.0]])
    for end in ("start", "end"):
        rates = {f"{end}_velocity": [0.3, 0.0, 0.0, 0.0]}
        with np.errstate(all="raise", under="ignore"):
            timed = time_path(stage, path, limits(1.0, 1e-3, 1e-5), **rates)
        assert timed.failure is TimingFailure.NOT_RETIMED


def test_a_stop_that_takes_for_ever_is_none(stage):
    """The reason has the joint."""
    path = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    slow = limits([1.0, 1.0, 1.0, 1.0], [1.0, 1e-12, 1.0, 1.0], None)
    timed = time_path(stage, path, slow, start_velocity=[0.0, 0.5, 0.0, 0.0])
    assert not timed.is_success
    assert "'j1'" in timed.reason

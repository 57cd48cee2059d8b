"""Trajectories along paths of robots: rounded where that is free, and proven at all times."""

import numpy as np
import pytest
from robot_scenes import BALL, CART, CORNER, diagram, DRONE, move, PLATE, POST, ROD, SLIDE

from scene_graph_ros.planning import (
    CollisionCheckerError,
    EdgeStatus,
    load_robot_diagram,
    plan_path,
    SceneGraphCollisionChecker,
    time_path,
    TimingFailure,
)
from scene_graph_ros.planning.checker.position_limits import beyond_limits
from scene_graph_ros.planning.trajectories import find_excess, MotionLimits, TrajectoryError

BLOCK = """
geometries:
  - {name: block, source: around, pose: {xyz: [-49.15, 50.15, 0]},
      shape: {type: box, size: [100, 100, 1]}}
"""


def cart(folder, x, y, **paddings):
    """Return the checker of the ball, and its limits."""
    robots = diagram(folder, CART, POST.format(x=x, y=y))
    checker = SceneGraphCollisionChecker(robots, **paddings)
    return checker, MotionLimits.of_tree(robots.tree, accelerations=2.0)


def samples(timed, count=2000):
    """Return configurations on a trajectory."""
    return timed.trajectory.value(np.linspace(0.0, timed.duration, count))


# Curved edges.


def test_a_curved_edge_is_proven_or_collides_where_it_must(tmp_path):
    """A rod turns as far as half its middle control point and back; a plate is at 0.5."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))
    turns = np.array([[[0.0], [middle], [0.0]] for middle in (0.9, 0.99, 1.02, -3.0)])
    measures = checker.measure_edges(turns)
    assert [m.status for m in measures] == [
        EdgeStatus.FREE,
        EdgeStatus.FREE,
        EdgeStatus.COLLIDES,
        EdgeStatus.FREE,
    ]
    stopped = measures[2]
    t = stopped.alpha
    # The plate begins 0.7 m away; there half its thickness and half the rod's are 0.00055 m.
    assert 2.0 * t * (1.0 - t) * 1.02 == pytest.approx(0.5 - 0.00055 / 0.7, abs=5e-6)
    assert 0.0 < stopped.at < 0.5
    assert checker.find_colliding_pair(stopped.configuration) is not None
    assert 0.0 < measures[0].least_clearance <= 0.05 * 0.9


def test_a_straight_curve_is_the_edge(tmp_path):
    """Control points evenly on a line give what the two ends give."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    ends = np.array([[[-1.0], [0.5]], [[-1.0], [1.5]]])
    curves = np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1)
    for edge, curve in zip(
        checker.measure_edges(ends), checker.measure_edges(curves), strict=True
    ):
        assert edge.status is curve.status
        assert curve.alpha == pytest.approx(edge.alpha, abs=1e-5)


def test_no_proven_curve_of_a_panda_collides():
    """None of 300 configurations on each of 100 random cubics; many of them are proven."""
    checker = SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))
    tree, rng = checker.plan.tree, np.random.default_rng(4)
    q = rng.uniform(tree.lower, tree.upper, (400, tree.num_positions))
    q = q[checker.check_configs_collision_free(q)][:100]
    curves = q[:, np.newaxis] + np.cumsum(rng.normal(0.0, 0.15, (len(q), 4, q.shape[1])), axis=1)
    curves[:, 0] = q
    measures = checker.measure_edges(curves)
    t = np.linspace(0.0, 1.0, 300)[:, np.newaxis]
    s = 1.0 - t
    weights = np.stack([s**3, 3.0 * s**2 * t, 3.0 * s * t**2, t**3], axis=1)[..., 0]
    free = 0
    for curve, measure in zip(curves, measures, strict=True):
        on = weights @ curve
        is_free = checker.check_configs_collision_free(on)
        if measure.completely_free:
            assert is_free.all()
            free += 1
        assert is_free[t[:, 0] <= measure.alpha - 1e-9].all()
        if is_free.all() and not measure.completely_free:
            near = min(checker.calc_robot_clearance(p, 0.1).distances.min(initial=1.0) for p in on)
            assert near < 1e-3
    assert free > 30


def test_what_is_no_curve_is_refused(tmp_path):
    """By shape; and where a floating joint would turn."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, DRONE))
    still = np.zeros((1, 3, 7))
    still[..., 0] = 1.0
    still[0, 1, 4] = 2.0
    assert checker.check_edges_collision_free(still).all()
    turning = still.copy()
    turning[0, 1, 1] = 0.1
    with pytest.raises(CollisionCheckerError, match="edge 0 is curved, so its joint 'free'"):
        checker.check_edges_collision_free(turning)
    for shape in ((1, 1, 7), (1, 7), (1, 3, 6)):
        with pytest.raises(CollisionCheckerError, match="or more control points"):
            checker.check_edges_collision_free(np.ones(shape))


# Trajectories.


def test_a_free_corner_is_rounded_as_far_as_it_can(tmp_path):
    """The post is far away: the parabola is that from the middle of one edge to the other's."""
    checker, limits = cart(tmp_path, 3.0, 3.0)
    timed = time_path(checker, CORNER, limits)
    assert timed.is_success, timed.reason
    assert (timed.rounded, timed.stops) == (1, 0)
    q = samples(timed)
    # Half way between the corner and the middle of the chord: 1/4 from both edges' ends.
    nearest = np.linalg.norm(q - [0.875, 0.125], axis=1).min()
    assert nearest < 1e-3
    # A path that stops takes two edges of 1 with v = 1 and a = 2.
    assert timed.duration < 2.0 * (1.0 + 1.0 / 2.0)
    assert find_excess(timed.trajectory, limits) is None


def test_a_corner_is_rounded_less_where_something_is_inside(tmp_path):
    """The full parabola passes (0.875, 0.125), into a post that keeps 5 cm from both edges."""
    checker, limits = cart(tmp_path, 0.75, 0.25)
    for rise_time in (0.0, 0.05):
        timed = time_path(checker, CORNER, limits, rise_time=rise_time)
        assert timed.is_success, timed.reason
        assert (timed.rounded, timed.stops) == (1, 0)
        q = samples(timed)
        apart = np.linalg.norm(q - [0.75, 0.25], axis=1).min() - 0.2
        assert 0.0 < timed.least_clearance <= apart < 0.05 + 1e-6
        assert np.linalg.norm(q - [0.875, 0.125], axis=1).min() > 0.02
        assert (timed.points.accelerations is None) == (rise_time == 0.0)


@pytest.mark.parametrize("rise_time", [0.0, 0.05])
def test_a_corner_without_room_is_stopped_at(tmp_path, rise_time):
    """A block leaves 5 cm on both edges of 60 m; corners are cut by 1/64 of 30 m at least.

    Where the block ends, 0.15 m before the corner, such a parabola is 88 mm from its edge already.
    """
    wide = CART.replace('lower="-1"', 'lower="-99"').replace('upper="3"', 'upper="99"')
    wide = wide.replace('upper="1"', 'upper="99"')
    robots = diagram(tmp_path, wide, BLOCK)
    checker = SceneGraphCollisionChecker(robots)
    limits = MotionLimits.of_tree(robots.tree, accelerations=2.0)
    path = np.array([[-59.0, 0.0], [1.0, 0.0], [1.0, 60.0]])
    timed = time_path(checker, path, limits, rise_time=rise_time)
    assert timed.is_success, timed.reason
    assert (timed.rounded, timed.stops) == (0, 1)
    assert 0.0 < timed.least_clearance <= 0.05
    corner = (np.abs(timed.points.positions - path[1]) < 1e-9).all(axis=1)
    assert corner.any()
    assert np.abs(timed.points.velocities[corner]).max() < 1e-9
    # Each edge by itself; with a rise time once for each edge.
    assert timed.duration == pytest.approx(2.0 * (60.0 + 0.5 + rise_time), rel=1e-6)
    assert checker.check_configs_collision_free(samples(timed)).all()


def test_a_panda_s_trajectory_is_free_and_within_all_limits():
    """From one compartment of a shelf into the next, at 3000 times by the scene's own queries."""
    checker = SceneGraphCollisionChecker(
        load_robot_diagram("config/scenes/panda_cell.yaml"), env_collision_padding=0.005
    )
    tree = checker.plan.tree
    start = np.array([1.07, 1.31, 0.81, -1.17, 2.78, 2.67, -1.38, 0.02])
    goal = np.array([1.37, 0.75, 0.17, -0.51, 2.53, 3.09, -0.12, 0.02])
    path = plan_path(checker, start, goal, group="arm").configurations
    limits = MotionLimits.of_tree(
        tree, accelerations=5.0, velocity_scaling=0.5, positions=tree.group_positions("arm")
    )
    # The URDF says 2.175 rad/s of the first joint.
    assert limits.velocities[0] == pytest.approx(0.5 * 2.175)
    for rise_time in (0.0, 0.03):
        timed = time_path(checker, path, limits, rise_time=rise_time)
        assert timed.is_success, timed.reason
        assert timed.rounded + timed.stops == len(path) - 2
        q = samples(timed, 3000)
        assert checker.check_configs_collision_free(q).all()
        move(checker.model, q[1234])
        assert not beyond_limits(tree, q).any()
        np.testing.assert_array_equal(timed.points.positions[[0, -1]], [start, goal])
        assert not timed.points.velocities[:, 7].any()
        t = np.linspace(0.0, timed.duration, 3000)
        rates = timed.trajectory.derivative().value(t)[:, :7]
        assert (np.abs(rates) <= limits.velocities * (1.0 + 1e-12)).all()
        rates = timed.trajectory.derivative(2).value(t)[:, :7]
        assert (np.abs(rates) <= limits.accelerations * (1.0 + 1e-12)).all()
        near = [checker.calc_robot_clearance(each, 0.05).distances for each in q[::25]]
        assert 0.0 < timed.least_clearance <= min(d.min(initial=np.inf) for d in near)


def test_paths_without_length_and_with_points_twice(tmp_path):
    """One configuration stays for the shortest time; the same twice is no corner."""
    checker, limits = cart(tmp_path, 3.0, 3.0)
    for path in (CORNER[:1], CORNER[[0, 0, 0]]):
        timed = time_path(checker, path, limits)
        assert timed.is_success
        assert 0.0 < timed.duration < 1e-5
        np.testing.assert_array_equal(timed.points.positions, CORNER[[0, 0]])
    twice = time_path(checker, CORNER[[0, 0, 1, 1, 1, 2, 2]], limits)
    once = time_path(checker, CORNER, limits)
    np.testing.assert_array_equal(twice.points.positions, once.points.positions)
    np.testing.assert_array_equal(twice.points.nanoseconds, once.points.nanoseconds)


def test_a_path_that_is_not_free_has_no_trajectory(tmp_path):
    """It says which pair is not apart, and when."""
    checker, limits = cart(tmp_path, 0.5, 0.0)
    timed = time_path(checker, CORNER, limits)
    assert timed.failure is TimingFailure.NOT_FREE
    assert not timed.is_success
    assert timed.duration == 0.0
    assert "post" in timed.reason
    assert "between" in timed.reason


def test_a_path_beyond_limits_of_positions_says_which_by_how_much_and_when(tmp_path):
    """The rail y ends at 1."""
    checker, limits = cart(tmp_path, 3.0, 3.0)
    timed = time_path(checker, [[0.0, 0.0], [0.0, 1.25]], limits)
    assert timed.failure is TimingFailure.LIMIT
    assert "position of 'y' is 1.25 at" in timed.reason
    assert "beyond its limit 1 by 0.25" in timed.reason


def test_time_that_is_over_ends_it(tmp_path):
    """Nothing is left behind, and what watches may end it, too. With time there is one."""
    checker, limits = cart(tmp_path, 0.75, 0.25)
    rng = np.random.default_rng(0)
    long = rng.uniform(-1.0, 0.1, (300, 2))

    class StoppedError(Exception):
        pass

    def stop():
        raise StoppedError

    with pytest.raises(StoppedError):
        time_path(checker, long, limits, watch=stop)
    late = time_path(checker, np.tile(long, (10, 1)), limits, timeout=0.0)
    assert late.failure is TimingFailure.TIMEOUT
    timed = time_path(checker, long, limits)
    assert timed.is_success, timed.reason
    # It rests where it turns back, by 172 degrees or more.
    ways = np.diff(long, axis=0)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    turns_back = ((ways[:-1] * ways[1:]).sum(axis=1) < -0.99).sum()
    assert (timed.rounded, timed.stops) == (len(long) - 2 - turns_back, turns_back)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"path": CORNER[0]}, r"shape \(n, nq\), not \(2,\)"),
        (
            {"limits": MotionLimits([1.0], [1.0], ("x",))},
            "position 'y', which has no limits",
        ),
        ({"limits": MotionLimits([1.0], [1.0])}, "1 entries without names, and there are 2"),
        ({"rise_time": -1.0}, "rise_time must be seconds from 0 on, not -1.0"),
        ({"grid_points": 0}, "grid_points must be a whole number from 1 on, not 0"),
        ({"timeout": np.nan}, "timeout must be seconds"),
    ],
)
def test_what_makes_no_sense_is_named(tmp_path, change, words):
    """By argument and value."""
    checker, limits = cart(tmp_path, 3.0, 3.0)
    arguments = {"path": CORNER, "limits": limits, **change}
    path, most = arguments.pop("path"), arguments.pop("limits")
    with pytest.raises(TrajectoryError, match=words):
        time_path(checker, path, most, **arguments)


def test_limits_of_a_robot_are_its_own_or_refused_by_name(tmp_path):
    """Velocities of the URDF, unless given; a joint without, or with zero, is named."""
    tree = diagram(tmp_path, CART).tree
    np.testing.assert_array_equal(tree.velocity_limits, [1.0, 1.0])
    own = MotionLimits.of_tree(
        tree, accelerations={"x": 3.0, "y": 4.0}, velocities={"y": 0.5}, acceleration_scaling=0.5
    )
    np.testing.assert_array_equal(own.velocities, [1.0, 0.5])
    np.testing.assert_array_equal(own.accelerations, [1.5, 2.0])
    for arguments, words in (
        ({"accelerations": {"x": 1.0}}, "position 'y' has no limit of acceleration"),
        ({"accelerations": 0.0}, "accelerations of 'x' must be from 1e-12 to 1e\\+18, not 0"),
        ({"accelerations": {"z": 1.0}}, "accelerations: there is no position 'z'"),
        ({"accelerations": 1.0, "velocities": {"x": 0.0}}, "velocities of 'x' must be from"),
        ({"accelerations": 1.0, "velocity_scaling": 1.5}, r"velocity_scaling must be in \(0, 1\]"),
    ):
        with pytest.raises(TrajectoryError, match=words):
            MotionLimits.of_tree(tree, **arguments)
    bare = diagram(tmp_path, SLIDE).tree
    with pytest.raises(TrajectoryError, match="position 'rail' has no limit of velocity"):
        MotionLimits.of_tree(bare, accelerations=1.0)


def test_a_joint_that_follows_keeps_its_limit_of_velocity(tmp_path):
    """It is twice as fast as the joint that it follows, and has half its limit."""
    follower = """<joint name="echo" type="prismatic"><parent link="base"/><child link="two"/>
      <axis xyz="1 0 0"/><limit lower="-5" upper="5" velocity="0.5"/>
      <mimic joint="x" multiplier="-2"/></joint></robot>"""
    urdf = CART.replace("</robot>", f'<link name="two"/>{follower}')
    np.testing.assert_array_equal(diagram(tmp_path, urdf).tree.velocity_limits, [0.25, 1.0])


def test_a_floating_joint_that_turns_is_refused(tmp_path):
    """And one that stays is no trouble."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, DRONE))
    names = ("free.x", "free.y", "free.z")
    limits = MotionLimits(np.ones(3), np.ones(3), names)
    path = np.zeros((2, 7))
    path[:, 0] = 1.0
    path[1, 4:] = 1.0
    assert time_path(checker, path, limits).is_success
    path[1, :2] = 0.6, 0.8
    with pytest.raises(TrajectoryError, match="floating joint 'free'"):
        time_path(checker, path, limits)

"""Velocities that keep a distance: nearest, within limits, proven, and what else is told."""

import math

import numpy as np
import pytest
from robot_scenes import CART, diagram, DRONE, SLIDE

from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.planning import (
    load_robot_diagram,
    SafeVelocity,
    SafeVelocityError,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots.tree_joint import KinematicTreeError
from scene_graph_ros.trajectories import MotionLimits, TrajectoryError

DT = 0.001

# A ball of 0.1 m on rails, and a wall whose face is at x = 1.
WALL = """
geometries:
  - {name: wall, source: around, pose: {xyz: [1.1, 0, 0]}, shape: {type: box, size: [0.2, 4, 1]}}
"""

# The same wall on a frame that moves.
DOOR = """
frames:
  - {name: door, source: around, pose: {xyz: [1.1, 0, 0]}}
geometries:
  - {name: wall, frame: door, source: around, shape: {type: box, size: [0.2, 4, 1]}}
"""


def cart_limits(acceleration=5.0):
    """Return the limits of the cart: 1 m/s on both rails."""
    return MotionLimits(np.ones(2), np.full(2, acceleration), ("x", "y"))


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A ball on two rails before a wall."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("cart"), CART, WALL))


@pytest.fixture(scope="module")
def door(tmp_path_factory):
    """The same before a wall that may move, and its frame."""
    model = diagram(tmp_path_factory.mktemp("door"), CART, DOOR)
    inspector = model.context.snapshot.inspector
    source = inspector.get_source_id_by_name("around")
    return SceneGraphCollisionChecker(model), inspector.get_frame_id_by_name(source, "door")


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


def drive(barrier, q, v, ticks, dt=DT, obstacles=None):
    """Follow a filter; return the positions ``(ticks + 1, nq)`` and the steps."""
    qs, steps = [np.array(q, dtype=float)], []
    for _ in range(ticks):
        steps.append(barrier.filter(qs[-1], v, dt, obstacles=obstacles))
        qs.append(qs[-1] + dt * steps[-1].velocity)
    return np.array(qs), steps


def test_what_is_far_away_passes_as_it_is(cart):
    """A velocity that its acceleration's limit allows is returned with the same bits."""
    barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
    asked = np.array([0.004, -0.003])
    step = barrier.filter([0.0, 0.0], asked, DT)
    assert (step.velocity == asked).all()
    assert step.is_kept and step.active == () and step.nearest is None
    assert step.proven_until == DT
    assert step.brake_time == DT


def test_acceleration_and_velocity_end_at_their_limits(cart):
    """From rest it becomes faster by 5 m/s^2, up to 1 m/s, and no faster."""
    barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
    _, steps = drive(barrier, [0.0, 0.0], [0.0, 9.0], 250)
    speeds = np.array([step.velocity[1] for step in steps])
    np.testing.assert_allclose(speeds[:200], 0.005 * np.arange(1, 201), rtol=1e-12)
    assert (speeds[200:] == 1.0).all()


def test_it_comes_to_rest_at_the_distance(cart):
    """Straight at a wall 0.9 m away: it ends 0.05 m before it, and never nearer."""
    barrier = SafeVelocity(cart, 0.05, gain=5.0, limits=cart_limits(20.0))
    qs, steps = drive(barrier, [0.0, 0.0], [9.0, 0.0], 4000)
    gaps = 0.9 - qs[:, 0]
    assert gaps.min() >= 0.05
    assert gaps[-1] <= 0.05 + 1e-4
    assert all(step.is_kept and step.proven_until == DT for step in steps)
    # A distance shrinks by at most the gain times what is left.
    rates = np.diff(gaps) / DT
    assert (rates >= -5.0 * (gaps[:-1] - 0.05) - 1e-9).all()
    (active,) = steps[-1].active
    assert {active.pair.name_A, active.pair.name_B} == {
        "around/world/wall",
        "robot/ball/ball_collision_0",
    }
    assert active.distance == pytest.approx(gaps[-2], abs=1e-12)
    assert steps[-1].nearest == active


def test_along_a_wall_nothing_is_lost(cart):
    """At a wall the part of the velocity along it is let through, to 1e-9."""
    barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
    q, velocity = np.array([0.85 - 1e-4, -0.9]), np.zeros(2)
    for _ in range(300):
        velocity = barrier.filter(q, [0.5, 0.5], DT).velocity
        q = q + DT * velocity
    assert abs(velocity[1] - 0.5) <= 1e-9
    assert 0.0 <= velocity[0] <= 5.0 * 1e-4
    assert q[0] <= 0.85


@pytest.mark.parametrize("acceleration", [0.2, 5.0, 1e6])
def test_it_brakes_before_what_it_can_not_pass(cart, acceleration):
    """Whatever its brakes: at each tick it could come to rest before the distance."""
    barrier = SafeVelocity(cart, 0.05, gain=1e3, limits=cart_limits(acceleration))
    q = np.array([0.0, 0.0])
    for _ in range(2500):
        step = barrier.filter(q, [9.0, 0.0], DT)
        q = q + DT * step.velocity
        assert step.is_kept
        assert 0.9 - q[0] - step.velocity[0] ** 2 / (2.0 * acceleration) >= 0.05 - 1e-12


def test_positions_stay_within_their_limits(cart):
    """Into the corner of both rails' limits at full speed, and out of it again."""
    barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
    qs, _ = drive(barrier, [-0.5, -0.2], [-9.0, -9.0], 3000)
    assert (qs >= -1.0).all()
    np.testing.assert_allclose(qs[-1], -1.0, atol=1e-5)
    barrier.reset()
    assert (barrier.filter([-1.0, -1.0], [-1.0, -1.0], DT).velocity == 0.0).all()
    assert (barrier.filter([-1.0, -1.0], [1.0, 1.0], DT).velocity > 0.0).all()
    # Beyond a limit it may only come back.
    barrier.reset()
    velocity = barrier.filter([-1.2, 0.0], [-1.0, 0.001], DT).velocity
    assert velocity[0] == 0.0 and velocity[1] == 0.001
    assert barrier.filter([-1.2, 0.0], [1.0, 0.0], DT).velocity[0] > 0.0


@pytest.mark.parametrize("start", [0.93, 0.9, 0.87, 0.85])
def test_nearer_than_asked_nothing_comes_nearer(cart, start):
    """In contact, deep in it, and at the distance itself: it stays, goes along, or goes away."""
    barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
    qs, _ = drive(barrier, [start, 0.0], [1.0, 0.3], 300)
    assert qs[:, 0].max() <= start + 1e-5
    assert qs[-1, 1] > 0.05
    barrier.reset()
    qs, steps = drive(barrier, [start, 0.0], [-0.5, 0.0], 600)
    assert all(step.is_kept for step in steps)
    assert qs[-1, 0] < start - 0.1


def test_a_wall_that_comes_pushes_and_one_that_goes_lets_follow(door):
    """Asked for nothing it goes as fast as the wall that comes; behind one it may follow."""
    checker, frame = door
    for speed, asked in ((-0.2, 0.0), (0.2, 9.0)):
        barrier = SafeVelocity(checker, 0.05, limits=cart_limits())
        q, x, at = np.array([0.0, 0.0]), 1.1, checker
        gaps = []
        for _ in range(290):
            X = pose_from_xyz_rpy((x, 0.0, 0.0), (0.0, 0.0, 0.0))
            at = checker.at(checker.snapshot.with_frame_poses({frame: X}))
            barrier.move_to(at)
            twist = [0.0, 0.0, 0.0, speed, 0.0, 0.0]
            step = barrier.filter(q, [asked, 0.0], 0.02, obstacles={frame: twist})
            assert step.is_kept
            q, x = q + 0.02 * step.velocity, x + 0.02 * speed
            gaps.append(x - 0.1 - q[0] - 0.1)
        assert min(gaps) >= 0.05
        if speed < 0.0:
            assert gaps[-1] <= 0.1 and step.velocity[0] == pytest.approx(speed, rel=1e-3)
        else:
            assert gaps[-1] <= 0.35 and step.velocity[0] >= speed


def test_where_nothing_keeps_the_distance_the_least_is_lost(door):
    """A wall at 3 m/s, a robot of 1 m/s at its distance: it flees as fast as it can, and says."""
    checker, frame = door
    barrier = SafeVelocity(checker, 0.05, limits=cart_limits())
    for value in ([0.0, 0.0, 0.0, -3.0, 0.0, 0.0], 3.0):
        barrier.reset()
        step = barrier.filter([0.849, 0.0], [1.0, 0.002], DT, obstacles={frame: value})
        assert not step.is_kept and step.proven_until == 0.0
        np.testing.assert_allclose(step.velocity, [-0.005, 0.002], atol=1e-6)
        assert len(step.active) == 1
    # One that moves away, or stands, is no reason to.
    barrier.reset()
    step = barrier.filter([0.849, 0.0], [0.0, 0.0], DT, obstacles={frame: [0, 0, 0, 3.0, 0, 0]})
    assert step.is_kept and (step.velocity == 0.0).all()


def test_a_robot_that_can_not_brake_in_time_brakes(cart):
    """Where it is told to be too fast already: as hard as it can, along its line."""
    barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
    step = barrier.filter([0.84, 0.0], [1.0, 0.0], DT, present=[0.8, 0.4])
    assert not step.is_kept
    np.testing.assert_allclose(step.velocity, np.array([0.8, 0.4]) * 159 / 160, rtol=1e-12)
    assert step.brake_time == pytest.approx(0.159)


def test_the_velocity_is_the_nearest(cell):
    """No other of 10 000 velocities that change distances no faster is nearer to the one asked."""
    tree, rng = cell.plan.tree, np.random.default_rng(3)
    limits = MotionLimits.of_tree(tree, accelerations=1e4)
    barrier = SafeVelocity(cell, 0.01, gain=5.0, limits=limits)
    compared = 0
    for q in tree.sample(rng, 40):
        clearance = cell.calc_robot_clearance(q, 0.2)
        spare = clearance.distances - 0.01
        if (spare < 0.0).any():
            continue
        barrier.reset()
        asked = rng.uniform(-1.0, 1.0, 8) * np.minimum(tree.velocity_limits, 0.3)
        step = barrier.filter(q, asked, DT)
        sizes = 10.0 ** rng.uniform(-4.0, -1.0, (10_000, 1))
        others = step.velocity + sizes * rng.normal(size=(10_000, 8))
        room = np.minimum(tree.upper - q, q - tree.lower) / (2 * DT)
        fits = (np.abs(others) <= np.minimum(tree.velocity_limits, 0.5 * room)).all(axis=1)
        fits &= (others @ clearance.jacobians.T >= -5.0 * spare).all(axis=1)
        distances = np.linalg.norm(others[fits] - asked, axis=1)
        compared += len(distances)
        assert distances.min(initial=np.inf) >= np.linalg.norm(step.velocity - asked) - 1e-4
    assert compared > 10_000


def test_at_a_singular_pose_it_answers_as_elsewhere(cell):
    """Stretched out, and with two axes in one line: limits hold, and nothing is lost."""
    limits = MotionLimits.of_tree(cell.plan.tree, accelerations=15.0)
    q = np.zeros(8)
    q[3] = -0.0698  # where fingers and forearm are 8.5 mm apart
    for asked in (np.full(8, 0.005), np.zeros(8)):
        barrier = SafeVelocity(cell, 0.005, limits=limits)
        step = barrier.filter(q, np.where(np.arange(8) == 3, -asked, asked), DT)
        assert step.is_kept
        assert np.isfinite(step.velocity).all()
        assert (np.abs(step.velocity - np.where(np.arange(8) == 3, -asked, asked)) <= 1e-3).all()


def test_a_huge_velocity_is_cut_and_a_tiny_one_passes(cart):
    """From the least number to the largest."""
    for value in (5e-324, 1e-300, 1e300, 1.7e308):
        barrier = SafeVelocity(cart, 0.05, limits=cart_limits())
        step = barrier.filter([0.0, 0.0], [value, -value], DT)
        most = min(value, 0.005)
        np.testing.assert_allclose(step.velocity, [most, -most], rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([0, 0], [math.nan, 0], DT), "v of position 'x' must be finite, not nan"),
        (([0, 0], [0, math.inf], DT), "v of position 'y' must be finite, not inf"),
        (([0, 0], [0], DT), r"v must have shape \(2,\), not \(1,\)"),
        (([0, 0], "fast", DT), "v must be numbers"),
        (([0, 0], [0, 0], 0.0), "dt must be positive, not 0"),
        (([0, 0], [0, 0], -1.0), "dt must be a finite number from 0 on, not -1.0"),
        (([0, 0], [0, 0], math.nan), "dt must be a finite number"),
        (([0, 0], [0, 0], DT, [0, math.nan]), "present of position 'y' must be finite"),
        (([0, 0], [0, 0], DT, None, {"door": 1.0}), "obstacles: 'door' is no frame"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(cart, arguments, words):
    """A typed error says which argument, which position, and what it was."""
    barrier = SafeVelocity(cart, limits=cart_limits())
    with pytest.raises(SafeVelocityError, match=words):
        barrier.filter(*arguments)


def test_obstacles_are_refused_by_name(door):
    """A velocity that is none, and frames on which nothing is that could be near."""
    checker, frame = door
    barrier = SafeVelocity(checker, limits=cart_limits())
    for value in (-1.0, math.nan, [1.0, 2.0], [0, 0, 0, 0, 0, math.inf], "fast"):
        with pytest.raises(SafeVelocityError, match="'around/door' must have a velocity"):
            barrier.filter([0, 0], [0, 0], DT, obstacles={frame: value})
    inspector = checker.snapshot.inspector
    source = inspector.get_source_id_by_name("robot")
    ball = inspector.get_frame_id_by_name(source, "ball")
    words = "no geometry that is checked, and around the robots, is on 'robot/ball'"
    with pytest.raises(SafeVelocityError, match=words):
        barrier.filter([0, 0], [0, 0], DT, obstacles={ball: 1.0})


def test_filters_that_make_no_sense_are_refused(tmp_path, cart):
    """Bad numbers, no limits, joints that float, positions that must not move."""
    for name, value in (("keep", -0.1), ("keep", math.nan), ("gain", 0.0), ("gain", math.inf)):
        with pytest.raises(SafeVelocityError, match=name):
            SafeVelocity(cart, **{name: value}, limits=cart_limits())
    with pytest.raises(TrajectoryError, match="limit of acceleration"):
        SafeVelocity(cart)
    with pytest.raises(SafeVelocityError, match="names"):
        SafeVelocity(cart, limits=MotionLimits(np.ones(2), np.ones(2)))
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE))
    with pytest.raises(SafeVelocityError, match="'free', which floats"):
        SafeVelocity(drone, limits=cart_limits())
    barrier = SafeVelocity(cart, limits=MotionLimits(np.ones(1), np.ones(1), ("x",)))
    with pytest.raises(SafeVelocityError, match="moves position 'y'"):
        barrier.filter([0, 0], [0.0, 1.0], DT)
    assert (barrier.filter([0, 0], [0.1, 0.0], DT).velocity == [0.001, 0.0]).all()
    with pytest.raises(KinematicTreeError, match="must be finite"):
        barrier.filter([math.nan, 0], [0.0, 0.0], DT)
    slide = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE))
    with pytest.raises(SafeVelocityError, match="other positions or pairs"):
        barrier.move_to(slide)

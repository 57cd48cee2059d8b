"""Random drives through clutter: nothing comes nearer than asked by the robot's own motion.

That is judged by ordinary queries of the scene. A small share here; `make search` goes on for
many times longer, and EFFORT=2000 for a million ticks.
"""

import math

import numpy as np
import pytest
from searching import times
from velocity_judge import braking_positions, Judge, step_positions

from scene_graph_ros.planning import (
    load_robot_diagram,
    SafeVelocity,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.trajectories import MotionLimits

KEEP = 0.01
ALLOWED = 1e-5
"""Metres that a pair may lose which was nearer than asked."""

START = np.array([0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.8, 0.02])
ACCELERATION = 15.0
BESIDE = 0.25
"""m: from a link's origin to an object's."""


class Drive:
    """A Panda in its cell, driven at random; what is on frames of the cell's objects may move."""

    def __init__(self, seed, dt):
        """Begin at rest."""
        model = load_robot_diagram("config/scenes/panda_cell.yaml")
        self.checker = SceneGraphCollisionChecker(model)
        self.tree, self.rng, self.dt = self.checker.plan.tree, np.random.default_rng(seed), dt
        self.judge = Judge(model, "objects")
        self.limits = MotionLimits.of_tree(self.tree, accelerations=ACCELERATION)
        self.barrier = SafeVelocity(self.checker, KEEP, limits=self.limits)
        inspector, moment = model.context.snapshot.inspector, model.context.snapshot
        self.frames = sorted(inspector.frames_for_source(self.judge.around))
        self.X_WFs = np.array([moment.pose_in_world(frame) for frame in self.frames])
        self.q, self.present, self.kind = START, np.zeros(8), 0
        self.goal = self.direction = START
        self.worst, self.kept, self.held = -np.inf, 0, 0

    def asked(self, tick):
        """Return a velocity: towards a collision, in one direction, or another each tick."""
        if tick % max(1, round(0.3 / self.dt)) == 0:
            goals = self.tree.sample(self.rng, 100)
            hits = ~self.checker.check_configs_collision_free(goals)
            self.goal, self.kind = goals[hits][0], self.rng.integers(4) if tick else 0
            self.direction = 5.0 * self.rng.normal(size=8)
        noise = 3.0 * self.rng.normal(size=8)
        return (4.0 * (self.goal - self.q), self.direction, noise, 0.0 * noise)[self.kind]

    def follow(self, step):
        """Move on with a step, whose limits must hold: at once, or evenly."""
        change = np.abs(step.velocity - self.present)
        assert (change <= ACCELERATION * self.dt * (1.0 + 1e-9)).all()
        assert (np.abs(step.velocity) <= self.limits.velocities + 1e-12).all()
        middle = 0.5 * (self.present + step.velocity)
        self.q = self.q + self.dt * (step.velocity if self.rng.random() < 0.5 else middle)
        assert (self.q >= self.tree.lower - 1e-9).all()
        assert (self.q <= self.tree.upper + 1e-9).all()
        self.present = step.velocity
        self.kept += step.is_kept
        self.held += bool(step.active)

    def note(self, losses):
        """Note the largest loss."""
        self.worst = max(self.worst, max(losses.values(), default=-np.inf))


@pytest.mark.search
@pytest.mark.parametrize(("dt", "seed", "every"), [(0.001, 7, 10), (0.01, 2, 4)])
def test_nothing_comes_nearer_in_a_cell_that_stands_still(dt, seed, every):
    """On steps, and on the braking motion after some of them: 10 mm are kept, exactly."""
    drive = Drive(seed, dt)
    count = times(200)
    for tick in range(count):
        step = drive.barrier.filter(drive.q, drive.asked(tick), dt)
        before = {}
        for q in step_positions(drive.q, drive.present, step.velocity, dt, 1):
            drive.note(drive.judge.losses(before, q, KEEP))
        if tick % every == 0:
            end = drive.q + dt * step.velocity
            for q in braking_positions(end, step.velocity, step.brake_time, 4)[1]:
                drive.note(drive.judge.losses(before, q, KEEP))
        drive.follow(step)
    print(f"{count} ticks of {dt} s: worst {drive.worst}, held {drive.held}")
    assert drive.worst <= 0.0
    assert drive.kept == count
    assert drive.held > 0


def test_the_judge_sees_what_an_unfiltered_drive_loses():
    """Towards the table without a filter: pairs come nearer than they may."""
    drive = Drive(6, 0.01)
    down = np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(20):
        for q in step_positions(drive.q, down, down, drive.dt, 1):
            drive.note(drive.judge.losses({}, q, KEEP))
        drive.q = drive.q + drive.dt * down
    assert drive.worst > 0.002


def moved(X_WFs, twists, t):
    """Return poses after a time with constant twists (angular, linear) in W."""
    result = X_WFs.copy()
    for X, twist in zip(result, twists, strict=True):
        angle = math.sqrt(twist[:3] @ twist[:3]) * t
        if angle > 0.0:
            x, y, z = twist[:3] * t / angle
            K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            X[:3, :3] = (np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K) @ X[
                :3, :3
            ]
        X[:3, 3] += t * twist[3:]
    return result


def throw(drive, twists, spin, fastest):
    """Let some of the objects go towards a link, or home; those beside a link go away from it.

    No robot keeps what an object in it takes: one that stayed there would have nothing to keep.
    """
    links = drive.tree.link_poses(drive.q, list(drive.tree.link_names[3:10]))[:, :3, 3]
    for k, X in enumerate(drive.X_WFs):
        if drive.rng.random() < 0.5:
            at = links[drive.rng.integers(len(links))]
            way = at - X[:3, 3] + 0.3 * drive.rng.normal(size=3)
            nearest = links[np.argmin(np.linalg.norm(links - X[:3, 3], axis=1))]
            if np.linalg.norm(X[:3, 3] - nearest) < BESIDE:
                way = X[:3, 3] - nearest + 0.05 * drive.rng.normal(size=3)
            elif drive.rng.random() < 0.3:
                way = drive.rng.uniform([0.2, -0.6, 0.5], [0.9, 0.6, 1.2]) - X[:3, 3]
            twists[k, 3:] = way * drive.rng.uniform(0.0, fastest) / np.linalg.norm(way)
            twists[k, :3] = spin * drive.rng.normal(size=3)


@pytest.mark.search
@pytest.mark.parametrize(("is_known", "seed", "fastest"), [(True, 3, 0.8), (False, 4, 0.4)])
def test_nothing_comes_nearer_where_objects_fly_about(is_known, seed, fastest):
    """Where it says that distances are kept, they are, whatever flies; else it flees or brakes.

    What is told of the objects is their velocity, which changes at times, or a bound of it, within
    which they go another way at each tick.
    """
    dt = 0.01
    drive, twists = Drive(seed, dt), np.zeros((8, 6))
    count = times(60)
    for tick in range(count):
        if not is_known or tick % 10 == 0:
            throw(drive, twists, 0.5 if is_known else 0.0, fastest)
        drive.judge.set_obstacles(drive.X_WFs)
        before = drive.judge.distances(drive.q)
        # Between the snapshot and the queries nothing else moves.
        drive.barrier.move_to(drive.checker.at(drive.judge.model.context.snapshot))
        told = dict(zip(drive.frames, twists if is_known else [fastest] * 8, strict=True))
        step = drive.barrier.filter(drive.q, drive.asked(tick), dt, obstacles=told)
        if step.is_kept:
            drive.judge.set_obstacles(moved(drive.X_WFs, twists, dt))
            for q in step_positions(drive.q, drive.present, step.velocity, dt, 1):
                drive.note(drive.judge.losses(before, q, KEEP))
            late, braking = braking_positions(
                drive.q + dt * step.velocity, step.velocity, step.brake_time, 3
            )
            for t, q in zip(late, braking, strict=True):
                drive.judge.set_obstacles(moved(drive.X_WFs, twists, dt + t))
                drive.note(drive.judge.losses(before, q, KEEP))
        elif not is_braking(drive.present, step.velocity, dt):
            for q in step_positions(drive.q, drive.present, step.velocity, dt, 1):
                drive.note(drive.judge.losses(before, q, KEEP))
        drive.follow(step)
        drive.X_WFs = moved(drive.X_WFs, twists, dt)
    print(f"{count} ticks: worst {drive.worst}, kept {drive.kept}, held {drive.held}")
    assert drive.worst <= ALLOWED
    assert drive.kept > 0.5 * count


def is_braking(present, velocity, dt):
    """Tell whether a velocity is that of a robot that brakes as hard as it may."""
    ticks = max(1, math.ceil(float(np.abs(present).max()) / ACCELERATION / dt - 1e-9))
    return np.allclose(velocity, present * (ticks - 1) / ticks, rtol=0.0, atol=1e-12)


@pytest.mark.search
def test_from_any_start_pairs_that_are_too_near_come_no_nearer():
    """From configurations that collide or nearly do: no such pair loses more than 10 µm."""
    dt, ticks = 0.002, 20
    drive, tried = Drive(5, dt), 0
    while tried < times(6):
        drive.q, drive.present = drive.tree.sample(drive.rng, 1)[0], np.zeros(8)
        before = drive.judge.distances(drive.q)
        if not any(distance < KEEP for distance in before.values()):
            continue
        tried += 1
        drive.barrier.reset()
        asked, worst = 3.0 * drive.rng.normal(size=8), -np.inf
        for _ in range(ticks):
            step = drive.barrier.filter(drive.q, asked, dt)
            drive.follow(step)
            assert step.is_kept
            worst = max([worst, *drive.judge.losses(before, drive.q, KEEP).values()])
        assert worst <= ALLOWED + 1e-9
        drive.note({None: worst})
    print(f"{tried} starts: worst {drive.worst}")

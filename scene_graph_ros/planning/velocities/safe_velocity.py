"""A filter of velocities: the nearest to the one asked for that keeps a distance, proven."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.checker.batches_of_one import one_configuration
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.near_pairs import NearPairs
from scene_graph_ros.planning.velocities.errors import SafeVelocityError
from scene_graph_ros.planning.velocities.motion_proofs import MotionProofs, NearBy, UNKNOWN
from scene_graph_ros.planning.velocities.moving_kernels import Profile
from scene_graph_ros.planning.velocities.moving_obstacles import (
    MovingObstacles,
    ObstacleFrames,
    ObstacleVelocities,
)
from scene_graph_ros.planning.velocities.nearest_velocity import (
    least_loss,
    nearest_velocity,
    NearestVelocity,
)
from scene_graph_ros.planning.velocities.safe_step import DistantPair, SafeStep
from scene_graph_ros.planning.velocities.velocity_arguments import (
    number_from,
    VelocityArguments,
)
from scene_graph_ros.planning.velocities.velocity_box import (
    joint_limits,
    motion_of,
    steps_to_rest,
    velocity_box,
    VelocityBox,
)
from scene_graph_ros.robots.tree_kernels import FLOATING
from scene_graph_ros.trajectories.motion_limits import MotionLimits

__all__ = ["SafeVelocity"]

_SPARE = 2e-6
"""Metres: the distance that a new motion keeps in addition; braking keeps half of it. So braking
is proven again at each tick, in spite of rounding."""

_ALLOWED = 1e-5
"""Metres that a pair may lose in all which is nearer than it should be at the start: from no
distance to spare nothing can be proven, not even that it becomes more."""

_MORE = (1e-3, 4e-3, 0.0)
"""Metres that a pair whose motion is not proven must have more at its end, at the next try."""

_PARTS = (1.0, 0.75, 0.5, 0.25, 0.1)
"""Of the way from braking to the velocity that distances and their derivatives allow."""


class _Tick(NamedTuple):
    """The state at one tick."""

    q: NDArray[np.float64]
    asked: NDArray[np.float64]
    present: NDArray[np.float64]
    dt: float
    box: VelocityBox
    found: NearPairs
    near: NearBy
    keeps: NDArray[np.float64]
    """``(k,)`` m: the distance of each pair to keep beyond its padding."""
    spares: NDArray[np.float64]
    """``(k,)`` m: how much more a new motion keeps."""
    drifts: NDArray[np.float64]
    """``(k,)`` m: the largest effect of a velocity that changes evenly instead of at once."""


@one_line("keep", "gain")
class SafeVelocity:
    """Lets velocities through that keep a distance, and makes of others the nearest one that does.

    A distance may shrink by ``gain`` (1/s) times the distance to spare (control barrier function;
    Ames and others, *Control Barrier Functions: Theory and Applications*, 2019), or more slowly
    where the robot could not brake: the nearest velocity that fulfils this for all pairs near by,
    and all limits, is a small quadratic program. Its proposal counts once it is proven: the
    straight edge of the step and the braking after it, by the proofs of edges. Where it is not,
    the velocity is made shorter, up to that of a robot that brakes as it was proven at the tick
    before.

    The robot is taken to have the velocity returned after each step, at once or evenly during the
    step, and to brake evenly along the line on which it is. Between ticks of one ``dt`` it then
    never needs more than its limits allow. Pairs nearer than ``keep`` at the start do not come
    nearer: together they lose at most 10 µm of their distance.

    One thread at a time; it remembers its last velocity.
    """

    def __init__(
        self,
        checker: SceneGraphCollisionChecker,
        keep: float = 0.02,
        gain: float = 5.0,
        limits: MotionLimits | None = None,
    ) -> None:
        """Prepare for a checker's robots and scene.

        ``keep`` (m) is kept beyond the checker's paddings. ``limits`` are the largest velocities
        and accelerations of the positions that may move, by name; all others stay where they are.
        Default: the robot's own, which must have both. Raises SafeVelocityError for a number that
        is negative or not finite, a gain of 0, joints that float and ways that are not straight,
        TrajectoryError for a robot without limits.
        """
        self._keep = number_from("keep", keep)
        self._gain = number_from("gain", gain)
        if self._gain == 0.0:
            raise SafeVelocityError("gain must be positive, not 0")
        if not checker.is_straight:
            raise SafeVelocityError("SafeVelocity needs a checker with straight edges")
        tree = checker.plan.tree
        floating = [joint.name for joint in tree.joints if joint.kind == FLOATING]
        if floating:
            raise SafeVelocityError(
                f"SafeVelocity can't filter velocities of joint {floating[0]!r}, which floats"
            )
        self._names = tree.position_names
        own = MotionLimits.of_tree(tree) if limits is None else limits
        self._limits = joint_limits(tree, own)
        others = checker.plan.other_positions
        self._limits.moves[others] = False
        self._limits.velocities[others] = 0.0
        self._wanted = VelocityArguments(self._names, self._limits)
        self._last = np.zeros(tree.num_positions)
        self._use(checker)
        self._floors = np.full(checker.num_pairs, np.inf)

    def _use(self, checker: SceneGraphCollisionChecker) -> None:
        self._checker, plan = checker, checker.plan
        self._plan, self._proofs = plan, MotionProofs(plan)
        self._frames: ObstacleFrames | None = None

    @property
    def keep(self) -> float:
        """Metres beyond the checker's paddings."""
        return self._keep

    @property
    def gain(self) -> float:
        """1/s: of the distance to spare, how much may be used up in a second."""
        return self._gain

    @property
    def checker(self) -> SceneGraphCollisionChecker:
        """The checker in use."""
        return self._checker

    def move_to(self, checker: SceneGraphCollisionChecker) -> None:
        """Go on with the same robots at another moment of their scene (`checker.at`).

        Raises SafeVelocityError for a checker with other positions or pairs.
        """
        plan = checker.plan
        if plan.tree.position_names != self._names or not np.array_equal(
            plan.pairs.bodies, self._plan.pairs.bodies
        ):
            raise SafeVelocityError("checker has other positions or pairs than this filter's")
        self._use(checker)

    def reset(self) -> None:
        """Forget the last velocity, and how near pairs have been."""
        self._last = np.zeros(len(self._names))
        self._floors[:] = np.inf

    def filter(
        self,
        q: ArrayLike,
        v: ArrayLike,
        dt: float,
        present: ArrayLike | None = None,
        obstacles: ObstacleVelocities | None = None,
    ) -> SafeStep:
        """Return the velocity for the next ``dt`` (s) of a robot at q that is nearest to v.

        ``q`` ``(nq,)``, ``v`` ``(nv,)`` and ``present`` ``(nv,)``, the velocity now, in rad, m,
        rad/s and m/s; by default ``present`` is the velocity returned last, at first zero. The
        nearest one is that by the sum of squares. ``obstacles`` has velocities of frames around
        the robots: ``(6,)``, angular and linear velocity of the frame in W, rad/s and m/s, or a
        bound (m/s) of the speed of all their points, in any direction. They are taken to go on so
        until the robot has braked; those not named stand still.

        Raises SafeVelocityError naming the argument and entry that is wrong, KinematicTreeError
        for a bad q, CollisionCheckerError for one beyond all scenes.
        """
        tick = self._tick(q, v, dt, present, obstacles)
        step = self._kept(tick)
        if step is None:
            step = self._lost(tick)
        self._last = step.velocity
        return step

    def brake(self, dt: float, present: ArrayLike | None = None) -> NDArray[np.float64]:
        """Return the velocity ``(nv,)`` for the next ``dt`` (s) of a robot that brakes evenly.

        Along its line, as the step before has proven: it needs no configuration, so it is there
        where that is not known. ``present`` as for `filter`, which goes on from there. Raises
        SafeVelocityError naming the argument and entry that is wrong.
        """
        step = number_from("dt", dt)
        if step == 0.0:
            raise SafeVelocityError("dt must be positive, not 0")
        now = self._last if present is None else self._wanted.velocity("present", present)
        ticks = steps_to_rest(np.abs(now), self._limits, step)
        self._last = now * ((ticks - 1) / ticks)
        return self._last.copy()

    # One tick.

    def _tick(
        self,
        q: ArrayLike,
        v: ArrayLike,
        dt: float,
        present: ArrayLike | None,
        obstacles: ObstacleVelocities | None,
    ) -> _Tick:
        (position,) = self._checker.checked_configurations(one_configuration("q", q))
        step = number_from("dt", dt)
        if step == 0.0:
            raise SafeVelocityError("dt must be positive, not 0")
        asked = self._wanted.velocity("v", v)
        now = self._last if present is None else self._wanted.velocity("present", present)
        moving = self._moving(obstacles)
        box = velocity_box(self._limits, position, now, step)
        # Farther away no motion leads too near, nor does any use up distances too fast.
        factor = max(1.0, 1.0 / (self._gain * box.longest))
        seconds = max(box.time + step, 1.0 / self._gain)
        rules = self._keep + 2.0 * _SPARE + _ALLOWED, factor, seconds
        found = self._proofs.near_pairs(box.edge, box.changes, rules, moving)
        near = self._proofs.near_by(found.rows, moving)
        drifts = self._proofs.reaches(near, position, box.most, box.drift)
        keeps, spares = self._pads(found, near, drifts)
        return _Tick(position, asked, now, step, box, found, near, keeps, spares, drifts)

    def _pads(
        self, found: NearPairs, near: NearBy, drifts: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the distances that pairs keep, and spare ones, ``(k,)`` m both."""
        distances, rows, goal = found.distances, found.rows, self._keep + 2.0 * _SPARE
        is_near = distances < goal
        self._floors[rows[~is_near]] = np.inf
        keeps, spares = np.full(len(rows), self._keep + _SPARE), np.full(len(rows), _SPARE)
        if is_near.any():
            floors = self._floors[rows]
            # One that lost more than it may was moved by something else.
            is_new = (floors == np.inf) | (distances < floors - 1.5 * _ALLOWED)
            is_new[near.moving] = True
            floors = np.where(is_new, distances, np.maximum(floors, distances - drifts))
            self._floors[rows[is_near]] = floors[is_near]
            keeps[is_near] = floors[is_near] - _ALLOWED
            spares[is_near] = 0.5 * _ALLOWED
        return keeps, spares

    def _kept(self, tick: _Tick) -> SafeStep | None:
        """Return the nearest velocity that keeps all distances, None where none was found."""
        box, found = tick.box, tick.found
        active: tuple[int, ...] = ()
        rates, best = self._rates(tick), None
        for more in _MORE:
            proposed = nearest_velocity(tick.asked, box.low, box.high, found.jacobians, rates)
            if proposed is None:
                break
            best = proposed
            active = tuple(dict.fromkeys((*active, *best.active.tolist())))
            pair = self._open(tick, best.velocity, is_still=False)
            if pair == NO_PAIR:
                return self._step(tick, best.velocity, active, is_kept=True)
            if pair < 0:
                break
            active = tuple(dict.fromkeys((*active, pair)))
            rates[pair] = max(rates[pair], found.jacobians[pair] @ best.velocity)
            rates[pair] += more / box.longest
        if best is not None:
            velocity = self._longest_proven(tick, best, is_still=False)
            if velocity is not None:
                return self._step(tick, velocity, active, is_kept=True)
        if self._brakes(tick, is_still=False) == NO_PAIR:
            return self._step(tick, box.braking, active, is_kept=True)
        return None

    def _lost(self, tick: _Tick) -> SafeStep:
        """Return the velocity that loses least, while the robot itself comes near nothing."""
        box, near, found = tick.box, tick.near, tick.found
        own, count = self._rates(tick, is_still=True), len(found.rows)
        chosen = np.concatenate([np.arange(count), near.moving])
        rates = np.concatenate([own, self._rates(tick)[near.moving]])
        is_soft = np.arange(len(chosen)) >= count
        G = found.jacobians[chosen]
        best = least_loss(tick.asked, (box.low, box.high), G, rates, is_soft)
        if best is None:
            return self._step(tick, box.braking, (), is_kept=False)
        active = tuple(dict.fromkeys(chosen[best.active].tolist()))
        velocity = self._longest_proven(tick, best, is_still=True)
        braking = box.braking if velocity is None else velocity
        return self._step(tick, braking, active, is_kept=False)

    def _rates(self, tick: _Tick, *, is_still: bool = False) -> NDArray[np.float64]:
        """Return the least rates at which the robot has to change distances, ``(k,)`` m/s.

        Of the distance to spare it may use up the gain times a second, or as much as leaves enough
        for braking. From an obstacle that comes nearer it also has to go so far that nothing is
        missing when it has braked.
        """
        box = tick.box
        spare = tick.found.distances - tick.keeps - tick.spares - tick.drifts
        spare = np.maximum(spare, 0.0)
        rates = -min(self._gain, 1.0 / box.longest) * spare
        if is_still or tick.near.obstacles is None:
            return rates
        closing = self._proofs.closing_rates(tick.near, tick.q)
        late = (spare + closing * (box.time + tick.dt)) / (tick.dt - box.longest)
        return np.where(closing < 0.0, np.maximum(rates - closing, late), rates - closing)

    def _longest_proven(
        self, tick: _Tick, best: NearestVelocity, *, is_still: bool
    ) -> NDArray[np.float64] | None:
        """Return the longest part of the way from braking to a velocity that is proven."""
        braking = tick.box.braking
        for part in _PARTS:
            velocity = braking + part * (best.velocity - braking)
            if self._open(tick, velocity, is_still=is_still) == NO_PAIR:
                return velocity
        return None

    def _open(self, tick: _Tick, velocity: NDArray[np.float64], *, is_still: bool) -> int:
        """Return a pair that a step and the braking after it may bring too near, or NO_PAIR."""
        dt = tick.dt
        motion = motion_of(self._limits, tick.q, velocity, tick.present, dt)
        if motion.leaves_limits:
            return UNKNOWN
        way, brake, keeps = motion.way, motion.brake, tick.keeps + tick.spares
        if motion.is_beside:
            keeps += self._proofs.reaches(tick.near, tick.q, way, motion.beside)
        lag = dt / (dt + 0.5 * brake)
        profile = None if is_still else Profile(dt, brake, 2.0 * dt + brake, lag)
        return self._proofs.first_open(tick.near, tick.q, way, keeps, profile)

    def _brakes(self, tick: _Tick, *, is_still: bool) -> int:
        """Return a pair that braking from now on may bring too near, or NO_PAIR."""
        brake = tick.box.brake_time
        way = tick.present * (0.5 * brake)
        profile = Profile(0.0, brake, tick.dt + brake, tick.dt / brake)
        return self._proofs.first_open(
            tick.near, tick.q, way, tick.keeps, None if is_still else profile
        )

    def _step(
        self, tick: _Tick, velocity: NDArray[np.float64], active: tuple[int, ...], *, is_kept: bool
    ) -> SafeStep:
        found = tick.found
        nearest = int(np.argmin(found.distances)) if len(found.rows) else None
        return SafeStep(
            velocity,
            tuple(self._named(found, row) for row in active),
            is_kept,
            tick.dt if is_kept else 0.0,
            None if nearest is None else self._named(found, nearest),
            tick.dt * steps_to_rest(np.abs(velocity), self._limits, tick.dt),
        )

    def _named(self, found: NearPairs, row: int) -> DistantPair:
        return DistantPair(self._plan.ids(int(found.rows[row])), float(found.distances[row]))

    # What is given.

    def _moving(self, obstacles: ObstacleVelocities | None) -> MovingObstacles | None:
        if not obstacles:
            return None
        if self._frames is None:
            self._frames = ObstacleFrames(self._plan, self._checker.snapshot)
        return self._frames.moving(obstacles)

"""Which configurations and edges of robots are free of collisions, proven."""

from __future__ import annotations

from collections.abc import Iterable
import copy
from functools import cached_property
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.planning.bodies import new_places
from scene_graph_ros.planning.check_kernels import (
    check_configurations,
    NO_PAIR,
)
from scene_graph_ros.planning.checker_plan import CheckerPlan, make_plan, placed
from scene_graph_ros.planning.curves import turning_quaternions
from scene_graph_ros.planning.edge_kernels import EdgeRules, FREE
from scene_graph_ros.planning.edge_measure import EdgeMeasure, measure_of
from scene_graph_ros.planning.edge_proofs import prove
from scene_graph_ros.planning.in_threads import in_threads
from scene_graph_ros.planning.robot_diagram import RobotDiagram

__all__ = [
    "CollisionCheckerError",
    "ConfigurationCollisions",
    "RobotClearance",
    "SceneGraphCollisionChecker",
]


class CollisionCheckerError(SceneGraphError, ValueError):
    """Arguments of a collision checker that make no sense."""


class RobotClearance(NamedTuple):
    """Padded distances of pairs within a distance of influence, and how q changes them."""

    pairs: tuple[tuple[Any, Any], ...]
    """Geometry ids; the first in the scene's order."""
    distances: NDArray[np.float64]
    """``(k,)`` metres; negative where a pair is nearer than its padding."""
    jacobians: NDArray[np.float64]
    """``(k, nq)``: derivative of the distance, m per unit of each position."""


class ConfigurationCollisions(NamedTuple):
    """A pair of each configuration that is not free."""

    rows: NDArray[np.intp]
    """``(k,)``: which configurations."""
    pairs: tuple[tuple[Any, Any], ...]
    """Geometry ids; the first in the scene's order."""
    depths: NDArray[np.float64]
    """``(k,)`` metres: how much nearer than its padding the pair is."""


class SceneGraphCollisionChecker:
    """Checks configurations and edges of robots against each other and all else in their scene.

    Pairs are those that the scene's filters leave; two bodies that cannot move relative to each
    other are no pair. Paddings (m) are distances that must be kept. The scene is taken as it is
    when the checker is made. Methods may be called from any thread.
    """

    def __init__(
        self,
        model: RobotDiagram,
        *,
        snapshot: Snapshot | None = None,
        env_collision_padding: float = 0.0,
        self_collision_padding: float = 0.0,
        tolerance: float = 1e-6,
    ) -> None:
        """Prepare for the robots of ``model`` at its context's present moment, or at ``snapshot``.

        ``env_collision_padding`` is kept between robots and what is around them,
        ``self_collision_padding`` between robots' own bodies; a negative one allows that they
        overlap. Where an edge's clearance is below ``tolerance`` it is undecided. Raises
        CollisionCheckerError for a number that is not finite, or a tolerance that is not positive.
        """
        self._model, self._tree = model, model.tree
        links = {int(frame): self._tree.link_index(name) for name, frame in model.frames.items()}
        self._snapshot = model.context.snapshot if snapshot is None else snapshot
        plan = make_plan(self._snapshot, self._tree, links)
        self._plan = _padded(plan, env_collision_padding, self_collision_padding)
        self._tolerance = _number("tolerance", tolerance)
        if self._tolerance <= 0.0:
            raise CollisionCheckerError(f"tolerance must be positive, not {quoted(tolerance)}")

    @property
    def model(self) -> RobotDiagram:
        """The robots and their scene."""
        return self._model

    def at(
        self,
        snapshot: Snapshot,
        *,
        env_collision_padding: float = 0.0,
        self_collision_padding: float = 0.0,
    ) -> SceneGraphCollisionChecker:
        """Return a checker for the same robots at another moment of the scene, with own paddings.

        What is around the robots, and what is carried by them, is where ``snapshot`` has it. That
        is much faster than to make a checker. Raises CollisionCheckerError for another model than
        this one's, and for a number that is not finite.
        """
        if snapshot.model_version != self._snapshot.model_version:
            raise CollisionCheckerError(
                f"the snapshot is of model version {snapshot.model_version}, the checker was made"
                f" for version {self._snapshot.model_version}"
            )
        result = copy.copy(self)
        result._snapshot = snapshot
        plan = placed(self._plan, snapshot)
        result._plan = _padded(plan, env_collision_padding, self_collision_padding)
        return result

    @property
    def snapshot(self) -> Snapshot:
        """The moment of the scene that it is about."""
        return self._snapshot

    @property
    def plan(self) -> CheckerPlan:
        """What kernels read."""
        return self._plan

    @property
    def tolerance(self) -> float:
        """Metres: an edge that comes nearer to a collision is undecided."""
        return self._tolerance

    @property
    def num_pairs(self) -> int:
        """How many pairs of geometries are checked."""
        return len(self._plan.pairs.bodies)

    # Configurations.

    def check_config_collision_free(self, q: ArrayLike) -> bool:
        """Tell whether no pair is nearer than its padding at q ``(nq,)``.

        Raises KinematicTreeError for another shape and what is not finite, CollisionCheckerError
        for a position beyond all scenes.
        """
        return bool(self.check_configs_collision_free(_row("q", q))[0])

    def check_configs_collision_free(
        self, configurations: ArrayLike, *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell the same of many configurations ``(n, nq)``; the same for any number of threads."""
        return self._first_pairs(configurations, threads) == NO_PAIR

    def find_colliding_pair(self, q: ArrayLike) -> tuple[Any, Any] | None:
        """Return the ids of a pair that is nearer than its padding at q ``(nq,)``, or None."""
        pair = int(self._first_pairs(_row("q", q), 1)[0])
        return None if pair == NO_PAIR else self._plan.ids(pair)

    def _first_pairs(self, configurations: ArrayLike, threads: int) -> NDArray[np.int64]:
        q = self.checked_configurations(configurations)
        result = np.empty(len(q), dtype=np.int64)
        plan = self._plan

        def check(part: slice) -> None:
            places = new_places(len(self._tree.table.kinds), len(plan.bodies.rows))
            check_configurations(
                plan.held.places,
                self._tree.table,
                plan.bodies,
                plan.pairs,
                q[part],
                self._tree.X_WB,
                result[part],
                places,
            )

        in_threads(check, len(q), threads)
        return result

    def find_collisions(
        self, configurations: ArrayLike, *, threads: int = 1
    ) -> ConfigurationCollisions:
        """Return a pair of each configuration ``(n, nq)`` that is not free: the first found.

        The same for any number of threads.
        """
        q = self.checked_configurations(configurations)
        first = self._first_pairs(q, threads)
        rows = np.flatnonzero(first != NO_PAIR)
        pairs = tuple(self._plan.ids(int(pair)) for pair in first[rows])
        depths = [self._depth(q[row], int(first[row])) for row in rows]
        return ConfigurationCollisions(rows, pairs, np.array(depths, dtype=np.float64))

    def calc_pair_depth(self, q: ArrayLike, pair: tuple[Any, Any]) -> float:
        """Return how much nearer than its padding a pair that is checked is at q ``(nq,)``, in m.

        ``pair`` are two geometry ids. Negative where the pair is further apart. Raises
        CollisionCheckerError for a pair that is not checked.
        """
        (configuration,) = self.checked_configurations(_row("q", q))
        wanted = frozenset(int(each) for each in pair)
        row = self._row_of_pair.get(wanted)
        if row is None:
            raise CollisionCheckerError(f"geometries {sorted(wanted)} are no pair that is checked")
        return self._depth(configuration, row)

    @cached_property
    def _row_of_pair(self) -> dict[frozenset[int], int]:
        ids = (self._plan.ids(row) for row in range(self.num_pairs))
        return {frozenset((int(a), int(b))): row for row, (a, b) in enumerate(ids)}

    def _depth(self, q: NDArray[np.float64], pair: int) -> float:
        """Return how much nearer than its padding a pair (row of the plan) is at q ``(nq,)``."""
        plan = self._plan
        a, b = plan.pairs.bodies[pair, ::-1] if plan.pairs.swaps[pair] else plan.pairs.bodies[pair]
        rows = plan.bodies.rows[[[a, b]]]
        solved = solve_pairs(plan.held, self._poses_of_rows(q), rows, math.inf, WITHIN)
        return float(plan.pairs.paddings[pair] - solved.distance[0])

    def checked_configurations(self, configurations: ArrayLike) -> NDArray[np.float64]:
        """Return configurations ``(n, nq)`` after checking that poses may have such positions.

        Raises KinematicTreeError for another shape and what is not finite, CollisionCheckerError
        for a position beyond all scenes.
        """
        q = self._tree.checked_configurations(configurations)
        far = np.argwhere(np.abs(q) > MAX_COORDINATE)
        if len(far):
            row, column = far[0]
            raise CollisionCheckerError(
                f"position {self._tree.position_names[column]!r} of configuration {row} is beyond"
                f" {MAX_COORDINATE:g}: {q[row, column]}"
            )
        return q

    def calc_robot_clearance(self, q: ArrayLike, influence_distance: float) -> RobotClearance:
        """Return the padded distances at q ``(nq,)`` up to a distance (m), and their derivatives.

        A pair of a robot's bodies is there once. Raises KinematicTreeError for a bad q, and
        CollisionCheckerError for a distance that is negative or not finite.
        """
        influence = _number("influence_distance", influence_distance)
        if influence < 0.0:
            raise CollisionCheckerError(
                f"influence_distance must not be negative: {quoted(influence_distance)}"
            )
        (configuration,) = self.checked_configurations(_row("q", q))
        plan, paddings = self._plan, self._plan.pairs.paddings
        X_WG = self._poses_of_rows(configuration)
        rows = plan.bodies.rows[plan.pairs.bodies]
        rows[plan.pairs.swaps] = rows[plan.pairs.swaps, ::-1]
        near = np.flatnonzero(plan.least_distances(X_WG) <= influence + paddings)
        reach = max(influence + float(paddings.max(initial=-np.inf)), 0.0)
        solved = solve_pairs(plan.held, X_WG, rows[near], reach, WITHIN)
        kept, nhats_W = solved.rows, solved.nhat_BA_W
        pair_of = {
            (int(a), int(b)): int(pair) for pair, (a, b) in zip(near, rows[near], strict=True)
        }
        found = np.array([pair_of[int(a), int(b)] for a, b in kept], dtype=np.intp)
        padded = solved.distance - paddings[found]
        chosen = np.flatnonzero(padded <= influence)
        rates = self._tree.velocity_map(configuration)
        jacobians = np.zeros((len(chosen), self._tree.num_positions))
        for row, k in enumerate(chosen):
            sides = ((kept[k, 0], solved.p_ACa[k], 1.0), (kept[k, 1], solved.p_BCb[k], -1.0))
            jacobians[row] = self._gradient(configuration, nhats_W[k], sides) @ rates
        ids = tuple(self._plan.ids(int(pair)) for pair in found[chosen])
        return RobotClearance(ids, padded[chosen], jacobians)

    def _poses_of_rows(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses ``(n, 4, 4)`` of all rows of the scene's proximity arrays at q."""
        plan = self._plan
        robots = len(plan.X_LG)
        X_WG = self._snapshot.X_WG.copy()
        X_WL = self._tree.link_poses(q)
        X_WG[plan.bodies.rows[:robots]] = X_WL[plan.owners[:robots]] @ plan.X_LG
        return X_WG

    def _gradient(
        self, q: NDArray[np.float64], nhat_BA_W: NDArray[np.float64], sides: Iterable[Any]
    ) -> NDArray[np.float64]:
        """Return the derivative ``(nv,)`` of a pair's distance.

        Witness points are stationary to first order (envelope theorem): the distance changes as
        the bodies' own points there move along the normal.
        """
        result = np.zeros(self._tree.num_velocities)
        for row, p_GC, sign in sides:
            body = self._plan.body_of_row[row]
            link = self._plan.owners[body]
            if link >= 0:
                X_LG = self._plan.X_LG[body]
                p_LC = X_LG[:3, :3] @ p_GC + X_LG[:3, 3]
                J = self._tree.jacobians(q, self._tree.link_names[link], p_LC)
                result += sign * (nhat_BA_W @ J[3:])
        return result

    # Edges.

    def check_edge_collision_free(self, q1: ArrayLike, q2: ArrayLike) -> bool:
        """Tell whether the straight edge between two configurations ``(nq,)`` is proven free.

        Floating joints turn the short way at one speed (slerp).
        """
        edges = np.stack([_row("q1", q1)[0], _row("q2", q2)[0]])[np.newaxis]
        return bool(self.check_edges_collision_free(edges)[0])

    def check_edges_collision_free(
        self, edges: ArrayLike, *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell the same of many edges ``(n, 2, nq)``, or ``(n, m, nq)`` for curved ones.

        Those are Bézier curves with m control points, along which floating joints must not turn.
        An edge that comes nearer to a collision than the checker's tolerance counts as not free.
        Raises KinematicTreeError for what is not finite, CollisionCheckerError for another shape.
        """
        return self.edge_statuses(edges, threads=threads) == FREE

    def edge_statuses(self, edges: ArrayLike, *, threads: int = 1) -> NDArray[np.int64]:
        """Return the value of the `EdgeStatus` of each of many edges ``(n, m, nq)``."""
        rules = EdgeRules(measures=False, part=1.0, tolerance=self._tolerance)
        return prove(self._plan, self._checked_edges(edges), rules, threads=threads).statuses

    def measure_edge(self, q1: ArrayLike, q2: ArrayLike) -> EdgeMeasure:
        """Return how far the edge from q1 to q2 ``(nq,)`` is proven free, and what stops it."""
        edges = np.stack([_row("q1", q1)[0], _row("q2", q2)[0]])[np.newaxis]
        return self.measure_edges(edges)[0]

    def measure_edges(self, edges: ArrayLike, *, threads: int = 1) -> list[EdgeMeasure]:
        """Return the same of many edges ``(n, m, nq)``; see `check_edges_collision_free`."""
        checked = self._checked_edges(edges)
        # Half of each distance is kept, as the clearance is asked for.
        rules = EdgeRules(measures=True, part=0.5, tolerance=self._tolerance)
        proofs = prove(self._plan, checked, rules, threads=threads)
        return [measure_of(self._plan, checked[e], proofs, e) for e in range(len(checked))]

    def _checked_edges(self, edges: ArrayLike) -> NDArray[np.float64]:
        try:
            array = np.require(edges, np.float64, ["C", "W"])
        except (TypeError, ValueError, OverflowError) as error:
            raise CollisionCheckerError(f"edges must be numbers: {quoted(edges)}") from error
        nq = self._tree.num_positions
        if array.ndim != 3 or array.shape[1] < 2 or array.shape[2] != nq:
            raise CollisionCheckerError(
                f"edges must have shape (n, 2, {nq}), or more control points, not {array.shape}"
            )
        self.checked_configurations(array.reshape(-1, nq) if nq else array[:, 0])
        turning = turning_quaternions(self._tree, array) if array.shape[1] > 2 else ()
        for edge, name in turning:
            raise CollisionCheckerError(
                f"edge {edge} is curved, so its joint {name!r}, which floats, must not turn"
            )
        return array


def _padded(plan: CheckerPlan, environment: float, own: float) -> CheckerPlan:
    """Return the plan with paddings (m) to what is around the robots, and between their bodies."""
    around = _number("env_collision_padding", environment)
    among = _number("self_collision_padding", own)
    is_of_robot = plan.owners[plan.pairs.bodies[:, 1]] >= 0
    paddings = np.where(is_of_robot, among, around)
    return plan._replace(pairs=plan.pairs._replace(paddings=paddings))


def _number(name: str, value: object) -> float:
    number = as_float(value)
    if number is None or not math.isfinite(number):
        raise CollisionCheckerError(f"{name} must be a finite number, not {quoted(value)}")
    return number


def _row(name: str, q: ArrayLike) -> NDArray[np.float64]:
    """Return one configuration as a batch of one."""
    try:
        array = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise CollisionCheckerError(f"{name} must be numbers: {quoted(q)}") from error
    if array.ndim != 1:
        raise CollisionCheckerError(f"{name} must have shape (nq,), not {array.shape}")
    return array[np.newaxis]

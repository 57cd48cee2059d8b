"""Which configurations and edges of robots are free of collisions, proven."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.paths import GeometryPair
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.planning.checker.batches_of_one import one_configuration, one_edge
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.checker.checker_state import CheckerState, make_state
from scene_graph_ros.planning.checker.configuration_checks import first_pairs
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    ConfigurationDistanceFunction,
    DistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.checker.robot_clearance import (
    clearance_columns,
    ClearanceColumns,
    collision_types,
    poses_of_rows,
    robot_clearance,
    robot_clearances,
    RobotClearance,
    RobotCollisionType,
)
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.planning.edges.curves import turning_quaternions
from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure, measure_of
from scene_graph_ros.planning.edges.edge_proofs import prove
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE
from scene_graph_ros.planning.edges.edge_ways import joined_measures, joined_statuses, Ways
from scene_graph_ros.planning.errors import CollisionCheckerError, finite_number
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan

__all__ = [
    "ConfigurationCollisions",
    "SceneGraphCollisionChecker",
]


class ConfigurationCollisions(NamedTuple):
    """A pair of each configuration that is not free."""

    rows: NDArray[np.intp]
    """``(k,)``: which configurations."""
    pairs: tuple[GeometryPair, ...]
    """With names; the first in the scene's order."""
    depths: NDArray[np.float64]
    """``(k,)`` metres: how much nearer than its padding the pair is."""


@one_line("robot_model_instances", "num_pairs", "tolerance", "edge_step_size")
class SceneGraphCollisionChecker(CollisionChecker):
    """Checks configurations and edges of robots against each other and all else in their scene.

    Pairs are those that the scene's filters leave, until others are set; two bodies that cannot
    move relative to each other are no pair. Paddings (m) are distances that must be kept. The
    scene is taken as it is when the checker is made. Methods may be called from any thread.
    """

    def __init__(
        self,
        model: RobotDiagram,
        *,
        snapshot: Snapshot | None = None,
        env_collision_padding: float = 0.0,
        self_collision_padding: float = 0.0,
        tolerance: float = 1e-6,
        edge_step_size: float = 0.05,
        distance_and_interpolation_provider: DistanceAndInterpolationProvider | None = None,
        configuration_distance_function: ConfigurationDistanceFunction | None = None,
        robot_model_instances: Iterable[str] | None = None,
        implicit_context_parallelism: int | None = None,
        require_homogeneous_filters: bool = False,
    ) -> None:
        """Prepare for the robots of ``model`` at its context's present moment, or at ``snapshot``.

        ``env_collision_padding`` is kept between robots and all around them,
        ``self_collision_padding`` between robots' own bodies; a negative one allows that they
        overlap. Where an edge's clearance is below ``tolerance`` it is undecided. Distances and
        ways are the linear provider's, or those of one of your own; then ``edge_step_size`` is how
        long the straight pieces of a way are. ``robot_model_instances`` names the robots that it
        is for, else all: others move with q, but count as surroundings, and are not checked
        against each other. ``implicit_context_parallelism`` is the number of contexts with
        numbers. With ``require_homogeneous_filters`` the scene must filter all geometries of two
        bodies or none. Raises CollisionCheckerError for a number that is not finite, a tolerance
        or step size that is not positive, and a robot that is not there; HeterogeneousFiltersError
        for a scene that filters some geometries of two bodies only.
        """
        self._tolerance = finite_number("tolerance", tolerance)
        if self._tolerance <= 0.0:
            raise CollisionCheckerError(f"tolerance must be positive, not {quoted(tolerance)}")
        moment = model.context.snapshot if snapshot is None else snapshot
        state = make_state(model, moment, robot_model_instances)
        super().__init__(
            model,
            state.padded(env_collision_padding, self_collision_padding),
            edge_step_size=edge_step_size,
            distance_and_interpolation_provider=distance_and_interpolation_provider,
            configuration_distance_function=configuration_distance_function,
            implicit_context_parallelism=implicit_context_parallelism,
            require_homogeneous_filters=require_homogeneous_filters,
            supports_parallel_checking=True,
        )

    def at(
        self,
        snapshot: Snapshot,
        *,
        model: RobotDiagram | None = None,
        env_collision_padding: float | None = None,
        self_collision_padding: float | None = None,
    ) -> SceneGraphCollisionChecker:
        """Return a checker for the same robots at another moment of the scene.

        Surroundings, and geometry that robots carry, are where ``snapshot`` has them; added
        shapes, filters and paddings are this one's, but for paddings that are given. That is much
        faster than to make a checker. With a ``model`` of the same robots they stand where that
        has them. Raises CollisionCheckerError for other robots, another model of the scene than
        this one's, and for a number that is not finite.
        """
        state = self._state
        if snapshot.model_version != state.base.model_version:
            raise CollisionCheckerError(
                f"the snapshot is of model version {snapshot.model_version}, the checker was made"
                f" for version {state.base.model_version}"
            )
        paddings = env_collision_padding, self_collision_padding
        own, other = self._tree, self._tree if model is None else model.tree
        if (own.position_names, own.link_names) != (other.position_names, other.link_names):
            raise CollisionCheckerError("model has other robots than the checker was made for")
        result = self._with_state(state.at(snapshot, other).padded(*paddings))
        result._model, result._tree = model or self._model, other
        return result

    def with_pair_paddings(self, paddings: NDArray[np.float64]) -> SceneGraphCollisionChecker:
        """Return a checker whose pairs of geometries, in the plan's order, keep ``(p,)``, m."""
        plan = self.plan.with_paddings(paddings)
        return self._with_state(self._state._replace(plan=plan))

    @property
    def snapshot(self) -> Snapshot:
        """The moment of the scene that it is about, with added shapes."""
        return self._state.snapshot

    @property
    def plan(self) -> CheckerPlan:
        """The kernels' inputs."""
        return self._state.plan

    @property
    def tolerance(self) -> float:
        """Metres: an edge that comes nearer to a collision is undecided."""
        return self._tolerance

    @property
    def num_pairs(self) -> int:
        """How many pairs of geometries are checked."""
        return len(self._state.plan.pairs.bodies)

    # Configurations.

    def check_config_collision_free(self, q: ArrayLike) -> bool:
        """Tell whether no pair is nearer than its padding at q ``(nq,)``.

        Raises KinematicTreeError for another shape and for infinities, CollisionCheckerError
        for a position beyond all scenes.
        """
        return bool(self.check_configs_collision_free(one_configuration("q", q))[0])

    def check_configs_collision_free(
        self, configurations: ArrayLike, *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell the same of many configurations ``(n, nq)``; the same for any number of threads."""
        q = self.checked_configurations(configurations)
        return first_pairs(self._state.plan, q, threads) == NO_PAIR

    def find_colliding_pair(self, q: ArrayLike) -> GeometryPair | None:
        """Return a pair of geometries that is nearer than its padding at q ``(nq,)``, or None."""
        plan = self._state.plan
        pair = int(first_pairs(plan, self.checked_configurations(one_configuration("q", q)), 1)[0])
        return None if pair == NO_PAIR else plan.ids(pair)

    def find_collisions(
        self, configurations: ArrayLike, *, threads: int = 1
    ) -> ConfigurationCollisions:
        """Return a pair of each configuration ``(n, nq)`` that is not free: the first found.

        The same for any number of threads.
        """
        q = self.checked_configurations(configurations)
        state = self._state
        first = first_pairs(state.plan, q, threads)
        rows = np.flatnonzero(first != NO_PAIR)
        pairs = tuple(state.plan.ids(int(pair)) for pair in first[rows])
        depths = [_depth(state, q[row], int(first[row])) for row in rows]
        return ConfigurationCollisions(rows, pairs, np.array(depths, dtype=np.float64))

    def calc_pair_depth(self, q: ArrayLike, pair: tuple[GeometryId, GeometryId]) -> float:
        """Return the padding of a checked pair less its distance at q ``(nq,)``, in m.

        ``pair`` are two geometry ids. Negative where the pair is further apart. Raises
        CollisionCheckerError for a pair that is not checked.
        """
        (configuration,) = self.checked_configurations(one_configuration("q", q))
        state, ids = self._state, [int(each) for each in pair]
        row = state.plan.pair_of(*ids) if len(ids) == 2 else None
        if row is None:
            raise CollisionCheckerError(f"geometries {sorted(ids)} are no pair that is checked")
        return _depth(state, configuration, row)

    def checked_configurations(self, configurations: ArrayLike) -> NDArray[np.float64]:
        """Return configurations ``(n, nq)`` after checking that poses may have such positions.

        Raises KinematicTreeError for another shape and for infinities, CollisionCheckerError
        for a position beyond all scenes.
        """
        if self._tree.is_certainly_within(configurations, MAX_COORDINATE):
            return configurations  # type: ignore[return-value]
        q = self._tree.checked_configurations(configurations)
        if (np.abs(q) > MAX_COORDINATE).any():
            row, column = np.argwhere(np.abs(q) > MAX_COORDINATE)[0]
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
        influence = _influence(influence_distance)
        configuration = self.checked_configurations(one_configuration("q", q))
        return robot_clearance(self._state, configuration, influence)

    def calc_robot_clearances(
        self, configurations: ArrayLike, influence_distance: float
    ) -> list[RobotClearance]:
        """Return `calc_robot_clearance` of each of many configurations ``(n, nq)``.

        That is faster than asking about one after another. Raises as that does.
        """
        influence = _influence(influence_distance)
        return robot_clearances(
            self._state, self.checked_configurations(configurations), influence
        )

    def calc_clearance_columns(
        self, configurations: ArrayLike, influence_distance: float
    ) -> ClearanceColumns:
        """Return `calc_robot_clearances` of ``(n, nq)`` as arrays, without objects."""
        influence = _influence(influence_distance)
        return clearance_columns(
            self._state, self.checked_configurations(configurations), influence
        )

    def max_num_distances(self) -> int:
        """Return the largest number of rows of `calc_robot_clearance`."""
        return self.num_pairs

    def classify_body_collisions(self, q: ArrayLike) -> list[RobotCollisionType]:
        """Return the type of each body's collisions at q ``(nq,)``, in the bodies' order.

        All pairs are looked at. Bodies around the robots are NO_COLLISION in any case.
        Raises as `check_config_collision_free`.
        """
        (configuration,) = self.checked_configurations(one_configuration("q", q))
        return collision_types(self._state, configuration)

    # Edges.

    def check_edges_collision_free(
        self, edges: ArrayLike, *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell whether each edge is proven free: ``(n, 2, nq)``, or ``(n, m, nq)`` for curves.

        An edge is straight, and floating joints turn the short way at one speed (slerp). Where the
        provider has ways of its own it is these, as straight pieces (`way`), each of them proven.
        Curves are Bézier curves with m control points, along which floating joints must not turn.
        An edge that comes nearer to a collision than the checker's tolerance counts as not free.
        Raises KinematicTreeError for infinities, CollisionCheckerError for another shape.
        """
        return self.edge_statuses(edges, threads=threads) == FREE

    def check_edge(self, q1: ArrayLike, q2: ArrayLike, *, proof: bool = True) -> bool:
        """Tell whether the edge between two configurations ``(nq,)`` is proven free.

        With ``proof=False`` that its samples are free, at steps of ``edge_step_size``; nothing is
        known of the edge in between. Raises as `check_edges_collision_free`.
        """
        if proof:
            return self.check_edge_collision_free(q1, q2)
        return bool(self.check_edges_by_samples(one_edge(q1, q2))[0])

    def edge_statuses(self, edges: ArrayLike, *, threads: int = 1) -> NDArray[np.int64]:
        """Return the value of the `EdgeStatus` of each of many edges ``(n, m, nq)``."""
        rules = EdgeRules(measures=False, part=1.0, tolerance=self._tolerance)
        plan, checked = self._state.plan, self._checked_edges(edges)
        ways = self._ways(checked)
        if ways is None:
            return prove(plan, checked, rules, threads=threads).statuses
        return joined_statuses(prove(plan, ways.pieces, rules, threads=threads).statuses, ways)

    def measure_edges(self, edges: ArrayLike, *, threads: int = 1) -> list[EdgeMeasure]:
        """Return the part of each edge ``(n, m, nq)`` that is proven free, and its obstacle.

        See `check_edges_collision_free`.
        """
        checked = self._checked_edges(edges)
        # Half of each distance is kept, as the clearance is asked for.
        rules = EdgeRules(measures=True, part=0.5, tolerance=self._tolerance)
        plan, ways = self._state.plan, self._ways(checked)
        pieces = checked if ways is None else ways.pieces
        proofs = prove(plan, pieces, rules, threads=threads)
        measures = [measure_of(plan, pieces[e], proofs, e) for e in range(len(pieces))]
        if ways is not None:
            measures = joined_measures(measures, ways)
        distances = self._interpolation.distances(checked)
        return [replace(m, distance=d) for m, d in zip(measures, distances, strict=True)]

    def _ways(self, edges: NDArray[np.float64]) -> Ways | None:
        """Return the pieces of edges whose ways are a provider's own; None: they are straight."""
        if self.is_straight or edges.shape[1] != 2 or not len(edges):
            return None
        ways = Ways.of([self.way(q1, q2) for q1, q2 in edges])
        return ways._replace(pieces=self._checked_edges(ways.pieces))

    def _checked_edges(self, edges: ArrayLike) -> NDArray[np.float64]:
        array = real_array(edges, "edges must be numbers", CollisionCheckerError)
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


def _influence(distance: float) -> float:
    """Return it; raises CollisionCheckerError where it is negative or not finite."""
    if type(distance) is float and 0.0 <= distance < math.inf:
        return distance
    influence = finite_number("influence_distance", distance)
    if influence < 0.0:
        raise CollisionCheckerError(f"influence_distance must not be negative: {quoted(distance)}")
    return influence


def _depth(state: CheckerState, q: NDArray[np.float64], pair: int) -> float:
    """Return the padding of a pair (row of the plan) less its distance at q ``(nq,)``, in m."""
    plan = state.plan
    a, b = plan.pairs.bodies[pair, ::-1] if plan.pairs.swaps[pair] else plan.pairs.bodies[pair]
    rows = plan.bodies.rows[[[a, b]]]
    _, distances = plan.shapes.solve(poses_of_rows(plan, q), rows, math.inf)
    return float(plan.pairs.paddings[pair] - distances[0])

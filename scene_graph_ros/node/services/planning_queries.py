"""Answers about configurations and edges of robots; imported when one is first asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.arrays import float64s_to_msg, uint8s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import (
    clearance_table_to_msg,
    collision_table_to_msg,
    configurations_from_msg,
    count_rows,
    padding_from_msg,
)
from scene_graph_msgs.srv import CheckEdges
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.node.services.queries import QueryScope
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.planning import ClearanceColumns, EdgeMeasure, SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.position_limits import beyond_limits

__all__ = ["check_clearance", "check_configurations", "check_edges"]


_COLUMNS = 8
"""Numbers of a Jacobian that count as one more row of an answer."""

_CLEARANCES = 64
"""Configurations whose clearances are asked for at once; then rows are counted."""


class _Collisions(NamedTuple):
    """Rows that something stops, which pair does, by how much (m), and where on the edge."""

    rows: list[int]
    pairs: list[tuple[Any, Any]]
    depths: list[float]
    at: list[float]


_NONE = _Collisions([], [], [], [])


class _Found(NamedTuple):
    """The answers about the rows for one configuration of ``what_if``."""

    outcomes: NDArray[np.uint8]
    collisions: _Collisions = _NONE
    measures: NDArray[np.float64] = np.empty((0, 2))
    """``(n, 2)``, or no rows: up to where edges are proven, and what they keep."""


class _Question(NamedTuple):
    """The question of both services: configurations, worlds and margins."""

    scope: QueryScope
    robots: PlanningRobots
    q: NDArray[np.float64]
    """``(n, nq)``."""
    paddings: dict[str, float]

    def checker(self, query: QueryObject) -> SceneGraphCollisionChecker:
        """Return the checker for one configuration of what_if."""
        return self.robots.checker(query.snapshot, **self.paddings)

    @property
    def threads(self) -> int:
        """How many share the rows: one, where they share the worlds."""
        scope = self.scope
        return int(scope.limit("query_threads")) if len(scope.options.configurations) == 1 else 1


def check_clearance(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer CheckClearance. A configuration costs about as much as an edge, and counts as one."""
    count = count_rows(request.configurations) * len(scope.options.configurations)
    scope.require("max_edges_per_request", count, "configurations")
    question = _question(request, request.configurations, "configurations", scope)
    influence = request.influence_distance
    if not 0.0 <= influence <= MAX_COORDINATE:
        raise MessageError(
            f"influence_distance must be a number from 0 to {MAX_COORDINATE:g}, not {influence}"
        )
    width = question.q.shape[1] if request.with_jacobians else 0

    def answer(query: QueryObject) -> list[ClearanceColumns]:
        checker, parts = question.checker(query), []
        for first in range(0, max(len(question.q), 1), _CLEARANCES):
            rows = question.q[first : first + _CLEARANCES]
            part = checker.calc_clearance_columns(rows, influence)
            scope.tally.add(len(part.distance) * (1 + width // _COLUMNS))
            parts.append(part._replace(configuration=part.configuration + first))
        return parts

    parts = [
        part._replace(configuration=part.configuration + number * len(question.q))
        for number, answers in enumerate(scope.each(answer))
        for part in answers
    ]
    response.clearances = clearance_table_to_msg(
        ClearanceColumns(*(np.concatenate(column) for column in zip(*parts, strict=True))),
        question.robots.tree.position_names if request.with_jacobians else None,
        scope.legend,
    )


def check_configurations(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer CheckConfigurations."""
    count = count_rows(request.configurations) * len(scope.options.configurations)
    scope.require("max_robot_configurations_per_request", count, "configurations")
    question = _question(request, request.configurations, "configurations", scope)
    beyond = beyond_limits(question.robots.tree, question.q).any(axis=1)

    def answer(query: QueryObject) -> _Found:
        checker = question.checker(query)
        if not request.with_collisions:
            free = checker.check_configs_collision_free(question.q, threads=question.threads)
            return _Found(_unless(beyond, free))
        found = checker.find_collisions(question.q, threads=question.threads)
        free = np.ones(len(question.q), dtype=np.bool_)
        free[found.rows] = False
        rows, depths = found.rows.tolist(), found.depths.tolist()
        collisions = _Collisions(rows, list(found.pairs), depths, [0.0] * len(rows))
        return _Found(_unless(beyond, free), collisions)

    _respond(response, scope.each(answer), scope)


def check_edges(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer CheckEdges."""
    rows = count_rows(request.ends)
    count = rows // 2 * len(scope.options.configurations)
    scope.require("max_edges_per_request", count, "edges")
    question = _question(request, request.ends, "ends", scope)
    if len(question.q) % 2:
        raise MessageError(f"ends has {len(question.q)} rows; an edge has two")
    edges = question.q.reshape(-1, 2, question.q.shape[1])
    beyond = beyond_limits(question.robots.tree, edges).any(axis=(1, 2))

    def answer(query: QueryObject) -> _Found:
        checker = question.checker(query)
        if not request.with_measures:
            statuses = checker.edge_statuses(edges, threads=question.threads)
            return _Found(_unless(beyond, statuses))
        measures = checker.measure_edges(edges, threads=question.threads)
        return _Found(
            _unless(beyond, np.array([each.status.value for each in measures])),
            _collisions_of(checker, measures),
            np.array([(each.alpha, each.least_clearance) for each in measures]).reshape(-1, 2),
        )

    answers = scope.each(answer)
    _respond(response, answers, scope)
    measures = np.concatenate([each.measures for each in answers])
    response.proven_up_to = float64s_to_msg(measures[:, 0])
    response.least_clearances = float64s_to_msg(measures[:, 1])


def _question(request: Any, rows: Any, field: str, scope: QueryScope) -> _Question:
    """Return the question; raises UnknownIdError, NameConflictError and MessageError."""
    snapshot = scope.snapshot
    robots = snapshot.robots.planning(snapshot.query.snapshot, snapshot.bases)
    for frame in scope.options.configurations[0]:
        if frame in robots.link_frames:
            raise MessageError(
                f"what_if.frames: {quoted(snapshot.names.frame_path(frame))} is a link of a robot,"
                " which is where its positions put it"
            )
    present = robots.present(snapshot.positions)
    q = configurations_from_msg(rows, robots.positions, present, field)
    paddings = {
        name: padding_from_msg(getattr(request, name), name)
        for name in ("environment_padding", "self_padding")
    }
    return _Question(scope, robots, q, paddings)


def _unless(beyond: Any, outcomes: NDArray[Any]) -> NDArray[np.uint8]:
    """Return outcomes, that of rows beyond limits being so."""
    return np.where(beyond, CheckEdges.Response.BEYOND_LIMITS, outcomes).astype(np.uint8)


def _collisions_of(
    checker: SceneGraphCollisionChecker, measures: Sequence[EdgeMeasure]
) -> _Collisions:
    """Return the collisions that stop edges."""
    found: list[tuple[int, tuple[Any, Any], float, float]] = []
    for row, each in enumerate(measures):
        if each.pair is not None and each.configuration is not None and each.at is not None:
            depth = checker.calc_pair_depth(each.configuration, each.pair)
            found.append((row, each.pair, depth, each.at))
    return _Collisions(*(list(column) for column in zip(*found, strict=True))) if found else _NONE


def _respond(response: Any, answers: Sequence[_Found], scope: QueryScope) -> None:
    """Fill in the outcomes and collisions of all configurations of what_if."""
    response.outcomes = uint8s_to_msg(np.concatenate([each.outcomes for each in answers]))
    rows, pairs, depths, at = [], [], [], []
    first = 0
    for each in answers:
        rows += [first + row for row in each.collisions.rows]
        pairs += each.collisions.pairs
        depths += each.collisions.depths
        at += each.collisions.at
        first += len(each.outcomes)
    response.collisions = collision_table_to_msg(rows, pairs, depths, at, scope.legend)

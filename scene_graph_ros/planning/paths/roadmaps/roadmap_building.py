"""Roadmaps whose edges are proven beforehand, by any number of processes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.checker.carried_checker import pack, PackedChecker
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.cliques.visibility_graph import checked_parallelism
from scene_graph_ros.planning.edges.edge_proofs import prove
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.in_executor import (
    AnyExecutor,
    checked_executor,
    in_executor,
    parts_of,
)
from scene_graph_ros.planning.paths.roadmaps.roadmap import Roadmap
from scene_graph_ros.planning.paths.search.path_search import search_rules
from scene_graph_ros.planning.paths.search.position_space import (
    moving_positions,
    normalized,
    PositionSpace,
)

__all__ = ["build_roadmap"]

_LEAST_EDGES, _MOST_EDGES = 64, 4096
"""Of a share of the work."""

_HURRIED_EDGES = 512
"""Of a share where there is a time limit."""

_NONE = "not all edges were decided"

_MOST_DRAWS = 100
"""Times the configurations that are wanted: so many random ones are looked at."""


def build_roadmap(
    checker: SceneGraphCollisionChecker,
    q: ArrayLike,
    count: int,
    *,
    group: str | None = None,
    seed: int = 0,
    parallelize: bool | int = True,
    executor: AnyExecutor | None = None,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> Roadmap:
    """Return a roadmap of ``count`` random free configurations, each edge of it looked at.

    Positions that are not of the ``group`` are where they are in q ``(nq,)``. Paths through it are
    found by `plan_path` with ``planner="prm"``, which then proves little more than the ways to it.
    ``parallelize`` is a number of threads; True takes all processors. With an ``executor`` other
    processes share the proofs, each with as many threads. The same ``seed`` gives the same
    roadmap, whoever proves it. ``watch`` is called now and then and may raise.

    Raises PlanningError for options that make no sense, and where hardly anything is free,
    OutOfTimeError where not all edges are decided after ``timeout`` (s); and as the checker for q.
    """
    deadline = Deadline.of(timeout, watch, PlanningError)
    number, root = as_float(count), as_float(seed)
    if number is None or number < 1.0 or not number.is_integer():
        raise PlanningError(f"count must be an integer from 1 on, not {quoted(count)}")
    if root is None or root < 0.0 or not root.is_integer():
        raise PlanningError(f"seed must be a whole number from 0 on, not {quoted(seed)}")
    at = real_array(q, "q must be numbers (nq,)", PlanningError)
    if at.ndim != 1:
        raise PlanningError(f"q must have shape (nq,), not {at.shape}")
    plan = checker.plan
    held = normalized(plan.tree, checker.checked_configurations(at))
    space = PositionSpace.of(plan, held, moving_positions(plan.tree, group))
    roadmap = Roadmap()
    roadmap.prepare(plan, space, int(root))
    proofs = _SharedProofs(checker, parallelize, executor, deadline)
    _draw(roadmap, proofs, int(number))
    rows, edges = roadmap.unknown()
    roadmap.note(rows, proofs.are_free(edges, search_rules(checker.tolerance)))
    return roadmap


def _draw(roadmap: Roadmap, proofs: _SharedProofs, count: int) -> None:
    """Add random free configurations until there are so many. Raises PlanningError."""
    rules, drawn = search_rules(proofs.tolerance)._replace(part=1.0), 0
    while roadmap.num_configurations < count:
        q = roadmap.draw(count)
        drawn += len(q)
        free = proofs.are_free(np.repeat(q[:, np.newaxis], 2, axis=1), rules)
        roadmap.add(q[free][: count - roadmap.num_configurations], proofs.look)
        if drawn >= _MOST_DRAWS * count and roadmap.num_configurations < count:
            raise PlanningError(
                f"{roadmap.num_configurations} of {drawn} random configurations are free:"
                f" too few for a roadmap of {count}"
            )


class _SharedProofs:
    """Proofs of edges by this process, or by those of an executor."""

    def __init__(
        self,
        checker: SceneGraphCollisionChecker,
        parallelize: bool | int,
        executor: AnyExecutor | None,
        deadline: Deadline,
    ) -> None:
        self._deadline = deadline
        self._executor = checked_executor(executor)
        self._threads = checked_parallelism(checker, parallelize)
        self._asked: Any = checker if self._executor is None else pack(checker)
        self.tolerance = checker.tolerance

    def look(self) -> None:
        """Raise OutOfTimeError if the time is over."""
        self._deadline.check(_NONE)

    def are_free(self, edges: NDArray[np.float64], rules: EdgeRules) -> NDArray[np.bool_]:
        """Tell of edges ``(n, 2, nq)`` whether each is proven free."""
        is_timed = self._deadline.is_set
        least = _MOST_EDGES if self._executor is None and not is_timed else _LEAST_EDGES
        shares = [
            (self._asked, edges[first:last], tuple(rules), self._threads)
            for first, last in parts_of(
                len(edges), least, _HURRIED_EDGES if is_timed else _MOST_EDGES
            )
        ]
        parts = in_executor(_are_free, shares, self._executor, self._deadline, _NONE)
        return np.concatenate([np.zeros(0, dtype=np.bool_), *parts])


def _are_free(
    asked: SceneGraphCollisionChecker | PackedChecker,
    edges: NDArray[np.float64],
    rules: tuple[bool, float, float],
    threads: int,
) -> NDArray[np.bool_]:
    """Answer about a share."""
    checker: Any = asked.unpacked() if isinstance(asked, PackedChecker) else asked
    statuses = prove(checker.plan, edges, EdgeRules(*rules), threads=threads).statuses
    return np.asarray(statuses == FREE)

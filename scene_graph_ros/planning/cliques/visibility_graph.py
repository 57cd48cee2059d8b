"""Which of some configurations see each other: straight edges between them are free."""

from __future__ import annotations

from collections.abc import Callable
import os
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.query.arguments import checked_threads
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.checker.carried_checker import pack, PackedChecker
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.errors import CollisionCheckerError
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.in_executor import (
    AnyExecutor,
    checked_executor,
    in_executor,
    parts_of,
)

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

__all__ = [
    "checked_configurations",
    "checked_parallelism",
    "numbered_pairs",
    "visibility_graph",
]

_LEAST_EDGES, _MOST_EDGES = 64, 4096
"""Of a share of the work: milliseconds to some tenths of a second for a robot of seven joints."""


_HURRIED_EDGES = 512
"""Of a share where there is a time limit."""


def visibility_graph(
    checker: CollisionChecker,
    points: ArrayLike,
    parallelize: bool | int = True,
    *,
    proof: bool = True,
    executor: AnyExecutor | None = None,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> csc_matrix:
    """Return the mutual visibility of ``points (n, nq)``: a symmetric matrix ``(n, n)`` of bool.

    Edges are those of ``checker.check_edges_collision_free``: the scene's own checker proves them.
    With ``proof=False`` they are sampled at ``edge_step_size``. A point sees itself if it is free;
    one that is not, and one nearer to a collision than the checker's tolerance, sees none. An edge
    is asked for in one direction only.

    ``parallelize`` is a number of threads; True takes all processors. With an ``executor`` other
    processes share the edges, each with as many threads; the graph is the same. ``watch`` is
    called now and then and may raise.

    Raises KinematicTreeError and CollisionCheckerError for points of another shape, that are not
    finite or beyond all scenes, and for a checker that can't be sent to other processes;
    OutOfTimeError where not all edges are decided after ``timeout`` (s).
    """
    deadline = Deadline.of(timeout, watch, CollisionCheckerError)
    from scipy.sparse import csc_matrix

    q = checked_configurations(checker, points)
    threads = checked_parallelism(checker, parallelize)
    executor = checked_executor(executor)
    if executor is not None and not proof and isinstance(checker, SceneGraphCollisionChecker):
        raise CollisionCheckerError(
            "proof=False is for this process; with an executor the scene's edges are proven"
        )
    # A point's own edge keeps what any edge has to keep.
    alone = np.arange(len(q))
    deadline.check("not all edges were decided")
    seen = _free(checker, q, alone, alone, proof=proof, threads=threads)
    free = np.flatnonzero(seen)
    count = len(free) * (len(free) - 1) // 2
    asked: Any = checker if executor is None else pack(checker)
    least = _MOST_EDGES if executor is None else _LEAST_EDGES
    if deadline.is_set:
        least = _LEAST_EDGES
    parts = parts_of(count, least, _HURRIED_EDGES if deadline.is_set else _MOST_EDGES)
    shares = [(asked, q[free], *part, bool(proof), threads) for part in parts]
    seen_parts = in_executor(_visible, shares, executor, deadline, "not all edges were decided")
    visible = np.concatenate([np.zeros(0, dtype=np.bool_), *seen_parts])
    i, j = (free[rows[visible]] for rows in numbered_pairs(len(free), 0, count))
    rows, columns = np.concatenate([free, i, j]), np.concatenate([free, j, i])
    return csc_matrix((np.ones(len(rows), np.bool_), (rows, columns)), shape=(len(q), len(q)))


def _visible(
    asked: CollisionChecker | PackedChecker,
    q: NDArray[np.float64],
    first: int,
    last: int,
    proof: bool,
    threads: int,
) -> NDArray[np.bool_]:
    """Answer about some pairs of points, by their numbers from first to last."""
    checker = asked.unpacked() if isinstance(asked, PackedChecker) else asked
    pairs = numbered_pairs(len(q), first, last)
    return _free(checker, q, *pairs, proof=proof, threads=threads)


def _free(
    checker: Any,
    q: NDArray[np.float64],
    i: NDArray[np.intp],
    j: NDArray[np.intp],
    *,
    proof: bool,
    threads: int,
) -> NDArray[np.bool_]:
    edges = np.stack([q[i], q[j]], axis=1)
    if proof:
        return np.asarray(checker.check_edges_collision_free(edges, threads=threads), np.bool_)
    return checker.check_edges_by_samples(edges, threads=threads)


def numbered_pairs(n: int, first: int, last: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs ``i < j`` of n points, by their numbers in the order of i, then j."""
    numbers = np.arange(first, last)
    begins = np.arange(n) * n - np.arange(n) * (np.arange(n) + 1) // 2
    i = np.searchsorted(begins, numbers, side="right") - 1
    # Where rows are empty, their beginnings are the same: the last row with a pair is meant.
    i = np.minimum(i, max(n - 2, 0))
    return i, numbers - begins[i] + i + 1


def checked_configurations(checker: CollisionChecker, points: ArrayLike) -> NDArray[np.float64]:
    """Return configurations ``(n, nq)`` of a checker's robots, or raise as it does."""
    own = getattr(checker, "checked_configurations", None)
    return checker.model.tree.checked_configurations(points) if own is None else own(points)


def checked_parallelism(checker: CollisionChecker, parallelize: Any) -> int:
    """Return a number of threads that the checker supports. Raises CollisionCheckerError."""
    if isinstance(parallelize, (bool, np.bool_)):
        threads = (os.cpu_count() or 1) if parallelize else 1
    else:
        try:
            threads = checked_threads(parallelize)
        except ValueError:
            raise CollisionCheckerError(
                f"parallelize must be True, False or an integer >= 1, not {quoted(parallelize)}"
            ) from None
    return threads if checker.supports_parallel_checking() else 1

"""A configuration space covered by few regions, grown around cliques of visibility graphs.

Werner, Amice, Marcucci, Rus and Tedrake, "Approximating robot configuration spaces with few convex
sets using clique covers of visibility graphs", ICRA 2024.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.checker.carried_checker import pack, PackedChecker
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.cliques.clique_cover import MinCliqueCoverSolverViaGreedy
from scene_graph_ros.planning.cliques.max_clique import (
    MaxCliqueSolverBase,
    MaxCliqueSolverViaGreedy,
)
from scene_graph_ros.planning.cliques.visibility_graph import (
    checked_parallelism,
    numbered_pairs,
)
from scene_graph_ros.planning.errors import OutOfTimeError
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.in_executor import (
    AnyExecutor,
    checked_executor,
    in_executor,
    parts_of,
)
from scene_graph_ros.planning.regions.arguments import checked_domain
from scene_graph_ros.planning.regions.around_seeds import (
    ellipsoid_around,
    feasibility_of,
    grow_around,
)
from scene_graph_ros.planning.regions.cover_options import IrisFromCliqueCoverOptions
from scene_graph_ros.planning.regions.errors import RegionError, RegionNotFoundError
from scene_graph_ros.planning.regions.feasibility import feasibility_of_share
from scene_graph_ros.planning.regions.region_record import ConfigurationRegion, share_bound

__all__ = ["DroppedClique", "RegionCover", "iris_in_configuration_space_from_clique_cover"]

_MOST_DRAWS = 100
"""Batches of random points, until there are enough that are free and in no region."""

_LEAST_EDGES, _MOST_EDGES = 64, 4096
"""Of a share of a visibility graph."""

_CONFIDENCE = 0.95


@dataclass(frozen=True, eq=False)
class DroppedClique:
    """A clique around which no region was found, and why."""

    points: NDArray[np.float64]
    """``(k, nq)``."""
    reason: str


@one_line()
@dataclass(frozen=True, eq=False)
class RegionCover:
    """Regions, and their share of the free volume."""

    regions: tuple[HPolyhedron, ...]
    """Those that were given, then new ones."""
    records: tuple[ConfigurationRegion, ...]
    """Of the new ones."""
    dropped: tuple[DroppedClique, ...]
    coverage: float
    """Share of random free points that some region has."""
    coverage_bound: float
    """What the share of all that is free is at least, at 95 % for this one check."""
    iterations: int
    reason: str
    """Why it ended: ``covered``, ``iterations``, ``timeout``, or ``points``: none that is free and
    in no region was found."""


@overload
def iris_in_configuration_space_from_clique_cover(
    checker: CollisionChecker,
    options: IrisFromCliqueCoverOptions | None = ...,
    generator: np.random.Generator | None = ...,
    sets: Sequence[HPolyhedron] = ...,
    max_clique_solver: MaxCliqueSolverBase | None = ...,
    *,
    domain: HPolyhedron | None = ...,
    executor: AnyExecutor | None = ...,
    certificate: Literal[False] = ...,
    timeout: float | None = ...,
    watch: Callable[[], object] | None = ...,
) -> list[HPolyhedron]: ...


@overload
def iris_in_configuration_space_from_clique_cover(
    checker: CollisionChecker,
    options: IrisFromCliqueCoverOptions | None = ...,
    generator: np.random.Generator | None = ...,
    sets: Sequence[HPolyhedron] = ...,
    max_clique_solver: MaxCliqueSolverBase | None = ...,
    *,
    domain: HPolyhedron | None = ...,
    executor: AnyExecutor | None = ...,
    certificate: Literal[True],
    timeout: float | None = ...,
    watch: Callable[[], object] | None = ...,
) -> RegionCover: ...


def iris_in_configuration_space_from_clique_cover(
    checker: CollisionChecker,
    options: IrisFromCliqueCoverOptions | None = None,
    generator: np.random.Generator | None = None,
    sets: Sequence[HPolyhedron] = (),
    max_clique_solver: MaxCliqueSolverBase | None = None,
    *,
    domain: HPolyhedron | None = None,
    executor: AnyExecutor | None = None,
    certificate: bool = False,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> list[HPolyhedron] | RegionCover:
    """Return regions that cover a share of the free configurations of a domain.

    Regions of ``sets`` count as covering, and come first. Edges that are proven free join free
    points that no region has; around each clique of that graph a region grows. Free is
    one predicate everywhere: the checker with its paddings, and the obstacles and constraints of
    ``iris_options``. A clique without a region is dropped, and told of. The domain is the box of
    the joints' limits unless given; the same ``generator`` gives the same cover, with an
    ``executor``, too: then other processes prove edges, and grow the regions of a round. After
    ``timeout`` (s) the regions that there are then are the answer; ``watch`` is called now and
    then and may raise.

    Raises RegionError for options that make no sense.
    """
    deadline = Deadline.of(timeout, watch, RegionError)
    chosen = IrisFromCliqueCoverOptions() if options is None else options
    solver = MaxCliqueSolverViaGreedy() if max_clique_solver is None else max_clique_solver
    box = checked_domain(checker, domain)
    cover = _Cover(checker, box, chosen, solver, checked_executor(executor), deadline)
    cover.generator = np.random.default_rng(0) if generator is None else generator
    cover.take(sets)
    found = cover.grow()
    return found if certificate else list(found.regions)


class _Cover:
    """A cover on its way."""

    generator: np.random.Generator

    def __init__(
        self,
        checker: CollisionChecker,
        domain: HPolyhedron,
        options: IrisFromCliqueCoverOptions,
        solver: MaxCliqueSolverBase,
        executor: AnyExecutor | None,
        deadline: Deadline,
    ) -> None:
        self._options, self._domain, self._executor = options, domain, executor
        self._deadline, self._iterations, self._checked = deadline, 0, (0, 0)
        n = domain.ambient_dimension
        self._feasibility = feasibility_of(checker, options.iris_options, domain, deadline)
        self._feasibility.threads = checked_parallelism(checker, options.parallelism)
        self._least = max(options.minimum_clique_size, n + 1)
        self._count = max(options.num_points_per_visibility_round, 2 * self._least)
        self._solver = MinCliqueCoverSolverViaGreedy(solver, self._least)
        axes = np.eye(n)
        self._low = np.array([-domain.support(-axis).value for axis in axes])
        self._high = np.array([domain.support(axis).value for axis in axes])
        self._asked: Any = checker if executor is None else pack(checker)
        self._regions: list[HPolyhedron] = []
        self._records: list[ConfigurationRegion] = []
        self._dropped: list[DroppedClique] = []

    @property
    def _of_shares(self) -> Deadline:
        return self._deadline if self._executor is None else self._deadline.apart()

    @property
    def _threads(self) -> int:
        """Of a share."""
        return self._feasibility.threads if self._executor is None else 1

    def take(self, sets: Sequence[Any]) -> None:
        """Begin with regions. Raises RegionError for an object that is none."""
        for k, each in enumerate(sets):
            n = self._domain.ambient_dimension
            if not isinstance(each, HPolyhedron) or each.ambient_dimension != n:
                raise RegionError(
                    f"sets[{k}] must be an HPolyhedron in {n} dimensions, not {quoted(each)}"
                )
            self._regions.append(each)

    def grow(self) -> RegionCover:
        """Add regions until one of the reasons to end comes up."""
        reason = ""
        while not reason:
            try:
                reason = self._round()
            except OutOfTimeError:
                reason = "timeout"
        count, covered = self._checked
        share = covered / count if count else float(reason != "timeout")
        bound = 1.0 - share_bound(count, count - covered, 1.0 - _CONFIDENCE) if count else 0.0
        return RegionCover(
            tuple(self._regions),
            tuple(self._records),
            tuple(self._dropped),
            share,
            bound,
            self._iterations,
            reason,
        )

    def _round(self) -> str:
        """Check how much is covered, and add regions; return the reason if it was the last."""
        options = self._options
        free = self._draw(options.num_points_per_coverage_check, covered=True)
        left = free[~self._is_covered(free)]
        self._checked = count, covered = len(free), len(free) - len(left)
        if not count or covered / count >= options.coverage_termination_threshold:
            return "covered"
        if self._iterations == options.iteration_limit:
            return "iterations"
        self._iterations += 1
        points = self._draw(self._count, covered=False)
        if not len(points):
            return "points"
        cliques = self._cliques(points)
        if not cliques:
            self._count *= 2
        self._add(cliques, left, count)
        return ""

    def _draw(self, count: int, *, covered: bool) -> NDArray[np.float64]:
        """Return up to so many free points of the domain; those of regions, too, or not."""
        found: list[NDArray[np.float64]] = []
        missing = count
        for _ in range(_MOST_DRAWS):
            q = self.generator.uniform(self._low, self._high, (count, len(self._low)))
            q = q[self._domain.point_in_set(q, 0.0)]
            if not covered:
                q = q[~self._is_covered(q)]
            q = q[self._feasibility.free(q)][:missing]
            found.append(q)
            missing -= len(q)
            if not missing:
                break
        return np.concatenate(found)

    def _is_covered(self, q: NDArray[np.float64]) -> NDArray[np.bool_]:
        result = np.zeros(len(q), dtype=np.bool_)
        for region in self._regions:
            result |= region.point_in_set(q, self._options.point_in_set_tol)
        return result

    def _cliques(self, points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return the points ``(k, nq)`` of each clique of a partition, largest first."""
        n = len(points)
        count = n * (n - 1) // 2
        least = _MOST_EDGES if self._executor is None else _LEAST_EDGES
        shares = [
            (
                self._asked,
                points,
                *part,
                self._options.iris_options,
                self._threads,
                self._of_shares,
            )
            for part in parts_of(count, least, _MOST_EDGES)
        ]
        parts = in_executor(_seen, shares, self._executor, self._deadline)
        seen = np.concatenate([np.zeros(0, dtype=np.bool_), *parts])
        i, j = numbered_pairs(n, 0, count)
        graph = np.zeros((n, n), dtype=np.bool_)
        graph[i[seen], j[seen]] = graph[j[seen], i[seen]] = True
        cover = self._solver.solve_min_clique_cover(graph, partition=True)
        return [points[sorted(clique)] for clique in cover]

    def _add(
        self, cliques: Sequence[NDArray[np.float64]], left: NDArray[np.float64], count: int
    ) -> None:
        """Grow a region around each clique, but where earlier ones have left too few points.

        Until of ``count`` free points as many are covered as is asked for; those ``left`` are not.
        Other processes grow all, of which the same ones are kept.
        """
        options = self._options
        rank_tol = options.rank_tol_for_minimum_volume_circumscribed_ellipsoid
        shares = [
            (
                self._asked,
                self._domain,
                clique,
                rank_tol,
                options.iris_options,
                self._threads,
                self._of_shares,
            )
            for clique in cliques
        ]
        grown = None
        if self._executor is not None:
            grown = in_executor(_region_of_clique, shares, self._executor, self._deadline)
        for k, clique in enumerate(cliques):
            if np.count_nonzero(~self._is_covered(clique)) < self._least:
                continue
            found = _region_of_clique(*shares[k]) if grown is None else grown[k]
            if isinstance(found, str):
                self._dropped.append(DroppedClique(clique, found))
            else:
                self._records.append(found)
                self._regions.append(found.region)
                left = left[~found.region.point_in_set(left, options.point_in_set_tol)]
                if 1.0 - len(left) / count >= options.coverage_termination_threshold:
                    break


def _seen(
    asked: CollisionChecker | PackedChecker,
    points: NDArray[np.float64],
    first: int,
    last: int,
    iris_options: Any,
    threads: int,
    deadline: Deadline,
) -> NDArray[np.bool_]:
    """Tell of some pairs of points, by their numbers, whether they see each other."""
    i, j = numbered_pairs(len(points), first, last)
    edges = np.stack([points[i], points[j]], axis=1)
    return feasibility_of_share(asked, iris_options, threads, deadline).segments_free(edges)


def _region_of_clique(
    asked: CollisionChecker | PackedChecker,
    domain: HPolyhedron,
    clique: NDArray[np.float64],
    rank_tol: float,
    iris_options: Any,
    threads: int,
    deadline: Deadline,
) -> ConfigurationRegion | str:
    """Return a region around the points of a clique, or why there is none.

    The centre of their ellipsoid stays inside, or the point nearest to it where that is not free:
    the hull of all need not be free.
    """
    feasibility = feasibility_of_share(asked, iris_options, threads, deadline)
    try:
        B, center = ellipsoid_around(clique, rank_tol)
        if not (domain.point_in_set(center, 0.0) and feasibility.free(center[np.newaxis])[0]):
            center = clique[np.argmin(np.linalg.norm(clique - center, axis=1))]
        kept = center[np.newaxis]
        return grow_around(feasibility, domain, B, center, kept, iris_options)
    except (RegionError, RegionNotFoundError, ConvexSetError, SolverError) as error:
        return str(error)

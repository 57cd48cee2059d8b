"""Regions around seeds: a configuration, some, an edge, a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import itertools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.iris.options import IrisOptions
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.planning.checker.carried_checker import pack, PackedChecker
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.cliques.visibility_graph import checked_parallelism
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.in_executor import (
    AnyExecutor,
    checked_executor,
    in_executor,
)
from scene_graph_ros.planning.regions.arguments import (
    checked_center,
    checked_domain,
    checked_points,
    refuse_parameterization,
)
from scene_graph_ros.planning.regions.errors import RegionError, RegionNotFoundError
from scene_graph_ros.planning.regions.feasibility import (
    checked_constraints,
    checked_obstacles,
    Feasibility,
    feasibility_of_share,
)
from scene_graph_ros.planning.regions.held_positions import Held, held_by_group, HeldChecker
from scene_graph_ros.planning.regions.iris_np import grow_np, np_options
from scene_graph_ros.planning.regions.iris_zo import grow_zo
from scene_graph_ros.planning.regions.iris_zo_options import IrisZoOptions
from scene_graph_ros.planning.regions.region_record import ConfigurationRegion

__all__ = [
    "AnyIrisOptions",
    "ellipsoid_around",
    "grow_around",
    "region_around",
    "regions_along",
    "regions_around",
]

AnyIrisOptions = IrisZoOptions | IrisOptions

_THIN = 1e-2
"""Relative to the longest: how long the axes of an ellipsoid around points are at least."""

_SMALL = 1e-3
"""rad or m: the radius where there is one point only; its size does not count."""

_NONE = "not all regions were grown"

_STRAIGHT = 1e-9
"""Of directions of length 1: edges that differ by less are pieces of one."""


def region_around(
    checker: CollisionChecker,
    seed: ArrayLike,
    domain: HPolyhedron | None = None,
    options: AnyIrisOptions | None = None,
    *,
    group: str | None = None,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> ConfigurationRegion:
    """Return a region that keeps a configuration ``(nq,)`` inside, or all of ``(m, nq)``.

    Two are an edge. All edges between seeds must be free; the ellipsoid to begin with is the
    smallest around them. ``options`` are an `IrisZoOptions`, which are the default, or an
    `IrisOptions`; seeds are inside in any case. With a ``group`` of an SRDF, region and domain are
    of its k positions alone, and all others stay as they are in the seeds. ``timeout`` and
    ``watch`` are as of `iris_zo`. Raises as that,
    RegionError for seeds that do not see each other or move positions outside of the group, and
    KinematicTreeError for a group that there is not.
    """
    deadline = Deadline.of(timeout, watch, RegionError)
    chosen = IrisZoOptions() if options is None else options
    refuse_parameterization(chosen, "region_around")
    given = checked_points("seed", seed, checker.model.tree.num_positions)
    held = held_by_group(checker, group, given, "seed")
    box = checked_domain(checker, domain, None if held is None else held.rows)
    seeds = given if held is None else given[:, held.rows]
    feasibility = _held(feasibility_of(checker, chosen, box, deadline), held)
    _check_seeds(feasibility, box, seeds)
    B, center = ellipsoid_around(seeds)
    return grow_around(feasibility, box, B, center, seeds, chosen)


def regions_around(
    checker: CollisionChecker,
    seeds: Sequence[ArrayLike],
    domain: HPolyhedron | None = None,
    options: AnyIrisOptions | None = None,
    *,
    executor: AnyExecutor | None = None,
    group: str | None = None,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> list[ConfigurationRegion]:
    """Return a region around each of some seeds, as `region_around` grows it.

    Each seed is ``(nq,)`` or ``(m, nq)``. With an ``executor`` other processes grow them, a share
    each: the answer is the same. After ``timeout`` (s) no further ellipsoid is tried around any.
    Raises as `region_around`, naming the seed by its row, RegionNotFoundError where one has no
    region, OutOfTimeError where one has none in time, and CollisionCheckerError for an object that
    is no executor.
    """
    deadline = Deadline.of(timeout, watch, RegionError)
    pool = checked_executor(executor)
    chosen = IrisZoOptions() if options is None else options
    refuse_parameterization(chosen, "regions_around")
    asked: Any = checker if pool is None else pack(checker)
    of_shares = deadline if pool is None else deadline.apart()
    shares = []
    for k, seed in enumerate(seeds):
        given = checked_points(f"seeds[{k}]", seed, checker.model.tree.num_positions)
        held = held_by_group(checker, group, given, f"seeds[{k}]")
        box = checked_domain(checker, domain, None if held is None else held.rows)
        own = given if held is None else given[:, held.rows]
        feasibility = _held(feasibility_of(checker, chosen, box, deadline), held)
        _check_seeds(feasibility, box, own, f"seeds[{k}]")
        threads = feasibility.threads if pool is None else 1
        shares.append((asked, held, box, own, chosen, threads, of_shares))
    regions: list[ConfigurationRegion] = []
    for k, found in enumerate(in_executor(_region_or_error, shares, pool, deadline, _NONE)):
        if isinstance(found, Exception):
            raise RegionNotFoundError(f"seeds[{k}]: {found}") from found
        regions.append(found)
    return regions


def regions_along(
    checker: CollisionChecker,
    path: ArrayLike,
    domain: HPolyhedron | None = None,
    options: AnyIrisOptions | None = None,
    *,
    executor: AnyExecutor | None = None,
    group: str | None = None,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> list[ConfigurationRegion]:
    """Return regions along a path ``(m, nq)`` of free edges, such as `plan_path` finds.

    Each keeps an edge inside, so neighbours share a configuration of the path. An edge that is in
    the region before gets none of its own. With an ``executor`` other processes grow regions at
    once for all edges that go in a new direction, and the answer is the same. ``group`` is as of
    `region_around`, ``timeout`` and ``watch`` as of `regions_around`. Raises as those do.
    """
    deadline = Deadline.of(timeout, watch, RegionError)
    pool = checked_executor(executor)
    chosen = IrisZoOptions() if options is None else options
    refuse_parameterization(chosen, "regions_along")
    given = checked_points("path", path, checker.model.tree.num_positions)
    held = held_by_group(checker, group, given, "path")
    box = checked_domain(checker, domain, None if held is None else held.rows)
    if len(given) == 1:
        left, look = deadline.left, deadline.look
        return [region_around(checker, given, box, chosen, group=group, timeout=left, watch=look)]
    q = given if held is None else given[:, held.rows]
    feasibility = _held(feasibility_of(checker, chosen, box, deadline), held)
    asked: Any = checker if pool is None else pack(checker)
    threads = feasibility.threads if pool is None else 1
    of_shares = deadline if pool is None else deadline.apart()
    edges = itertools.pairwise(q)
    shares = [(asked, held, box, np.stack(edge), chosen, threads, of_shares) for edge in edges]
    regions: list[ConfigurationRegion] = []
    grown: dict[int, ConfigurationRegion | Exception] = {}
    # Others are grown at once: those that turn, then twice as many as before while all are needed.
    wave: list[int] = []
    ahead, unneeded = 1, 0
    for k, share in enumerate(shares):
        edge = share[3]
        if regions and regions[-1].region.point_in_set(edge, 0.0).all():
            unneeded += k in wave
            continue
        _check_seeds(feasibility, box, edge)
        if k not in grown:
            others: list[int] = []
            if pool is not None:
                ahead = 2 * ahead if not unneeded else max(ahead // 2, 1)
                others = [each for each in range(k + 1, len(shares)) if each not in grown]
                others = others[: ahead - 1] if wave else _turning_edges(q, k)
            wave, unneeded = [k, *others], 0
            found = in_executor(
                _region_or_error, [shares[each] for each in wave], pool, deadline, _NONE
            )
            grown |= zip(wave, found, strict=True)
        region = grown[k]
        if isinstance(region, Exception):
            raise region
        regions.append(region)
    return regions


def _turning_edges(q: NDArray[np.float64], first: int) -> list[int]:
    """Return the edges of a path ``(m, n)`` after one of them that go in a new direction."""
    ways = np.diff(q, axis=0)
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    ways = np.divide(ways, lengths, out=np.zeros_like(ways), where=lengths > 0.0)
    turns = np.abs(np.diff(ways, axis=0)).max(axis=1) > _STRAIGHT
    return [k for k in range(first + 1, len(ways)) if turns[k - 1]]


def _held(feasibility: Feasibility, held: Held | None) -> Feasibility:
    """Return the checker of the moving positions alone."""
    if held is not None:
        feasibility.checker = HeldChecker(feasibility.checker, held)
    return feasibility


def _region_or_error(
    asked: CollisionChecker | PackedChecker,
    held: Held | None,
    domain: HPolyhedron,
    seeds: NDArray[np.float64],
    options: AnyIrisOptions,
    threads: int,
    deadline: Deadline,
) -> ConfigurationRegion | Exception:
    """Return a region that keeps an edge inside, or the reason against it."""
    B, center = ellipsoid_around(seeds)
    try:
        feasibility = _held(feasibility_of_share(asked, options, threads, deadline), held)
        return grow_around(feasibility, domain, B, center, seeds, options)
    except (RegionError, RegionNotFoundError, ConvexSetError, SolverError) as error:
        return error


def _check_seeds(
    feasibility: Feasibility,
    domain: HPolyhedron,
    seeds: NDArray[np.float64],
    name: str = "seed",
) -> None:
    """Raise RegionError for seeds ``(m, n)`` that are not free or do not see each other."""
    for k, each in enumerate(seeds):
        checked_center(feasibility, domain, each, f"{name}[{k}]")
    pairs = list(itertools.combinations(range(len(seeds)), 2))
    edges = np.array([[seeds[i], seeds[j]] for i, j in pairs]).reshape(-1, 2, seeds.shape[1])
    hidden = np.flatnonzero(~feasibility.segments_free(edges))
    if len(hidden):
        i, j = pairs[hidden[0]]
        raise RegionError(
            f"{name}[{i}] and {name}[{j}] do not see each other: the edge between them is not"
            " free, so no convex region has both"
        )


def feasibility_of(
    checker: CollisionChecker, options: AnyIrisOptions, domain: HPolyhedron, deadline: Deadline
) -> Feasibility:
    """Return the predicate of options, after checking those that it takes."""
    chosen = options if isinstance(options, IrisZoOptions) else np_options(options)
    n = domain.ambient_dimension
    return Feasibility(
        checker,
        checked_obstacles(chosen.configuration_obstacles, n),
        checked_constraints(chosen.additional_constraints),
        checked_parallelism(checker, chosen.parallelism),
        deadline=deadline,
    )


def ellipsoid_around(
    points: NDArray[np.float64], rank_tol: float = 1e-6
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return map ``(n, n)`` and centre ``(n,)`` of an ellipsoid around points that is not flat."""
    n = points.shape[1]
    ball = AffineBall.minimum_volume_circumscribed_ellipsoid(points, rank_tol)
    axes, radii, _ = np.linalg.svd(ball.B)
    least = _THIN * float(radii.max(initial=0.0)) or _SMALL
    return axes @ np.diag(np.maximum(radii, least)).reshape(n, n), np.array(ball.center)


def grow_around(
    feasibility: Feasibility,
    domain: HPolyhedron,
    B: NDArray[np.float64],
    center: NDArray[np.float64],
    kept: NDArray[np.float64],
    options: AnyIrisOptions,
) -> ConfigurationRegion:
    """Return a region around an ellipsoid by the algorithm that the options are of.

    Where the ellipsoid's centre is not free it is moved to the nearest point that is kept.
    """
    if not feasibility.free(center[np.newaxis])[0]:
        center = kept[np.argmin(np.linalg.norm(kept - center, axis=1))]
    if isinstance(options, IrisZoOptions):
        return grow_zo(feasibility, domain, B, center, kept, options)
    return grow_np(feasibility, domain, B, center, kept, np_options(options))

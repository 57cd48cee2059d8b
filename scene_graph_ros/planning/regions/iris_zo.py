"""Regions of configurations that are free with a stated probability, from checks alone.

Werner, Cohn, Jiang, Seyde, Simchowitz, Tedrake and Rus, "Faster algorithms for growing
collision-free convex polytopes in robot configuration space", 2024 (IRIS-ZO): points of the region
that are not free are moved towards the ellipsoid's centre as long as they stay so; faces touch
the ellipsoid, grown up to the nearest of them; a test of independent points says when that is
enough.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.cliques.visibility_graph import checked_parallelism
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.regions.arguments import (
    checked_center,
    checked_domain_of,
    checked_kept,
    ellipsoid_map,
)
from scene_graph_ros.planning.regions.errors import RegionError, RegionNotFoundError
from scene_graph_ros.planning.regions.faces import Cut, cut_between
from scene_graph_ros.planning.regions.feasibility import (
    checked_constraints,
    checked_obstacles,
    Feasibility,
)
from scene_graph_ros.planning.regions.hit_and_run import walked
from scene_graph_ros.planning.regions.iris_zo_options import IrisZoOptions
from scene_graph_ros.planning.regions.outer_loop import Attempt, grow, rounding_shape
from scene_graph_ros.planning.regions.parameterization import checked_parameterization
from scene_graph_ros.planning.regions.region_record import ConfigurationRegion, share_bound

__all__ = ["bisected", "grow_zo", "iris_zo", "refuse_inside"]

_AT_ONCE = 1000
"""Points of a test, which ends when too many of them are not free."""


@overload
def iris_zo(
    checker: CollisionChecker,
    starting_ellipsoid: ConvexSet,
    domain: HPolyhedron,
    options: IrisZoOptions = ...,
    *,
    certificate: Literal[False] = ...,
    timeout: float | None = ...,
    watch: Callable[[], object] | None = ...,
) -> HPolyhedron: ...


@overload
def iris_zo(
    checker: CollisionChecker,
    starting_ellipsoid: ConvexSet,
    domain: HPolyhedron,
    options: IrisZoOptions = ...,
    *,
    certificate: Literal[True],
    timeout: float | None = ...,
    watch: Callable[[], object] | None = ...,
) -> ConfigurationRegion: ...


def iris_zo(
    checker: CollisionChecker,
    starting_ellipsoid: ConvexSet,
    domain: HPolyhedron,
    options: IrisZoOptions | None = None,
    *,
    certificate: bool = False,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> HPolyhedron | ConfigurationRegion:
    """Return a large polyhedron in a bounded domain, nearly all of which is free.

    ``starting_ellipsoid`` is a `Hyperellipsoid` or `AffineBall` ``(nq,)`` about a configuration
    that is free and in the domain; its size does not count. Paddings of the checker are kept. With
    ``certificate`` a `ConfigurationRegion`, which has the test that the region passed. With
    ``options.parameterization`` all three are of the points that it takes, ``(k,)``. After
    ``timeout`` (s) no further ellipsoid is tried; ``watch`` is called now and then and may raise.

    Raises RegionError for a centre that is not free or not in the domain, an unbounded domain,
    robots that float, and points to keep whose hull is not free or has not the centre in it;
    RegionNotFoundError where no region passed the test, OutOfTimeError where none did in time.
    """
    deadline = Deadline.of(timeout, watch, RegionError)
    chosen = IrisZoOptions() if options is None else options
    parameterization = checked_parameterization(chosen.parameterization, "IrisZoOptions")
    box = checked_domain_of(parameterization, checker, domain)
    feasibility = Feasibility(
        checker,
        checked_obstacles(chosen.configuration_obstacles, checker.model.tree.num_positions),
        checked_constraints(chosen.additional_constraints),
        checked_parallelism(checker, chosen.parallelism),
        parameterization,
        deadline,
    )
    B, center = ellipsoid_map(starting_ellipsoid, box.ambient_dimension)
    checked_center(feasibility, box, center, "starting_ellipsoid: the centre")
    kept = checked_kept(feasibility, box, center, chosen.containment_points)
    found = grow_zo(feasibility, box, B, center, kept, chosen)
    return found if certificate else found.region


def grow_zo(
    feasibility: Feasibility,
    domain: HPolyhedron,
    B: NDArray[np.float64],
    center: NDArray[np.float64],
    kept: NDArray[np.float64],
    options: IrisZoOptions,
) -> ConfigurationRegion:
    """Return a region around an ellipsoid ``{B u + center}`` for arguments that were checked."""
    if options.require_sample_point_is_contained:
        kept = np.concatenate([center[np.newaxis], kept])
    rounds = _Rounds(feasibility, domain, kept, options)
    return grow(feasibility, B, center, kept, options, options.max_iterations, rounds.attempt)


class _Rounds:
    """Rounds of faces and tests, for one ellipsoid after the other."""

    def __init__(
        self,
        feasibility: Feasibility,
        domain: HPolyhedron,
        kept: NDArray[np.float64],
        options: IrisZoOptions,
    ) -> None:
        self._feasibility, self._domain, self._kept = feasibility, domain, kept
        self._options = options
        self._generator = np.random.default_rng(options.random_seed)
        self._ellipsoids = self._tests = 0

    def attempt(self, B: NDArray[np.float64], center: NDArray[np.float64]) -> Attempt:
        """Return the domain cut by faces around an ellipsoid, whose centre is free, tested."""
        options = self._options
        self._ellipsoids += 1
        cut = Cut(B, center, self._kept)
        A, b = self._domain.A, self._domain.b
        starts = points = center[np.newaxis]
        hits = 0
        passed: Attempt | None = None
        for number in range(1, options.max_iterations_separating_planes + 1):
            # All errors together are at most delta: 6 / (pi k)^2 is their share of it.
            share = (6.0 / math.pi**2) ** 2 / (self._ellipsoids * number) ** 2
            error = options.delta * share
            samples, most = _test_size(error, options)
            points = self._points(A, b, starts, options.num_particles, B)
            free = self._feasibility.free(points)
            colliding, hits = points[~free], int((~free).sum())
            is_passed = False
            if hits <= _likely(samples, most, len(points)):
                # The test is of points that nothing else has used.
                points, free = self._tested(A, b, starts, samples, most)
                more, hits = points[~free], int((~free).sum())
                colliding = np.concatenate([colliding, more])[: options.num_particles]
                is_passed = hits <= most
            self._tests += 1
            self._tell(number, hits, len(points), len(b))
            if is_passed:
                bound = share_bound(len(points), hits, error)
                region = HPolyhedron(A, b)
                passed = Attempt(
                    region, len(points), hits, bound, 1.0 - options.delta, self._tests
                )
                if not (hits and options.remove_all_collisions_possible):
                    return passed
            nearer = bisected(self._feasibility, colliding, center, options.bisection_steps)
            most_faces = options.max_separating_planes_per_iteration
            normals, sides, inside = cut_between(
                cut, nearer, options.configuration_space_margin, most_faces
            )
            refuse_inside(inside)
            A, b = np.concatenate([A, normals]), np.append(b, sides)
            still = (points @ np.array(normals).T <= np.array(sides)).all(axis=1)
            starts = points[still] if still.any() else center[np.newaxis]
            if not self._holds_start(A, b, starts):
                starts = self._kept[:1] if len(self._kept) else center[np.newaxis]
        if passed is not None:
            return passed
        raise RegionNotFoundError(
            f"iris_zo: {options.max_iterations_separating_planes} rounds of faces left"
            f" {hits} of {len(points)} points that are not free; raise"
            " max_iterations_separating_planes, epsilon or configuration_space_margin"
        )

    def _holds_start(
        self, A: NDArray[np.float64], b: NDArray[np.float64], starts: NDArray[np.float64]
    ) -> bool:
        return bool((starts[0] @ A.T <= b).all())

    def _tested(
        self,
        A: NDArray[np.float64],
        b: NDArray[np.float64],
        starts: NDArray[np.float64],
        samples: int,
        most: int,
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return points of a test and which are free; not all once too many are not free."""
        shape = rounding_shape(A, b)
        points, free, hits = np.zeros((0, A.shape[1])), np.zeros(0, dtype=np.bool_), 0
        while len(points) < samples and hits <= most:
            count = min(_AT_ONCE, samples - len(points))
            more = self._points(A, b, starts, count, shape)
            points = np.concatenate([points, more])
            free = np.append(free, self._feasibility.free(more))
            hits = int((~free).sum())
        return points, free

    def _points(
        self,
        A: NDArray[np.float64],
        b: NDArray[np.float64],
        starts: NDArray[np.float64],
        count: int,
        shape: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return points of the region, walked to from some that are already spread out."""
        chosen = starts[self._generator.integers(len(starts), size=count)]
        return walked(A, b, chosen, self._options.mixing_steps, shape, self._generator)

    def _tell(self, number: int, hits: int, samples: int, faces: int) -> None:
        if self._options.verbose:
            print(  # noqa: T201 - asked for
                f"iris_zo: ellipsoid {self._ellipsoids}, round {number}: {hits} of {samples}"
                f" points are not free, {faces} faces"
            )


def _test_size(error: float, options: IrisZoOptions) -> tuple[int, int]:
    """Return the number of points of a test, and the most of them that may be not free.

    Of a share above epsilon, Chernoff's bound of so few hits is ``exp(-tau^2 epsilon N / 2)``.
    """
    samples = math.ceil(2.0 * math.log(1.0 / error) / (options.epsilon * options.tau**2))
    return samples, math.floor((1.0 - options.tau) * options.epsilon * samples)


def _likely(samples: int, most: int, asked: int) -> float:
    """Return the number of hits of some points below which the test passes but for bad luck.

    A region with more is not tested further: to fail costs the test nothing.
    """
    expected = most * min(1.0, asked / samples)
    return min(most, expected + 3.0 * math.sqrt(expected))


def bisected(
    feasibility: Feasibility,
    colliding: NDArray[np.float64],
    center: NDArray[np.float64],
    steps: int,
) -> NDArray[np.float64]:
    """Return configurations that are not free, on the ways ``(m, n)`` from a centre that is free.

    By halving each way, all at once; where it is free in between the half beyond is looked at.
    """
    low, high = np.zeros((2, len(colliding)))
    high += 1.0
    ways = colliding - center
    for _ in range(steps):
        middle = 0.5 * (low + high)
        free = feasibility.free(center + middle[:, np.newaxis] * ways)
        low, high = np.where(free, middle, low), np.where(free, high, middle)
    # Where no half was not free it is the end itself, without rounding.
    nearer = center + high[:, np.newaxis] * ways
    result: NDArray[np.float64] = np.where((high == 1.0)[:, np.newaxis], colliding, nearer)
    return result


def refuse_inside(inside: NDArray[np.float64] | None) -> None:
    """Raise RegionNotFoundError for a configuration that no face can keep out."""
    if inside is not None:
        raise RegionNotFoundError(
            f"configuration {inside.tolist()} is not free and in the hull of the points that must"
            " be inside; give points of which all between is free"
        )

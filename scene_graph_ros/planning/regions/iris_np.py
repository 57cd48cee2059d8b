"""Regions of configurations by counter-examples, which exact gradients of clearances lead to."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.iris.options import IrisOptions
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.intersection import Intersection
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.cliques.visibility_graph import checked_parallelism
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.regions.arguments import (
    checked_center,
    checked_domain_of,
    checked_points,
    ellipsoid_map,
)
from scene_graph_ros.planning.regions.counter_examples import descend, slide
from scene_graph_ros.planning.regions.errors import RegionError, RegionNotFoundError
from scene_graph_ros.planning.regions.faces import Cut, cut_between
from scene_graph_ros.planning.regions.feasibility import (
    checked_constraints,
    checked_obstacles,
    Feasibility,
)
from scene_graph_ros.planning.regions.hit_and_run import walked
from scene_graph_ros.planning.regions.iris_zo import bisected, refuse_inside
from scene_graph_ros.planning.regions.np_options import IrisNpOptions
from scene_graph_ros.planning.regions.outer_loop import Attempt, grow, rounding_shape
from scene_graph_ros.planning.regions.region_record import ConfigurationRegion, share_bound

__all__ = ["grow_np", "iris_in_configuration_space", "np_options"]

_FIRST_RADIUS = 1e-3
"""Of the ball about the sample, of which only the shape counts."""

_POINTS = 512
"""Of a round: they are checked, all at once."""

_SEARCHES = 8
"""Of these points, from which gradients are followed where all are free."""

_NEAREST = 16
"""Configurations of a round that slide along what they collide with."""

_MOST_ROUNDS = 1000
"""For an ellipsoid; in seven dimensions 60 to 300 are needed."""

_MOST_KNOWN = 300
"""Configurations that are not free, with which the next ellipsoid begins."""

_INFLUENCE = 0.2
"""Metres: pairs that are farther apart are not brought together."""

_HALVINGS = 10
_CONFIDENCE = 0.95


@overload
def iris_in_configuration_space(
    checker: CollisionChecker,
    sample: ArrayLike,
    options: IrisOptions = ...,
    *,
    domain: HPolyhedron | None = ...,
    certificate: Literal[False] = ...,
    timeout: float | None = ...,
    watch: Callable[[], object] | None = ...,
) -> HPolyhedron: ...


@overload
def iris_in_configuration_space(
    checker: CollisionChecker,
    sample: ArrayLike,
    options: IrisOptions = ...,
    *,
    domain: HPolyhedron | None = ...,
    certificate: Literal[True],
    timeout: float | None = ...,
    watch: Callable[[], object] | None = ...,
) -> ConfigurationRegion: ...


def iris_in_configuration_space(
    checker: CollisionChecker,
    sample: ArrayLike,
    options: IrisOptions | None = None,
    *,
    domain: HPolyhedron | None = None,
    certificate: bool = False,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> HPolyhedron | ConfigurationRegion:
    """Return a large polyhedron around a free configuration in which none was found not free.

    ``sample`` is ``(nq,)``, ``domain`` the box of the joints' limits unless given, and ``options``
    may be an `IrisNpOptions`. With its ``parameterization`` both are of the points that it takes,
    ``(k,)``. The checker must answer ``calc_robot_clearance``; its paddings are
    kept. With ``certificate`` a `ConfigurationRegion`, whose test is of points that made no face.
    After ``timeout`` (s) no further ellipsoid is tried; ``watch`` is called now and then and may
    raise.

    Raises RegionError for a sample that is not free or not in the domain, a domain that is not
    bounded, and robots that float; RegionNotFoundError where searches did not end, OutOfTimeError
    where they did not in time.
    """
    deadline = Deadline.of(timeout, watch, RegionError)
    chosen = np_options(options)
    parameterization = chosen.parameterization
    box = checked_domain_of(parameterization, checker, domain)
    if chosen.bounding_region is not None:
        both = box.intersection(chosen.bounding_region)
        box = checked_domain_of(parameterization, checker, both)
    n = box.ambient_dimension
    (center,) = checked_points("sample", sample, n)[:1]
    feasibility = Feasibility(
        checker,
        checked_obstacles(chosen.configuration_obstacles, checker.model.tree.num_positions),
        checked_constraints(chosen.additional_constraints),
        checked_parallelism(checker, chosen.parallelism),
        parameterization,
        deadline,
    )
    checked_center(feasibility, box, center, "sample")
    B, about = _FIRST_RADIUS * np.eye(n), center
    if chosen.starting_ellipse is not None:
        B, about = ellipsoid_map(chosen.starting_ellipse, n)
        checked_center(feasibility, box, about, "starting_ellipse: the centre")
    kept = center[np.newaxis] if chosen.require_sample_point_is_contained else np.zeros((0, n))
    found = grow_np(feasibility, box, B, about, kept, chosen)
    return found if certificate else found.region


def np_options(options: IrisOptions | None) -> IrisNpOptions:
    """Return options of `iris` with the defaults of all others."""
    if isinstance(options, IrisNpOptions):
        return options
    return IrisNpOptions(**({} if options is None else vars(options)))


def grow_np(
    feasibility: Feasibility,
    domain: HPolyhedron,
    B: NDArray[np.float64],
    center: NDArray[np.float64],
    kept: NDArray[np.float64],
    options: IrisNpOptions,
) -> ConfigurationRegion:
    """Return a region around an ellipsoid ``{B u + center}`` for arguments that were checked."""
    searches = _Searches(feasibility, domain, kept, options)
    most = options.iteration_limit
    return grow(feasibility, B, center, kept, options, most, searches.attempt)


class _Searches:
    """Rounds of searches and faces, for one ellipsoid after the other."""

    def __init__(
        self,
        feasibility: Feasibility,
        domain: HPolyhedron,
        kept: NDArray[np.float64],
        options: IrisNpOptions,
    ) -> None:
        self._feasibility, self._domain, self._kept = feasibility, domain, kept
        self._options, self._tests = options, 0
        self._generator = np.random.default_rng(options.random_seed)
        self._known = np.zeros((0, domain.ambient_dimension))
        self._rounds = options.num_collision_infeasible_samples
        if options.additional_constraints is not None:
            more = options.num_additional_constraint_infeasible_samples
            self._rounds = max(self._rounds, more)

    def attempt(self, B: NDArray[np.float64], center: NDArray[np.float64]) -> Attempt:
        """Return the domain cut at counter-examples around an ellipsoid, and its test."""
        cut = Cut(B, center, self._kept)
        A, b = self._domain.A, self._domain.b
        starts, failures, shape = center[np.newaxis], 0, None
        # Those of ellipsoids before are met at once.
        colliding = self._known
        for _ in range(_MOST_ROUNDS):
            if len(colliding):
                A, b = self._cut(cut, A, b, colliding)
                inside = (starts @ A.T <= b).all(axis=1)
                starts = starts[inside] if inside.any() else self._start(center, A, b)
            chosen = starts[self._generator.integers(len(starts), size=_POINTS)]
            steps = self._options.mixing_steps
            starts = walked(A, b, chosen, steps, B if shape is None else shape, self._generator)
            colliding = self._search(cut, A, b, starts)
            failures = 0 if len(colliding) else failures + 1
            if failures == self._rounds:
                # Walks of the region's shape go everywhere in it; a few faces more change little.
                shape = rounding_shape(A, b) if shape is None else shape
                tested, points, free = self._tested(A, b, starts, shape)
                if free.all():
                    return tested
                # Rounds go on from points that are spread as those which found something.
                colliding, starts, failures = points[~free], points[free], 0
        raise RegionNotFoundError(
            f"iris_in_configuration_space: after {_MOST_ROUNDS} rounds and {len(b)} faces there"
            " are still configurations that are not free; raise configuration_space_margin"
        )

    def _start(
        self, center: NDArray[np.float64], A: NDArray[np.float64], b: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return a point to walk from; the centre is inside but for the margin."""
        for point in (center, *self._kept):
            if (A @ point <= b).all():
                return point[np.newaxis]
        raise RegionNotFoundError(
            f"iris_in_configuration_space: the centre {center.tolist()} is nearer than"
            f" configuration_space_margin {self._options.configuration_space_margin} to what is"
            " not free; lower it, or set require_sample_point_is_contained"
        )

    def _search(
        self,
        cut: Cut,
        A: NDArray[np.float64],
        b: NDArray[np.float64],
        points: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return configurations of the region that are not free, ``(k, n)``, if some are found."""
        free = self._feasibility.free(points)
        if not free.all():
            return points[~free]
        found: list[NDArray[np.float64]] = []
        for q in points[:_SEARCHES]:
            found += descend(self._feasibility, cut, A, b, q, _INFLUENCE)
        # With a parameterization they are among the pairs of gradients.
        is_own = self._feasibility.parameterization is None
        for obstacle in self._feasibility.obstacles if is_own else ():
            shared = Intersection([HPolyhedron(A, b), obstacle]).maybe_get_feasible_point()
            if shared is not None and not self._feasibility.free(shared[np.newaxis])[0]:
                found.append(shared)
        return np.array(found).reshape(len(found), points.shape[1])

    def _cut(
        self,
        cut: Cut,
        A: NDArray[np.float64],
        b: NDArray[np.float64],
        colliding: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        margin = self._options.configuration_space_margin
        left = bisected(self._feasibility, colliding, cut.center, _HALVINGS)
        # Faces at what has slid as near as it goes leave more inside than those at the others.
        while len(left):
            order = np.argsort(cut.distances(left), kind="stable")[:_NEAREST]
            slid = np.array(
                [slide(self._feasibility, cut, A, b, q, _INFLUENCE) for q in left[order]]
            )
            if len(self._known) < _MOST_KNOWN:
                self._known = np.concatenate([self._known, slid])
            normals, sides, inside = cut_between(cut, slid, margin, -1)
            refuse_inside(inside)
            A, b = np.concatenate([A, normals]), np.append(b, sides)
            left = np.delete(left, order, axis=0)
            left = left[(left @ np.array(normals).T <= np.array(sides)).all(axis=1)]
        return A, b

    def _tested(
        self,
        A: NDArray[np.float64],
        b: NDArray[np.float64],
        starts: NDArray[np.float64],
        shape: NDArray[np.float64],
    ) -> tuple[Attempt, NDArray[np.float64], NDArray[np.bool_]]:
        """Return the region with a test of new points, these, and which of them are free.

        Each test has its share of the error.
        """
        self._tests += 1
        count = self._options.num_test_samples
        chosen = starts[self._generator.integers(len(starts), size=count)]
        steps = max(50, self._options.mixing_steps)
        points = walked(A, b, chosen, steps, shape, self._generator)
        free = self._feasibility.free(points)
        hits = int((~free).sum())
        error = (1.0 - _CONFIDENCE) * 6.0 / (math.pi * self._tests) ** 2
        bound = share_bound(count, hits, error)
        tested = Attempt(HPolyhedron(A, b), count, hits, bound, _CONFIDENCE, self._tests)
        return tested, points, free

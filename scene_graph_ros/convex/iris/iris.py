"""The largest ellipsoid among convex obstacles, and the faces around it: IRIS.

Deits and Tedrake, "Computing large convex regions of obstacle-free space through semidefinite
programming", 2014: faces that touch the obstacles where these are nearest to an ellipsoid, then
the largest ellipsoid within the faces, in turn. Each face is put where its obstacle ends as floats
can bound it, and a little further in, so that no point of an obstacle is in the region.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import heapq
from typing import Any, Literal, overload

import numpy as np

from scene_graph_ros.convex.errors import (
    ConvexSetError,
    SampleError,
    SolverError,
)
from scene_graph_ros.convex.iris.obstacles import Obstacles
from scene_graph_ros.convex.iris.options import IrisOptions
from scene_graph_ros.convex.questions.arguments import as_list, as_vector
from scene_graph_ros.convex.questions.axes import unit_ball_volume
from scene_graph_ros.convex.questions.certificates import Certificate
from scene_graph_ros.convex.questions.ellipsoids import Extremal, inscribed
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["IrisRegion", "Separation", "iris"]

_FIRST_RADIUS = 1e-3
"""Relative to the domain's size: of the ball about the sample, of which only the shape counts."""

_INWARD = 1e-12
"""Relative to the largest coordinate: how much further in than its obstacle each face is."""


@one_line()
@dataclass(frozen=True)
class Separation:
    """Obstacle ``obstacle`` is beyond row ``row`` of the region."""

    obstacle: int
    row: int
    certificate: Certificate
    """Weights of the row and of the obstacle's own rows that contradict each other."""


@one_line()
@dataclass(frozen=True)
class IrisRegion:
    """A region, the proof that it is free, and its history."""

    region: HPolyhedron
    separations: tuple[Separation, ...]
    """One for each obstacle that is not empty."""
    ellipsoid: Hyperellipsoid | None
    """The largest in the region; None where that is too thin for one."""
    volumes: tuple[float, ...]
    """Of the largest ellipsoid in each region that was made."""
    reason: str
    """Why growing ended: ``converged``, ``iterations``, ``sample``, ``termination_func``, or
    ``thin``: the region is so thin that floats don't know its ellipsoid, or the next one."""


@overload
def iris(
    obstacles: Sequence[Any],
    sample: Any,
    domain: HPolyhedron,
    options: IrisOptions = ...,
    *,
    certificate: Literal[False] = ...,
) -> HPolyhedron: ...


@overload
def iris(
    obstacles: Sequence[Any],
    sample: Any,
    domain: HPolyhedron,
    options: IrisOptions = ...,
    *,
    certificate: Literal[True],
) -> IrisRegion: ...


def iris(
    obstacles: Sequence[Any],
    sample: Any,
    domain: HPolyhedron,
    options: IrisOptions | None = None,
    *,
    certificate: bool = False,
) -> HPolyhedron | IrisRegion:
    """Return a large polyhedron in a bounded domain that has no point of any obstacle.

    ``obstacles`` are `ConvexSet`s and ``sample`` ``(n,)`` a point outside of all, in the
    coordinates of the domain. The region's rows are those of the domain, of
    ``options.bounding_region`` and one for each obstacle that needs its own. With ``certificate``
    an `IrisRegion`, in which each obstacle has the row that keeps it out and the proof. The first
    region holds the sample; later ones may not, see `IrisOptions`.

    Raises ConvexSetError for a sample that is not free or not in the domain, and for an unbounded
    domain; SolverError where no face could be put between an obstacle and the ellipsoid.
    """
    if options is not None and not isinstance(options, IrisOptions):
        raise ConvexSetError(f"iris: options must be IrisOptions or None, not {quoted(options)}")
    given = as_list(obstacles, "iris: obstacles")
    grower = _Grower(given, sample, domain, options or IrisOptions())
    grower.grow()
    return grower.record() if certificate else grower.region


class _Grower:
    """A region on its way."""

    def __init__(
        self, obstacles: Sequence[Any], sample: Any, domain: Any, options: IrisOptions
    ) -> None:
        self._options = options
        self._domain = _whole_domain(domain, options)
        n = self._domain.ambient_dimension
        if self._domain.is_empty():
            raise ConvexSetError("iris: the domain is empty")
        self._sample = as_vector(sample, "iris: sample", n)
        if not self._domain.point_in_set(self._sample, 0.0):
            raise ConvexSetError(
                f"iris: sample {self._sample.tolist()} is outside the domain by"
                f" {float(self._domain.projection(self._sample[None]).distances[0]):.3g}"  # type: ignore[union-attr]
            )
        box = _box_around(self._domain, options)
        self._obstacles = Obstacles(obstacles, box)
        self._width = float((box.ub - box.lb).max(initial=0.0))
        size = max(float(np.abs([box.lb, box.ub]).max(initial=0.0)), self._obstacles.size())
        self._inward = _INWARD * size
        self.region, self._rows_of = self._domain, np.zeros(0, dtype=np.int64)
        self._ellipsoid: Extremal | None = None
        self._volumes: list[float] = []
        self._reason = ""

    def grow(self) -> None:
        """Make regions until one of the reasons to end comes up."""
        options = self._options
        B, center = self._first_ellipsoid()
        while not self._reason:
            try:
                region, rows_of = self._separate(B, center)
            except SolverError:
                if not self._volumes:
                    raise
                self._reason = "thin"
                break
            if options.require_sample_point_is_contained and not region.point_in_set(
                self._sample, 0.0
            ):
                self._end_without_sample()
                break
            if options.termination_func is not None and options.termination_func(region):
                self._end_by_caller()
                break
            self.region, self._rows_of = region, rows_of
            try:
                found = inscribed(region)
            except (ConvexSetError, SolverError):
                self._reason = "thin"
                break
            self._ellipsoid, B, center = found, found.B, found.center
            self._take_volume(unit_ball_volume(len(center)) * abs(float(np.linalg.det(B))))

    def _end_by_caller(self) -> None:
        self._reason = "termination_func"
        if not self._volumes:
            raise ConvexSetError(
                "iris: termination_func is true of the first region already, so that there is"
                " none to return"
            )

    def _end_without_sample(self) -> None:
        self._reason = "sample"
        if not self._volumes:
            raise ConvexSetError(
                f"iris: sample {self._sample.tolist()} is not in the first region, which is around"
                " starting_ellipse; leave that out"
            )

    def _first_ellipsoid(self) -> tuple[np.ndarray, np.ndarray]:
        start: Any = self._options.starting_ellipse
        n = len(self._sample)
        if start is None:
            return _FIRST_RADIUS * (self._width or 1.0) * np.eye(n), self._sample
        if not isinstance(start, Hyperellipsoid) or start.ambient_dimension != n:
            raise ConvexSetError(
                f"IrisOptions: starting_ellipse must be a Hyperellipsoid in {n} dimensions, not"
                f" {quoted(start)}"
            )
        ball = AffineBall(start)
        return ball.B, ball.center

    def _take_volume(self, volume: float) -> None:
        """Note the volume of the newest region's ellipsoid, and see whether growing ends."""
        best = max(self._volumes, default=0.0)
        self._volumes.append(volume)
        options, growth, is_first = self._options, volume - best, len(self._volumes) == 1
        least, share = options.termination_threshold, options.relative_termination_threshold
        is_small = (growth <= least and least >= 0.0) or (growth <= share * best and share >= 0.0)
        if self._reason:
            return
        if not is_first and is_small:
            self._reason = "converged"
        elif len(self._volumes) >= options.iteration_limit:
            self._reason = "iterations"

    def _separate(self, B: np.ndarray, center: np.ndarray) -> tuple[HPolyhedron, np.ndarray]:
        """Return the domain cut at the obstacles, nearest first, and the row of each of these."""
        obstacles = self._obstacles
        least = obstacles.nearest_bounds(B, center)
        alive = np.isfinite(least)
        rows_of = np.full(len(least), -1, dtype=np.int64)
        # Obstacles wait with a bound of how near they are, once they are first with the distance.
        waiting: list[tuple[float, int, np.ndarray | None]] = [
            (float(least[k]), int(k), None) for k in np.flatnonzero(alive)
        ]
        heapq.heapify(waiting)
        normals: list[np.ndarray] = []
        sides: list[float] = []
        while waiting:
            _, k, nearest = heapq.heappop(waiting)
            if not alive[k]:
                continue
            if nearest is None:
                nearest = obstacles.nearest(k, B, center)
                away = float(np.linalg.norm(np.linalg.solve(B, nearest - center)))
                heapq.heappush(waiting, (away, k, nearest))
                continue
            normal, side = self._face(k, nearest, B, center)
            row = len(self._domain.b) + len(sides)
            normals.append(normal)
            sides.append(side)
            hidden = obstacles.beyond(alive, normal, side + self._inward)
            hidden[k] = True
            rows_of[hidden], alive[hidden] = row, False
        A = np.concatenate([self._domain.A, np.array(normals).reshape(len(normals), len(center))])
        return HPolyhedron(A, np.append(self._domain.b, sides)), rows_of

    def _face(
        self, k: int, nearest: np.ndarray, B: np.ndarray, center: np.ndarray
    ) -> tuple[np.ndarray, float]:
        """Return the face, of a unit normal, that has an obstacle behind it and the centre before.

        Square to the way from the ellipsoid as it measures, then, where rounding leaves too little
        of that, square to the way itself.
        """
        way = nearest - center
        for normal in (np.linalg.solve(B.T, np.linalg.solve(B, way)), way):
            length = float(np.linalg.norm(normal))
            if not 0.0 < length < np.inf:
                continue
            unit = normal / length
            side = self._obstacles.floor(k, unit) - self._inward
            if side > float(unit @ center):
                return unit, side
        depth = float(np.linalg.norm(way))
        where = (
            "sample" if not self._volumes and self._options.starting_ellipse is None else "centre"
        )
        message = (
            f"iris: {where} {center.tolist()} is in or at {self._obstacles.label(k)}, {depth:.3g}"
            " from its nearest point"
        )
        if self._volumes:
            raise SolverError(message)
        raise SampleError(message, k)

    def record(self) -> IrisRegion:
        """Prove that each obstacle is beyond its row."""
        separations = []
        for k, row in enumerate(self._rows_of.tolist()):
            if row < 0:
                continue
            shown = self._obstacles.beyond_proven(k, self.region.A[row], float(self.region.b[row]))
            if shown.kind != "farkas":
                raise SolverError(
                    f"iris: {self._obstacles.label(k)} could not be shown to be beyond its face"
                )
            separations.append(Separation(k, row, shown))
        ellipsoid = self._ellipsoid
        return IrisRegion(
            self.region,
            tuple(separations),
            None
            if ellipsoid is None
            else Hyperellipsoid(AffineBall(ellipsoid.B, ellipsoid.center)),
            tuple(self._volumes),
            self._reason,
        )


def _whole_domain(domain: Any, options: IrisOptions) -> HPolyhedron:
    whole = domain
    for label, each in (("iris: domain", domain), ("bounding_region", options.bounding_region)):
        if label == "bounding_region" and each is None:
            continue
        if not isinstance(each, HPolyhedron):
            raise ConvexSetError(f"{label} must be an HPolyhedron, not {quoted(each)}")
        if each is not domain:
            whole = domain.intersection(each)
    return whole


def _box_around(domain: HPolyhedron, options: IrisOptions) -> Hyperrectangle:
    """Return the box around a domain, from supports alone where its boundedness is known."""
    if options.verify_domain_boundedness and not domain.is_bounded():
        raise ConvexSetError(
            "iris: the domain is unbounded; intersect it with a box, HPolyhedron.make_box"
        )
    axes = np.eye(domain.ambient_dimension)
    low, high = ([domain.support(sign * e) for e in axes] for sign in (-1.0, 1.0))
    return Hyperrectangle([-r.value - r.gap for r in low], [r.value + r.gap for r in high])

"""What convex sets and graphs of them cost, beside Drake: ``python -m benchmarks.convex_sets``.

One thread. Each row asks the same random polytopes, made anew for each question, as a set
remembers what was found of it, or the same maze. Answers are compared before times are taken;
where they differ, the row says so. Without pydrake only ours is measured, and that is said;
``make peers`` installs it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
import itertools
import os
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.mazes import doors_of, drakes_graph, our_graph  # noqa: E402
from benchmarks.random_polytopes import half_redundant, polytope  # noqa: E402
from scene_graph_ros.geometry.optimization import (  # noqa: E402
    compute_pairwise_intersections,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    iris,
    VPolytope,
)

__all__ = ["SIZES", "Row", "main", "measure"]

SIZES = ((2, 24), (3, 36), (7, 64), (14, 128))
"""Dimensions and rows of the polytopes."""

OBSTACLES = (10, 100, 1000)
"""How many of them a region is grown among, in two and three dimensions."""

MAZES = (5, 10, 20, 30, 50)
"""Cells along a side of mazes that paths are sought in, in two dimensions."""

MANY = {2: 1000, 7: 300}
"""By dimension how many sets are asked which of them meet."""

_SAMPLES, _STEPS = 1000, 50
"""Points that are drawn, and steps between two of them."""

_COVERED, _COVERING = 5000, 30
"""Points of which sets tell whether they are inside, and the sets."""

_POINTS = 100
_SAME = 1e-6
"""Relative difference up to which results count as equal: the promise of Drake's solvers."""

_ROUGH = 0.01
"""The gap that is asked for where a path need not be the best."""

_MOST_REPEATS = 200


@dataclass(frozen=True)
class Row:
    """One question of one polytope; times in microseconds, NaN where nobody was asked."""

    what: str
    dimension: int
    rows: int
    ours: float
    theirs: float
    agree: str


def _microseconds(ask: Callable[[], Any], seconds: float) -> float:
    """Return the least time of a call."""
    best, end = np.inf, time.perf_counter() + seconds
    for _ in range(_MOST_REPEATS):
        begin = time.perf_counter()
        ask()
        best = min(best, time.perf_counter() - begin)
        if time.perf_counter() > end:
            break
    return best * 1e6


def _drake() -> Any:
    try:
        import pydrake.geometry.optimization as drake
    except ImportError:
        return None
    return drake


def _log_volume(ellipsoid: Any) -> float:
    A = ellipsoid.A if isinstance(ellipsoid, Hyperellipsoid) else ellipsoid.A()
    return -float(np.linalg.slogdet(A)[1])


def _questions(
    rng: np.random.Generator, n: int, m: int, drake: Any
) -> Iterator[tuple[str, Callable[[], Any], Callable[[], Any]]]:
    """Name each question, with how we and Drake are asked; both return comparable numbers."""
    A, b = polytope(rng, n, m)
    C, d = polytope(rng, n, m)
    R, r = half_redundant(np.random.default_rng(n), n, m)
    d = d + C @ np.full(n, 0.9)
    away, apart = b + A @ np.full(n, 10.0), d + C @ np.full(n, 4.0)
    points = 2.0 * rng.normal(size=(_POINTS, n))
    cloud = rng.normal(size=(200, n))

    def ours() -> HPolyhedron:
        return HPolyhedron(A, b)

    def theirs() -> Any:
        return drake.HPolyhedron(A, b)

    def radius(center: np.ndarray) -> float:
        return float((b - A @ center).min())

    def distances() -> Any:
        found = ours().projection(points)
        return None if found is None else found.distances

    yield "is_empty", lambda: ours().is_empty(), lambda: theirs().IsEmpty()
    yield (
        "is_empty, away from the origin",
        lambda: HPolyhedron(A, away).is_empty(),
        lambda: drake.HPolyhedron(A, away).IsEmpty(),
    )
    yield "is_bounded", lambda: ours().is_bounded(), lambda: theirs().IsBounded()
    yield (
        "intersects_with",
        lambda: ours().intersects_with(HPolyhedron(C, d)),
        lambda: theirs().IntersectsWith(drake.HPolyhedron(C, d)),
    )
    yield (
        "intersects_with, apart",
        lambda: ours().intersects_with(HPolyhedron(C, apart)),
        lambda: theirs().IntersectsWith(drake.HPolyhedron(C, apart)),
    )
    yield (
        "contained_in",
        lambda: ours().contained_in(HPolyhedron(C, d)),
        lambda: theirs().ContainedIn(drake.HPolyhedron(C, d)),
    )
    yield (
        "chebyshev_center, radius",
        lambda: radius(ours().chebyshev_center()),
        lambda: radius(theirs().ChebyshevCenter()),
    )
    yield (
        "axis-aligned box",
        lambda: Hyperrectangle.maybe_calc_axis_aligned_bounding_box(ours()).ub,  # type: ignore[union-attr]
        lambda: drake.Hyperrectangle.MaybeCalcAxisAlignedBoundingBox(theirs()).ub(),
    )
    yield (
        "reduce_inequalities, rows",
        lambda: len(ours().reduce_inequalities().b),
        lambda: len(theirs().ReduceInequalities().b()),
    )
    yield (
        "reduce_inequalities, half redundant, rows",
        lambda: len(HPolyhedron(R, r).reduce_inequalities().b),
        lambda: len(drake.HPolyhedron(R, r).ReduceInequalities().b()),
    )
    yield (
        f"projection of {_POINTS} points",
        distances,
        lambda: np.array(theirs().Projection(points.T)[0]),
    )
    yield (
        "inscribed ellipsoid, log volume",
        lambda: _log_volume(ours().maximum_volume_inscribed_ellipsoid()),
        lambda: _log_volume(theirs().MaximumVolumeInscribedEllipsoid()),
    )
    yield (
        "circumscribed ellipsoid of 200 points",
        lambda: _log_volume(Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(cloud)),
        lambda: _log_volume(drake.Hyperellipsoid.MinimumVolumeCircumscribedEllipsoid(cloud.T)),
    )
    if n <= 3:
        yield (
            "vertices, number",
            lambda: len(VPolytope(ours()).vertices),
            lambda: drake.VPolytope(theirs()).vertices().shape[1],
        )


def _many(
    rng: np.random.Generator, n: int, m: int, count: int, drake: Any
) -> Iterator[tuple[str, Callable[[], Any], Callable[[], Any]]]:
    """Name each question about many sets or points, whose answers are compared by numbers."""
    # As many neighbours in two dimensions as in seven.
    sides = np.full(n, 8.0 if n == 2 else 1.5)
    asked = []
    for center in rng.uniform(-sides, sides, (count, n)):
        A, b = polytope(rng, n, m)
        asked.append((A, 0.5 * b + A @ center))
    points = rng.uniform(-1.5, 1.5, (_COVERED, n))
    about = [(A, b + A @ rng.uniform(-0.5, 0.5, n)) for A, b in
             (polytope(rng, n, m) for _ in range(_COVERING))]  # fmt: skip
    A, b = polytope(rng, n, m)

    def numbered(pairs: Any) -> np.ndarray:
        """Return how many pairs there are, and a sum that tells them apart."""
        return np.array([len(pairs), sum(count * i + j for i, j in pairs)])

    yield (
        f"pairwise intersections of {count}",
        lambda: numbered(compute_pairwise_intersections([HPolyhedron(*of) for of in asked])[0]),
        lambda: numbered(
            drake.ComputePairwiseIntersections([drake.HPolyhedron(*of) for of in asked], [])[0]
        ),
    )

    def theirs_drawn() -> float:
        from pydrake.common import RandomGenerator

        body, generator, at, inside = drake.HPolyhedron(A, b), RandomGenerator(1), np.zeros(n), 0
        for _ in range(_SAMPLES):
            at = body.UniformSample(generator, previous_sample=at, mixing_steps=_STEPS)
            inside += body.PointInSet(at)
        return inside / _SAMPLES

    def ours_drawn() -> float:
        body, generator = HPolyhedron(A, b), np.random.default_rng(1)
        drawn = body.uniform_samples(generator, _SAMPLES, mixing_steps=_STEPS)
        return float(body.point_in_set(drawn.points).mean())

    yield f"{_SAMPLES} samples, inside", ours_drawn, theirs_drawn
    ours_about = [HPolyhedron(*of) for of in about]
    theirs_about = [drake.HPolyhedron(*of) for of in about] if drake is not None else []
    yield (
        f"{_COVERED} points in {_COVERING} sets",
        lambda: sum(int(each.point_in_set(points).sum()) for each in ours_about),
        lambda: sum(each.PointInSet(point) for each in theirs_about for point in points),
    )


def _scattered(
    rng: np.random.Generator, n: int, count: int, drake: Any
) -> dict[str, tuple[list[Any], list[Any]]]:
    """Return hulls and balls about the origin, which is free, as ours and as Drake's."""
    hulls: tuple[list[Any], list[Any]] = ([], [])
    balls: tuple[list[Any], list[Any]] = ([], [])
    while len(hulls[0]) < count:
        center, radius = rng.uniform(-1.0, 1.0, n), rng.uniform(0.2, 0.6) * count ** (-1.0 / n)
        if np.linalg.norm(center) < 2.0 * radius + 0.02:
            continue
        ways = rng.normal(size=(8, n))
        corners = center + radius * ways / np.linalg.norm(ways, axis=1)[:, None]
        hulls[0].append(VPolytope(corners))
        balls[0].append(Hyperellipsoid.make_hypersphere(radius, center))
        if drake is not None:
            hulls[1].append(drake.VPolytope(corners.T))
            balls[1].append(drake.Hyperellipsoid.MakeHypersphere(radius, center))
    return {"hulls": hulls, "balls": balls}


def _regions(
    rng: np.random.Generator, n: int, count: int, drake: Any
) -> Iterator[tuple[str, Callable[[], Any], Callable[[], Any]]]:
    """Name each question about obstacles; both return the log volume of the ellipsoid inside."""
    low, high = -np.ones(n), np.ones(n)

    def ours(obstacles: list[Any]) -> float:
        region = iris(obstacles, np.zeros(n), HPolyhedron.make_box(low, high))
        return _log_volume(region.maximum_volume_inscribed_ellipsoid())

    def theirs(obstacles: list[Any]) -> float:
        try:
            region = drake.Iris(obstacles, np.zeros(n), drake.HPolyhedron.MakeBox(low, high))
        except RuntimeError:
            return np.nan
        return _log_volume(region.MaximumVolumeInscribedEllipsoid())

    for kind, (mine, other) in _scattered(rng, n, count, drake).items():
        yield f"iris, {count} {kind}", lambda o=mine: ours(o), lambda o=other: theirs(o)  # type: ignore[misc]


def _paths(rng: np.random.Generator, size: int, drake: Any) -> Iterator[tuple[Any, ...]]:
    """Name each question about a maze; both return a cost, or a bound of it.

    Behind the answers up to which relative difference they are the same, if that is not usual.

    Drake adds constraints for two edges between the same sets, so that its bound may be higher.
    What we prove is best is compared with its rounded path: to prove more it needs a licence.
    """
    doors = doors_of(rng, size)
    graph, start, goal = our_graph(doors, size)
    asked = drakes_graph(doors, size, drake) if drake is not None else None

    def ours(most: int) -> float:
        options = GraphOfConvexSetsOptions(convex_relaxation=True, max_rounded_paths=most)
        result = graph.solve_shortest_path(start, goal, options)
        return result.cost if most else result.lower_bound

    def theirs(most: int) -> float:
        options = drake.GraphOfConvexSetsOptions()
        options.convex_relaxation, options.max_rounded_paths = True, most
        other, u, v = asked  # type: ignore[misc]
        return float(other.SolveShortestPath(u, v, options).get_optimal_cost())

    def best(gap: float) -> float:
        options = GraphOfConvexSetsOptions(gap_tolerance=gap)
        result = graph.solve_shortest_path(start, goal, options)
        assert result.gap <= gap * result.cost, "the gap is not what was asked for"
        return result.cost

    yield f"relaxation, {size}x{size} maze", lambda: ours(0), lambda: theirs(0)
    yield f"rounded path, {size}x{size} maze", lambda: ours(5), lambda: theirs(5)
    yield f"path, ours proven, {size}x{size} maze", lambda: best(_SAME), lambda: theirs(5)
    way = graph.solve_shortest_path(start, goal, GraphOfConvexSetsOptions(gap_tolerance=_ROUGH))
    places = {edge.id: k for k, edge in enumerate(graph.edges)}
    mine = [graph.edges[places[number]] for number in way.path]
    their_edges = [] if asked is None else asked[0].Edges()
    same = [their_edges[places[number]] for number in way.path] if asked is not None else []
    yield (
        f"points of a path, {size}x{size} maze",
        lambda: graph.solve_convex_restriction(mine).cost,
        lambda: float(asked[0].SolveConvexRestriction(same).get_optimal_cost()),  # type: ignore[index]
    )
    ours_rough = lambda: best(_ROUGH)  # noqa: E731
    yield f"path, gap of 1 %, {size}x{size} maze", ours_rough, lambda: theirs(5), _ROUGH


def measure(
    sizes: Sequence[tuple[int, int]] = SIZES,
    seconds: float = 0.5,
    seed: int = 1,
    obstacles: Sequence[int] = OBSTACLES,
    mazes: Sequence[int] = MAZES[:3],
    many: Mapping[int, int] = MANY,
) -> Iterator[Row]:
    """Ask everything of a polytope of each size, of regions among so many obstacles, of mazes.

    Of ``many`` sets by dimension which of them meet. Ours and Drake's in turn.
    """
    drake = _drake()

    def draw(*numbers: int) -> np.random.Generator:
        # Its own for each: how often points are drawn depends on the time that takes.
        return np.random.default_rng((seed, *numbers))

    for n, m in sizes:
        rng = np.random.default_rng(seed)
        asked: Iterator[tuple[Any, ...]] = _questions(rng, n, m, drake)
        if n <= 3:
            among = (_regions(draw(n, k), n, k, drake) for k in obstacles)
            asked = itertools.chain(asked, *among)
        if n in many:
            asked = itertools.chain(asked, _many(draw(n), n, m, many[n], drake))
        if n == 2:
            asked = itertools.chain(asked, *(_paths(draw(k), k, drake) for k in mazes))
        for what, ours, theirs, *tolerance in asked:
            same = tolerance[0] if tolerance else _SAME
            answer = ours()
            agree, theirs_us = "alone", np.nan
            if drake is not None:
                other = theirs()
                agree = "yes" if np.allclose(answer, other, same, same) else "NO"
                agree = "Drake FAILS" if np.isnan(other).any() else agree
                theirs_us = _microseconds(theirs, seconds)
            yield Row(what, n, m, _microseconds(ours, seconds), theirs_us, agree)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.convex_sets", description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.5, help="for each row and engine")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=14, help="dimensions")
    parser.add_argument("--most-obstacles", type=int, default=1000)
    parser.add_argument("--most-cells", type=int, default=20, help="along a side of mazes")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    if _drake() is None:
        print("pydrake is not installed, so only ours is measured; make peers installs it")
    print(f"{'what':38} {'n/rows':>7} {'ours (us)':>11} {'Drake (us)':>11} {'ratio':>6} same")
    sizes = [size for size in SIZES if size[0] <= options.most]
    obstacles = [count for count in OBSTACLES if count <= options.most_obstacles]
    mazes = [size for size in MAZES if size <= options.most_cells]
    for row in measure(sizes, options.seconds, options.seed, obstacles, mazes):
        size = f"{row.dimension}/{row.rows}"
        print(
            f"{row.what:38} {size:>7} {row.ours:11.1f} {row.theirs:11.1f}"
            f" {row.theirs / row.ours:6.2f} {row.agree}"
        )
    print(machine(load), end="")


if __name__ == "__main__":
    main()

"""Error against time of questions about convex sets: ``python -m benchmarks.sets_errors``.

Each question is asked of turned and shifted boxes of several sizes, and of several widths along
one of their axes; the truth follows from their construction. One thread, the least processor time
of some calls, each with the making of its sets. Writes ``sets_errors.csv`` and
``sets_errors.png``; without pydrake only ours, which it says.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import csv
from dataclasses import dataclass
import itertools
import logging
import math
import os
from pathlib import Path
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from scene_graph_ros.geometry.optimization import (  # noqa: E402
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    norm,
    Point,
    VPolytope,
)

__all__ = ["QUESTIONS", "Row", "main", "measure"]

_DOCS = Path(__file__).parents[1] / "docs"
SIZES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
"""Metres."""
WIDTHS = (1.0, 1e-2, 1e-4)
"""Of the box along one axis, beside the others."""
_REPEATS = 3

QUESTIONS = (
    "Chebyshev centre",
    "projection",
    "bounding box",
    "vertices",
    "volume",
    "inscribed ellipsoid",
    "circumscribed ellipsoid",
    "scaling to touch",
    "shortest path",
)


@dataclass(frozen=True)
class Box:
    """``|Q (x - center)| <= half``: rows A, b, and corners ``(8, 3)``."""

    Q: np.ndarray
    center: np.ndarray
    half: np.ndarray
    size: float

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``A (6, 3)`` and ``b (6,)``."""
        A = np.concatenate([self.Q, -self.Q])
        return A, A @ self.center + np.tile(self.half, 2)

    @property
    def corners(self) -> np.ndarray:
        """Return the corners."""
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
        return self.center + (signs * self.half) @ self.Q


@dataclass(frozen=True)
class Row:
    """What one engine said of one box: relative error, NaN where it failed, and seconds."""

    engine: str
    question: str
    size: float
    width: float
    error: float
    seconds: float


def box_of(size: float, width: float) -> Box:
    """Return a box that is turned by a fixed random turn."""
    Q, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    return Box(Q, size * np.array([0.3, -0.2, 0.5]), size * np.array([1.0, 0.6, width]), size)


_BEYOND = np.array([0.1, 0.2, 0.05])
"""Of the size: how far beyond a corner points and balls are."""


def error_of(question: str, box: Box, answer: Any) -> float:
    """Return how far an answer is from the truth of the construction, beside its size."""
    A, b = box.rows
    beyond = box.size * float(np.linalg.norm(_BEYOND))
    log_volume = float(np.log(box.half).sum())
    if question == "Chebyshev centre":
        return abs(float((b - A @ answer).min()) / float(box.half.min()) - 1.0)
    if question == "projection":
        return abs(answer / beyond - 1.0)
    if question == "bounding box":
        reach = np.abs(box.Q.T) @ box.half
        truth = np.concatenate([box.center - reach, box.center + reach])
        return float(np.abs(answer - truth).max()) / box.size
    if question == "vertices":
        apart = np.linalg.norm(box.corners[:, None] - answer[None], axis=2)
        return float(max(apart.min(axis=0).max(), apart.min(axis=1).max())) / box.size
    if question == "volume":
        return abs(answer / (8.0 * float(np.prod(box.half))) - 1.0)
    if question == "inscribed ellipsoid":
        return abs(answer - log_volume)
    if question == "circumscribed ellipsoid":
        return abs(answer - log_volume - 1.5 * math.log(3.0))
    if question == "scaling to touch":
        return abs(answer / (beyond / (0.01 * box.size)) - 1.0)
    return abs(answer / (10.0 * box.size) - 1.0)


def _far(box: Box) -> np.ndarray:
    """Return the point beyond a corner."""
    return box.center + (box.half + box.size * _BEYOND) @ box.Q


def _ours(question: str, box: Box) -> Any:
    A, b = box.rows
    if question == "Chebyshev centre":
        return HPolyhedron(A, b).chebyshev_center()
    if question == "projection":
        found = HPolyhedron(A, b).projection(_far(box)[None])
        return float(found.distances[0]) if found is not None else math.nan
    if question == "bounding box":
        around = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(HPolyhedron(A, b))
        return np.concatenate([around.lb, around.ub]) if around is not None else np.nan
    if question == "vertices":
        return VPolytope(HPolyhedron(A, b)).vertices
    if question == "volume":
        return HPolyhedron(A, b).calc_volume()
    if question == "inscribed ellipsoid":
        return -np.linalg.slogdet(HPolyhedron(A, b).maximum_volume_inscribed_ellipsoid().A)[1]
    if question == "circumscribed ellipsoid":
        around = Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(box.corners)
        return -np.linalg.slogdet(around.A)[1]
    if question == "scaling to touch":
        ball = Hyperellipsoid.make_hypersphere(0.01 * box.size, _far(box))
        return ball.minimum_uniform_scaling_to_touch(HPolyhedron(A, b))[0]
    graph = GraphOfConvexSets()
    s, m, t = (graph.add_vertex(each) for each in _stations(box, Point, HPolyhedron))
    for u, v in ((s, m), (m, t)):
        edge = graph.add_edge(u, v)
        edge.add_cost(norm(edge.xv - edge.xu))
    options = GraphOfConvexSetsOptions(convex_relaxation=True)
    return graph.solve_shortest_path(s, t, options).cost


def _stations(box: Box, point: Any, polyhedron: Any) -> list[Any]:
    """Return two points 8 sizes apart and a slab 3 away from their line: two sides of 5."""
    along, across, up = box.Q
    rows = np.stack([up, -up, across, -across, along, -along])
    mid = box.center
    width = box.half[2]
    # It begins 3 sizes above the straight way's middle, and is as thick as the box.
    reach = box.size * np.array([3.0, -3.0, 0.0, 0.0, 0.0, 0.0])
    reach += np.array([width, 0.0, box.size, box.size, box.size, box.size])
    ends = [mid - 4.0 * box.size * along, mid + 4.0 * box.size * along]
    return [point(ends[0]), polyhedron(rows, reach + rows @ mid), point(ends[1])]


def _drakes_path(box: Box, drake: Any) -> float:
    from pydrake.solvers import Binding, Cost, L2NormCost

    graph = drake.GraphOfConvexSets()
    sets = _stations(box, drake.Point, drake.HPolyhedron)
    s, m, t = (graph.AddVertex(each) for each in sets)
    for u, v in ((s, m), (m, t)):
        edge = graph.AddEdge(u, v)
        length = L2NormCost(np.concatenate([-np.eye(3), np.eye(3)], axis=1), np.zeros(3))
        edge.AddCost(Binding[Cost](length, np.concatenate([edge.xu(), edge.xv()])))
    options = drake.GraphOfConvexSetsOptions()
    options.convex_relaxation, options.max_rounded_paths = True, 5
    found = graph.SolveShortestPath(s, t, options)
    return float(found.get_optimal_cost()) if found.is_success() else math.nan


def _drake() -> Callable[[str, Box], Any] | None:
    try:
        import pydrake.geometry.optimization as drake
    except ImportError:
        return None
    logging.getLogger("drake").setLevel(logging.CRITICAL)

    def around(of: Any) -> np.ndarray:
        box = drake.Hyperrectangle.MaybeCalcAxisAlignedBoundingBox(of)
        return np.concatenate([box.lb(), box.ub()])

    def log_volume(ellipsoid: Any) -> float:
        return -float(np.linalg.slogdet(ellipsoid.A())[1])

    def touch(of: Any, box: Box) -> float:
        ball = drake.Hyperellipsoid.MakeHypersphere(0.01 * box.size, _far(box))
        return float(ball.MinimumUniformScalingToTouch(of)[0])

    answers: dict[str, Callable[[Any, Box], Any]] = {
        "Chebyshev centre": lambda of, _: of.ChebyshevCenter(),
        "projection": lambda of, box: float(of.Projection(_far(box)[:, None])[0][0]),
        "bounding box": lambda of, _: around(of),
        "vertices": lambda of, _: drake.VPolytope(of).vertices().T,
        "volume": lambda of, _: drake.VPolytope(of).CalcVolume(),
        "inscribed ellipsoid": lambda of, _: log_volume(of.MaximumVolumeInscribedEllipsoid()),
        "scaling to touch": touch,
    }

    def ask(question: str, box: Box) -> Any:
        if question == "shortest path":
            return _drakes_path(box, drake)
        if question == "circumscribed ellipsoid":
            of_points = drake.Hyperellipsoid.MinimumVolumeCircumscribedEllipsoid
            return log_volume(of_points(box.corners.T))
        return answers[question](drake.HPolyhedron(*box.rows), box)

    return ask


def measure(
    sizes: tuple[float, ...] = SIZES, widths: tuple[float, ...] = WIDTHS, repeats: int = _REPEATS
) -> Iterator[Row]:
    """Ask each engine each question of each box."""
    drake = _drake()
    engines = {"ours": _ours} if drake is None else {"ours": _ours, "Drake": drake}
    for question, size, width in itertools.product(QUESTIONS, sizes, widths):
        box = box_of(size, width)
        for name, ask in engines.items():
            best, error = math.inf, math.nan
            for _ in range(repeats):
                begin = time.process_time()
                try:
                    answer = ask(question, box)
                # Drake ends the process in some of its failures.
                except (RuntimeError, SystemExit, ValueError, TypeError):
                    break
                best = min(best, time.process_time() - begin)
                error = error_of(question, box, answer)
            yield Row(name, question, size, width, error, best)


def _picture(rows: list[Row], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 9.0), layout="constrained")
    axes = figure.subplots(3, 3, sharex=True, sharey=True)
    engines = list(dict.fromkeys(row.engine for row in rows))
    for axis, question in zip(axes.flat, QUESTIONS, strict=True):
        for engine, mark, color in zip(engines, "os", ("C0", "C1"), strict=False):
            of = [row for row in rows if (row.engine, row.question) == (engine, question)]
            found = [row for row in of if math.isfinite(row.error)]
            failed = len(of) - len(found)
            axis.plot(
                [1e3 * row.seconds for row in found],
                [max(row.error, 1e-17) for row in found],
                mark,
                color=color,
                alpha=0.75,
                label=f"{engine}, {failed} of {len(of)} failed" if failed else engine,
            )
        axis.set(xscale="log", yscale="log", title=question)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel("CPU time (ms)")
    for axis in axes[:, 0]:
        axis.set_ylabel("relative error")
    figure.savefig(path, dpi=100)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sets_errors", description=__doc__)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    if _drake() is None:
        print("pydrake is not installed, so only ours is measured; make peers installs it")
    rows = list(measure())
    with (options.out / "sets_errors.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("engine", "question", "size", "width", "relative error", "seconds"))
        writer.writerows(
            (r.engine, r.question, repr(r.size), repr(r.width), repr(r.error), repr(r.seconds))
            for r in rows
        )
    for question, engine in itertools.product(QUESTIONS, dict.fromkeys(r.engine for r in rows)):
        of = [r for r in rows if (r.engine, r.question) == (engine, question)]
        found = [r for r in of if math.isfinite(r.error)]
        worst = max((r.error for r in found), default=math.nan)
        middle = 1e3 * float(np.median([r.seconds for r in found])) if found else math.nan
        print(
            f"{question:24} {engine:6} worst {worst:.1e}, median {middle:.3f} ms, failed"
            f" {len(of) - len(found)} of {len(of)}"
        )
    _picture(rows, options.out / "sets_errors.png")
    print(machine(load), end="")


if __name__ == "__main__":
    main()

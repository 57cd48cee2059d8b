"""Which solver answers a question about convex sets: counted on random sets.

    python test/support/solver_counts.py     write the shares into docs/solvers.md

A question goes from one solver to the next until one answers; the last that was asked counts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
import re
import sys
from typing import Any

import numpy as np

from scene_graph_ros.convex.questions import quick_answers
from scene_graph_ros.convex.sets import conversions
from scene_graph_ros.convex.solve.cones.cone_program import ConeProgram
from scene_graph_ros.convex.solve.cutting.cones import first_cuts
from scene_graph_ros.convex.solve.cutting.cutting import maximize_in_cones
from scene_graph_ros.convex.solve.ellipsoids.circumscribed import smallest_around
from scene_graph_ros.convex.solve.ellipsoids.ellipsoid_distance import nearest_on_axes
from scene_graph_ros.convex.solve.exact.feasibility import find_point
from scene_graph_ros.convex.solve.exact.maximize import maximize, prove_bound
from scene_graph_ros.convex.solve.exact.recession import recession
from scene_graph_ros.convex.solve.nearest.nearest_by_support import nearest_by_support
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.convex.solve.nearest.projection import project_points
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    ConvexSet,
    HPolyhedron,
    Hyperrectangle,
    MinkowskiSum,
    Spectrahedron,
    VPolytope,
)

__all__ = ["PAGE", "SOLVERS", "counted", "read"]

PAGE = Path(__file__).parents[2] / "docs" / "solvers.md"
MARKS = "<!-- who answers -->", "<!-- end -->"

_FLOATS = ("point_of_rows", "center_of_rows", "extents_of_rows", "support_of_rows",
           "is_row_bounded", "meet", "is_contained", "redundant")  # fmt: skip
SOLVERS: dict[str, tuple[Callable[..., Any], ...]] = {
    "floats": tuple(getattr(quick_answers, name) for name in _FLOATS),
    "projection": (project_points,),
    "hull": (nearest_in_hull,),
    "axes": (nearest_on_axes,),
    "simplex": (maximize,),
    "fractions": (find_point, recession, prove_bound),
    "supports": (nearest_by_support,),
    "planes": (first_cuts, maximize_in_cones),
    "cone program": (ConeProgram.solve,),
    "ellipsoids": (smallest_around, conversions.shape_of_hull),
}
"""By name, in the order in which they are asked: the last one that was asked has answered."""

_BY_CODE = {
    getattr(f, "__wrapped__", f).__code__: name for name, each in SOLVERS.items() for f in each
}
_ORDER = list(SOLVERS)


def _answering(question: Callable[[], object]) -> str:
    """Return who answered a question, "closed form" where no solver was asked."""
    asked: set[str] = set()

    def note(frame: Any, event: str, _: object) -> None:
        if event == "call" and frame.f_code in _BY_CODE:
            asked.add(_BY_CODE[frame.f_code])

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        question()
    finally:
        sys.setprofile(before)
    return max(asked, key=_ORDER.index, default="closed form")


def _bodies(seed: int) -> Iterator[tuple[str, ConvexSet, ConvexSet]]:
    """Yield a kind's name and two sets of it, which overlap, touch or are apart."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    way = np.zeros(n)
    way[0] = rng.choice([0.5, 2.0, 4.0])  # of bodies that are about 1 wide on each side

    def rows() -> np.ndarray:
        A = rng.normal(size=(int(rng.integers(0, 20)), n))
        A = A / np.linalg.norm(A, axis=1, keepdims=True)
        return np.concatenate([np.eye(n), -np.eye(n), A])

    A, B = rows(), rows()
    yield "HPolyhedron", HPolyhedron(A, np.ones(len(A))), HPolyhedron(B, 1.0 + B @ way)
    half = rng.integers(1, 3, size=n) / 2.0
    yield "Hyperrectangle", Hyperrectangle(-half, half), Hyperrectangle(way - 1.0, way + 1.0)
    V = rng.normal(size=(int(rng.integers(n + 1, 30)), n))
    yield "VPolytope", VPolytope(V), VPolytope(V + way)
    axes = rng.normal(size=(n, n)) * 0.3 + np.eye(n)
    yield "AffineBall", AffineBall(axes, np.zeros(n)), AffineBall(np.eye(n), way)
    box = Hyperrectangle(-0.5 * np.ones(n), 0.5 * np.ones(n))
    yield (
        "MinkowskiSum",
        MinkowskiSum(box, VPolytope(0.3 * V)),
        MinkowskiSum(box, VPolytope(0.3 * V + way)),
    )
    ball = [np.eye(2), np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])]
    moved = [ball[0] - way[0] * ball[1], *ball[1:]]
    yield "Spectrahedron", Spectrahedron(ball), Spectrahedron(moved)


def _questions(one: ConvexSet, other: ConvexSet, seed: int) -> Iterator[tuple[str, Any]]:
    rng = np.random.default_rng(seed)
    n = one.ambient_dimension
    p, d = 3.0 * rng.normal(size=n), rng.normal(size=n)
    yield "is it empty", one.is_empty
    yield "is it bounded", one.is_bounded
    yield "is a point in it", lambda: one.point_in_set(p)
    yield "how far does it reach", lambda: one.support(d)
    yield "which point is nearest", lambda: one.projection(p)
    yield "do two meet", lambda: one.intersects_with(other)
    if isinstance(one, HPolyhedron):
        yield "is one in another", lambda: one.contained_in(other)
        yield "which rows are needed", one.reduce_inequalities


def counted(seeds: int = 40) -> dict[tuple[str, str], Counter[str]]:
    """Return for each question and kind of set who answered how often."""
    found: dict[tuple[str, str], Counter[str]] = {}
    for seed in range(seeds):
        for kind, one, other in _bodies(seed):
            for name, question in _questions(one, other, seed):
                found.setdefault((name, kind), Counter())[_answering(question)] += 1
    return found


def _table(found: dict[tuple[str, str], Counter[str]]) -> str:
    lines = ["| question | set | who answers, % |", "| --- | --- | --- |"]
    for (question, kind), counts in sorted(found.items()):
        total = sum(counts.values())
        shares = ", ".join(f"{name} {100 * k / total:.0f}" for name, k in counts.most_common())
        lines.append(f"| {question} | {kind} | {shares} |")
    return "\n".join(lines)


def read() -> dict[tuple[str, str], dict[str, float]]:
    """Return the percentages on the page."""
    between = PAGE.read_text().split(MARKS[0])[1].split(MARKS[1])[0]
    rows = re.findall(r"^\| (.+?) \| (\w+) \| (.+?) \|$", between, re.M)
    return {
        (question, kind): {
            name: float(share) for name, share in re.findall(r"([a-z ]+?) (\d+)(?:, |$)", shares)
        }
        for question, kind, shares in rows[1:]
    }


if __name__ == "__main__":
    text = PAGE.read_text()
    before, _, rest = text.partition(MARKS[0])
    after = rest.partition(MARKS[1])[2]
    PAGE.write_text(f"{before}{MARKS[0]}\n{_table(counted())}\n{MARKS[1]}{after}")

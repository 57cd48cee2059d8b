"""Sets of many points or members: ``python -m benchmarks.many_members``.

Processor time of one question to a new set, in milliseconds: hulls of 1000 points, and hulls and
sums of 60 members. The furthest points of a pair along a direction and against it are put upon
each other, or so far into or away from each other that the answer is known. One thread, the least
and the most of some sets. Writes ``many_members.csv``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import csv
import os
from pathlib import Path
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from scene_graph_ros.geometry.optimization import (  # noqa: E402
    ConvexHull,
    Hyperellipsoid,
    Hyperrectangle,
    MinkowskiSum,
    VPolytope,
)

__all__ = ["BODIES", "main", "measure"]

_CSV = Path(__file__).parents[1] / "docs" / "many_members.csv"
_OVERLAPS = (-0.1, -1e-9, 0.0, 1e-9, 0.1)
Generator = np.random.Generator


def _segment(rng: Generator, n: int, away: np.ndarray) -> Any:
    middle, way = rng.normal(size=(2, n))
    return VPolytope(np.stack([middle - way, middle + way]) + away)


def _box(rng: Generator, n: int, away: np.ndarray) -> Any:
    middle, half = rng.normal(size=n) + away, rng.uniform(0.1, 1.0, n)
    return Hyperrectangle(middle - half, middle + half)


def _ball(rng: Generator, n: int, away: np.ndarray) -> Any:
    return Hyperellipsoid.make_axis_aligned(rng.uniform(0.2, 1.0, n), rng.normal(size=n) + away)


def _members(kind: Any, member: Any, count: int) -> Callable[..., Any]:
    def make(rng: Generator, n: int, away: np.ndarray) -> Any:
        is_sum = kind is MinkowskiSum
        none = np.zeros(n)
        return kind([member(rng, n, none if is_sum and k else away) for k in range(count)])

    return make


def _points(count: int) -> Callable[..., Any]:
    return lambda rng, n, away: VPolytope(rng.normal(size=(count, n)) + away)


BODIES = {
    "hull of points": _points,
    **{
        f"{name} of {what}": lambda count, kind=kind, member=member: _members(kind, member, count)
        for name, kind in (("hull", ConvexHull), ("sum", MinkowskiSum))
        for what, member in (("segments", _segment), ("boxes", _box), ("balls", _ball))
    },
}
"""By name: functions of how many points or members, whose answers make a set."""


def _timed(ask: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    answer = ask()
    return answer, 1e3 * (time.process_time() - start)


def measure(make: Callable[..., Any], n: int, seed: int) -> Iterator[tuple[str, float]]:
    """Yield questions and their times; each is asked of a set that was not asked before."""

    def new(which: int = 0, away: Any = None) -> Any:
        rng = np.random.default_rng((seed, which))
        return make(rng, n, np.zeros(n) if away is None else away)

    d = np.random.default_rng(seed).normal(size=n)
    d /= np.linalg.norm(d)
    one, other = new(), new(1)
    top, bottom = one.support(d).point, other.support(-d).point
    ways = np.concatenate([np.eye(n), -np.eye(n)])
    middle = np.mean([one.support(way).point for way in ways], axis=0)
    for name, ask, right in (
        ("support", lambda s: s.support(d).value > -np.inf, True),
        ("is_empty", lambda s: s.is_empty(), False),
        ("is_bounded", lambda s: s.is_bounded(), True),
        ("point_in_set, inside", lambda s: s.point_in_set(middle), True),
        ("point_in_set, outside", lambda s: s.point_in_set(top + 1e-3 * d), False),
        ("distance", lambda s: s.projection((top + d)[None]).distances[0] > 0.9, True),
    ):
        asked = new()
        answer, spent = _timed(lambda asked=asked, ask=ask: ask(asked))
        assert bool(answer) is right, (name, answer)
        yield name, spent
    inwards = (middle - top) / np.linalg.norm(middle - top)
    for overlap in _OVERLAPS:
        # A corner of the one is moved into the other, or away along a normal.
        moved = overlap * inwards if overlap > 0.0 else -overlap * d
        asked, beside = new(), new(1, top - bottom + moved)
        meets, spent = _timed(lambda asked=asked, beside=beside: asked.intersects_with(beside))
        assert overlap == 0.0 or meets is (overlap > 0.0), (overlap, meets)
        yield f"pair, overlap {overlap:g}", spent


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=5, help="sets of a kind")
    parser.add_argument("--dimensions", type=int, nargs="+", default=[3, 7])
    parser.add_argument("--points", type=int, default=1000, help="of a hull of points")
    parser.add_argument("--members", type=int, default=60, help="of other sets")
    parser.add_argument("--csv", type=Path, default=_CSV)
    chosen = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    rows = []
    for name, make_of in BODIES.items():
        count = chosen.points if name == "hull of points" else chosen.members
        for n in chosen.dimensions:
            dict(measure(make_of(min(count, 40)), n, 0))  # what is compiled or imported first
            spent: dict[str, list[float]] = {}
            for seed in range(1, chosen.seeds + 1):
                for question, ms in measure(make_of(count), n, seed):
                    spent.setdefault(question, []).append(ms)
            for question, each in spent.items():
                rows.append((name, count, n, question, f"{min(each):.3g}", f"{max(each):.3g}"))
            worst = {question: round(max(each), 1) for question, each in spent.items()}
            print(name, count, n, worst, flush=True)
    with chosen.csv.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("set", "count", "dimensions", "question", "least ms", "most ms"))
        writer.writerows(rows)


if __name__ == "__main__":
    main()

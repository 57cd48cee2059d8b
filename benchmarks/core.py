"""Time the core against its peers: ``python -m benchmarks.core``.

One seeded scene of mixed shapes; every pose changes before every query, so that no cache hides
work. Times are medians on one thread, called from Python; the size of each result stands beside
its time. A peer's ``move`` is a loop in Python, since its interface has no batch; what of the time
is its own library's is printed too.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
import statistics
import subprocess
import sys
import time
from typing import Any

from benchmarks.peers import PEERS
from benchmarks.scenes import MixedScene, Ours

__all__ = ["main"]

POSE_SETS = 8


def _median(work: Callable[[int], Any], rounds: int) -> tuple[float, Any]:
    """Return the median time of ``work(round)`` in milliseconds, and the mean of its results."""
    work(0)
    times, results = [], []
    for k in range(1, rounds + 1):
        start = time.perf_counter()
        result = work(k)
        times.append(1e3 * (time.perf_counter() - start))
        results.append(result)
    sizes = [r for r in results if r is not None]
    return statistics.median(times), statistics.fmean(sizes) if sizes else None


def _with_move(engine: Any, ask: Callable[[], int]) -> Callable[[int], int]:
    def work(k: int) -> int:
        engine.move(k)
        return ask()

    return work


def _report(name: str, milliseconds: float, size: float | None, ours: float | None) -> None:
    ratio = "" if ours is None else f"{milliseconds / ours:8.2f} x"
    count = "" if size is None else f"{size:9.1f}"
    print(f"  {name:<38}{milliseconds:10.3f} ms {count:>9} {ratio}")


def _engines(scene: MixedScene) -> list[Any]:
    engines: list[Any] = [Ours(scene)]
    for peer in PEERS:
        try:
            engines.append(peer(scene))
        except ImportError as error:
            print(f"{peer.name} is left out: {error}")
    return engines


def run(n: int, rounds: int, seed: int) -> None:
    """Print the table for ``n`` shapes at 5 % fill."""
    scene = MixedScene.make(n, fill=0.05, pose_sets=POSE_SETS, seed=seed)
    engines = _engines(scene)
    print(f"{n} mixed shapes, 5 % fill, seed {seed}, median of {rounds}, new poses each time")
    for title, method in (
        ("pose update and candidates", "candidates"),
        ("pose update and all penetrations", "penetrations"),
    ):
        print(f"{title}: time, size of the result, ratio to ours")
        ours = None
        for engine in engines:
            if hasattr(engine, method):
                ms, size = _median(_with_move(engine, getattr(engine, method)), rounds)
                _report(engine.name, ms, size, ours)
                ours = ms if ours is None else ours
    print("of which the pose update alone")
    for engine in engines:
        _report(engine.name, *_median(engine.move, rounds), None)
    ms, size = _median(_with_move(engines[0], lambda: engines[0].distances(0.1)), rounds)
    print("signed distance up to 0.1 m, update included")
    _report(engines[0].name, ms, size, None)


def time_of_import(rounds: int) -> float:
    """Return the median time in seconds that a new process takes to import the core."""
    code = (
        "import time; t = time.perf_counter(); import scene_graph_ros.geometry;"
        "print(time.perf_counter() - t)"
    )
    command = [sys.executable, "-c", code]
    times = [
        float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        for _ in range(rounds)
    ]
    return statistics.median(times)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shapes", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    run(options.shapes, options.rounds, options.seed)
    print(f"import of the core, warm: {time_of_import(5):.2f} s")


if __name__ == "__main__":
    main()

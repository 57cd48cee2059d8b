"""Tell which kernels a query's time goes to: ``python -m benchmarks.samples``.

The scene of the benchmark is asked again and again, with new poses each time, while perf looks
where the processor is, some thousand times a second. That needs no counters of the processor, and
shows what is not in the source: what calls cost, what waits for memory or for a root, and what the
processor guesses wrong. Kernels that are inlined count as those that they are in. Needs perf
(Debian: linux-perf), and the right to use it.
"""

from __future__ import annotations

import argparse
from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence
import os
from pathlib import Path
import shutil
import signal
import subprocess
import tempfile
import time

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded

from benchmarks.compiled_places import compiled_places, Place  # noqa: E402
from benchmarks.machine import machine  # noqa: E402
from benchmarks.speed.engines.ours import Ours  # noqa: E402
from benchmarks.speed.make_scenes import mixed  # noqa: E402
from benchmarks.speed.rows import ROWS  # noqa: E402

__all__ = ["Asking", "by_place", "main"]

OTHERS = "Python, numpy and what else is no kernel"

_PACKAGE = "scene_graph_ros.geometry."
"""What names of kernels begin with, and that a reader can do without."""

_WARM = 200
"""Queries before samples are taken."""
_START = 0.5
"""Seconds that perf takes to begin."""


class Asking:
    """One row of the benchmark, asked of mixed shapes."""

    def __init__(self, key: str, size: int, seed: int) -> None:
        (row,) = (row for row in ROWS if row.key == key)
        scene = mixed(size, seed)
        poses = row.poses(scene)
        if poses is None:
            raise ValueError(f"{size} mixed shapes have no poses for {key!r}")
        self._engine = Ours(scene)
        self._engine.choose(poses, row.max_distance)
        self._ask = getattr(self._engine, row.method)
        self._arguments = row.arguments(scene)
        self._count = 0

    def once(self) -> None:
        """Move everything, and ask."""
        self._engine.move(self._count)
        self._ask(*self._arguments)
        self._count += 1

    def for_seconds(self, seconds: float) -> float:
        """Ask for so long; return the mean time of a query in microseconds."""
        count, start = 0, time.perf_counter()
        while (elapsed := time.perf_counter() - start) < seconds or not count:
            self.once()
            count += 1
        return 1e6 * elapsed / count


def by_place(addresses: Sequence[int], places: Sequence[Place]) -> Counter[str]:
    """Count addresses by the function that they are in; ``places`` are sorted."""
    starts = [place.start for place in places]
    found: Counter[str] = Counter()
    for address in addresses:
        k = bisect_right(starts, address) - 1
        is_in = k >= 0 and address < places[k].start + places[k].size
        found[places[k].name if is_in else OTHERS] += 1
    return found


def _sampled(asking: Asking, seconds: float, rate: int) -> tuple[float, list[int]]:
    """Return the time of a query in microseconds, and where samples were."""
    with tempfile.TemporaryDirectory() as folder:
        data = str(Path(folder) / "perf.data")
        record = ["perf", "record", "-q", "-e", "cpu-clock", "-F", str(rate), "-o", data]
        perf = subprocess.Popen([*record, "-p", str(os.getpid())])
        try:
            asking.for_seconds(_START)
            mean = asking.for_seconds(seconds)
        finally:
            perf.send_signal(signal.SIGINT)
            perf.wait()
        told = subprocess.run(
            ["perf", "script", "-i", data, "-F", "ip"], capture_output=True, text=True, check=False
        )
    addresses = [int(address, 16) for address in told.stdout.split()]
    if not addresses:
        raise SystemExit(f"perf took no samples: {told.stderr.strip() or 'is it allowed to?'}")
    return mean, addresses


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.samples", description=__doc__)
    parser.add_argument("--row", default="distance", choices=[row.key for row in ROWS])
    parser.add_argument("--size", type=int, default=1000, help="number of mixed shapes")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rate", type=int, default=5000, help="samples in a second")
    parser.add_argument("--most", type=int, default=30, help="lines of the table")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    if shutil.which("perf") is None:
        raise SystemExit("perf is not installed (Debian: apt-get install linux-perf)")
    print(machine(os.getloadavg()[0]))
    asking = Asking(options.row, options.size, options.seed)
    for _ in range(_WARM):
        asking.once()
    print(f"asking for {options.seconds:g} s ...", flush=True)
    mean, addresses = _sampled(asking, options.seconds, options.rate)
    print(f"{mean:.1f} us a query, {len(addresses)} samples")
    print("   us  share  where")
    for name, count in by_place(addresses, compiled_places()).most_common(options.most):
        share = count / len(addresses)
        print(f"{mean * share:5.1f} {100.0 * share:5.1f} %  {name.removeprefix(_PACKAGE)}")


if __name__ == "__main__":
    main()

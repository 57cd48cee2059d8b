"""How long a filter of velocities takes at 1 kHz, and what the distance that is kept costs.

``python -m benchmarks.safe_velocity`` drives a Panda through its cell at random, its limits 15
rad/s^2, and prints of one tick the median, 99 and 99.9 % of the time, alone and with eight
objects that fly about, and the share of ticks within 1 ms in a loop that sleeps until each next
millisecond. Times are those of the thread's processor, and of the clock beside them, as they
differ where others work on the machine. ``--write`` writes docs/safe_velocity.csv and .png: for
distances to keep, what is left of the speed that is asked for, and the least distance that was
seen, by `calc_robot_clearance`. ``--quick`` takes a tenth of the ticks.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import csv
import os
from pathlib import Path
import time
from typing import Any, NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    load_robot_diagram,
    SafeVelocity,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.trajectories import MotionLimits  # noqa: E402

__all__ = ["main"]

_START = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
_ACCELERATION = 15.0
_PERIOD = 0.001
_TICKS = 10_000
_KEEPS = (0.0, 0.01, 0.02, 0.05, 0.1)
_GAINS = (2.0, 5.0, 20.0)
_DOCS = Path(__file__).parents[1] / "docs"


class _Drive(NamedTuple):
    seconds: np.ndarray
    """Of the thread's processor, for each tick."""
    clock: np.ndarray
    speeds: float
    """The speed along what is asked for, as a share of it."""
    kept: float
    """The share of ticks whose distances are proven to be kept."""
    least: float
    """Metres: the least distance that was seen."""


def _checker() -> SceneGraphCollisionChecker:
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


def _drive(
    checker: SceneGraphCollisionChecker,
    ticks: int,
    *,
    keep: float = 0.02,
    gain: float = 5.0,
    obstacles: Any = None,
    in_time: bool = False,
    seen: bool = False,
) -> _Drive:
    """Ask for velocities towards random configurations, another each 0.4 s."""
    tree, rng = checker.plan.tree, np.random.default_rng(0)
    limits = MotionLimits.of_tree(tree, accelerations=_ACCELERATION)
    barrier = SafeVelocity(checker, keep, gain, limits)
    q, goal, most = _START, _START, tree.velocity_limits
    seconds, clock = np.empty(ticks), np.empty(ticks)
    gone, asked_for, kept, least = 0.0, 0.0, 0, np.inf
    barrier.filter(q, np.zeros(len(q)), _PERIOD, obstacles=obstacles)
    due = time.perf_counter()
    for tick in range(ticks):
        if tick % 400 == 0:
            goal = tree.sample(rng, 1)[0]
        v = np.clip(4.0 * (goal - q), -most, most)
        if in_time:
            due += _PERIOD
            time.sleep(max(0.0, due - time.perf_counter()))
            due = max(due, time.perf_counter() - _PERIOD)
        begin, start = time.thread_time(), time.perf_counter()
        step = barrier.filter(q, v, _PERIOD, obstacles=obstacles)
        seconds[tick], clock[tick] = time.thread_time() - begin, time.perf_counter() - start
        q = q + _PERIOD * step.velocity
        speed = float(np.linalg.norm(v))
        gone += float(step.velocity @ v) / speed
        asked_for += speed
        kept += step.is_kept
        if seen and tick % 10 == 0:
            distances = checker.calc_robot_clearance(q, keep + 0.02).distances
            least = min(least, distances.min(initial=np.inf))
    return _Drive(seconds, clock, gone / asked_for, kept / ticks, least)


def _row(name: str, drive: _Drive) -> str:
    quantiles = [
        f"{1e6 * each:8.0f}"
        for times in (drive.seconds, drive.clock)
        for each in np.percentile(times, [50.0, 99.0, 99.9])
    ]
    within = np.mean(drive.clock <= _PERIOD)
    return f"{name:28}{''.join(quantiles)} {within:9.2%} {drive.kept:9.2%}"


def _times(checker: SceneGraphCollisionChecker, ticks: int) -> None:
    inspector = checker.snapshot.inspector
    source = inspector.get_source_id_by_name("objects")
    obstacles = dict.fromkeys(inspector.frames_for_source(source), 0.1)
    print("us a tick                     processor: median, 99, 99.9 %   clock: the same"
          "   in 1 ms      kept")  # fmt: skip
    print(_row("one after the other", _drive(checker, ticks)))
    print(_row("a loop at 1 kHz", _drive(checker, ticks, in_time=True)))
    print(_row("eight objects at 0.1 m/s", _drive(checker, ticks // 4, obstacles=obstacles)))
    begin = time.thread_time()
    for _ in range(1000):
        checker.calc_robot_clearance(_START, 0.2)
    spent = 1e3 * (time.thread_time() - begin)
    print(f"for comparison, calc_robot_clearance up to 0.2 m: {spent:.0f}")


def _write(checker: SceneGraphCollisionChecker, ticks: int) -> None:
    """Write what is left of the speed to the documentation."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = []
    for gain in _GAINS:
        for keep in _KEEPS:
            drive = _drive(checker, ticks, keep=keep, gain=gain, seen=True)
            assert drive.least >= keep
            rows.append((gain, keep, drive.speeds, drive.least))
    with (_DOCS / "safe_velocity.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("gain", "keep", "speed", "least"))
        for gain, keep, speed, least in rows:
            writer.writerow((f"{gain:g}", f"{keep:g}", f"{speed:.4f}", f"{least:.5f}"))
    figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
    for gain in _GAINS:
        chosen = [row for row in rows if row[0] == gain]
        axes.plot(
            [1e3 * row[1] for row in chosen],
            [100.0 * row[2] for row in chosen],
            marker="o",
            label=f"gain {gain:g}/s",
        )
    axes.set_xlabel("distance that is kept, mm")
    axes.set_ylabel("speed along what is asked for, %")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(_DOCS / "safe_velocity.png", dpi=110)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, and print or write; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the ticks")
    parser.add_argument("--write", action="store_true", help="write docs/safe_velocity.*")
    options = parser.parse_args(arguments)
    load, checker = os.getloadavg()[0], _checker()
    ticks = _TICKS // 10 if options.quick else _TICKS
    _times(checker, ticks)
    if options.write:
        _write(checker, ticks // 2)
    print(machine(load), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

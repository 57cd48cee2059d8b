"""How fast motions of arms are, and how long they take to find: problems of MotionBenchMaker.

``python -m benchmarks.motions`` plans for a Panda with 15 rad/s^2 and 500 rad/s^3, from
configuration to configuration: by `plan_trajectory`, and by `plan_path` and `time_path`. It prints
processor times of one process, how many are solved and proven, and durations beside the least ones
that start and goal allow without anything in the way. ``--problems`` takes another archive than
the seventy in the repository, ``--all`` downloads all seven hundred, ``--picture`` writes a file.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
import os
from pathlib import Path
import tempfile
import time
from typing import NamedTuple

import numpy as np

from benchmarks.machine import machine
from benchmarks.plans import download, moveit_problems, Problem
from scene_graph_ros.planning import plan_path, plan_trajectory, time_path, TimedPath
from scene_graph_ros.planning.trajectories import find_excess, MotionLimits
from scene_graph_ros.trajectories.straight_motion import least_duration

__all__ = ["ARM_LIMITS", "least_time", "main"]

_PROBLEMS = Path("test/benchmarks/motion_bench_maker_panda.tar.bz2")
_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))
ARM_LIMITS = MotionLimits([2.175] * 4 + [2.61] * 3, [15.0] * 7, _JOINTS, [500.0] * 7)
"""Of a Panda: velocities of its URDF, accelerations and jerks as cuRobo's."""
_TIMEOUT = 60.0
"""s."""


class _Run(NamedTuple):
    kind: str
    seconds: float
    ratio: float
    """The duration, by the least one without anything in the way; not finite without success."""
    duration: float


def least_time(problem: Problem) -> float:
    """Return the least time (s) of a motion from start to goal, whatever is in the way."""
    tree = problem.checker.plan.tree
    rows = [tree.position_index(name) for name in ARM_LIMITS.names]
    return least_duration((problem.goal - problem.start)[rows], ARM_LIMITS)


def _in_one_call(problem: Problem) -> TimedPath:
    return plan_trajectory(
        problem.checker, problem.start, problem.goal, ARM_LIMITS, group="arm", timeout=_TIMEOUT
    )


def _along_the_path(problem: Problem) -> TimedPath:
    plan = plan_path(problem.checker, problem.start, problem.goal, group="arm", timeout=_TIMEOUT)
    return time_path(problem.checker, plan.configurations, ARM_LIMITS, timeout=_TIMEOUT)


_WAYS: dict[str, Callable[[Problem], TimedPath]] = {
    "plan_trajectory": _in_one_call,
    "plan_path, time_path": _along_the_path,
}


def _run(problem: Problem, way: Callable[[Problem], TimedPath]) -> _Run:
    begin = time.process_time()
    motion = way(problem)
    seconds = time.process_time() - begin
    if motion.points is None or motion.trajectory is None:
        return _Run(problem.kind, seconds, np.inf, np.inf)
    tree = problem.checker.plan.tree
    rows = np.array([tree.position_index(name) for name in ARM_LIMITS.names])
    excess = find_excess(motion.points.of(rows).trajectory(), ARM_LIMITS)
    along = motion.trajectory.value(np.linspace(0.0, motion.duration, 200))
    if excess is not None or not problem.checker.check_configs_collision_free(along).all():
        raise RuntimeError(f"a motion of {problem.kind} is none: {excess}")
    return _Run(problem.kind, seconds, motion.duration / least_time(problem), motion.duration)


def _row(kind: str, runs: Sequence[_Run]) -> str:
    times = 1e3 * np.array([run.seconds for run in runs])
    ratios = np.array([run.ratio for run in runs])
    durations = np.array([run.duration for run in runs])
    solved = int(np.isfinite(ratios).sum())
    words = f"{kind:22} {solved:4}/{len(runs):<4} {np.median(times):9.2f}"
    words += f" {np.percentile(times, 95):9.2f} {np.median(durations):9.3f}"
    return words + f" {np.median(ratios):9.3f} {np.percentile(ratios, 90):9.3f}"


def _print_table(problems: Iterable[Problem]) -> Mapping[str, Sequence[_Run]]:
    load = os.getloadavg()[0]
    runs: dict[str, list[_Run]] = {name: [] for name in _WAYS}
    for number, problem in enumerate(problems):
        for name, way in _WAYS.items():
            if number == 0:  # Kernels are loaded by a first call, which is not measured.
                way(problem)
            runs[name].append(_run(problem, way))
    print(
        f"{'':22} {'solved':>9} {'median ms':>9} {'95 % ms':>9} {'motion s':>9} {'by least':>9}"
        f" {'90 %':>9}"
    )
    for name, mine in runs.items():
        print(f"{name}:")
        kinds = dict.fromkeys(run.kind for run in mine)
        for kind in kinds:
            print(_row(kind, [run for run in mine if run.kind == kind]))
        print(_row("all", mine))
    print(machine(load), end="")
    return runs


def _draw(runs: Mapping[str, Sequence[_Run]], output: Path) -> None:
    """Write what share of motions takes at most how many times the least time."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(6.4, 3.4), layout="constrained")
    for name, mine in runs.items():
        ratios = np.sort([run.ratio for run in mine])
        axis.step(ratios, np.arange(1, len(mine) + 1) / len(mine), where="post", label=name)
    axis.set_xscale("log")
    ticks = [1.0, 1.1, 1.2, 1.5, 2.0, 3.0, 4.0]
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks], minor=False)
    axis.set_xticks([], minor=True)
    axis.set_xlim(0.98, 4.2)
    axis.set_ylim(0.0, 1.02)
    axis.set_xlabel("duration, by the least one without anything in the way")
    axis.set_ylabel("share of the problems")
    axis.grid(alpha=0.3)
    axis.legend(loc="lower right")
    figure.savefig(output, dpi=130)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=Path, default=_PROBLEMS, help="an archive")
    parser.add_argument("--all", action="store_true", help="download all problems")
    parser.add_argument("--count", type=int, help="problems of each set, if not all")
    parser.add_argument("--picture", type=Path, help="a file for durations")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        archive = download(folder) if options.all else options.problems
        runs = _print_table(moveit_problems(archive, options.count))
    if options.picture is not None:
        _draw(runs, options.picture)


if __name__ == "__main__":
    main()

"""The best motions beside Drake, and their accuracy: ``python -m benchmarks.optimal_control``.

One thread, processor time, the least of some runs. Swing-ups begin from a straight line; curves of
seven joints have bounds up to jerk; six steps are planned for a zero-moment point. ``--accuracy``
solves problems with known solutions for more and more knots, and draws the error against the time.
Without pydrake only ours is measured, and that is said; ``make peers`` installs it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import importlib.util
import os
from pathlib import Path
from typing import Any, NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.seven_ends import seven_ends  # noqa: E402
from benchmarks.swing_ups import problem, SWING_UPS  # noqa: E402
from benchmarks.timing import least_time  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    DirectCollocation,
    DirectTranscription,
    Dynamics,
    KinematicTrajectoryOptimization,
    ZmpPlanner,
)
from scene_graph_ros.planning.trajectories import (  # noqa: E402
    BsplineTrajectory,
    PiecewisePolynomial,
)

__all__ = ["accuracy", "main"]

_PICTURE = Path(__file__).parents[1] / "docs" / "optimal_control_accuracy.png"
_KNOTS = {"collocation": (4, 8, 16, 32, 64, 128), "transcription": (8, 32, 128, 512, 2048)}


class Row(NamedTuple):
    """What was asked; seconds to set up and solve, and the cost: NaN where nobody found one."""

    name: str
    ours: float
    theirs: float
    our_cost: float
    their_cost: float
    note: str


def footsteps() -> PiecewisePolynomial:
    """Return the zero-moment point of six steps."""
    y = [0.0, 0.0, *([0.085, 0.085, -0.085, -0.085] * 3), 0.0, 0.0]
    x = np.repeat(np.arange(len(y) // 2) * 0.11, 2)
    times = np.cumsum(np.tile([0.25, 0.7], len(y) // 2))
    return PiecewisePolynomial.first_order_hold(times, np.column_stack([x, y]))


def seven_joints() -> KinematicTrajectoryOptimization:
    """Return a problem of seven joints and twelve points, from rest to rest."""
    made = KinematicTrajectoryOptimization(7, 12, 4, 2.0)
    ones = np.ones(7)
    start, goal = seven_ends()
    made.add_duration_cost()
    made.add_path_length_cost(0.1)
    made.add_duration_constraint(0.1, 20.0)
    made.add_position_bounds(-2.8 * ones, 2.8 * ones)
    made.add_velocity_bounds(-2.0 * ones, 2.0 * ones)
    made.add_acceleration_bounds(-5.0 * ones, 5.0 * ones)
    made.add_jerk_bounds(-50.0 * ones, 50.0 * ones)
    for q, s in ((start, 0.0), (goal, 1.0)):
        made.add_path_position_constraint(q, q, s)
        made.add_path_velocity_constraint(0.0 * ones, 0.0 * ones, s)
    line = np.linspace(start, goal, 12)
    made.set_initial_guess(BsplineTrajectory.clamped_uniform(line, 3, 0.0, 2.0))
    return made


def comparisons(runs: int, has_drake: bool) -> list[Row]:
    """Measure all, ours and Drake's in turn."""
    peer: Any = None
    if has_drake:
        from benchmarks import optimal_control_drake as peer
    rows = []
    for name in SWING_UPS:
        ours, found = least_time(lambda n=name: problem(n).solve(), runs)
        note = f"ours {found.status.value}, starts: {found.program_result.starts}"
        our_cost = found.cost if found.is_success else np.nan
        for solver in ("snopt", "ipopt"):
            theirs, cost, words = np.nan, np.nan, ""
            if peer is not None:
                theirs, (cost, words) = least_time(
                    lambda n=name, s=solver: peer.swing_up(n, s), runs
                )
            title = f"swing-up, {name}; Drake by {solver}"
            rows.append(Row(title, ours, theirs, our_cost, cost, f"{note}; Drake {words}"))
    ours, result = least_time(lambda: seven_joints().solve(), runs)
    for solver in ("ipopt", "snopt"):
        theirs, cost, words = np.nan, np.nan, ""
        if peer is not None:
            theirs, (cost, words) = least_time(lambda s=solver: peer.seven_joints(s), runs)
        name = f"seven joints, 12 points; Drake by {solver}"
        rows.append(Row(name, ours, theirs, result.cost, cost, words))
    zmp, planner = footsteps(), ZmpPlanner()
    state = np.array([*zmp.value(0.0), 0.0, 0.0])
    many = 20

    def plan() -> None:
        for _ in range(many):
            planner.plan(zmp, state, 0.83)

    ours, theirs, cost = least_time(plan, 5)[0] / many, np.nan, np.nan
    end = float(planner.get_nominal_com(3.0)[1])
    if peer is not None:
        theirs, cost = peer.zmp(zmp.breaks, zmp.value(zmp.breaks), state, 0.83, many)
    rows.append(Row("zero-moment point, six steps (cost: y at 3 s)", ours, theirs, end, cost, ""))
    return rows


def accuracy(knots: dict[str, Sequence[int]]) -> dict[str, list[tuple[int, float, float, float]]]:
    """Return knots, processor seconds, error at knots and residual between, by method.

    The system is x' = u, y' = -y^2 from (1, 1), over two seconds, with the least integral of x^2 +
    u^2: x = cosh(2 - t) / cosh(2), y = 1 / (1 + t).
    """
    system = Dynamics(lambda x, u, t, p: [u[0], -(x[1] ** 2)], 2, 1)
    result: dict[str, list[tuple[int, float, float, float]]] = {}
    for method, counts in knots.items():
        rows = result.setdefault(method, [])
        for count in counts:
            step = 2.0 / (count - 1)

            def solved(count: int = count, step: float = step, method: str = method) -> Any:
                made = (
                    DirectCollocation(system, count, step, step)
                    if method == "collocation"
                    else DirectTranscription(system, count, step)
                )
                made.prog().add_constraint(made.initial_state() == 1.0)
                made.add_running_cost(made.state()[0] ** 2 + made.input()[0] ** 2)
                return made.solve()

            seconds, found = least_time(solved, 2)
            t = found.sample_times
            truth = np.column_stack([np.cosh(2.0 - t) / np.cosh(2.0), 1.0 / (1.0 + t)])
            error = float(abs(found.states - truth).max())
            rows.append((count, seconds, error, found.residual_between_knots))
    return result


def draw(found: dict[str, list[tuple[int, float, float, float]]], path: Path) -> None:
    """Draw error and residual against time, with the knots beside each point."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
    for (method, rows), color in zip(found.items(), ("#1f6fb4", "#d1495b"), strict=True):
        counts, seconds, errors, residuals = map(np.array, zip(*rows, strict=True))
        left.loglog(seconds, errors, "o-", color=color, label=method)
        right.loglog(counts - 1, errors, "o-", color=color, label=f"{method}: states at knots")
        right.loglog(counts - 1, residuals, "s--", color=color, mfc="white", label="rates between")
        for count, x, y in zip(counts, seconds, errors, strict=True):
            left.annotate(str(count), (x, y), (6, 4), textcoords="offset points", fontsize=8)
    for order in (1, 3, 4):
        steps = np.array([150.0, 600.0])
        lines = 1e-5 * (steps[0] / steps) ** order
        right.loglog(steps, lines, color="0.6", lw=0.8)
        right.annotate(f"order {order}", (1.05 * steps[1], lines[1]), fontsize=8, va="center")
    right.set_ylim(1e-13, 2.0)
    left.set(xlabel="processor time, s", ylabel="largest error of a state at knots")
    left.set_title("what accuracy costs; numbers are knots", fontsize=10)
    right.set(xlabel="steps", ylabel="error")
    right.set_title("order of convergence", fontsize=10)
    left.legend(frameon=False)
    right.legend(frameon=False, fontsize=8, loc="lower left")
    for axis in (left, right):
        axis.grid(alpha=0.25)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=3, help="of which the fastest counts")
    parser.add_argument("--accuracy", action="store_true", help="error against time, drawn")
    parser.add_argument("--most-knots", type=int, default=4096, help="for --accuracy")
    parser.add_argument("--output", type=Path, default=_PICTURE, help="the picture")
    options = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    if options.accuracy:
        knots = {
            name: [k for k in counts if k <= options.most_knots] for name, counts in _KNOTS.items()
        }
        found = accuracy(knots)
        print(f"{'method':14} {'knots':>5} {'s':>8} {'error':>9} {'residual':>9}")
        for method, rows in found.items():
            for count, seconds, error, residual in rows:
                print(f"{method:14} {count:5} {seconds:8.4f} {error:9.2e} {residual:9.2e}")
        draw(found, options.output)
        print(f"Picture: {options.output}")
        return 0
    has_drake = _has_drake()
    if not has_drake:
        print("pydrake is not installed: only ours is measured; `make peers` installs it")
    print(f"{'':46} {'ours, s':>9} {'Drake, s':>9} {'our cost':>10} {'Drake':>10}")
    for row in comparisons(options.runs, has_drake):
        print(
            f"{row.name:46} {row.ours:9.5f} {row.theirs:9.5f} {row.our_cost:10.5f}"
            f" {row.their_cost:10.5f} {row.note}"
        )
    return 0


def _has_drake() -> bool:
    return importlib.util.find_spec("pydrake") is not None


if __name__ == "__main__":
    raise SystemExit(main())

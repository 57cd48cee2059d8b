"""How near jerk-limited motions along curves are to the best ones that a nonlinear program finds.

``python -m benchmarks.jerk_limited_optimum`` prints durations along random curves of degree 5:
ours, and those of IPOPT for s(t) with even jerks in each of many intervals. These keep limits at
the ends and in the middles of intervals only, so none is slower than the best within the limits,
but for the intervals. It takes some minutes; a test has the numbers.
"""

from __future__ import annotations

from itertools import pairwise

import casadi
import numpy as np

from scene_graph_ros.trajectories.jerk_limited import sample_jerk_limited
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

__all__ = ["curve_of", "main"]

_INTERVALS = 60
_SEEDS = range(3)
_V, _A, _JERK = 1.5, 5.0, 40.0


def curve_of(seed: int, rows: int = 3) -> tuple[PiecewisePolynomial, MotionLimits]:
    """Return a random curve of degree 5, and limits."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.0, 0.5, (6, rows)), axis=0)
    limits = MotionLimits([_V] * rows, [_A] * rows, (), [_JERK] * rows)
    return PiecewisePolynomial([0.0, 1.0], points[np.newaxis]), limits


def best_duration(curve: PiecewisePolynomial, limits: MotionLimits, guess: float) -> float:
    """Return the duration of IPOPT's motion from rest to rest."""
    degree, n = curve.degree, _INTERVALS
    program = casadi.Opti()
    jerks, states = program.variable(n), program.variable(3, n + 1)
    duration = program.variable()
    h = duration / n

    def after(state: casadi.MX, jerk: casadi.MX, t: casadi.MX) -> casadi.MX:
        s, v, a = state[0], state[1], state[2]
        return casadi.vertcat(
            s + t * (v + t * (a / 2 + t * jerk / 6)), v + t * (a + t * jerk / 2), a + t * jerk
        )

    def bernstein(points: np.ndarray, s: casadi.MX) -> casadi.MX:
        rows = [casadi.DM(points[i]) for i in range(len(points))]
        while len(rows) > 1:
            rows = [(1 - s) * a + s * b for a, b in pairwise(rows)]
        return rows[0]

    control = curve.control_points[0]
    orders = [control]
    for order in range(3):
        orders.append(np.diff(orders[-1], axis=0) * (degree - order))
    for k in range(n):
        program.subject_to(states[:, k + 1] == after(states[:, k], jerks[k], h))
        for part in (0.0, 0.5, 1.0):
            state = after(states[:, k], jerks[k], part * h)
            one, two, three = (bernstein(orders[i], state[0]) for i in (1, 2, 3))
            v, a = state[1], state[2]
            jerk = three * v**3 + 3 * two * v * a + one * jerks[k]
            for value, most in (
                (one * v, limits.velocities),
                (two * v**2 + one * a, limits.accelerations),
                (jerk, np.asarray(limits.jerks)),
            ):
                program.subject_to(program.bounded(-1, value / casadi.DM(most), 1))
    program.subject_to(states[:, 0] == casadi.DM([0, 0, 0]))
    program.subject_to(states[:, n] == casadi.DM([1, 0, 0]))
    program.subject_to(casadi.vec(states[1, :]) >= 0)
    t = np.linspace(0.0, 1.0, n + 1)
    program.set_initial(states[0, :], t**3 * (10.0 - 15.0 * t + 6.0 * t**2))
    program.set_initial(states[1, :], t**2 * (30.0 - 60.0 * t + 30.0 * t**2) / guess)
    program.set_initial(duration, guess)
    program.subject_to(duration >= 0.1 * guess)
    program.minimize(duration)
    program.solver("ipopt", {"print_time": False}, {"print_level": 0, "max_iter": 2000})
    return float(program.solve().value(duration))


def main() -> None:
    """Print the table."""
    print(f"{'curve':>6} {'ours, s':>10} {'IPOPT, s':>10} {'longer by':>10}")
    for seed in _SEEDS:
        curve, limits = curve_of(seed)
        ours = sample_jerk_limited(curve, limits).points.duration
        best = best_duration(curve, limits, 1.5 * ours)
        print(f"{seed:6} {ours:10.4f} {best:10.4f} {100.0 * (ours / best - 1.0):9.2f} %")


if __name__ == "__main__":
    main()

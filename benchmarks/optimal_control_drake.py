"""The same problems for Drake, with its own systems, classes and solvers."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from pydrake.math import BsplineBasis_
from pydrake.planning import (
    DirectCollocation,
    KinematicTrajectoryOptimization,
    ZmpPlanner,
)
from pydrake.solvers import IpoptSolver, SnoptSolver
from pydrake.symbolic import cos, sin, Variable
from pydrake.systems.primitives import SymbolicVectorSystem
from pydrake.trajectories import BsplineTrajectory, PiecewisePolynomial

from benchmarks.seven_ends import seven_ends
from benchmarks.swing_ups import SWING_UPS

__all__ = ["seven_joints", "swing_up", "zmp"]


def _system(name: str) -> Any:
    """Return the same equations as symbols of Drake's."""
    kind = SWING_UPS[name]
    x = np.array([Variable(f"x{k}") for k in range(kind.num_states)])
    u = np.array([Variable("u")])
    return SymbolicVectorSystem(state=x, input=u, dynamics=_rates(name, x, u), output=x)


def _rates(name: str, x: Any, u: Any) -> Any:
    """Return the equations of `benchmarks.swing_ups` again, as CasADi's functions do not fit."""
    from benchmarks import swing_ups

    class _Functions:
        sin, cos = staticmethod(sin), staticmethod(cos)

        @staticmethod
        def vertcat(*rows: Any) -> Any:
            return np.array(rows)

    kept, swing_ups.ca = swing_ups.ca, _Functions
    try:
        return np.array(SWING_UPS[name].f(x, u, 0.0, ()))
    finally:
        swing_ups.ca = kept


def swing_up(name: str, solver: str, samples: int = 21) -> tuple[float, str]:
    """Return the cost, its integral of straight lines between inputs, and the solver's words."""
    kind = SWING_UPS[name]
    system = _system(name)
    made = DirectCollocation(
        system, system.CreateDefaultContext(), samples, 1.0 / samples, 10.0 / samples
    )
    prog = made.prog()
    made.AddEqualTimeIntervalsConstraints()
    u = made.input()[0]
    made.AddConstraintToAllKnotPoints(u <= kind.effort)
    made.AddConstraintToAllKnotPoints(u >= -kind.effort)
    zero = np.zeros(kind.num_states)
    prog.AddBoundingBoxConstraint(zero, zero, made.initial_state())
    prog.AddBoundingBoxConstraint(kind.goal, kind.goal, made.final_state())
    made.AddRunningCost(kind.weight * u**2)
    made.AddFinalCost(made.time()[0])
    ends = np.column_stack([zero, kind.goal])
    made.SetInitialTrajectory(
        PiecewisePolynomial(), PiecewisePolynomial.FirstOrderHold([0.0, 4.0], ends)
    )
    engine = IpoptSolver() if solver == "ipopt" else SnoptSolver()
    result = engine.Solve(prog)
    words = result.get_solution_result().name
    if not result.is_success():
        return np.nan, words
    t, efforts = made.GetSampleTimes(result), made.GetInputSamples(result)[0]
    first, second = efforts[:-1], efforts[1:]
    squares = np.diff(t) @ (first**2 + first * second + second**2) / 3.0
    return float(kind.weight * squares + t[-1]), words


def seven_joints(solver: str) -> tuple[float, str]:
    """Return the cost and the solver's words."""
    start, goal = seven_ends()
    ones = np.ones(7)
    made = KinematicTrajectoryOptimization(7, 12, 4, 2.0)
    made.AddDurationCost(1.0)
    made.AddPathLengthCost(0.1)
    made.AddDurationConstraint(0.1, 20.0)
    made.AddPositionBounds(-2.8 * ones, 2.8 * ones)
    made.AddVelocityBounds(-2.0 * ones, 2.0 * ones)
    made.AddAccelerationBounds(-5.0 * ones, 5.0 * ones)
    made.AddJerkBounds(-50.0 * ones, 50.0 * ones)
    for q, s in ((start, 0.0), (goal, 1.0)):
        made.AddPathPositionConstraint(q, q, s)
        made.AddPathVelocityConstraint(0.0 * ones, 0.0 * ones, s)
    line = np.linspace(start, goal, 12)
    basis = BsplineBasis_[float](4, 12, initial_parameter_value=0.0, final_parameter_value=2.0)
    made.SetInitialGuess(BsplineTrajectory(basis, line.T))
    engine = IpoptSolver() if solver == "ipopt" else SnoptSolver()
    result = engine.Solve(made.prog())
    words = result.get_solution_result().name
    return (result.get_optimal_cost() if result.is_success() else np.nan), words


def zmp(
    breaks: np.ndarray, values: np.ndarray, state: np.ndarray, height: float, many: int
) -> tuple[float, float]:
    """Return the seconds that one plan takes, and where the centre of mass is at 3 s, m."""
    desired = PiecewisePolynomial.FirstOrderHold(breaks, values.T)
    planner, best = ZmpPlanner(), np.inf
    for _ in range(5):
        begin = time.process_time()
        for _ in range(many):
            planner.Plan(desired, state, height)
        best = min(best, (time.process_time() - begin) / many)
    return best, float(planner.get_nominal_com(3.0)[1])

"""Calls of public functions of trajectories with small arrays."""

from __future__ import annotations

from scene_graph_ros.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    DiscreteTimeTrajectory,
    ExponentialPlusPiecewisePolynomial,
    find_excess,
    FunctionHandleTrajectory,
    MotionLimits,
    PiecewisePolynomial,
    PiecewisePose,
    PiecewiseQuaternionSlerp,
    StackedTrajectory,
    TrajectoryPoints,
)

__all__ = ["CALLS"]

T = [0.0, 1, 2]
SOME = [[1.0, 2], [3.0, 5], [0.0, 7]]
TURNED = [[0.0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 0, 1]]
POSES = [TURNED, [[1.0, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], TURNED]
TURNS = [[0.0, 0, 0, 1], [0, 0, 1, 0], [1, 0, 0, 0]]
SAMPLES = {"breaks": T, "samples": SOME}


def _of(kind, name):
    """Return a call of a class's method that makes a curve, and asks it."""
    return lambda w, **arrays: getattr(kind, name)(**arrays).value(0.5)


def _made(kind, *names, **more):
    """Return a call that makes a value, and reads its arrays."""
    return lambda w, **arrays: [getattr(kind(**arrays, **more), name) for name in names]


def _poses():
    return PiecewisePose.make_linear(T, POSES)


def _spline():
    return BsplineTrajectory.clamped_uniform(SOME, 2, 0.0, 4.0)


def _slerp():
    return PiecewiseQuaternionSlerp(T, TURNS)


CURVE_AT = {
    "StackedTrajectory.value": lambda: StackedTrajectory((BezierCurve(0, 2, SOME),)).value,
    "DiscreteTimeTrajectory.value": lambda: DiscreteTimeTrajectory(T, SOME).value,
    "FunctionHandleTrajectory.value": (
        lambda: FunctionHandleTrajectory(lambda t: [t, t * t], 2).value
    ),
    "BsplineTrajectory.evaluate_linear_in_control_points": (
        lambda: (
            BsplineTrajectory.clamped_uniform(SOME, 2, 0.0, 2.0).evaluate_linear_in_control_points
        )
    ),
    "PiecewisePose.value": lambda: _poses().value,
    "PiecewisePose.get_pose": lambda: _poses().get_pose,
    "PiecewisePose.get_velocity": lambda: _poses().get_velocity,
    "PiecewisePose.get_acceleration": lambda: _poses().get_acceleration,
    "PiecewiseQuaternionSlerp.value": lambda: _slerp().value,
    "PiecewiseQuaternionSlerp.orientation": lambda: _slerp().orientation,
    "PiecewiseQuaternionSlerp.angular_velocity": lambda: _slerp().angular_velocity,
    "PiecewiseQuaternionSlerp.angular_acceleration": lambda: _slerp().angular_acceleration,
}
"""What takes times of a curve."""

CALLS = {
    **{
        name: ((lambda w, t, method=method: method()(t)), {"t": T})
        for name, method in CURVE_AT.items()
    },
    "BsplineTrajectory.insert_knots": (
        lambda w, additional_knots: _spline().insert_knots(additional_knots).control_points,
        {"additional_knots": [1.0, 3, 2]},
    ),
    "PiecewisePolynomial.integral": (
        lambda w, value_at_start_time: (
            PiecewisePolynomial.first_order_hold(T, SOME).integral(value_at_start_time).value(0.5)
        ),
        {"value_at_start_time": [1.0, 2]},
    ),
    **{
        f"PiecewisePolynomial.{name}": (_of(PiecewisePolynomial, name), arrays)
        for name, arrays in {
            "zero_order_hold": SAMPLES,
            "cubic_shape_preserving": SAMPLES,
            "lagrange_interpolating_polynomial": {"times": T, "samples": SOME},
            "cubic_with_continuous_second_derivatives": {
                **SAMPLES,
                "sample_dot_at_start": [1.0, 2],
                "sample_dot_at_end": [3.0, 0],
            },
        }.items()
    },
    "PiecewisePose.make_linear": (_of(PiecewisePose, "make_linear"), {"times": T, "poses": POSES}),
    "PiecewisePose.make_cubic_linear_with_end_linear_velocity": (
        _of(PiecewisePose, "make_cubic_linear_with_end_linear_velocity"),
        {"times": T, "poses": POSES, "start_vel": [1.0, 2, 3], "end_vel": [0.0, 1, 0]},
    ),
    "FunctionHandleTrajectory.__init__": (
        lambda w, func, func_derivative: [
            curve.value(0.5) for curve in _handles(FunctionHandleTrajectory, func, func_derivative)
        ],
        {"func": [1.0, 2], "func_derivative": [3.0, 4]},
    ),
    "BezierCurve.value": (lambda w, t: BezierCurve(0, 2, SOME).value(t), {"t": T}),
    "BsplineTrajectory.clamped_uniform": (
        lambda w, control_points: BsplineTrajectory.clamped_uniform(control_points, 2).value(0.5),
        {"control_points": SOME},
    ),
    "BsplineTrajectory.value": (
        lambda w, t: BsplineTrajectory.clamped_uniform(SOME, 2).value(t),
        {"t": [0.0, 1]},
    ),
    "CompositeTrajectory.value": (
        lambda w, t: CompositeTrajectory([BezierCurve(0, 2, SOME)]).value(t),
        {"t": T},
    ),
    "PiecewisePolynomial.value": (
        lambda w, t: PiecewisePolynomial.first_order_hold(T, SOME).value(t),
        {"t": T},
    ),
    "PiecewisePolynomial.first_order_hold": (
        lambda w, breaks, samples: PiecewisePolynomial.first_order_hold(breaks, samples).value(1),
        {"breaks": T, "samples": SOME},
    ),
    "PiecewisePolynomial.cubic_hermite": (
        lambda w, breaks, samples, samples_dot: PiecewisePolynomial.cubic_hermite(
            breaks, samples, samples_dot
        ).value(0.5),
        {"breaks": T, "samples": SOME, "samples_dot": SOME},
    ),
    "PiecewisePolynomial.quintic_hermite": (
        lambda w, breaks, samples, samples_dot, samples_ddot: PiecewisePolynomial.quintic_hermite(
            breaks, samples, samples_dot, samples_ddot
        ).value(0.5),
        {"breaks": T, "samples": SOME, "samples_dot": SOME, "samples_ddot": SOME},
    ),
    "find_excess": (
        lambda w, lower, upper: find_excess(
            BezierCurve(0, 2, SOME), w.limits, lower=lower, upper=upper
        ),
        {"lower": [1.0, 2], "upper": [3.0, 5]},
    ),
    "BezierCurve.__init__": (
        _made(BezierCurve, "control_points", start_time=0, end_time=2),
        {"control_points": SOME},
    ),
    "BsplineTrajectory.__init__": (
        _made(BsplineTrajectory, "knots", "control_points"),
        {"knots": [0.0, 0, 1, 2, 2], "control_points": SOME},
    ),
    "DiscreteTimeTrajectory.__init__": (
        _made(DiscreteTimeTrajectory, "times", "values"),
        {"times": T, "values": SOME},
    ),
    "ExponentialPlusPiecewisePolynomial.__init__": (
        lambda w, rates, coefficients: ExponentialPlusPiecewisePolynomial(
            rates, coefficients, PiecewisePolynomial.first_order_hold(T, SOME)
        ).value(0.5),
        {"rates": [0.0, 1], "coefficients": [[[1.0, 2], [3, 4]], [[1, 0], [0, 1]]]},
    ),
    "MotionLimits.__init__": (
        _made(MotionLimits, "velocities", "accelerations", "jerks", names=("a", "b")),
        {"velocities": [1.0, 2], "accelerations": [3.0, 4], "jerks": [5.0, 6]},
    ),
    "PiecewisePolynomial.__init__": (
        _made(PiecewisePolynomial, "breaks", "control_points"),
        {"breaks": T, "control_points": [SOME, SOME]},
    ),
    "PiecewiseQuaternionSlerp.__init__": (
        _made(PiecewiseQuaternionSlerp, "breaks", "quaternions"),
        {"breaks": T, "quaternions": TURNS},
    ),
    "TrajectoryPoints.__init__": (
        _made(TrajectoryPoints, "nanoseconds", "positions", "velocities", "accelerations"),
        {"nanoseconds": T, "positions": SOME, "velocities": SOME, "accelerations": SOME},
    ),
}


def _handles(kind, func, func_derivative):
    """Return a curve of functions that return arrays, and what is made of it."""
    curve = kind(lambda t: func, 2, 0.0, 2.0, lambda t, order: func_derivative)
    later = curve.scale_time(2.0).shift_right(1.0).reverse_time()
    return later.derivative(), curve.derivative(), later, curve

"""The public names of `scene_graph_ros.trajectories`, which has the curves and retimers."""

from scene_graph_ros.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    ExponentialPlusPiecewisePolynomial,
    find_excess,
    LimitExcess,
    MotionLimits,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    retime,
    Retimer,
    RetimingError,
    Trajectory,
    TrajectoryError,
    TrajectoryPoints,
)

__all__ = [
    "BezierCurve",
    "BsplineTrajectory",
    "CompositeTrajectory",
    "ExponentialPlusPiecewisePolynomial",
    "LimitExcess",
    "MotionLimits",
    "PathParameterizedTrajectory",
    "PiecewisePolynomial",
    "Retimer",
    "RetimingError",
    "Trajectory",
    "TrajectoryError",
    "TrajectoryPoints",
    "find_excess",
    "retime",
]

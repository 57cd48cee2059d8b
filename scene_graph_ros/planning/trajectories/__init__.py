"""Curves in time, the fastest ones along a path, and whether they keep limits at all times."""

from scene_graph_ros.planning.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.planning.trajectories.bspline_trajectory import BsplineTrajectory
from scene_graph_ros.planning.trajectories.composite_trajectory import CompositeTrajectory
from scene_graph_ros.planning.trajectories.errors import TrajectoryError
from scene_graph_ros.planning.trajectories.exponential_plus_piecewise_polynomial import (
    ExponentialPlusPiecewisePolynomial,
)
from scene_graph_ros.planning.trajectories.motion_limits import (
    find_excess,
    LimitExcess,
    MotionLimits,
)
from scene_graph_ros.planning.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.planning.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.planning.trajectories.retimer import Retimer, RetimingError
from scene_graph_ros.planning.trajectories.time_optimal import retime
from scene_graph_ros.planning.trajectories.trajectory import Trajectory
from scene_graph_ros.planning.trajectories.trajectory_points import TrajectoryPoints

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

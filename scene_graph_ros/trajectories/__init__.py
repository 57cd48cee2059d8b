"""Curves in time, the fastest ones along a path, and whether they keep limits at all times."""

from scene_graph_ros.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory
from scene_graph_ros.trajectories.discrete_time_trajectory import DiscreteTimeTrajectory
from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.exponential_plus_piecewise_polynomial import (
    ExponentialPlusPiecewisePolynomial,
)
from scene_graph_ros.trajectories.function_handle_trajectory import FunctionHandleTrajectory
from scene_graph_ros.trajectories.motion_limits import (
    find_excess,
    LimitExcess,
    MotionLimits,
)
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.piecewise_pose import PiecewisePose
from scene_graph_ros.trajectories.piecewise_quaternion_slerp import PiecewiseQuaternionSlerp
from scene_graph_ros.trajectories.retimer import Retimer
from scene_graph_ros.trajectories.stacked_trajectory import StackedTrajectory
from scene_graph_ros.trajectories.time_optimal import retime
from scene_graph_ros.trajectories.trajectory import Trajectory
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = [
    "BezierCurve",
    "BsplineTrajectory",
    "CompositeTrajectory",
    "DiscreteTimeTrajectory",
    "ExponentialPlusPiecewisePolynomial",
    "FunctionHandleTrajectory",
    "LimitExcess",
    "MotionLimits",
    "PathParameterizedTrajectory",
    "PiecewisePolynomial",
    "PiecewisePose",
    "PiecewiseQuaternionSlerp",
    "Retimer",
    "RetimingError",
    "StackedTrajectory",
    "Trajectory",
    "TrajectoryError",
    "TrajectoryPoints",
    "find_excess",
    "retime",
]

"""Trajectories as paths of unit time a segment, and without the jumps of whole turns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scene_graph_ros.convex.questions.arguments import as_nonnegative
from scene_graph_ros.convex.sets.pairwise_intersections import as_joints
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import whole_array
from scene_graph_ros.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory
from scene_graph_ros.trajectories.errors import TrajectoryError

__all__ = ["normalize_segment_times", "unwrap_to_continuous_trajectory"]

_TURN = 2.0 * np.pi


def normalize_segment_times(trajectory: CompositeTrajectory) -> CompositeTrajectory:
    """Return the path r(s): the same segments, each of 1 s, from the same start time on.

    Raises TrajectoryError for segments of other kinds than `BezierCurve`.
    """
    start = trajectory.start_time
    return CompositeTrajectory(
        tuple(
            BezierCurve(start + k, start + k + 1.0, segment.control_points)
            for k, segment in enumerate(_bezier_segments(trajectory, "normalize_segment_times"))
        )
    )


def unwrap_to_continuous_trajectory(
    gcs_trajectory: CompositeTrajectory,
    continuous_revolute_joints: Sequence[int],
    starting_rounds: Sequence[int] | None = None,
    tol: float = 1e-8,
) -> CompositeTrajectory:
    """Return a trajectory with whole turns added to segments, so that each begins where one ended.

    With ``starting_rounds`` each joint begins in [2 pi k, 2 pi (k + 1)) for its k, otherwise where
    it is. Raises TrajectoryError where a segment begins elsewhere than a number of whole turns
    away, to ``tol`` (rad), or is no `BezierCurve`; ConvexSetError for joints it doesn't have.
    """
    label = "unwrap_to_continuous_trajectory"
    segments = _bezier_segments(gcs_trajectory, label)
    joints = as_joints(continuous_revolute_joints, gcs_trajectory.rows, label)
    most = as_nonnegative(tol, f"{label}: tol")
    shift = np.zeros(gcs_trajectory.rows)
    if starting_rounds is not None:
        begin = segments[0].initial_value[joints]
        shift[joints] = _TURN * (_rounds(starting_rounds, len(joints)) - np.floor(begin / _TURN))
    result: list[BezierCurve] = []
    for k, segment in enumerate(segments):
        if result:
            way = result[-1].final_value - segment.initial_value
            shift = np.zeros(gcs_trajectory.rows)
            shift[joints] = _TURN * np.rint(way[joints] / _TURN)
            off = np.abs(way - shift)
            if off.max(initial=0.0) > most:
                row = int(np.argmax(off))
                raise TrajectoryError(
                    f"{label}: entry {row} begins segment {k} at"
                    f" {segment.initial_value[row]:.10g}, which is {off[row]:.3g} and whole turns"
                    " from where the one before ends"
                )
        result.append(segment + shift)
    return CompositeTrajectory(tuple(result))


def _rounds(given: Any, size: int) -> np.ndarray:
    """Return a whole number for each joint. Raises TrajectoryError."""
    rule = f"starting_rounds must be {size} whole numbers, one for each joint"
    rounds = whole_array(given, rule, TrajectoryError)
    if rounds.shape != (size,):
        raise TrajectoryError(f"{rule}, not {quoted(given)}")
    return rounds


def _bezier_segments(trajectory: Any, label: str) -> list[BezierCurve]:
    if not isinstance(trajectory, CompositeTrajectory):
        raise TrajectoryError(
            f"{label}: a CompositeTrajectory is needed, not {quoted(trajectory)}"
        )
    for k, segment in enumerate(trajectory.segments):
        if not isinstance(segment, BezierCurve):
            raise TrajectoryError(
                f"{label}: segments[{k}] must be a BezierCurve, not {quoted(segment)}"
            )
    return [segment for segment in trajectory.segments if isinstance(segment, BezierCurve)]

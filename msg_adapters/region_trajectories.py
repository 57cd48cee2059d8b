"""Trajectories through regions of configurations to messages, and how they are to be found."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np

from msg_adapters.arrays import float64s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import configurations_to_msg, RobotNames
from scene_graph_msgs.msg import RegionTrajectory, RegionTrajectoryOptions
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.trajectories import BezierCurve, CompositeTrajectory

__all__ = ["RegionTrajectoryRules", "region_trajectory_to_msg", "rules_from_msg"]

_HIGHEST_ORDER = 20
"""Of curves: their programs grow with it, and no motion needs more."""


_MOST_WAYS = 1000
"""Of a relaxation: each is a program of its own, which is not interrupted."""


class RegionTrajectoryRules(NamedTuple):
    """Options of growing and of the trajectory, checked."""

    growing: dict[str, Any]
    """Of `IrisZoOptions`."""
    growth_padding: float
    """m."""
    curves: dict[str, Any]
    """Of `plan_through_regions`."""
    search: dict[str, Any]
    """Of `GraphOfConvexSetsOptions`."""


def rules_from_msg(message: RegionTrajectoryOptions, field: str) -> RegionTrajectoryRules:
    """Return the options but for the regions; raises MessageError naming the field."""

    def between(name: str, low: float, high: float, words: str) -> float:
        value = float(getattr(message, name))
        if not low <= value <= high:
            raise MessageError(f"{field}.{name} must be {words}, not {value:g}")
        return value

    inside = "a number above 0 and below 1"
    tiny, most = np.finfo(np.float64).tiny, math.nextafter(1.0, 0.0)
    growing = {
        "epsilon": between("epsilon", tiny, most, inside),
        "delta": between("delta", tiny, most, inside),
        "configuration_space_margin": between(
            "configuration_space_margin", 0.0, MAX_COORDINATE, "a number from 0 on"
        ),
        "num_particles": int(between("num_particles", 1, math.inf, "at least 1")),
    }
    padding = between("growth_padding", 0.0, MAX_COORDINATE, "a number from 0 on")
    order = int(between("order", 1, _HIGHEST_ORDER, f"a whole number from 1 to {_HIGHEST_ORDER}"))
    words = f"a whole number from 0 to the order, {order}"
    curves = {
        "order": order,
        "continuity_order": int(between("continuity_order", 0, order, words)),
        "time_weight": between("time_weight", 0.0, MAX_COORDINATE, "a number from 0 on"),
        "length_weight": between("length_weight", 0.0, MAX_COORDINATE, "a number from 0 on"),
    }
    if not curves["time_weight"] and not curves["length_weight"]:
        raise MessageError(
            f"{field}.time_weight and {field}.length_weight are both 0: then every way costs the"
            " same"
        )
    search = {
        "convex_relaxation": not message.search,
        "max_rounded_paths": int(
            between("max_rounded_paths", 1, _MOST_WAYS, f"from 1 to {_MOST_WAYS}")
        ),
        "max_search_programs": int(message.max_search_programs),
    }
    return RegionTrajectoryRules(growing, padding, curves, search)


def region_trajectory_to_msg(
    trajectory: CompositeTrajectory,
    regions: Sequence[str],
    names: RobotNames,
    positions: Sequence[int],
    *,
    cost: float,
    lower_bound: float,
    grown: str,
) -> RegionTrajectory:
    """Return a trajectory of some positions, whose Bézier curves are in regions by name.

    ``positions`` are rows of ``names``, one for each row of the trajectory.
    """
    curves = [each for each in trajectory.segments if isinstance(each, BezierCurve)]
    points = np.concatenate([each.control_points for each in curves])
    whole = np.zeros((len(points), len(names.names)))
    whole[:, positions] = points
    return RegionTrajectory(
        regions=list(regions),
        order=curves[0].order,
        control_points=configurations_to_msg(names, whole, positions),
        durations=float64s_to_msg([each.end_time - each.start_time for each in curves]),
        cost=cost,
        lower_bound=lower_bound,
        gap=max(0.0, cost - lower_bound),
        grown=grown,
    )

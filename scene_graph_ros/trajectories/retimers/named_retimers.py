"""Retimers by their names."""

from __future__ import annotations

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.retimer import Retimer, TimeOptimalRetimer
from scene_graph_ros.trajectories.retimers.retimer_libraries import get_ruckig, get_toppra
from scene_graph_ros.trajectories.retimers.ruckig_retimer import RuckigRetimer
from scene_graph_ros.trajectories.retimers.toppra_retimer import ToppraRetimer

__all__ = ["as_retimer"]

_NAMES: dict[str, type[Retimer]] = {
    "time_optimal": TimeOptimalRetimer,
    "toppra": ToppraRetimer,
    "ruckig": RuckigRetimer,
}


def as_retimer(retimer: Retimer | str, grid_points: int | None = None) -> Retimer:
    """Return a retimer by its name; our own has so many ``grid_points``.

    Raises TrajectoryError for an unknown one, and for ``grid_points`` of another one than our own;
    MissingRetimerError where it is not installed.
    """
    if retimer == "time_optimal" and grid_points is not None:
        return TimeOptimalRetimer(grid_points)
    if isinstance(retimer, str) and retimer in _NAMES:
        retimer = _NAMES[retimer]()
    if not isinstance(retimer, Retimer):
        names = ", ".join(map(repr, _NAMES))
        raise TrajectoryError(
            f"retimer must be one of {names}, a ToppraRetimer or a RuckigRetimer, not"
            f" {quoted(retimer)}"
        )
    if grid_points is not None:
        raise TrajectoryError(
            "grid_points are our own retimer's: give ToppraRetimer(grid_points=...) as retimer"
        )
    if isinstance(retimer, ToppraRetimer):
        get_toppra()
    elif isinstance(retimer, RuckigRetimer):
        get_ruckig()
    return retimer

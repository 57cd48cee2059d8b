"""The planners of paths, and the factory of each one's search."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.paths.manifold.manifold_search import ManifoldSearch
from scene_graph_ros.planning.paths.ompl_bridge.ompl_planner import OmplPlanner, OmplSearch
from scene_graph_ros.planning.paths.search.path_search import PathSearch, SearchTask

if TYPE_CHECKING:
    from scene_graph_ros.planning.paths.roadmaps.roadmap import Roadmap

__all__ = ["PLANNERS", "check_planner", "new_search"]


def _by_two_trees(task: SearchTask, roadmap: Roadmap | None) -> PathSearch:
    return PathSearch(task)


def _by_roadmap(task: SearchTask, roadmap: Roadmap | None) -> PathSearch:
    from scene_graph_ros.planning.paths.roadmaps.roadmap_search import RoadmapSearch

    return RoadmapSearch(task, roadmap)


_SEARCHES = {"rrt_connect": _by_two_trees, "prm": _by_roadmap}

PLANNERS = tuple(_SEARCHES)
"""What may be asked for."""


def check_planner(
    planner: object, roadmap: Roadmap | None, *, has_constraints: bool = False
) -> None:
    """Raise PlanningError for an unknown planner, and for what it does not take."""
    if planner not in PLANNERS and not isinstance(planner, OmplPlanner):
        known = ", ".join(PLANNERS)
        raise PlanningError(
            f"planner must be one of {known}, or an OmplPlanner, not {quoted(planner)}"
        )
    if roadmap is not None and planner != "prm":
        raise PlanningError(f"a roadmap is for the planner 'prm', not for {quoted(planner)}")
    if has_constraints and planner != "rrt_connect":
        raise PlanningError(
            f"constraints are for the planner 'rrt_connect', not for {quoted(planner)}"
        )


def new_search(
    planner: str | OmplPlanner,
    roadmap: Roadmap | None,
    timeout: float | None,
    held: HeldConstraints,
    moves: NDArray[np.bool_],
) -> Callable[..., PathSearch]:
    """Return the factory of a search. Raises MissingOmplError, and PlanningError as it does.

    ``held`` are conditions that hold along paths, ``moves`` ``(nq,)`` the positions that may move.
    """
    if held:
        return partial(ManifoldSearch, held=held, moves=moves)
    if isinstance(planner, OmplPlanner):
        planner.check_name()
        return partial(OmplSearch, planner=planner, timeout=timeout)
    return partial(_SEARCHES[planner], roadmap=roadmap)

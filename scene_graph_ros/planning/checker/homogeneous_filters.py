"""Whether the scene filters all geometries of two bodies alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.checker.body_matrices import CHECKED
from scene_graph_ros.planning.checker.checker_state import CheckerState
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["HeterogeneousFiltersError", "as_switch", "demand_homogeneous_filters"]


class HeterogeneousFiltersError(CollisionCheckerError):
    """A scene filters some geometries of two bodies, and others not."""


def as_switch(value: object) -> bool:
    """Return True or False. Raises CollisionCheckerError for anything else."""
    if not isinstance(value, (bool, np.bool_)):
        raise CollisionCheckerError(
            f"require_homogeneous_filters must be True or False, not {quoted(value)}"
        )
    return bool(value)


def demand_homogeneous_filters(state: CheckerState) -> None:
    """Raise HeterogeneousFiltersError where a scene's filters leave a part of two bodies' pairs.

    Pairs that no joint moves against each other are never checked, so they do not matter.
    """
    a, b = state.bodies_of_all.T
    allowed = state.plan.all_pairs.allowed
    is_robot = a < state.bodies.num_robot_bodies
    filtered = state.nominal.filtered[np.where(is_robot, a, 0), b]
    # Of bodies that are checked at all some geometries are.
    heterogeneous = np.flatnonzero((filtered == CHECKED) & is_robot & ~allowed)
    if not len(heterogeneous):
        return
    first = int(heterogeneous[0])
    same = (np.sort(state.bodies_of_all) == np.sort(state.bodies_of_all[first])).all(axis=1)
    left = int(np.flatnonzero(same & allowed)[0])
    one, other = (state.bodies.all[body].name for body in state.bodies_of_all[first])
    raise HeterogeneousFiltersError(
        f"bodies {one!r} and {other!r} are filtered heterogeneously: {_words(state, first)} are"
        f" filtered, {_words(state, left)} are not; filter all of their pairs in the scene or"
        " none, or leave require_homogeneous_filters off: then each pair is as the scene has it"
    )


def _words(state: CheckerState, pair: int) -> str:
    """Return the names of a pair of all pairs."""
    table, inspector = state.plan.all_pairs.table, state.snapshot.inspector

    def name(body: int) -> Any:
        return inspector.get_name(state.plan.geometry_ids[body])

    one, other = (name(int(body)) for body in table.bodies[pair])
    return f"{one!r} and {other!r}"

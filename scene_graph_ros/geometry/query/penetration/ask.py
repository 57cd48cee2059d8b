"""Ask which pairs penetrate, and how deep; or whether any does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.candidates.rows import candidate_rows
from scene_graph_ros.geometry.query.distance.driver import FIRST_PENETRATION, PENETRATIONS
from scene_graph_ros.geometry.query.distance.solve import ID_COLUMNS, pair_columns, Recipes, solve
from scene_graph_ros.geometry.query.distance.solved_pairs import WORLD
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.query.on_demand import on_demand
from scene_graph_ros.geometry.query.results import Penetrations
from scene_graph_ros.geometry.query.settings import Settings, settings_of

__all__ = ["compute_point_pair_penetration", "has_collisions", "penetrations_of"]


def has_collisions(
    memo: Memo, accuracy: Accuracy | str | None, engine: Engine | str | None
) -> bool:
    """Answer `QueryObject.has_collisions`."""
    settings = settings_of(memo.snapshot, accuracy, engine)
    return memo.get(("collides", settings), collides, settings)


def compute_point_pair_penetration(
    memo: Memo,
    derivatives: bool,
    certificate: bool,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
) -> Penetrations:
    """Answer `QueryObject.compute_point_pair_penetration`."""
    settings = settings_of(memo.snapshot, accuracy, engine, derivatives, certificate)
    return memo.get(("penetrations", settings), penetrations, settings)


def collides(snapshot: Snapshot, settings: Settings) -> bool:
    """Tell whether any pair penetrates; stops at the first."""
    pairs = candidate_rows(snapshot, 0.0)
    if len(pairs):
        solved = solve(snapshot, pairs, 0.0, FIRST_PENETRATION, settings, "has_collisions", WORLD)
        if len(solved) > 0:
            return True
    if snapshot.proximity.has_elements:
        return bool(on_demand("elements_collide")(snapshot, settings))
    return False


def penetrations(snapshot: Snapshot, settings: Settings) -> Penetrations:
    """Return all penetrating pairs."""
    pairs = candidate_rows(snapshot, 0.0)
    return penetrations_of(snapshot, pairs, settings, "compute_point_pair_penetration")


def penetrations_of(
    snapshot: Snapshot, pairs: NDArray[np.int64], settings: Settings, query: str
) -> Penetrations:
    """Return those of the (m, 2) rows ``pairs`` that penetrate; ``query`` is named in messages.

    With all of shapes of many elements, which are no rows.
    """
    solved = solve(snapshot, pairs, 0.0, PENETRATIONS, settings, query, WORLD)
    table = Penetrations(pair_columns(_COLUMNS, snapshot, solved, settings), snapshot.state)
    if snapshot.proximity.has_elements:
        table = on_demand("penetrations_with_elements")(snapshot, table, settings)
    return table


_COLUMNS: Recipes = {
    **ID_COLUMNS,
    "p_WCa": lambda answers: answers[1].p_WCa,
    "p_WCb": lambda answers: answers[1].p_WCb,
    "nhat_BA_W": lambda answers: answers[1].nhat_BA_W,
    "depth": lambda answers: -answers[1].distance,
}

"""Run the narrow phase on pairs of rows: the common part of penetration and distance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import BOUNDS, Engine
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.distance.driver import solve_pairs
from scene_graph_ros.geometry.query.distance.solved_pairs import BOTH, NO_FAILURE, SolvedPairs
from scene_graph_ros.geometry.query.distance.witness_derivatives import witness_derivatives
from scene_graph_ros.geometry.query.results import LateColumns
from scene_graph_ros.geometry.query.settings import Settings
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["ID_COLUMNS", "Recipes", "describe", "pair_columns", "solve"]

_FCL = Engine.FCL  # a look-up of a member takes longer


def solve(
    snapshot: Snapshot,
    pairs: NDArray[np.int64],
    max_distance: float,
    keep: int,
    settings: Settings,
    query: str,
    points: int,
) -> SolvedPairs:
    """Do the same as ``solve_pairs``, with more points where settings need them.

    Raises UnsupportedPairError for two half spaces.
    """
    if settings.engine is _FCL:
        from scene_graph_ros.geometry.query.distance.fcl_engine import solve_pairs_with_fcl

        solved = solve_pairs_with_fcl(
            snapshot, pairs, max_distance, keep, lambda row: describe(snapshot, row), query
        )
    else:
        solved = solve_pairs(
            snapshot.proximity.held,
            snapshot.X_WG,
            pairs,
            max_distance,
            keep,
            BOUNDS[settings.accuracy],
            settings.certificate,
            BOTH if settings.certificate or settings.derivatives else points,
        )
    if solved.failed != NO_FAILURE:
        names = [describe(snapshot, row) for row in pairs[solved.failed]]
        raise UnsupportedPairError(
            f"{query}: {names[0]} against {names[1]} has no answer: two half spaces overlap"
            " without bound unless they are parallel. Filter the pair, or anchor both."
        )
    return solved


def describe(snapshot: Snapshot, row: int) -> str:
    """Name a row of the proximity arrays in a message."""
    geometry_id = snapshot.proximity.geometry_ids[row]
    kind = ShapeKind(snapshot.proximity.table.kind[row])
    return f"{kind.name} {snapshot.inspector.get_name(geometry_id)!r} ({geometry_id!r})"


Answers = tuple[NDArray[np.int64], SolvedPairs]
"""What the columns of a result are made of: ids (n,) of the rows, and what was found."""

Recipes = Mapping[str, Callable[[Answers], NDArray[Any]]]

ID_COLUMNS: Recipes = {
    "id_A": lambda answers: answers[0][answers[1].rows_A],
    "id_B": lambda answers: answers[0][answers[1].rows_B],
}


def pair_columns(
    recipes: Recipes, snapshot: Snapshot, solved: SolvedPairs, settings: Settings
) -> LateColumns:
    """Return the columns of a result: those that it always has, and those asked for."""
    if settings.derivatives or settings.certificate:
        recipes = {**recipes, **_asked_for(snapshot, solved, settings)}
    return LateColumns(recipes, (snapshot.proximity.ids, solved), solved.count)


def _asked_for(snapshot: Snapshot, solved: SolvedPairs, settings: Settings) -> Recipes:
    """Return the columns beside those that every result has; they are made by now."""
    columns: dict[str, NDArray[Any]] = {}
    if settings.derivatives:
        columns |= _derivatives(snapshot, solved)
        columns |= witness_derivatives(snapshot.proximity.table, snapshot.X_WG, solved)
    if settings.certificate:
        columns["gap"] = solved.gap
        columns["decided_by"] = solved.decided_by
    return {name: _made(column) for name, column in columns.items()}


def _made(column: NDArray[Any]) -> Callable[[Answers], NDArray[Any]]:
    return lambda _answers: column


def _derivatives(snapshot: Snapshot, solved: SolvedPairs) -> dict[str, NDArray[np.float64]]:
    """Differentiate the distance with respect to both poses.

    The witness points are stationary to first order (envelope theorem), so the distance changes
    at the rate nhat . (v_Ca - v_Cb), the velocities of A's and B's material points there.
    """
    rows, nhat, X_WG = solved.rows, solved.nhat_BA_W, snapshot.X_WG
    result = {}
    for side, (name, witness, sign) in enumerate(
        (("ddistance_dX_WA", solved.p_WCa, 1.0), ("ddistance_dX_WB", solved.p_WCb, -1.0))
    ):
        arm = witness - X_WG[rows[:, side], :3, 3]
        result[name] = sign * np.concatenate([np.cross(arm, nhat), nhat], axis=1)
    return result

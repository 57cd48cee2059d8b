"""Run the narrow phase on pairs of rows: what penetration and distance have in common."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Engine
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.proximity import shape_table
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.query.distance.driver import NO_FAILURE, solve_pairs
from scene_graph_ros.geometry.query.distance.witness_derivatives import witness_derivatives
from scene_graph_ros.geometry.query.settings import Settings
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.held_table import HeldTable, hold

__all__ = ["describe", "extra_columns", "solve"]


@derived(Role.PROXIMITY)
def _held_table(state: GeometryState) -> HeldTable:
    return hold(shape_table(state))


def solve(
    snapshot: Snapshot,
    pairs: NDArray[np.int64],
    max_distance: float,
    keep: int,
    settings: Settings,
    query: str,
) -> tuple[NDArray[Any], ...]:
    """Return the columns of ``solve_pairs``. Raises UnsupportedPairError for two half spaces."""
    if settings.engine is Engine.FCL:
        from scene_graph_ros.geometry.query.distance.fcl_engine import solve_pairs_with_fcl

        *columns, failed = solve_pairs_with_fcl(
            snapshot, pairs, max_distance, keep, lambda row: describe(snapshot, row), query
        )
    else:
        *columns, failed = solve_pairs(
            _held_table(snapshot.state),
            snapshot.X_WG,
            pairs,
            max_distance,
            keep,
            settings.accuracy.bound,
            settings.certificate,
        )
    if failed != NO_FAILURE:
        names = [describe(snapshot, row) for row in pairs[failed]]
        raise UnsupportedPairError(
            f"{query}: {names[0]} against {names[1]} has no answer: two half spaces overlap"
            " without bound unless they are parallel. Filter the pair, or anchor both."
        )
    return tuple(columns)


def describe(snapshot: Snapshot, row: int) -> str:
    """Name a row of the proximity arrays in a message."""
    geometry_id = snapshot.proximity.geometry_ids[row]
    kind = ShapeKind(snapshot.proximity.table.kind[row])
    return f"{kind.name} {snapshot.inspector.get_name(geometry_id)!r} ({geometry_id!r})"


def extra_columns(
    snapshot: Snapshot, columns: tuple[NDArray[Any], ...], settings: Settings
) -> dict[str, NDArray[Any]]:
    """Return the columns that were asked for beside those that every result has."""
    result: dict[str, NDArray[Any]] = {}
    if settings.derivatives:
        result |= _derivatives(snapshot, columns[0], columns)
        result |= witness_derivatives(snapshot.proximity.table, snapshot.X_WG, columns)
    if settings.certificate:
        result["gap"] = columns[8]
        result["decided_by"] = columns[9]
    return result


def _derivatives(
    snapshot: Snapshot, rows: NDArray[np.int64], columns: tuple[NDArray[Any], ...]
) -> dict[str, NDArray[np.float64]]:
    """Differentiate the distance with respect to both poses.

    The witness points are stationary to first order (envelope theorem), so the distance changes
    at the rate nhat . (v_Ca - v_Cb), the velocities of A's and B's material points there.
    """
    nhat, X_WG = columns[6], snapshot.X_WG
    result = {}
    for side, (name, witness, sign) in enumerate(
        (("ddistance_dX_WA", columns[4], 1.0), ("ddistance_dX_WB", columns[5], -1.0))
    ):
        arm = witness - X_WG[rows[:, side], :3, 3]
        result[name] = sign * np.concatenate([np.cross(arm, nhat), nhat], axis=1)
    return result

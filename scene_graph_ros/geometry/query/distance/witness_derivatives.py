"""How the witness points of a pair move with the poses of both shapes.

At each witness the surface is described to first order (``local_surface``). With the unknown
parameters mu of both descriptions, the witnesses keep their optimality:

- the normals stay opposite: ``dm_A + dm_B = 0`` with ``dm = omega x m + T s mu``;
- the way between the witnesses stays along the normal: the part of ``da - db - phi dn`` across n
  is zero, with ``da = v + T w mu``, v being the velocity of the shape's material point.

T holds the two principal directions of a surface as columns. These are four linear equations for
four parameters, overlapping or apart. They are singular where the witness is a choice.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.query.distance.local_surface import local_surfaces
from scene_graph_ros.geometry.query.distance.solved_pairs import SolvedPairs
from scene_graph_ros.geometry.query.distance.witness_systems import solve_witnesses
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["witness_derivatives"]

FloatArray = NDArray[np.float64]


def _skew(v: FloatArray) -> FloatArray:
    """Return the (k, 3, 3) matrices of ``v x``."""
    result = np.zeros((len(v), 3, 3))
    result[:, 0, 1], result[:, 0, 2], result[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    result[:, 1, 0], result[:, 2, 0], result[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return result


def _described(
    table: Any,
    X_WG: FloatArray,
    rows: NDArray[np.int64],
    p_GC: FloatArray,
    m_W: FloatArray,
) -> tuple[NDArray[np.bool_], FloatArray, FloatArray, FloatArray]:
    """Return (is_smooth (k,), T_W (k, 3, 2), w (k, 2), s (k, 2)) of one side of the pairs."""
    k = len(rows)
    is_smooth, first, turns = np.empty(k, np.bool_), np.empty((k, 3)), np.empty((k, 4))
    local_surfaces(
        table, X_WG, np.ascontiguousarray(rows), np.array(p_GC), m_W, is_smooth, first, turns
    )
    T_W = np.stack([first, np.cross(m_W, first)], axis=2)
    return is_smooth, T_W, turns[:, ::2], turns[:, 1::2]


def witness_derivatives(
    table: Any, X_WG: FloatArray, solved: SolvedPairs
) -> dict[str, NDArray[Any]]:
    """Differentiate the witness points of k pairs with respect to both poses.

    Args:
        table: the ShapeTable that was solved.
        X_WG: (n, 4, 4), the poses that were solved.
        solved: k pairs.

    Returns:
        ``dp_WCa_dX_WA``, ``dp_WCa_dX_WB``, ``dp_WCb_dX_WA``, ``dp_WCb_dX_WB``, each (k, 3, 6):
        the witness moves at ``dp_WCa_dX_WA @ V_WA`` in W when A moves with the spatial velocity
        V_WA = (angular; of A's origin), in W. ``is_witness_differentiable`` (k,): False where the
        witnesses or the normal are a choice, or at a kink of a surface; each witness then counts
        as a point fixed to its own shape, so that all entries are finite.

    """
    rows, phi, nhat = solved.rows, solved.distance, solved.nhat_BA_W
    k = len(rows)
    smooth_A, T_A, w_A, s_A = _described(table, X_WG, rows[:, 0], solved.p_ACa, -nhat)
    smooth_B, T_B, w_B, s_B = _described(table, X_WG, rows[:, 1], solved.p_BCb, np.array(nhat))
    # Velocities of the material points at the witnesses, for (V_WA, V_WB): (k, 3, 12).
    v_a, v_b = np.zeros((k, 3, 12)), np.zeros((k, 3, 12))
    v_a[:, :, 0:3] = -_skew(solved.p_WCa - X_WG[rows[:, 0], :3, 3])
    v_b[:, :, 6:9] = -_skew(solved.p_WCb - X_WG[rows[:, 1], :3, 3])
    v_a[:, :, 3:6] = v_b[:, :, 9:12] = np.eye(3)
    # omega x n = -skew(n) omega.
    turn = -_skew(nhat)
    P = np.swapaxes(T_A, 1, 2)  # onto the tangent plane, in A's principal directions
    PT_B = product(P, T_B)
    size = np.maximum(table.scale[rows[:, 0]], table.scale[rows[:, 1]])[:, None, None]
    matrix, right = np.zeros((k, 4, 4)), np.zeros((k, 4, 12))
    matrix[:, :2, :2] = s_A[:, None, :] * np.eye(2)
    matrix[:, :2, 2:] = PT_B * s_B[:, None, :]
    right[:, :2, 0:3] = product(P, turn)
    right[:, :2, 6:9] = -right[:, :2, 0:3]
    matrix[:, 2:, :2] = w_A[:, None, :] * np.eye(2) / size
    matrix[:, 2:, 2:] = -PT_B * (w_B + phi[:, None] * s_B)[:, None, :] / size
    dn = np.zeros((k, 3, 12))
    dn[:, :, 6:9] = turn
    right[:, 2:] = product(P, v_b - v_a + phi[:, None, None] * dn) / size
    is_solvable = smooth_A & smooth_B & solved.is_unique & np.isfinite(matrix).all(axis=(1, 2))
    solve_witnesses(matrix, right, is_solvable)
    da = v_a + product(T_A * w_A[:, None, :], right[:, :2])
    db = v_b + product(T_B * w_B[:, None, :], right[:, 2:])
    return {
        "dp_WCa_dX_WA": np.ascontiguousarray(da[:, :, :6]),
        "dp_WCa_dX_WB": np.ascontiguousarray(da[:, :, 6:]),
        "dp_WCb_dX_WA": np.ascontiguousarray(db[:, :, :6]),
        "dp_WCb_dX_WB": np.ascontiguousarray(db[:, :, 6:]),
        "is_witness_differentiable": is_solvable,
    }

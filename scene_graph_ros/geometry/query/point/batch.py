"""Signed distance from many points to all rows of a shape table, in one call."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.query.point.all_shapes import answer_all
from scene_graph_ros.geometry.query.point.answers import Answers, new_answers
from scene_graph_ros.geometry.query.point.kind_table import group_by_kind, HeldKinds, hold_kinds
from scene_graph_ros.geometry.query.point.within_distance import (
    answer_within,
    Columns,
    world_boxes,
)

__all__ = ["distance_points", "distances_to_all"]

Result = TypeVar("Result")


def distance_points(
    table: Any,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    threshold: float,
    threads: int = 1,
) -> Columns:
    """Return the signed distances phi <= threshold of (m, 3) points to all n rows of a table.

    ``X_WG`` is (n, 4, 4). Returned are the columns (point, row, phi, p_GN, grad_W, unique), of
    shapes (k,), (k,), (k,), (k, 3), (k, 3), (k,), sorted by point, then row: the fields of
    ``distance_point``, the nearest point in the row's frame G, the gradient in W. A row whose
    bounding box is further away than the threshold is skipped. The points are shared out among
    ``threads`` >= 1; each answer is computed the same way whoever computes it.
    """
    if threshold == math.inf:
        m, n = len(p_WQs), len(X_WG)
        kinds, answers = hold_kinds(group_by_kind(table)), new_answers(m * n)
        columns = distances_to_all(table, kinds, X_WG, p_WQs, threads, answers)
        return np.repeat(np.arange(m), n), np.tile(np.arange(n), m), *columns
    boxes = world_boxes(table, X_WG)

    def answer(share: range) -> Columns:
        return answer_within(table, X_WG, p_WQs, boxes, threshold, share)

    filled = _for_each(answer, _shares(len(p_WQs), threads))
    if len(filled) == 1:
        return filled[0]
    return tuple(np.concatenate(same) for same in zip(*filled, strict=True))


def distances_to_all(
    table: Any,
    kinds: HeldKinds,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    threads: int,
    answers: Answers,
) -> Columns:
    """Return the signed distances of (m, 3) points to all n rows of a table, none left out.

    They are written to ``answers``, flat columns for m n of them. Returned are (phi, p_GN, grad_W,
    unique), in their shapes, as ``distance_points`` does; point q and row i have row q n + i.
    """

    def answer(share: range) -> None:
        answer_all(table, kinds, X_WG, p_WQs, share, answers)

    if threads == 1:
        answer(range(len(p_WQs)))
    else:
        _for_each(answer, _shares(len(p_WQs), threads))
    phi, p_GN, grad_W, unique = answers
    return phi, p_GN.reshape(-1, 3), grad_W.reshape(-1, 3), unique


def _shares(count: int, threads: int) -> list[range]:
    """Share the points out among threads."""
    parts = max(min(threads, count), 1)
    return [range(k * count // parts, (k + 1) * count // parts) for k in range(parts)]


def _for_each(answer: Callable[[range], Result], shares: list[range]) -> list[Result]:
    """Return what ``answer`` returns for each share, computed by a thread each."""
    if len(shares) == 1:
        return [answer(shares[0])]
    with ThreadPoolExecutor(len(shares)) as pool:
        return list(pool.map(answer, shares))

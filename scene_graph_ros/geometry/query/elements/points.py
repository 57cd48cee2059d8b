"""How far points are from the nearest ball of clouds, or how deep in the deepest one."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.elements.point_kernels import find_balls
from scene_graph_ros.geometry.query.elements.scene import clouds_of
from scene_graph_ros.geometry.query.results import PointDistances

__all__ = ["point_distances_with_elements"]


def point_distances_with_elements(
    snapshot: Snapshot,
    table: PointDistances,
    p_WQs: NDArray[np.float64],
    threshold: float,
    threads: int,
) -> PointDistances:
    """Return a table with the distances of (m, 3) points to clouds as well, sorted.

    A cloud without points is infinitely far away, and has no rows.
    """
    clouds, m = clouds_of(snapshot), len(p_WQs)
    parts = [{**table.columns, "element": np.full(len(table), -1)}]
    for k, cloud in enumerate(clouds.table.clouds):
        phi, unique, elements = np.empty(m), np.empty(m, np.bool_), np.empty(m, np.int64)
        p_GN, grad_W = np.empty((m, 3)), np.empty((m, 3))
        X_WC, places = np.ascontiguousarray(clouds.X_WC[k : k + 1]), cloud.places

        def answer(share: slice, where: tuple[NDArray[Any], ...]) -> None:
            some = tuple(column[share] for column in where)
            find_balls(places, X_WC, p_WQs[share], threshold, some[:4], some[4])  # noqa: B023

        columns = (phi, p_GN, grad_W, unique, elements)
        shares = [slice(i * m // threads, (i + 1) * m // threads) for i in range(threads)]
        if threads == 1:
            answer(shares[0], columns)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(answer, shares, [columns] * threads))
        found = np.flatnonzero(elements >= 0)
        parts.append(
            {
                "point": found,
                "id_G": np.full(len(found), clouds.ids[k]),
                "p_GN": p_GN[found],
                "distance": phi[found],
                "grad_W": grad_W[found],
                "is_grad_W_unique": unique[found],
                "element": elements[found],
            }
        )
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[1]}
    order = np.lexsort([whole["id_G"], whole["point"]])
    return PointDistances({n: column[order] for n, column in whole.items()}, snapshot.state)

"""How far points are from the nearest element of clouds and fields, or how deep in one."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.elements.point_kernels import find_balls
from scene_graph_ros.geometry.query.elements.scene import Clouds, clouds_of
from scene_graph_ros.geometry.query.results import PointDistances
from scene_graph_ros.geometry.tables.voxel_bits import PlacedVoxels

__all__ = ["point_distances_with_elements"]


def point_distances_with_elements(
    snapshot: Snapshot,
    table: PointDistances,
    p_WQs: NDArray[np.float64],
    threshold: float,
    threads: int,
) -> PointDistances:
    """Return a table with the distances of (m, 3) points to clouds and fields as well, sorted.

    A cloud without points is infinitely far away, and has no rows.
    """
    clouds, m = clouds_of(snapshot), len(p_WQs)
    parts = [{**table.columns, "element": np.full(len(table), -1)}]
    for k in range(len(clouds.ids)):
        phi, unique, elements = np.empty(m), np.empty(m, np.bool_), np.empty(m, np.int64)
        p_GN, grad_W = np.empty((m, 3)), np.empty((m, 3))
        find = _finder(clouds, k)

        def answer(share: slice, where: tuple[NDArray[Any], ...]) -> None:
            some = tuple(column[share] for column in where)
            find(p_WQs[share], threshold, some[:4], some[4])  # noqa: B023

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


def _finder(clouds: Clouds, k: int) -> Callable[..., None]:
    """Return the kernel that finds elements of the k-th cloud or field near points, bound."""
    X_WC = np.ascontiguousarray(clouds.X_WC[k : k + 1])
    if k < clouds.num_clouds:
        return functools.partial(find_balls, clouds.table.clouds[k].places, X_WC)
    field = k - clouds.num_clouds
    if isinstance(clouds.table.fields[field], PlacedVoxels):
        from scene_graph_ros.geometry.query.elements.voxel_kernels import find_voxels_at_points

        return functools.partial(find_voxels_at_points, clouds.table.held.places, field, X_WC)
    from scene_graph_ros.geometry.query.elements.field_kernels import find_prisms_at_points

    def find(*arguments: Any) -> None:  # in as many threads
        find_prisms_at_points(clouds.table.own_places(), field, X_WC, *arguments)

    return find

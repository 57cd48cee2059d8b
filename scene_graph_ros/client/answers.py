"""Answers of the node as tables with names."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.client.connection import check
from scene_graph_ros.client.table import Table

__all__ = ["Distance", "contact_table", "distance_table", "scene_table"]


class Distance(NamedTuple):
    """How far two geometries are apart: ``p_WCa - p_WCb = distance * normal``."""

    A: str
    B: str
    distance: float
    """Metres; negative where they overlap."""
    normal: tuple[float, float, float]
    """In the world, out of B into A."""

    @classmethod
    def of(cls, pair: Any) -> Distance:
        """Return a message's. Raises WorldError where it has no answer."""
        check(pair.status, "compute_signed_distance_pair")
        n = pair.normal
        A, B = _path(pair.geometry_a), _path(pair.geometry_b)
        return cls(A, B, float(pair.distance), (n.x, n.y, n.z))


def _path(name: Any) -> str:
    return f"{name.source}/{name.frame}/{name.name}"


def _names(table: Any) -> dict[int, str]:
    known = table.geometries
    columns = zip(known.id, known.source, known.frame, known.name, strict=True)
    return {int(i): f"{source}/{frame}/{name}" for i, source, frame, name in columns}


def _pairs(table: Any) -> dict[str, Any]:
    names = _names(table)
    return {
        "A": np.array([names[int(i)] for i in table.id_a], dtype=str),
        "B": np.array([names[int(i)] for i in table.id_b], dtype=str),
    }


def _vectors(values: Any) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64).reshape(-1, 3)


def contact_table(table: Any) -> Table:
    """Return pairs that penetrate, the deepest first."""
    depth = np.array(table.depth, dtype=np.float64)
    columns = {
        **_pairs(table),
        "depth": depth,
        "point_A": _vectors(table.points_a),
        "point_B": _vectors(table.points_b),
        "normal": _vectors(table.normals),
    }
    return _sorted("Contacts", columns, -depth)


def distance_table(table: Any) -> Table:
    """Return pairs, the nearest first."""
    distance = np.array(table.distance, dtype=np.float64)
    columns = {**_pairs(table), "distance": distance, "normal": _vectors(table.normals)}
    return _sorted("Distances", columns, distance)


def _sorted(title: str, columns: dict[str, Any], key: NDArray[np.float64]) -> Table:
    order = np.argsort(key, kind="stable")
    return Table(title, {name: column[order] for name, column in columns.items()})


def scene_table(answer: Any) -> Table:
    """Return all geometries, with where they are in the world."""
    from scene_graph_ros.client.poses import matrix_of

    frames = {frame.id: matrix_of(frame.pose) for frame in answer.frames}
    rows = [
        (
            each.geometry,
            (frames.get(each.geometry.frame_id, np.eye(4)) @ matrix_of(each.description.pose))[
                :3, 3
            ],
        )
        for each in answer.geometries
    ]
    places = np.array([p for _, p in rows]).reshape(-1, 3)
    return Table(
        "Geometries",
        {
            "source": np.array([g.source for g, _ in rows], dtype=str),
            "frame": np.array([g.frame for g, _ in rows], dtype=str),
            "name": np.array([g.name for g, _ in rows], dtype=str),
            "id": np.array([g.id for g, _ in rows], dtype=np.int64),
            "x": places[:, 0],
            "y": places[:, 1],
            "z": places[:, 2],
        },
    )

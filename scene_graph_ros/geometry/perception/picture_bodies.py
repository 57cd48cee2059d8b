"""Bodies of one picture each, for renderers that know pictures of whole bodies alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.perception.exact.ball_bodies import taken
from scene_graph_ros.geometry.perception.exact.bodies import Bodies
from scene_graph_ros.geometry.perception.exact.cover import BY_TRIANGLE, Cover

__all__ = ["with_one_picture_each"]


def with_one_picture_each(bodies: Bodies, cover: Cover) -> tuple[Bodies, Cover]:
    """Return the same, with several bodies for a mesh whose triangles differ in their picture.

    Each has the triangles of one picture and one colour, or those without a picture.
    """
    if not (cover.picture == BY_TRIANGLE).any():
        return bodies, cover
    rows, parts = _rows_and_parts(bodies, cover)
    result, covered = taken(bodies, cover, rows)
    vertices, triangles, paint = [bodies.vertices], [bodies.triangles], [bodies.paint]
    vertex_start, triangle_start = list(bodies.vertex_start), list(bodies.triangle_start)
    corners, count = [cover.corners], len(cover.corners)
    for new, part in parts.items():
        row = rows[new]
        mesh = bodies.mesh[row]
        at = bodies.triangle_start[mesh] + part
        result.mesh[new] = len(vertex_start) - 1
        vertices.append(bodies.vertices[bodies.vertex_start[mesh] : bodies.vertex_start[mesh + 1]])
        triangles.append(bodies.triangles[at])
        paint.append(bodies.paint[at])
        vertex_start.append(vertex_start[-1] + len(vertices[-1]))
        triangle_start.append(triangle_start[-1] + len(part))
        picture = covered.picture[new] = cover.of_triangle[cover.first[row] + part[0]]
        if picture >= 0:
            # All of these have one colour, with which the picture is multiplied.
            result.is_painted[new] = False
            if paint[-1][0] >= 0:
                result.diffuse[new] = bodies.palette[paint[-1][0]]
        covered.first[new] = count
        corners.append(cover.corners[cover.first[row] + part])
        count += len(part)
    return (
        result._replace(
            vertices=np.concatenate(vertices),
            vertex_start=np.array(vertex_start, np.int64),
            triangles=np.concatenate(triangles),
            triangle_start=np.array(triangle_start, np.int64),
            paint=np.concatenate(paint),
        ),
        covered._replace(corners=np.concatenate(corners)),
    )


def _rows_and_parts(
    bodies: Bodies, cover: Cover
) -> tuple[NDArray[np.int64], dict[int, NDArray[np.int64]]]:
    """Return the body of each new one, and of those that are parts the triangles."""
    rows: list[int] = []
    parts: dict[int, NDArray[np.int64]] = {}
    for row, picture in enumerate(cover.picture):
        if picture != BY_TRIANGLE:
            rows.append(row)
            continue
        for part in _parts(bodies, cover, row):
            parts[len(rows)] = part
            rows.append(row)
    return np.array(rows, np.int64), parts


def _parts(bodies: Bodies, cover: Cover, row: int) -> list[NDArray[np.int64]]:
    """Return the triangles of a body by picture and, where there is one, by colour."""
    start, stop = bodies.triangle_start[bodies.mesh[row] : bodies.mesh[row] + 2]
    paint = bodies.paint[start:stop]
    picture = cover.of_triangle[cover.first[row] : cover.first[row] + stop - start]
    key = np.stack([picture, np.where(picture >= 0, paint, -1)], axis=1)
    _, inverse = np.unique(key, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    return [np.flatnonzero(inverse == k) for k in range(int(inverse.max()) + 1)]

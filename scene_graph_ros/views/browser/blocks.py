"""Messages to a page: blocks, whose numbers a page reads where they are.

A message is blocks in a row; a block is its kind and the length of its content, two unsigned
integers of 32 bits, and the content, in a multiple of 8 bytes. All is little-endian. Items are
called by numbers, which doubles hold exactly. ``page/blocks.js`` reads these messages.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import enum
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.views.moment import Trouble
from scene_graph_ros.views.sliders import SliderState

__all__ = [
    "BlockKind",
    "contacts_block",
    "mesh_block",
    "motion_block",
    "picture_block",
    "plan_block",
    "poses_block",
    "scene_block",
    "sliders_block",
    "surfaces_block",
    "texture_block",
    "time_block",
    "troubles_block",
    "vertices_block",
]

_ALIGNMENT = 8

_NONE, _NOWHERE = np.empty(0, np.int64), np.empty((0, 4, 4))


class BlockKind(enum.IntEnum):
    """Kinds of blocks."""

    TIME = 1
    """Doubles: stamp in s, number of the moment, version of the scene."""
    SCENE = 2
    """JSON: which items there are."""
    MESH = 3
    """Double: number; integers: vertices v, triangles t, then painted ones p, covered ones c and
    rounded ones r, which are t or 0, and 0; floats (v, 3); integers (t, 3); bytes (p, 4) red,
    green, blue, 255; integers (c,) numbers of textures, ascending, 0 for none; floats (c, 3, 2) u
    to the right and v up there; floats (r, 3, 3) normals at the corners."""
    POSES = 4
    """Integers: count n, 0; doubles (n,) numbers, (n, 3) positions; floats (n, 4) x, y, z, w."""
    VERTICES = 5
    """Integers: vertices v, 0; doubles: number, origin (3); floats (v, 3) from the origin."""
    CONTACTS = 6
    """Integers: count n, 0; doubles (n, 3) points, (n, 2) ids of geometries A and B; floats (n, 3)
    normals, (n,) depths in m."""
    SURFACES = 7
    """Integers: corners n, 0; doubles: pressure of red in Pa, origin (3); floats (n, 3) from the
    origin, three for a triangle, (n,) pressures in Pa."""
    PICTURE = 8
    """Integers: count n, 0; bytes (n,) of a PNG file, none where a camera shows nothing."""
    SLIDERS = 9
    """JSON: where the joints are that may be moved."""
    TROUBLES = 10
    """JSON: a list of what is not as it should be: level, name, text."""
    TEXTURE = 11
    """Double: number; integers: count n, 0; bytes (n,) of a PNG file."""
    MOTION = 12
    """As PLAN, of one moment: the robot as a page drags it."""
    PLAN = 13
    """Integers: bodies n, moments k; doubles (n,) ids of geometries, (k, n, 3) positions; floats
    (k, n, 4) x, y, z, w; JSON."""


def _block(kind: BlockKind, *parts: bytes) -> bytes:
    length = sum(map(len, parts))
    padding = -length % _ALIGNMENT
    # JSON may end with spaces; arrays know their length.
    return b"".join((struct.pack("<II", kind, length + padding), *parts, b" " * padding))


def _bytes(values: ArrayLike, dtype: str) -> bytes:
    return np.ascontiguousarray(values, dtype=dtype).tobytes()


def time_block(stamp_ns: int, sequence: int, scene_version: int) -> bytes:
    """Return the block that says when a moment is, in the clock of the poses' stamps."""
    return _block(BlockKind.TIME, struct.pack("<ddd", stamp_ns * 1e-9, sequence, scene_version))


def scene_block(content: Mapping[str, Any]) -> bytes:
    """Return the block that says which items there are."""
    return _block(BlockKind.SCENE, json.dumps(content, allow_nan=False).encode())


def mesh_block(
    number: int,
    vertices: NDArray[Any],
    triangles: NDArray[Any],
    paint: NDArray[np.uint8] | None = None,
    *,
    textures: ArrayLike = (),
    coordinates: ArrayLike = (),
    normals: ArrayLike = (),
) -> bytes:
    """Return the block of a mesh: vertices ``(v, 3)`` in m, and triangles ``(t, 3)`` of them.

    ``paint`` ``(t, 3)`` are colours of the triangles; without, they have that of the item.
    ``textures`` ``(t,)``, ascending, are numbers of pictures on them, 0 for none, and
    ``coordinates`` ``(t, 3, 2)`` say where on these their corners are. ``normals`` ``(t, 3, 3)``
    are those at the corners; without, a triangle has its own.
    """
    painted = np.empty((0, 4), np.uint8)
    if paint is not None:
        painted = np.column_stack([paint, np.full(len(paint), 255, np.uint8)])
    counts = len(vertices), len(triangles), len(painted), np.size(textures), np.size(normals) // 9
    return _block(
        BlockKind.MESH,
        struct.pack("<dIIIIII", number, *counts, 0),
        _bytes(vertices, "<f4"),
        _bytes(triangles, "<u4"),
        _bytes(painted, "u1"),
        _bytes(textures, "<u4"),
        _bytes(coordinates, "<f4"),
        _bytes(normals, "<f4"),
    )


def texture_block(number: int, file: bytes) -> bytes:
    """Return the block of a picture that covers something, as a PNG file."""
    return _block(BlockKind.TEXTURE, struct.pack("<dII", number, len(file), 0), file)


def poses_block(numbers: NDArray[np.float64], X_WG: NDArray[np.float64]) -> bytes:
    """Return the block of items, by their numbers ``(n,)``, that are at ``X_WG`` ``(n, 4, 4)``."""
    return _block(
        BlockKind.POSES,
        struct.pack("<II", len(numbers), 0),
        _bytes(numbers, "<f8"),
        _bytes(X_WG[:, :3, 3], "<f8"),
        _bytes(quaternions_from_poses(X_WG), "<f4"),
    )


def vertices_block(number: float, p_WVs: NDArray[np.float64]) -> bytes:
    """Return the block of a deformable item whose vertices ``(v, 3)`` are there, in m.

    They are told from their first one, so that single precision does far from the origin.
    """
    origin = p_WVs[0] if len(p_WVs) else np.zeros(3)
    return _block(
        BlockKind.VERTICES,
        struct.pack("<IIdddd", len(p_WVs), 0, number, *origin.tolist()),
        _bytes(p_WVs - origin, "<f4"),
    )


def contacts_block(
    p_WCs: NDArray[np.float64],
    ids: NDArray[Any],
    nhat_BA_W: NDArray[np.float64],
    depths: NDArray[np.float64],
) -> bytes:
    """Return the block of points in contact ``(n, 3)``, normals ``(n, 3)`` and depths ``(n,)``.

    ``ids`` ``(n, 2)`` are those of the geometries A and B.
    """
    return _block(
        BlockKind.CONTACTS,
        struct.pack("<II", len(depths), 0),
        _bytes(p_WCs, "<f8"),
        _bytes(ids, "<f8"),
        _bytes(nhat_BA_W, "<f4"),
        _bytes(depths, "<f4"),
    )


def surfaces_block(
    corners_W: NDArray[np.float64], pressures: NDArray[np.float64], scale: float
) -> bytes:
    """Return the block of triangles, by corners ``(3 t, 3)`` in m and pressures ``(3 t,)`` in Pa.

    ``scale`` is the pressure that is shown in red.
    """
    origin = corners_W[0] if len(corners_W) else np.zeros(3)
    return _block(
        BlockKind.SURFACES,
        struct.pack("<IIdddd", len(corners_W), 0, scale, *origin.tolist()),
        _bytes(corners_W - origin, "<f4"),
        _bytes(pressures, "<f4"),
    )


def picture_block(file: bytes) -> bytes:
    """Return the block of a camera's image, a PNG file; empty for no image."""
    return _block(BlockKind.PICTURE, struct.pack("<II", len(file), 0), file)


def sliders_block(state: SliderState) -> bytes:
    """Return the block of where joints are that may be moved, and which may not now."""
    content = {"positions": state.positions, "refused": dict(state.refused)}
    return _block(BlockKind.SLIDERS, json.dumps(content, allow_nan=False).encode())


def motion_block(
    content: Mapping[str, Any], ids: NDArray[Any] = _NONE, X_WG: NDArray[np.float64] = _NOWHERE
) -> bytes:
    """Return the block of a robot as a page drags it, and of the state of the page's requests.

    Its geometries, by ids ``(n,)``, are at ``X_WG`` ``(n, 4, 4)`` then.
    """
    return _moving_block(BlockKind.MOTION, content, ids, X_WG[np.newaxis])


def plan_block(
    content: Mapping[str, Any],
    ids: NDArray[Any] = _NONE,
    X_WGs: NDArray[np.float64] = _NOWHERE[np.newaxis],
) -> bytes:
    """Return the block of a motion: geometries, by ids ``(n,)``, at ``X_WGs`` ``(k, n, 4, 4)``."""
    return _moving_block(BlockKind.PLAN, content, ids, X_WGs)


def _moving_block(
    kind: BlockKind, content: Mapping[str, Any], ids: NDArray[Any], X_WGs: NDArray[np.float64]
) -> bytes:
    return _block(
        kind,
        struct.pack("<II", len(ids), len(X_WGs)),
        _bytes(ids, "<f8"),
        _bytes(X_WGs[..., :3, 3], "<f8"),
        _bytes(quaternions_from_poses(X_WGs.reshape(-1, 4, 4)), "<f4"),
        json.dumps(content, allow_nan=False).encode(),
    )


def troubles_block(troubles: Iterable[Trouble]) -> bytes:
    """Return the block of troubles."""
    content = [trouble._asdict() for trouble in troubles]
    return _block(BlockKind.TROUBLES, json.dumps(content).encode())

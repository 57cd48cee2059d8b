"""Query requests to arguments of the core, result tables to responses."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Sequence
import math
from typing import Any, NamedTuple

from geometry_msgs.msg import Point, Vector3
import numpy as np
from numpy.typing import NDArray

from msg_adapters.arrays import (
    float64s_to_msg,
    int64s_to_msg,
    rows_from_msg,
    uint8s_to_msg,
    uint32s_to_msg,
    uint64s_to_msg,
)
from msg_adapters.errors import MessageError, TooLargeError
from msg_adapters.names import legend, SceneNames
from msg_adapters.poses import meant_name, poses_from_components
from msg_adapters.stamps import checked_stamp_from_msg, duration_from_msg
from msg_adapters.status import ok_status
from scene_graph_msgs.msg import (
    PairTable,
    PointContactTable,
    PointDistanceTable,
    QueryOptions,
    SignedDistancePair,
    SignedDistanceTable,
    WhatIf,
)
from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.model.ids import FrameId

__all__ = [
    "NO_OPTIONS",
    "Configuration",
    "Options",
    "candidates_to_msg",
    "configuration_start_to_msg",
    "flags_to_msg",
    "limit_from_msg",
    "options_from_msg",
    "point_contacts_to_msg",
    "point_distances_to_msg",
    "points_from_msg",
    "signed_distance_pair_to_msg",
    "signed_distances_to_msg",
    "what_if_from_msg",
    "what_if_to_msg",
]

Configuration = dict[FrameId, NDArray[np.float64]]
"""Poses ``X_PF`` ``(4, 4)`` of some frames; the others are where they are."""


class Options(NamedTuple):
    """The options of a request beside its own arguments."""

    configurations: tuple[Configuration, ...]
    """At least one; ``({},)`` is the world as it is."""
    minimal_stamp_ns: int
    """0: any."""
    minimal_stamp_sources: tuple[str, ...]
    timeout_ns: int
    """0: don't wait."""
    with_names: bool


NO_OPTIONS = Options(({},), 0, (), 0, True)
"""Those of a request that has none."""


def options_from_msg(
    msg: QueryOptions,
    names: SceneNames,
    *,
    max_configurations: float = math.inf,
    is_joint: Callable[[str], bool] = lambda path: False,
) -> Options:
    """Return the options of a query; ``is_joint`` tells whether "robot/joint" is one.

    Raises TooLargeError for more configurations than ``max_configurations``, UnknownIdError for a
    frame, joint or source that is not in the scene, InvalidPoseError for a pose that is none,
    MessageError for the rest.
    """
    count = len(msg.what_if.poses) // max(7 * len(msg.what_if.frames), 1)
    if msg.what_if.frames and count > max_configurations:
        raise TooLargeError(
            f"configurations: {count} are more than max_configurations_per_request, which is"
            f" {max_configurations}"
        )
    minimal_stamp_ns = checked_stamp_from_msg(msg.minimal_stamp)
    timeout_ns = duration_from_msg(msg.timeout)
    if timeout_ns < 0:
        raise MessageError(f"timeout is negative: {timeout_ns} ns")
    sources = tuple(map(meant_name, msg.minimal_stamp_sources))
    for name in sources:
        if "/" in name:
            if not is_joint(name):
                names.frame_id(name)
        else:
            names.source_id(name)
    return Options(
        what_if_from_msg(msg.what_if, names),
        minimal_stamp_ns,
        sources,
        timeout_ns,
        bool(msg.with_names),
    )


def what_if_from_msg(msg: WhatIf, names: SceneNames) -> tuple[Configuration, ...]:
    """Return the poses of each configuration by frame; ``({},)`` where no frame is named.

    Raises UnknownIdError or NameConflictError for a frame's name, MessageError for lengths that
    don't fit, InvalidPoseError with frame, configuration and value.
    """
    count = len(msg.frames)
    if not count:
        if len(msg.poses):
            raise MessageError(f"what_if has {len(msg.poses)} numbers of poses, but no frames")
        return ({},)
    frames = [names.frame_id(name) for name in msg.frames]
    if len(set(frames)) != count:
        raise MessageError(f"what_if names a frame more than once: {list(msg.frames)}")
    stride = 7 * count
    if not len(msg.poses) or len(msg.poses) % stride:
        raise MessageError(
            f"what_if has {len(msg.poses)} numbers of poses for {count} frames: "
            f"it takes {stride} per configuration"
        )
    components = np.array(msg.poses, dtype=np.float64).reshape(-1, 7)
    labels = _Labels(msg.frames)
    _, X_PF, refused = poses_from_components(components, labels)
    if refused:
        raise InvalidPoseError(f"what_if: {refused[0].message}")
    configurations = X_PF.reshape(-1, count, 4, 4)
    return tuple(dict(zip(frames, poses, strict=True)) for poses in configurations)


class _Labels(Sequence):
    """Names of the rows of a what_if, made only for a row that is complained about."""

    def __init__(self, frames: Sequence[str]) -> None:
        self._frames = frames

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, row: Any) -> str:
        configuration, frame = divmod(int(row), len(self._frames))
        return f"{self._frames[frame]} in configuration {configuration}"


def what_if_to_msg(frames: Sequence[str], components: NDArray[np.float64]) -> WhatIf:
    """Return configurations of named frames from ``(k, n, 7)``: x, y, z, qx, qy, qz, qw."""
    if np.ndim(components) != 3 or np.shape(components)[1:] != (len(frames), 7):
        raise MessageError(
            f"what_if of {len(frames)} frames takes (k, {len(frames)}, 7) numbers, not "
            f"{np.shape(components)}"
        )
    return WhatIf(frames=list(frames), poses=float64s_to_msg(components))


def limit_from_msg(values: Sequence[float], name: str) -> float:
    """Return an optional distance in metres; infinite where it is not given."""
    if not len(values):
        return math.inf
    if math.isnan(values[0]):
        raise MessageError(f"{name} is not a number")
    return float(values[0])


def points_from_msg(values: Sequence[float] | array) -> NDArray[np.float64]:
    """Return ``(m, 3)`` points; raises MessageError naming a point that is not finite."""
    return rows_from_msg(values, 3, "points")


def configuration_start_to_msg(tables: Iterable[Any]) -> array:
    """Return the first row of each table when all are put behind one another."""
    return uint64s_to_msg(np.cumsum([0, *(len(table) for table in tables)]))


def _column(tables: Sequence[Any], name: str) -> NDArray[Any]:
    columns = [np.asarray(getattr(table, name)) for table in tables]
    return columns[0] if len(columns) == 1 else np.concatenate(columns)


def point_contacts_to_msg(tables: Sequence[Any], names: SceneNames | None) -> PointContactTable:
    """Return one penetration table per configuration as columns.

    Without ``names`` the legend stays empty.
    """
    id_A, id_B = _column(tables, "id_A"), _column(tables, "id_B")
    return PointContactTable(
        configuration_start=configuration_start_to_msg(tables),
        id_a=int64s_to_msg(id_A),
        id_b=int64s_to_msg(id_B),
        points_a=float64s_to_msg(_column(tables, "p_WCa")),
        points_b=float64s_to_msg(_column(tables, "p_WCb")),
        normals=float64s_to_msg(_column(tables, "nhat_BA_W")),
        depth=float64s_to_msg(_column(tables, "depth")),
        geometries=legend(names, id_A, id_B),
    )


def signed_distances_to_msg(
    tables: Sequence[Any], names: SceneNames | None
) -> SignedDistanceTable:
    """Return one signed distance table per configuration as columns.

    Without ``names`` the legend stays empty.
    """
    id_A, id_B = _column(tables, "id_A"), _column(tables, "id_B")
    return SignedDistanceTable(
        configuration_start=configuration_start_to_msg(tables),
        id_a=int64s_to_msg(id_A),
        id_b=int64s_to_msg(id_B),
        distance=float64s_to_msg(_column(tables, "distance")),
        points_a_in_a=float64s_to_msg(_column(tables, "p_ACa")),
        points_b_in_b=float64s_to_msg(_column(tables, "p_BCb")),
        normals=float64s_to_msg(_column(tables, "nhat_BA_W")),
        is_normal_unique=uint8s_to_msg(_column(tables, "is_nhat_BA_W_unique")),
        geometries=legend(names, id_A, id_B),
    )


def point_distances_to_msg(tables: Sequence[Any], names: SceneNames | None) -> PointDistanceTable:
    """Return one table of point distances per configuration as columns.

    Without ``names`` the legend stays empty.
    """
    id_G = _column(tables, "id_G")
    return PointDistanceTable(
        configuration_start=configuration_start_to_msg(tables),
        point=uint32s_to_msg(_column(tables, "point")),
        id=int64s_to_msg(id_G),
        distance=float64s_to_msg(_column(tables, "distance")),
        nearest=float64s_to_msg(_column(tables, "p_GN")),
        gradients=float64s_to_msg(_column(tables, "grad_W")),
        is_gradient_unique=uint8s_to_msg(_column(tables, "is_grad_W_unique")),
        geometries=legend(names, id_G),
    )


def candidates_to_msg(tables: Sequence[Any], names: SceneNames | None) -> PairTable:
    """Return one table of candidate pairs per configuration as columns.

    Without ``names`` the legend stays empty.
    """
    id_A, id_B = _column(tables, "id_A"), _column(tables, "id_B")
    return PairTable(
        configuration_start=configuration_start_to_msg(tables),
        id_a=int64s_to_msg(id_A),
        id_b=int64s_to_msg(id_B),
        geometries=legend(names, id_A, id_B),
    )


def signed_distance_pair_to_msg(
    record: Any, names: SceneNames, X_WA: NDArray[np.float64], X_WB: NDArray[np.float64]
) -> SignedDistancePair:
    """Return one signed distance; ``X_WA`` and ``X_WB`` are the poses of the two geometries."""
    p_WCa = X_WA[:3, :3] @ record.p_ACa + X_WA[:3, 3]
    p_WCb = X_WB[:3, :3] @ record.p_BCb + X_WB[:3, 3]
    return SignedDistancePair(
        status=ok_status(),
        geometry_a=names.geometry_name(record.id_A),
        geometry_b=names.geometry_name(record.id_B),
        distance=float(record.distance),
        point_a=_point(p_WCa),
        point_a_in_a=_point(record.p_ACa),
        point_b=_point(p_WCb),
        point_b_in_b=_point(record.p_BCb),
        normal=_vector(record.nhat_BA_W),
        is_normal_unique=bool(record.is_nhat_BA_W_unique),
    )


def _point(p: NDArray[np.float64]) -> Point:
    x, y, z = np.asarray(p, dtype=np.float64).tolist()
    return Point(x=x, y=y, z=z)


def _vector(v: NDArray[np.float64]) -> Vector3:
    x, y, z = np.asarray(v, dtype=np.float64).tolist()
    return Vector3(x=x, y=y, z=z)


def flags_to_msg(flags: Iterable[bool]) -> array:
    """Return one 0 or 1 per flag."""
    return uint8s_to_msg([bool(flag) for flag in flags])

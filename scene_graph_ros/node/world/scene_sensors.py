"""The sensors of a scene: the geometry that they fill, and where all was at their stamps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TYPE_CHECKING

from scene_graph_ros.node.world.clouds import clouds_by_source

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from msg_adapters.names import SceneNames
    from scene_graph_ros.geometry.model.ids import FrameId
    from scene_graph_ros.geometry.perception import CameraDescription
    from scene_graph_ros.node.world.intake import SourceFrames
    from scene_graph_ros.node.world.pose_history import PoseHistory
    from scene_graph_ros.node.world.sensed import SensedGeometry

__all__ = ["connect_sensors", "sensed_by_source"]


def sensed_by_source(
    records: Mapping[str, Any], names: SceneNames, inspector: Any, world_frame: str
) -> dict[str, SensedGeometry]:
    """Return clouds, and voxel grids that sensors fill, by source; the latter imported for some.

    ``records`` are those of all sources by name.
    """
    filling = [each for each in records.values() if each.fills_voxels]
    senders = {n: (each.id, each.cloud) for n, each in records.items() if not each.fills_voxels}
    clouds = clouds_by_source(names, inspector, senders, world_frame)
    if not filling:
        return dict(clouds)
    from scene_graph_ros.node.world.sensed_grids import sensed_grids

    return {**clouds, **sensed_grids(filling, names, inspector, world_frame)}


def connect_sensors(
    sensed: Mapping[str, SensedGeometry],
    records: Mapping[str, Any],
    names: SceneNames,
    inspector: Any,
    cameras: Mapping[str, CameraDescription],
    frames: Mapping[str, SourceFrames],
    history: PoseHistory | None,
) -> PoseHistory | None:
    """Give sensors to the geometry that they fill; return the history of poses, None without."""
    if not sensed:
        return None
    from scene_graph_ros.node.world.pose_history import PoseHistory
    from scene_graph_ros.node.world.sensor_state import states_of

    known = PoseHistory() if history is None else history

    def place(wanted: Iterable[FrameId], at: int) -> Mapping[FrameId, NDArray[np.float64]]:
        return known.place(wanted, at, inspector, frames)

    for name, state in states_of(records, names, inspector, cameras, place).items():
        filled = sensed.get(records[name].filled)
        if filled is not None:
            filled.sensors[name] = state
    return known

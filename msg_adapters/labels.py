"""The meanings of the labels in a camera's images."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np

from msg_adapters.names import SceneNames
from scene_graph_msgs.msg import LabelTable
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.model.perception_properties import read_perception_properties

__all__ = ["label_table_to_msg"]


def label_table_to_msg(inspector: Any, names: SceneNames, *, scene_version: int) -> LabelTable:
    """Return the labels of all geometries with the perception role."""
    ids = sorted(inspector.get_all_geometry_ids(Role.PERCEPTION))
    labels = [
        read_perception_properties(
            inspector.get_properties(g, Role.PERCEPTION), inspector.get_name(g)
        ).label
        for g in ids
    ]
    return LabelTable(
        scene_version=scene_version,
        labels=array("H", map(int, labels)),
        geometries=names.legend(np.array(ids, dtype=np.int64)),
    )

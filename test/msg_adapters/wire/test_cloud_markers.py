"""Markers of clouds as bytes are those that a message of spheres would be."""

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.wire.cloud_markers import CloudMarkers, POINT_SIZE
from msg_adapters.wire.deformable_markers import Positions
from scene_graph_ros.geometry import PointCloud, Rgba
from scene_graph_ros.views.deformables import DeformableItem
from scene_graph_ros.views.draw_list import DrawItem

STAMP = 12 * 10**9 + 5
EMPTY = serialize_message(MarkerArray())


def markers_of(data):
    """Return the markers in bytes."""
    return deserialize_message(data, MarkerArray).markers


def positions(points, version):
    """Return where a cloud's balls are."""
    return {7: Positions(version, lambda: [np.array(points, dtype=np.float64).reshape(-1, 3)])}


@pytest.mark.parametrize(
    ("radius", "kind", "size"),
    [
        (0.25, Marker.SPHERE_LIST, 0.5),
        ([0.125, 0.5], Marker.SPHERE_LIST, 1.0),
        (0.0, Marker.POINTS, POINT_SIZE),
    ],
)
def test_a_cloud_is_a_list_of_its_balls(radius, kind, size):
    """One size for all, one colour, in the world."""
    shape = PointCloud([[0, 0, 0], [1, 1, 1]], radius)
    item = DrawItem(7, "proximity/camera/world", shape, Rgba(0.25, 0.5, 0.75, 0.5))
    wire = CloudMarkers(serialize_message, frame_id="map")
    wire.set_items([DeformableItem(item, np.empty((0, 3), np.int64))])
    points = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    version = object()
    data, count = wire.append(EMPTY, positions(points, version), STAMP, is_whole=True)
    assert count == 1
    (marker,) = markers_of(data)
    assert (marker.type, marker.action, marker.ns) == (kind, Marker.ADD, item.group)
    assert (marker.header.frame_id, marker.header.stamp.sec, marker.header.stamp.nanosec) == (
        "map", 12, 5,
    )  # fmt: skip
    assert [[p.x, p.y, p.z] for p in marker.points] == points
    assert (marker.scale.x, marker.scale.y, marker.scale.z) == (size, size, size)
    assert (marker.color.r, marker.color.a) == (0.25, 0.5)
    # Nothing where the points are the same; a deletion where there are none any more.
    assert wire.append(EMPTY, positions(points, version), STAMP, is_whole=False) == (EMPTY, 0)
    data, count = wire.append(EMPTY, positions([], object()), STAMP, is_whole=False)
    assert count == 1
    (gone,) = markers_of(data)
    assert (gone.action, gone.ns, gone.id) == (Marker.DELETE, marker.ns, marker.id)

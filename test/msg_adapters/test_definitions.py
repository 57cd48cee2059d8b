"""Definitions of messages as text: another program reads messages by them."""

from __future__ import annotations

import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointField
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.definitions import definition_with_parts, kind_of


def test_a_definition_has_all_its_parts_once():
    """In the form of MCAP: lines of equals signs, the names of the parts."""
    text = definition_with_parts("visualization_msgs/msg/MarkerArray")
    parts = [part.split("\n", 1)[0] for part in text.split(f"{'=' * 80}\nMSG: ")[1:]]
    assert len(parts) == len(set(parts))
    assert parts[0] == "visualization_msgs/Marker"
    assert {"std_msgs/Header", "builtin_interfaces/Time", "geometry_msgs/Vector3"} <= set(parts)
    assert kind_of(MarkerArray) == "visualization_msgs/msg/MarkerArray"
    assert "MSG:" not in definition_with_parts(kind_of(PointField))


def test_a_message_is_read_by_its_definition_alone():
    """By a program that knows no message of ROS."""
    typesys = pytest.importorskip("rosbags.typesys", reason="pip install rosbags")
    kind = kind_of(MarkerArray)
    types = typesys.get_typestore(typesys.Stores.EMPTY)
    types.register(typesys.get_types_from_msg(definition_with_parts(kind), kind))
    marker = Marker(ns="ä", id=7, type=Marker.SPHERE)
    marker.pose.position.y = 1.0 / 3.0
    read = types.deserialize_cdr(serialize_message(MarkerArray(markers=[marker])), kind)
    assert (read.markers[0].ns, read.markers[0].id) == ("ä", 7)
    assert read.markers[0].pose.position.y == 1.0 / 3.0


def test_a_message_that_is_not_there_is_an_error():
    """Of the import, by its name."""
    with pytest.raises(ModuleNotFoundError, match="no_msgs"):
        definition_with_parts("no_msgs/msg/Nothing")

"""Definitions of messages as text: another program reads messages by them."""

from __future__ import annotations

import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointField
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.definitions import definition_with_parts, kind_of, layout_of
from msg_adapters.message_classes import UnknownKindError
from scene_graph_msgs.srv import RegisterCamera, RegisterFrame


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
    """By the name of the package that is to be installed."""
    with pytest.raises(UnknownKindError, match="no package no_msgs is installed"):
        definition_with_parts("no_msgs/msg/Nothing")


def made_of(**fields):
    """Return a class of messages with these fields."""
    return type("Message", (), {"get_fields_and_field_types": staticmethod(lambda: fields)})


def test_a_layout_is_of_all_fields_also_of_parts():
    """By name and type, in their order; constants are none of it."""
    different = [
        made_of(),
        made_of(a="double"),
        made_of(b="double"),
        made_of(a="float"),
        made_of(a="double", b="double"),
        made_of(b="double", a="double"),
        made_of(a="geometry_msgs/Point"),
        # A vector has the fields of a point, by another name; the type's name is told, too.
        made_of(a="geometry_msgs/Vector3"),
        made_of(a="sequence<geometry_msgs/Vector3>"),
        made_of(a="sequence<visualization_msgs/Marker>"),
        RegisterCamera.Request,
        RegisterFrame.Request,
    ]
    assert len({layout_of(one) for one in different}) == len(different)
    assert layout_of(made_of(a="double")) == layout_of(made_of(a="double"))


def test_a_layout_depends_on_a_part_of_a_part(monkeypatch):
    """What a marker of an array is made of counts as its own fields do."""

    def array():
        return made_of(markers="sequence<visualization_msgs/Marker>")

    before = layout_of(array())
    fields = {**Marker.get_fields_and_field_types(), "new": "double"}
    monkeypatch.setattr(Marker, "get_fields_and_field_types", lambda: fields)
    assert layout_of(array()) != before

"""Contacts as messages and as markers."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import Point, Vector3
import numpy as np
import pytest
from visualization_msgs.msg import Marker

from msg_adapters.contacts import contact_markers_to_msg, contacts_to_msg
from msg_adapters.poses import header_to_msg
from scene_graph_msgs.msg import ContactArray, PointContact

STAMP = 8_000_000_009


class Table:
    """Columns of penetrations, as queries return them."""

    def __init__(self, pairs: list[tuple[int, int]]) -> None:
        count = len(pairs)
        self.id_A = np.array([a for a, _ in pairs], dtype=np.int64)
        self.id_B = np.array([b for _, b in pairs], dtype=np.int64)
        self.nhat_BA_W = np.tile((0.6, 0.0, 0.8), (count, 1))
        self.depth = 0.25 + np.arange(count, dtype=float)
        self.p_WCa = np.arange(3.0 * count).reshape(count, 3)
        # depth = (p_WCb - p_WCa) . nhat
        self.p_WCb = self.p_WCa + self.depth[:, np.newaxis] * self.nhat_BA_W

    def __len__(self) -> int:
        return len(self.id_A)


@pytest.fixture
def table(scene: SimpleNamespace) -> Table:
    """Return contacts of the ball with the tip and the floor."""
    ball, tip, floor = (int(i) for i in (scene.ball, scene.tip, scene.floor))
    return Table([(ball, tip), (ball, floor)])


def test_each_contact_has_both_names_points_normal_and_depth(
    scene: SimpleNamespace, table: Table, over_the_wire: Callable[[Any], Any]
) -> None:
    """Every field of the message, in the order of the table, after serialization."""
    msg = over_the_wire(
        contacts_to_msg(
            table, scene.names, stamp_ns=STAMP, frame_id="map", scene_version=np.int64(12)
        )
    )
    assert (msg.header, msg.scene_version) == (header_to_msg(STAMP, "map"), 12)
    assert msg.surfaces == []
    assert [contact.geometry_b.name for contact in msg.points] == ["tip", "floor"]
    assert msg.points[1] == PointContact(
        geometry_a=scene.names.geometry_name(scene.ball),
        geometry_b=scene.names.geometry_name(scene.floor),
        point_a=Point(x=3.0, y=4.0, z=5.0),
        point_b=Point(x=3.0 + 1.25 * 0.6, y=4.0, z=5.0 + 1.25 * 0.8),
        normal=Vector3(x=0.6, y=0.0, z=0.8),
        depth=1.25,
    )


def test_the_documented_invariant_holds_in_the_message(
    scene: SimpleNamespace, table: Table
) -> None:
    """Cb - Ca = depth * normal, as PointContact.msg says."""
    msg = contacts_to_msg(table, scene.names, stamp_ns=STAMP, frame_id="map", scene_version=1)
    for contact in msg.points:
        a, b, n = contact.point_a, contact.point_b, contact.normal
        np.testing.assert_allclose(
            [b.x - a.x, b.y - a.y, b.z - a.z],
            contact.depth * np.array([n.x, n.y, n.z]),
            rtol=0,
            atol=1e-15,
        )


def test_no_contacts_are_an_empty_message(scene: SimpleNamespace) -> None:
    """The header and version are there all the same."""
    msg = contacts_to_msg(Table([]), scene.names, stamp_ns=STAMP, frame_id="map", scene_version=3)
    assert msg == ContactArray(header=header_to_msg(STAMP, "map"), scene_version=3)


def test_contact_markers_show_witnesses_and_normals(
    table: Table, over_the_wire: Callable[[Any], Any]
) -> None:
    """Balls at Ca and Cb; lines from Cb along the normal, as long as the contact is deep."""
    msg = over_the_wire(
        contact_markers_to_msg(
            table,
            stamp_ns=STAMP,
            frame_id="map",
            point_diameter=0.5,
            normal_length=1.0,
            color=(0.125, 0.25, 0.5, 0.75),
        )
    )
    balls, lines = msg.markers
    assert (balls.type, lines.type) == (Marker.SPHERE_LIST, Marker.LINE_LIST)
    assert balls.ns == lines.ns and balls.id != lines.id
    assert balls.header == header_to_msg(STAMP, "map")
    assert (balls.scale.x, balls.scale.y, balls.scale.z) == (0.5, 0.5, 0.5)
    assert 0.0 < lines.scale.x < 0.5
    assert (balls.color.r, balls.color.g, balls.color.b, balls.color.a) == (0.125, 0.25, 0.5, 0.75)
    points = np.array([(p.x, p.y, p.z) for p in balls.points])
    np.testing.assert_array_equal(points[0::2], table.p_WCa)
    np.testing.assert_array_equal(points[1::2], table.p_WCb)
    ends = np.array([(p.x, p.y, p.z) for p in lines.points])
    np.testing.assert_array_equal(ends[0::2], table.p_WCb)
    # Depths are 0.25 and 1.25 m, so the lengths are 1 and 1.25 m.
    np.testing.assert_allclose(
        ends[1::2] - ends[0::2],
        np.array([(0.6, 0.0, 0.8)] * 2) * [[1.0], [1.25]],
        rtol=0,
        atol=1e-15,
    )


def test_contact_markers_vanish_with_the_contacts(table: Table) -> None:
    """Without contacts exactly what was shown is deleted."""
    shown = contact_markers_to_msg(table, stamp_ns=STAMP, frame_id="map").markers
    gone = contact_markers_to_msg(Table([]), stamp_ns=STAMP, frame_id="map").markers
    assert [m.action for m in gone] == [Marker.DELETE, Marker.DELETE]
    assert [(m.ns, m.id) for m in gone] == [(m.ns, m.id) for m in shown]
    assert {m.action for m in shown} == {Marker.ADD}

"""Contacts as bytes: those that the serializer makes of the same messages."""

from __future__ import annotations

import itertools
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from wire import assert_same_bytes

from msg_adapters.contact_rows import KINDS, PairRows
from msg_adapters.contacts import contact_markers_to_msg, contacts_to_msg
from msg_adapters.names import SceneNames
from msg_adapters.wire.contacts import ContactMarkerWire, ContactWire
from scene_graph_ros import geometry as core


class Table(SimpleNamespace):
    """Columns as those of a penetration table."""

    def __len__(self):
        return len(self.depth)


def table(rng, pairs):
    """Return contacts of pairs with distinct numbers."""
    ids = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    normals = rng.normal(size=(len(ids), 3))
    return Table(
        id_A=ids[:, 0],
        id_B=ids[:, 1],
        p_WCa=rng.normal(size=(len(ids), 3)),
        p_WCb=rng.normal(size=(len(ids), 3)),
        nhat_BA_W=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        depth=rng.uniform(0, 0.3, len(ids)),
    )


@pytest.fixture
def rng():
    """Numbers that are the same in each run."""
    return np.random.default_rng(3)


@pytest.fixture
def balls():
    """Ids of 40 geometries and their names, of all lengths, so that all paddings occur."""
    graph = core.SceneGraph()
    source = graph.register_source("ein Wörterbuch")
    ids = []
    for i in range(40):
        frame = graph.register_frame(source, core.GeometryFrame("f" * (1 + i % 9) + str(i)))
        ball = core.GeometryInstance(np.eye(4), core.Sphere(0.1), "g" * (i % 13) + str(i))
        ids.append(int(graph.register_geometry(source, frame, ball)))
    return ids, SceneNames(graph.model_inspector())


def expected(contacts, names, stamp, version, frame_id):
    """Return the message that the wire stands for."""
    return contacts_to_msg(
        contacts, names, stamp_ns=stamp, frame_id=frame_id, scene_version=version
    )


@pytest.mark.parametrize("frame_id", ["", "map", "world", "a/b/c/d/e"])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 39])
def test_contacts_are_byte_for_byte_what_is_serialized(rng, balls, frame_id, count):
    """No contact, one, and many, in a world frame of any length."""
    ids, names = balls
    wire = ContactWire(frame_id, serialize_message)
    contacts = table(rng, list(pairwise(ids))[:count])
    ours = wire.message(contacts, names, stamp_ns=1_234_567_890, scene_version=2**63 + 5)
    assert_same_bytes(ours, expected(contacts, names, 1_234_567_890, 2**63 + 5, frame_id))


def test_contacts_come_and_go(rng, balls):
    """Ten scenes in a row, the same pairs again among them: nothing is left of the one before."""
    ids, names = balls
    wire = ContactWire("world", serialize_message)
    for step, count in enumerate([0, 5, 5, 1, 0, 12, 3, 12, 12, 0]):
        chosen = sorted(rng.choice(ids, (2, count), replace=False).T.tolist()) if step != 2 else []
        contacts = table(rng, chosen)
        ours = wire.message(contacts, names, stamp_ns=step * 10**9 + 7, scene_version=step)
        assert_same_bytes(ours, expected(contacts, names, step * 10**9 + 7, step, "world"))


def other_rows(rng, pairs, kind):
    """Return contacts of a kind beside points, with distinct numbers."""
    ids = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return PairRows(ids[:, 0], ids[:, 1], rng.normal(size=(len(ids), KINDS[kind].width)))


@pytest.mark.parametrize("counts", list(itertools.product((0, 1, 3), repeat=3)))
def test_all_kinds_of_contacts_are_what_is_serialized(rng, balls, counts):
    """None, one or three of each kind, twice with other numbers, by one wire."""
    ids, names = balls
    wire = ContactWire("world", serialize_message)
    pairs = list(pairwise(ids))
    for stamp in (1, 2_000_000_003):
        points = table(rng, pairs[: counts[0]])
        others = {
            "surfaces": other_rows(rng, pairs[10 : 10 + counts[1]], 1),
            "deformables": other_rows(rng, pairs[20 : 20 + counts[2]], 2),
        }
        ours = wire.message(points, names, stamp_ns=stamp, scene_version=9, **others)
        message = contacts_to_msg(
            points, names, stamp_ns=stamp, frame_id="world", scene_version=9, **others
        )
        assert [len(message.surfaces), len(message.deformables)] == list(counts[1:])
        assert_same_bytes(ours, message)


def test_the_same_pairs_are_not_joined_again(rng, balls):
    """While the same pairs touch, the serializer is not asked at all."""
    ids, names = balls
    calls = 0

    def counting(message):
        nonlocal calls
        calls += 1
        return serialize_message(message)

    wire = ContactWire("world", counting)
    pairs = [(ids[0], ids[5]), (ids[1], ids[2])]
    wire.message(table(rng, pairs), names, stamp_ns=1, scene_version=1)
    before = calls
    for stamp in range(10):
        wire.message(table(rng, pairs), names, stamp_ns=stamp, scene_version=1)
    wire.message(table(rng, pairs[::-1]), names, stamp_ns=stamp, scene_version=1)
    assert calls == before


def test_renamed_geometry_has_its_new_name(rng):
    """Names are those of the scene that is given, not of the one before."""
    graph = core.SceneGraph()
    source = graph.register_source("s")
    anchored = [
        int(
            graph.register_anchored_geometry(
                source, core.GeometryInstance(np.eye(4), core.Sphere(1.0), name)
            )
        )
        for name in ("left", "right")
    ]
    wire = ContactWire("world", serialize_message)
    contacts = table(rng, [anchored])
    for name in ("left", "another one"):
        graph.rename_geometry(source, core_id(graph, anchored[0]), name)
        current = SceneNames(graph.clone().model_inspector())
        ours = wire.message(contacts, current, stamp_ns=1, scene_version=1)
        message = expected(contacts, current, 1, 1, "world")
        assert message.points[0].geometry_a.name == name
        assert_same_bytes(ours, message)


def core_id(graph, value):
    """Return the id object of a number."""
    return next(g for g in graph.model_inspector().get_all_geometry_ids() if int(g) == value)


def test_a_change_of_the_scene_writes_new_names_alone(rng):
    """After a geometry was added only its name is serialized; all bytes are right."""
    graph = core.SceneGraph()
    source = graph.register_source("s")

    def add(name):
        ball = core.GeometryInstance(np.eye(4), core.Sphere(0.1), name)
        return int(graph.register_anchored_geometry(source, ball))

    ids = [add("g" * (1 + i)) for i in range(8)]
    names = SceneNames(graph.clone().model_inspector())
    written = []

    def serialize(message):
        written.append(len(message.points))
        return serialize_message(message)

    wire = ContactWire("world", serialize)
    pairs = list(itertools.combinations(ids, 2))
    wire.message(table(rng, pairs), names, stamp_ns=0, scene_version=0)
    more = [*pairs, (ids[7], add("new"))]
    names = SceneNames(graph.clone().model_inspector(), names)
    for chosen, count in ((pairs, 0), (more, 1)):
        written.clear()
        contacts = table(rng, chosen)
        ours = wire.message(contacts, names, stamp_ns=5, scene_version=1)
        assert sum(written) == count
        assert_same_bytes(ours, expected(contacts, names, 5, 1, "world"))


@pytest.mark.parametrize("frame_id", ["", "map", "world"])
def test_markers_are_byte_for_byte_what_is_serialized(rng, frame_id):
    """Also after the number of contacts changes, to none and back, and the look."""
    wire = ContactMarkerWire(frame_id, serialize_message)
    looks = [(0.02, 0.1), (0.02, 0.1), (0.5, 0.01)]
    for step, count in enumerate([0, 1, 2, 2, 0, 7, 1, 150, 0]):
        contacts = table(rng, [(1, 2)] * count)
        diameter, length = looks[step % 3]
        options = {
            "stamp_ns": step * 10**9 + 3,
            "point_diameter": diameter,
            "normal_length": length,
        }
        ours = wire.message(contacts, **options)
        assert_same_bytes(ours, contact_markers_to_msg(contacts, frame_id=frame_id, **options))


def test_stamps_before_the_epoch_and_at_the_end_of_time(rng, balls):
    """Seconds are signed in a stamp, as the ordinary adapter writes them."""
    ids, names = balls
    wire = ContactWire("world", serialize_message)
    contacts = table(rng, [(ids[0], ids[1])])
    for stamp in (-1, (2**31 - 1) * 10**9 + 999_999_999):
        ours = wire.message(contacts, names, stamp_ns=stamp, scene_version=1)
        assert_same_bytes(ours, expected(contacts, names, stamp, 1, "world"))

"""Markers as bytes: those that the serializer makes of the same messages."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import threading

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from visualization_msgs.msg import Marker, MarkerArray
from wire import assert_same_bytes

from msg_adapters.marker_rows import MarkerRows
from msg_adapters.markers import SceneMarkers
from msg_adapters.wire.markers import MarkerWire
from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Rgba,
    Sphere,
)
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions
from scene_graph_ros.views.draw_list import DrawItem

VERTICES = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
RED = Rgba(0.75, 0.125, 0.25, 0.5)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def rng():
    """Numbers that are the same in each run."""
    return np.random.default_rng(11)


@pytest.fixture
def shapes(tmp_path):
    """Every kind of shape, a mesh also as a file."""
    path = tmp_path / "tetrahedron.obj"
    path.write_text(OBJ)
    return {
        "sphere": Sphere(0.3),
        "box": Box(0.1, 0.2, 0.3),
        "capsule": Capsule(0.1, 0.4),
        "cylinder": Cylinder(0.1, 0.4),
        "ellipsoid": Ellipsoid(0.1, 0.2, 0.3),
        "half space": HalfSpace(),
        "convex": Convex(vertices=np.array(VERTICES)),
        "mesh": Mesh(vertices=np.array(VERTICES), faces=np.array(FACES)),
        "mesh file": Mesh(path),
        "mirrored mesh file": Mesh(path, scale=(1.0, -1.0, 1.0)),
    }


def item(geometry_id, shape, ns="proximity/arm/hand", rgba=RED):
    """Return an item to draw."""
    return DrawItem(geometry_id, ns, shape, rgba)


def poses(rng, count):
    """Return random poses."""
    q = rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return poses_from_quaternions(rng.normal(size=(count, 3)), q)


class Both:
    """The wire, and the ordinary way beside it."""

    def __init__(self, frame_id="world"):
        self.calls = 0
        self.wire = MarkerWire(self._serialize, frame_id=frame_id)
        self.scene = SceneMarkers(frame_id=frame_id)

    def _serialize(self, message):
        self.calls += 1
        return serialize_message(message)

    def set_items(self, items):
        """Give both the same items."""
        self.wire.set_items(items)
        self.scene.set_items(items)

    def check(self, X_WG, stamp, is_whole):
        """Compare the bytes of both, and return how many markers there are."""
        ours, count = self.wire.message(X_WG, stamp, is_whole=is_whole)
        place = self.scene.full if is_whole else self.scene.moved
        message = place(X_WG, stamp)
        message.markers.extend(self.scene.deletions(stamp).markers)
        assert_same_bytes(ours, message)
        assert count == len(message.markers)
        return count


KINDS = [
    *("sphere", "box", "capsule", "cylinder", "ellipsoid", "half_space"),
    *("convex", "mesh", "mesh_file", "mirrored_mesh_file"),
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame_id", ["", "map", "world"])
def test_every_shape_is_byte_for_byte_what_is_serialized(rng, shapes, kind, frame_id):
    """One marker, moved twice; with a colour, and without, as a mesh may have its own."""
    shape = shapes[kind.replace("_", " ")]
    for rgba in (Rgba(0.1, 0.2, 0.3, 0.4), None):
        both = Both(frame_id)
        both.set_items([item(5, shape, rgba=rgba)])
        both.check(poses(rng, 1), 1_000_000_007, is_whole=True)
        both.check(poses(rng, 1), 3_000_000_009, is_whole=False)


def test_all_shapes_in_one_message(rng, shapes):
    """Markers of all lengths follow each other, in each order of two."""
    both = Both()
    kinds = list(shapes.values())
    pairs = [shape for first in kinds for second in kinds for shape in (first, second)]
    names = [f"illustration/{'n' * (i % 11)}" for i in range(len(pairs))]
    both.set_items([item(i, s, ns) for i, (s, ns) in enumerate(zip(pairs, names, strict=True))])
    assert both.check(poses(rng, len(pairs)), 5, is_whole=True) == 2 * len(kinds) ** 2


def test_any_selection_that_moved(rng, shapes):
    """Random subsets move, also none, also the same again, also all."""
    both = Both()
    chosen = [*shapes.values()] * 3
    both.set_items([item(i, shape, f"p/{'f' * i}") for i, shape in enumerate(chosen)])
    X_WG = poses(rng, len(chosen))
    both.check(X_WG, 1, is_whole=False)
    for step in range(40):
        X_WG = X_WG.copy()
        moved = rng.random(len(chosen)) < rng.choice([0.0, 0.1, 0.5, 1.0])
        X_WG[moved] = poses(rng, int(moved.sum()))
        count = both.check(X_WG, step * 10**8, is_whole=step % 7 == 0)
        assert step % 7 == 0 or count == moved.sum()


def test_changes_of_the_scene(rng, shapes):
    """Geometry comes, goes, changes its shape and comes back; vanished markers are deleted."""
    both = Both()
    kinds = list(shapes.values())
    for step in range(25):
        there = np.flatnonzero(rng.random(12) < 0.6)
        items = [
            item(int(i), kinds[(int(i) + step // 8) % len(kinds)], f"role/{'s' * int(i)}")
            for i in there
        ]
        both.set_items(items)
        X_WG = poses(rng, len(items))
        both.check(X_WG, step, is_whole=step % 3 == 0)
        both.check(X_WG, step, is_whole=False)


def test_while_the_same_markers_move_nothing_is_serialized(rng, shapes):
    """Neither for all of them, nor for some, nor for those that change places with all."""
    both = Both()
    both.set_items([item(i, shape) for i, shape in enumerate(shapes.values())])
    X_WG = poses(rng, len(shapes))

    def move():
        X_WG[2:4] = poses(rng, 2)
        return both.wire.message(X_WG, 1, is_whole=False)[1]

    both.wire.message(X_WG, 1, is_whole=True)
    move()
    before = both.calls
    assert [move() for _ in range(5)] == [2] * 5
    for _ in range(3):
        both.wire.message(poses(rng, len(shapes)), 1, is_whole=True)
    assert both.calls == before


def test_an_unchanged_marker_is_not_serialized_again_when_the_scene_changes(rng, shapes):
    """One more ball costs the serialization of a ball, not of all that was there."""
    both = Both()
    items = [item(i, shape) for i, shape in enumerate(shapes.values())]
    both.set_items(items)
    both.wire.message(poses(rng, len(items)), 1, is_whole=True)
    before = both.calls
    both.set_items([*items, item(99, Sphere(1.0))])
    both.wire.message(poses(rng, len(items) + 1), 1, is_whole=True)
    # The new piece, and the head of the message.
    assert both.calls - before <= 2


def test_prepared_markers_are_sent_without_serializing(rng, shapes):
    """What an edit prepared is only taken: all bytes of the first message are there."""
    both = Both()
    items = [item(i, shape) for i, shape in enumerate(shapes.values())]
    both.set_items(items)
    both.check(poses(rng, len(items)), 1, is_whole=True)
    more = [*items, item(99, Sphere(1.0)), item(100, shapes["mesh"])]
    prepared = both.wire.prepare(more)
    both.check(poses(rng, len(items)), 2, is_whole=False)
    before = both.calls
    both.wire.take(prepared)
    both.wire.message(X_WG := poses(rng, len(more)), 3, is_whole=True)
    assert both.calls == before
    both.scene.set_items(more)
    both.scene.full(X_WG, 3)
    both.check(poses(rng, len(more)), 4, is_whole=False)


@pytest.mark.parametrize("are_moved", [False, True], ids=["new ones", "new ones and what moves"])
def test_messages_that_are_likely_next_are_prepared(rng, shapes, are_moved, monkeypatch):
    """After an edit nothing is joined for what is new, nor for what moves as it did before."""
    both = Both()
    items = [item(i, shape) for i, shape in enumerate(shapes.values())]
    both.set_items(items)
    X_WG = poses(rng, len(items))
    both.check(X_WG, 1, is_whole=True)
    X_WG[::2] = poses(rng, len(X_WG[::2]))
    both.check(X_WG, 2, is_whole=False)
    more = [item(50, Sphere(1.0)), *items[:3], *items[4:], item(99, shapes["mesh"])]
    both.set_items(more)
    joined, join = [], both.wire._join
    monkeypatch.setattr(both.wire, "_join", lambda rows, *a: joined.append(rows) or join(rows, *a))
    X_WG = np.concatenate([poses(rng, 1), X_WG[:3], X_WG[4:], poses(rng, 1)])
    # Where every other one of before is by now.
    moving = [1, 3, 4, 6, 8]
    for stamp in (3, 4):
        if are_moved or stamp == 4:
            X_WG[moving] = poses(rng, len(moving))
        both.check(X_WG, stamp, is_whole=False)
    assert joined == []


def test_markers_that_were_prepared_in_vain_do_no_harm(rng, shapes):
    """A scene that never counted, and one that was prepared before another was taken."""
    both = Both()
    first = [item(i, shape) for i, shape in enumerate(shapes.values())]
    both.set_items(first)
    both.check(poses(rng, len(first)), 1, is_whole=True)
    both.wire.prepare(first[3:])
    second = [*first[:2], *first[4:], item(50, Sphere(0.5))]
    prepared = both.wire.prepare(second)
    both.wire.prepare([item(7, Sphere(0.1))])
    both.wire.take(prepared)
    both.scene.set_items(second)
    both.check(poses(rng, len(second)), 2, is_whole=False)


def test_markers_are_prepared_while_others_are_taken(rng, shapes, monkeypatch):
    """An edit's thread may come at any moment of it, also where there are fewer than before."""
    both = Both()
    items = [item(i, shape) for i, shape in enumerate(shapes.values())]
    both.set_items(items)
    both.check(poses(rng, len(items)), 1, is_whole=True)
    fewer, more = items[:4], [*items[:4], item(50, Sphere(0.5))]
    taken = both.wire.prepare(fewer)
    take, prepared = MarkerRows.take, []

    def take_and_be_interrupted(rows, *arguments):
        take(rows, *arguments)
        prepared.append(both.wire.prepare(more))

    monkeypatch.setattr(MarkerRows, "take", take_and_be_interrupted)
    both.wire.take(taken)
    both.scene.set_items(fewer)
    monkeypatch.setattr(MarkerRows, "take", take)
    both.check(poses(rng, len(fewer)), 2, is_whole=False)
    both.wire.take(prepared[0])
    both.scene.set_items(more)
    both.check(poses(rng, len(more)), 3, is_whole=True)


@pytest.mark.parametrize("kind", ["mesh", "mesh file"])
def test_threads_make_pieces_of_one_marker(shapes, kind):
    """An edit's thread may begin with one while another is made for a message, and end later."""
    both = Both()
    both.set_items([item(1, shapes[kind])])
    (look,) = both.wire._pieces.markers
    serialize, make = both.wire._serialize, both.wire._make_piece
    expected = [seen_of(make(look, alignment)) for alignment in (0, 4)]
    others, is_there, may_go_on = [], threading.Event(), threading.Event()

    def serialize_in_turns(message):
        if threading.current_thread() is not threading.main_thread():
            is_there.set()
            assert may_go_on.wait(60.0)
        elif not others:
            others.append(pool.submit(make, look, 4))
            assert is_there.wait(60.0)
        return serialize(message)

    both.wire._serialize = serialize_in_turns
    with ThreadPoolExecutor(1) as pool:
        made = make(look, 0)
        may_go_on.set()
        assert [seen_of(made), seen_of(others[0].result(60.0))] == expected


def seen_of(piece):
    """Return what is alike in all pieces of a marker: between its fields may be anything."""
    return len(piece.data), piece.stamp, piece.pose, piece.data[piece.pose :][: 7 * 8]


def test_poses_of_a_wrong_number_are_refused(rng, shapes):
    """As by the ordinary way, before anything is written."""
    both = Both()
    both.set_items([item(1, shapes["box"])])
    for is_whole in (True, False):
        with pytest.raises(ValueError, match="1 items"):
            both.wire.message(poses(rng, 2), 1, is_whole=is_whole)


def test_to_start_over_all_is_deleted_before_all_is_shown(rng, shapes):
    """One deletion for all, byte for byte, in place of those of what vanished; only then."""
    both = Both()
    both.set_items([item(i, shape) for i, shape in enumerate(shapes.values())])
    both.check(poses(rng, len(shapes)), 1, is_whole=True)
    both.set_items([item(0, shapes["sphere"]), item(1, shapes["mesh"])])
    X_WG = poses(rng, 2)
    ours, count = both.wire.message(X_WG, 5, is_whole=True, starts_over=True)
    deletion = both.scene.deletions(5).markers[0]
    deletion.ns, deletion.id, deletion.action = "", 0, Marker.DELETEALL
    message = MarkerArray(markers=[deletion, *both.scene.full(X_WG, 5).markers])
    assert_same_bytes(ours, message)
    assert count == 3
    both.check(poses(rng, 2), 6, is_whole=True)

"""Candidates of things that move: the same as without a memory, with no more work than asked."""

import threading

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    CollisionFilterDeclaration,
    Convex,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.broadphase import tracking
from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.broadphase.all_pairs import all_candidate_pairs
from scene_graph_ros.geometry.broadphase.tracking import BOUNDED, LOOKED_AT, REFENCED, SEARCHED
from scene_graph_ros.geometry.query.candidates.rows import pair_memory
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy

NO_FILTERS = np.zeros((0, 0), dtype=np.uint8)


class Scene:
    """Balls, boxes and hulls on frames, among anchored boxes above an anchored floor."""

    def __init__(self, moving: int, anchored: int, seed: int = 0) -> None:
        self.rng = np.random.default_rng(seed)
        graph = SceneGraph()
        self.source = graph.register_source("scene")
        self.frames, ids = [], []
        corners = self.rng.normal(size=(8, 3))
        shapes = [Sphere(0.1), Box(0.1, 0.2, 0.3), Convex(vertices=0.1 * corners)]
        for k in range(moving):
            frame = graph.register_frame(self.source, GeometryFrame(f"frame_{k}"))
            instance = GeometryInstance(np.eye(4), shapes[k % 3], f"geometry_{k}")
            ids.append(graph.register_geometry(self.source, frame, instance))
            self.frames.append(frame)
        for k, X_WG in enumerate(self.poses(anchored)):
            instance = GeometryInstance(X_WG, Box(0.2, 0.2, 0.2), f"anchored_{k}")
            ids.append(graph.register_anchored_geometry(self.source, instance))
        floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
        ids.append(graph.register_anchored_geometry(self.source, floor))
        for geometry in ids:
            graph.assign_role(self.source, geometry, ProximityProperties())
        few = GeometrySet(ids[: moving // 3])
        graph.collision_filter_manager().apply(CollisionFilterDeclaration().exclude_within(few))
        self.graph = graph
        self.context = graph.create_default_context()
        self.query = graph.query_object(self.context)
        self.X = self.poses(moving)
        self.context.set_frame_poses(self.source, self.X)

    def poses(self, n: int) -> np.ndarray:
        """Draw poses in a cube with room for some pairs."""
        angles = self.rng.uniform(-3.0, 3.0, (n, 3))
        places = self.rng.uniform(0.0, 1.5, (n, 3))
        poses = [pose_from_xyz_rpy(p, a) for p, a in zip(places, angles, strict=True)]
        return np.array(poses).reshape(n, 4, 4)

    def step(self, size: float, rows: slice = slice(None)) -> None:
        """Move frames by about ``size`` metres."""
        X = self.X.copy()
        X[rows, :3, 3] += self.rng.normal(scale=size, size=X[rows, :3, 3].shape)
        self.X = X
        self.context.set_frame_poses(self.source, X)

    def counters(self, margin: float = 0.0) -> np.ndarray:
        """Return what the context's memory counts."""
        return pair_memory(self.query.snapshot).counters(margin)


def expected_pairs(query, margin: float) -> np.ndarray:
    """Return the ids of the pairs that a look at all pairs finds."""
    snapshot = query.snapshot
    p = snapshot.proximity
    lower, upper = world_boxes(p.table, snapshot.X_WG)
    bits = NO_FILTERS if p.filter_bits is None else p.filter_bits
    is_half_space = p.table.kind == ShapeKind.HALF_SPACE
    return p.ids[
        all_candidate_pairs(lower, upper, is_half_space, snapshot.X_WG, p.frame, bits, margin)
    ]


def found_pairs(query) -> np.ndarray:
    """Return the ids of the candidates."""
    found = query.find_collision_candidates()
    return np.stack([found.id_A, found.id_B], axis=1)


@pytest.mark.parametrize("moving", [0, 1, 12, 150])
@pytest.mark.parametrize("size", [0.0, 1e-12, 0.003, 0.05, 1.0])
def test_candidates_of_moving_things(moving: int, size: float) -> None:
    """After steps of any size the candidates are those among all pairs."""
    scene = Scene(moving, 20)
    for _ in range(12):
        scene.step(size)
        assert np.array_equal(found_pairs(scene.query), expected_pairs(scene.query, 0.0))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.sampled_from([0.0, 0.001, 0.02, 0.2, 5.0]), min_size=2, max_size=10),
       st.integers(0, 10**6))  # fmt: skip
def test_candidates_do_not_depend_on_the_past(sizes: list[float], seed: int) -> None:
    """A context that came by any way finds what a fresh one finds at the same poses."""
    scene = Scene(40, 10, seed)
    for size in sizes:
        scene.step(size, slice(int(scene.rng.integers(40)), None))
        fresh = scene.graph.create_default_context()
        fresh.set_frame_poses(scene.source, scene.X)
        assert np.array_equal(
            found_pairs(scene.query), found_pairs(scene.graph.query_object(fresh))
        )


def test_margins_do_not_mix() -> None:
    """Distances with several limits in turn find the same pairs as a fresh context does."""
    scene = Scene(60, 10)
    for k in range(20):
        scene.step(0.02)
        fresh = scene.graph.create_default_context()
        fresh.set_frame_poses(scene.source, scene.X)
        limit = 0.05 * (k % 6)
        tables = [
            query.compute_signed_distance_pairwise_closest_points(limit)
            for query in (scene.query, scene.graph.query_object(fresh))
        ]
        for name in ("id_A", "id_B", "distance"):
            assert np.array_equal(getattr(tables[0], name), getattr(tables[1], name))


def test_memory_follows_the_model() -> None:
    """After a geometry came, went, or a filter changed, candidates are those of the new model."""
    scene = Scene(30, 5)
    found_pairs(scene.query)
    instance = GeometryInstance(np.eye(4), Sphere(3.0), "large")
    large = scene.graph.register_geometry(
        scene.source, scene.frames[0], instance, context=scene.context
    )
    scene.graph.assign_role(scene.source, large, ProximityProperties(), context=scene.context)
    assert np.array_equal(found_pairs(scene.query), expected_pairs(scene.query, 0.0))
    assert int(large) in found_pairs(scene.query)
    everything = GeometrySet(scene.query.snapshot.proximity.geometry_ids)
    manager = scene.graph.collision_filter_manager(scene.context)
    manager.apply(CollisionFilterDeclaration().exclude_within(everything))
    assert len(found_pairs(scene.query)) == 0


def test_little_motion_is_little_work() -> None:
    """Steps of 1 mm of 20 cm shapes search once for all pairs, then hardly ever for any."""
    scene = Scene(200, 100)
    found_pairs(scene.query)
    scene.step(0.001)  # the first step tells how large steps are
    found_pairs(scene.query)
    before = scene.counters()
    for _ in range(10):
        scene.step(0.001)
        found_pairs(scene.query)
    work = scene.counters() - before
    assert work[SEARCHED] <= 1
    assert work[REFENCED] <= 10 * 20
    assert work[BOUNDED] == 10 * 200  # anchored ones never


def test_fences_are_wide_where_boxes_are_few() -> None:
    """Scattered things that go on in one direction stay inside of their fences for some steps."""
    scene = Scene(40, 0)
    scene.X[:, :3, 3] *= 20.0

    def go_on() -> np.ndarray:
        scene.X = scene.X.copy()
        scene.X[:, 0, 3] += 0.03
        scene.context.set_frame_poses(scene.source, scene.X)
        found_pairs(scene.query)
        return scene.counters()

    go_on()
    before = go_on()  # now it is known how large steps are
    for _ in range(4):
        after = go_on()
    assert (after - before)[REFENCED] == 0
    assert (after - before)[SEARCHED] == 0


@pytest.mark.parametrize(("moving", "searches"), [(22, 0), (60, 1)])
def test_scattered_things_come_together(moving: int, searches: int) -> None:
    """So many new pairs that all are sorted, or that the list has no room for them, are found."""
    scene = Scene(moving, 0)
    scene.X[:, :3, 3] *= 20.0
    scene.context.set_frame_poses(scene.source, scene.X)
    few = len(found_pairs(scene.query))
    before = scene.counters()
    scene.X = scene.poses(moving)
    scene.X[:, :3, 3] *= 0.01
    scene.context.set_frame_poses(scene.source, scene.X)
    found = found_pairs(scene.query)
    assert np.array_equal(found, expected_pairs(scene.query, 0.0))
    assert few < 20
    assert len(found) > 200
    assert (scene.counters() - before)[SEARCHED] == searches
    for _ in range(3):
        scene.step(0.01)
        assert np.array_equal(found_pairs(scene.query), expected_pairs(scene.query, 0.0))


def test_anchored_things_are_not_touched() -> None:
    """One thing that moves among a thousand anchored ones costs looks at its own pairs only."""
    scene = Scene(1, 1000)
    found_pairs(scene.query)
    scene.step(0.001)
    found_pairs(scene.query)
    before = scene.counters()
    scene.step(1e-4)
    found_pairs(scene.query)
    work = scene.counters() - before
    assert work[BOUNDED] == 1
    assert work[SEARCHED] == 0
    assert work[LOOKED_AT] < 100


def test_unmoved_things_are_not_bounded_again() -> None:
    """Of a hundred frames, three of which move, three boxes are computed."""
    scene = Scene(100, 0)
    found_pairs(scene.query)
    before = scene.counters()
    scene.step(0.001, slice(3))
    found_pairs(scene.query)
    assert (scene.counters() - before)[BOUNDED] == 3


def test_asking_again_is_no_work() -> None:
    """A query repeated on the same snapshot returns the same table, and nothing is computed."""
    scene = Scene(50, 10)
    first = scene.query.compute_point_pair_penetration()
    limited = scene.query.compute_signed_distance_pairwise_closest_points(0.1)
    before = scene.counters(), scene.counters(0.1)
    assert scene.query.compute_point_pair_penetration() is first
    assert scene.query.compute_signed_distance_pairwise_closest_points(0.1) is limited
    assert np.array_equal((scene.counters(), scene.counters(0.1)), before)


def test_old_snapshots_keep_their_poses() -> None:
    """World poses that somebody holds are not written over by later snapshots."""
    scene = Scene(20, 5)
    baked = scene.query.bake()
    held, copies = [baked.snapshot.X_WG], [baked.snapshot.X_WG.copy()]
    for _ in range(5):
        scene.step(0.1)
        held.append(scene.query.snapshot.X_WG[3:])
        copies.append(held[-1].copy())
    scene.step(0.1)
    found_pairs(scene.query)
    for kept, copy in zip(held, copies, strict=True):
        assert np.array_equal(kept, copy)


def test_threads_that_ask_at_once() -> None:
    """Threads with snapshots of one context find what they would find alone."""
    scene = Scene(80, 10)
    baked = []
    for _ in range(8):
        scene.step(0.05)
        baked.append(scene.query.bake())
    truths = [expected_pairs(query, 0.0) for query in baked]
    answers: list[list[bool]] = [[] for _ in baked]

    def ask(k: int) -> None:
        for turn in range(30):
            i = (k + turn) % len(baked)
            memory = pair_memory(baked[i].snapshot)
            rows = memory.find(baked[i].snapshot.X_WG, 0.0, is_close=False)
            ids = baked[i].snapshot.proximity.ids[rows]
            answers[k].append(np.array_equal(ids, truths[i]))

    found_pairs(scene.query)
    threads = [threading.Thread(target=ask, args=(k,)) for k in range(len(baked))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(len(kept) == 30 and all(kept) for kept in answers)


def test_a_search_that_is_interrupted_is_done_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who is interrupted in the midst of a search leaves nothing that is believed afterwards."""
    scene = Scene(300, 10)
    found_pairs(scene.query)
    search = tracking._search

    def interrupted(*arguments):
        search(*arguments)
        raise KeyboardInterrupt

    scene.step(3.0)
    with monkeypatch.context() as patched:
        patched.setattr(tracking, "_search", interrupted)
        with pytest.raises(KeyboardInterrupt):
            found_pairs(scene.query)
    assert np.array_equal(found_pairs(scene.query), expected_pairs(scene.query, 0.0))
    scene.step(0.001)
    assert np.array_equal(found_pairs(scene.query), expected_pairs(scene.query, 0.0))


def test_a_choice_of_margin_that_is_interrupted_is_made_again() -> None:
    """The tracker of one margin is never asked for another's pairs."""

    class Interrupted(dict):
        def __setitem__(self, key, value):
            super().__setitem__(key, value)
            raise KeyboardInterrupt

    scene = Scene(300, 10)
    found_pairs(scene.query)
    snapshot = scene.query.snapshot
    memory = pair_memory(snapshot)
    near = memory.find(snapshot.X_WG, 0.0, is_close=False)
    memory._trackers = Interrupted(memory._trackers)
    with pytest.raises(KeyboardInterrupt):
        memory.find(snapshot.X_WG, 1.0, is_close=False)
    memory._trackers = dict(memory._trackers)
    assert np.array_equal(memory.find(snapshot.X_WG, 0.0, is_close=False), near)
    assert len(memory.find(snapshot.X_WG, 1.0, is_close=False)) > len(near)

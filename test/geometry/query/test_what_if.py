"""Many configurations at once: the answers of one after another, however many threads ask."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    ask_what_if,
    Box,
    Capsule,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    QueryObject,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    InvalidPoseError,
    QueryArgumentError,
    UnknownIdError,
)
from scene_graph_ros.geometry.query.candidates.rows import pair_memory

SHAPES = [Sphere(0.3), Box(0.5, 0.4, 0.3), Capsule(0.2, 0.4)]
BODIES = 9
EDGE = 2.8
"""Metres. Of the cube that holds the bodies: in some configurations they overlap."""


@pytest.fixture
def rng():
    """Numbers that are the same in each run."""
    return np.random.default_rng(5)


def place(rng):
    """Return a random pose, turned about z."""
    X, (c, s) = np.eye(4), np.sin(rng.uniform(0, 7) + np.array([0.5 * np.pi, 0.0]))
    X[:2, :2] = [[c, -s], [s, c]]
    X[:3, 3] = rng.uniform(0.0, EDGE, 3)
    return X


@pytest.fixture
def scene(rng):
    """A live query object and the frames of bodies of three kinds."""
    graph = SceneGraph()
    source = graph.register_source("bodies")
    frames = []
    for i in range(BODIES):
        frames.append(graph.register_frame(source, GeometryFrame(f"f{i}")))
        instance = GeometryInstance(np.eye(4), SHAPES[i % len(SHAPES)], f"g{i}")
        body = graph.register_geometry(source, frames[-1], instance)
        graph.assign_role(source, body, ProximityProperties())
    context = graph.create_default_context()
    context.set_frame_poses(source, {frame: place(rng) for frame in frames})
    return graph.query_object(context), frames


@pytest.fixture
def configurations(scene, rng):
    """Poses of some of the frames: all, a few, or none."""
    _, frames = scene
    return [
        {frame: place(rng) for frame in frames if rng.random() < share}
        for share in rng.choice([0.0, 0.3, 1.0], 23)
    ]


def everything(world):
    """Return all there is to ask about pairs, as bytes."""
    tables = [
        world.find_collision_candidates(),
        world.compute_point_pair_penetration(),
        world.compute_signed_distance_pairwise_closest_points(max_distance=0.2),
    ]
    columns = [
        np.ascontiguousarray(getattr(table, name)).tobytes()
        for table in tables
        for name in table.columns
    ]
    return [world.has_collisions(), *columns]


@pytest.mark.parametrize("threads", [1, 2, 3, 8, 50])
def test_threads_answer_bit_for_bit_what_one_after_another_does(scene, configurations, threads):
    """Each configuration alone, from a snapshot of its own, is the measure."""
    query, _ = scene
    expected = [
        everything(QueryObject(query.snapshot.with_frame_poses(poses))) for poses in configurations
    ]
    assert len({answers[0] for answers in expected}) == 2, "some collide, and some don't"
    assert ask_what_if(query, configurations, everything, threads=threads) == expected


def test_nothing_moves_and_nothing_is_remembered(scene, configurations):
    """The context's poses and what it knows of its pairs stay as they were."""
    query, frames = scene
    before, memory = everything(query), pair_memory(query.snapshot)
    X_WF = query.get_pose_in_world(frames[0])
    ask_what_if(query, configurations, everything, threads=2)
    assert np.array_equal(query.get_pose_in_world(frames[0]), X_WF)
    assert pair_memory(query.snapshot) is memory
    assert everything(query.bake()) == before


def test_all_threads_that_are_asked_for_take_part(scene, configurations):
    """Two threads meet inside the question, which one alone could not."""
    query, _ = scene
    barrier = threading.Barrier(2, timeout=60.0)
    met = ask_what_if(query, configurations[:2], lambda world: barrier.wait() in (0, 1), threads=2)
    assert met == [True, True]


def test_no_configurations_have_no_answers(scene):
    """An empty list is answered by an empty list."""
    assert ask_what_if(scene[0], [], everything, threads=4) == []


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2"])
def test_threads_must_be_a_positive_integer(scene, threads):
    """What is no number of threads is quoted."""
    with pytest.raises(QueryArgumentError, match=f"threads.*{threads!r}"):
        ask_what_if(scene[0], [{}], everything, threads=threads)


@pytest.mark.parametrize("threads", [1, 2])
def test_errors_of_configurations_and_questions_come_through(scene, configurations, threads):
    """A pose that is none, a geometry for a frame, and a question that raises."""
    query, frames = scene
    bad = [*configurations, {frames[0]: np.full((4, 4), np.nan)}]
    with pytest.raises(InvalidPoseError):
        ask_what_if(query, bad, everything, threads=threads)
    geometry = query.snapshot.role_arrays(Role.PROXIMITY).geometry_ids[0]
    with pytest.raises(UnknownIdError):
        ask_what_if(query, [{geometry: np.eye(4)}], everything, threads=threads)
    with pytest.raises(ZeroDivisionError):
        ask_what_if(query, configurations, lambda world: 1 / 0, threads=threads)

"""Requests about many configurations: the same response, however many threads share them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import threading
import time

import numpy as np
import pytest

from msg_adapters.queries import options_from_msg, what_if_to_msg
from scene_graph_msgs import srv
from scene_graph_msgs.msg import QueryOptions
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.query.candidates import ask as candidates
from scene_graph_ros.geometry.query.distance import ask as distance
from scene_graph_ros.geometry.query.penetration import ask as penetration
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

SCENE = """
version: 1
sources: [{name: s}]
frames: [{name: a, source: s}, {name: b, source: s}, {name: c, source: s}]
geometries:
  - {name: ball, source: s, frame: a, shape: {type: sphere, radius: 0.4}}
  - {name: box, source: s, frame: b, shape: {type: box, size: [0.5, 0.6, 0.7]}}
  - {name: can, source: s, frame: c, shape: {type: cylinder, radius: 0.3, length: 0.5}}
"""
CONFIGURATIONS = 17
DEADLINE = 60.0
"""Seconds after which a test gives up: far more than anything takes on a busy machine."""

REQUESTS = {
    "ComputePointPairPenetration": {},
    "ComputeSignedDistancePairwise": {},
    "ComputeSignedDistancePair": {
        "geometries_a": ["ball"],
        "geometries_b": ["can"],
    },
    "ComputeSignedDistanceToPoint": {"points": [0.5, 0.0, 0.2, -0.5, 1.0, 0.0]},
    "FindCollisionCandidates": {},
    "GetPoseInWorld": {"frames": ["b"]},
    "HasCollisions": {},
}


@pytest.fixture(scope="module")
def world():
    """Three bodies."""
    graph = SceneGraph()
    load_scene_text(SCENE).apply(graph)
    return World(graph)


def answer(world, name, fields, options, threads):
    """Return the response to a request."""
    limits = {"query_threads": threads}
    scope = QueryScope(
        world.snapshot,
        options_from_msg(options, world.snapshot.names),
        lambda parameter: limits.get(parameter, 10**6),
    )
    response = getattr(srv, name).Response()
    QUERIES[name].handler(getattr(srv, name).Request(**fields), response, scope)
    return response


@pytest.mark.parametrize("name", REQUESTS)
@pytest.mark.parametrize("threads", [2, 5])
def test_any_number_of_threads_gives_the_same_response(world, name, threads):
    """Seventeen configurations of two frames, some in collision and some not."""
    rng = np.random.default_rng(9)
    rows = np.zeros((CONFIGURATIONS, 2, 7))
    rows[..., :3] = rng.uniform(-1.0, 1.0, (CONFIGURATIONS, 2, 3))
    rows[..., 6] = 1.0
    options = QueryOptions(what_if=what_if_to_msg(["a", "b"], rows))
    one = answer(world, name, REQUESTS[name], options, 1)
    assert answer(world, name, REQUESTS[name], options, threads) == one
    if name == "HasCollisions":
        assert set(one.has_collisions) == {0, 1}


@pytest.mark.parametrize("threads", [2, 5])
def test_points_of_the_world_as_it_is_are_shared_too(world, threads):
    """Forty points, without a configuration."""
    points = np.random.default_rng(2).uniform(-1.0, 1.0, 120).tolist()
    name, fields = "ComputeSignedDistanceToPoint", {"points": points}
    one = answer(world, name, fields, QueryOptions(), 1)
    assert len(one.table.distance) == 3 * 40
    assert answer(world, name, fields, QueryOptions(), threads) == one


@pytest.mark.parametrize(
    ("name", "module", "computed"),
    [
        ("ComputePointPairPenetration", penetration, "penetrations"),
        ("ComputeSignedDistancePairwise", distance, "pair_distances"),
        ("FindCollisionCandidates", candidates, "pairs_of_candidates"),
        ("HasCollisions", penetration, "collides"),
    ],
)
def test_threads_that_ask_the_same_share_the_answer(world, monkeypatch, name, module, computed):
    """Four requests that come at the same time are computed once."""
    compute, count = getattr(module, computed), []
    together = threading.Barrier(4, timeout=DEADLINE)

    def slowly(*arguments):
        count.append(threading.current_thread())
        time.sleep(0.1)
        return compute(*arguments)

    def ask():
        together.wait()
        return answer(world, name, REQUESTS[name], QueryOptions(), 1)

    expected = answer(world, name, REQUESTS[name], QueryOptions(), 1)
    with world.lock:
        world.commit((), None)
    monkeypatch.setattr(module, computed, slowly)
    with ThreadPoolExecutor(4) as pool:
        answers = [task.result() for task in [pool.submit(ask) for _ in range(4)]]
    assert len(count) == 1
    assert answers == [expected] * 4


def test_other_questions_are_not_held_up(world):
    """While one is being answered another one is, too; one that fails has the next turn free."""
    snapshot = world.snapshot
    begun, go_on = threading.Event(), threading.Event()

    def fail(query):
        begun.set()
        assert go_on.wait(DEADLINE)
        raise RuntimeError("no answer")

    with ThreadPoolExecutor(1) as pool:
        failing = pool.submit(snapshot.ask, fail)
        assert begun.wait(DEADLINE)
        assert snapshot.ask(lambda query: query is snapshot.query)
        go_on.set()
        for task in (failing, pool.submit(snapshot.ask, fail)):
            with pytest.raises(RuntimeError, match="no answer"):
                task.result(DEADLINE)

"""The limit of rows holds while an answer is computed, whatever limit of distance is given."""

from __future__ import annotations

import numpy as np
import pytest

from msg_adapters.errors import TooLargeError
from msg_adapters.queries import options_from_msg, what_if_to_msg
from scene_graph_msgs import srv
from scene_graph_msgs.msg import QueryOptions
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.query import blocks
from scene_graph_ros.geometry.query.distance import ask as distance_ask
from scene_graph_ros.geometry.query.penetration import ask as penetration
from scene_graph_ros.geometry.query.point import ask as point
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

COUNT = 40
LIMIT = 100
SCENE = "\n".join(
    [
        "version: 1",
        "sources: [{name: s}]",
        "frames:",
        *(f"- {{name: f{i}, source: s}}" for i in range(COUNT)),
        "geometries:",
        *(
            f"- {{name: b{i}, source: s, frame: f{i}, shape: {{type: sphere, radius: 0.1}}}}"
            for i in range(COUNT)
        ),
    ]
)


@pytest.fixture(scope="module")
def world():
    """Forty balls a metre apart."""
    graph = SceneGraph()
    load_scene_text(SCENE).apply(graph)
    result = World(graph)
    X_PF = result.frames("s").X_PF
    X_PF[:, 0, 3], X_PF[:, 1, 3] = np.arange(COUNT) % 7, np.arange(COUNT) // 7
    result.commit(["s"], None)
    return result


@pytest.fixture
def rows(monkeypatch):
    """Collect how many rows the core computes, query by query."""
    computed = []
    for module, name in (
        (blocks, "distances_of_pairs"),
        (distance_ask, "distances_of_pairs"),
        (point, "point_distances"),
        (penetration, "penetrations"),
    ):
        original = getattr(module, name)

        def counted(*arguments, original=original):
            table = original(*arguments)
            computed.append(len(table))
            return table

        monkeypatch.setattr(module, name, counted)
    return computed


def ask(world, name, options=None, limit=LIMIT, **fields):
    """Return the response to a request, of a node whose rows are limited."""
    limits = {"query_threads": 1, "max_rows_per_response": limit}
    snapshot = world.snapshot
    scope = QueryScope(
        snapshot,
        options_from_msg(options or QueryOptions(), snapshot.names),
        lambda parameter: limits.get(parameter, 10**6),
        world.records,
    )
    response = getattr(srv, name).Response()
    QUERIES[name].handler(getattr(srv, name).Request(**fields), response, scope)
    return response


def test_points_within_a_distance_stop_at_the_limit(world, rows):
    """A thousand points and forty balls are 40 000 rows; no more than two limits are computed."""
    points = np.zeros(3000).tolist()
    with pytest.raises(TooLargeError, match="more than max_rows_per_response, which is 100"):
        ask(world, "ComputeSignedDistanceToPoint", points=points, threshold=[1e6])
    assert sum(rows) <= 2 * LIMIT


def test_pairs_within_a_distance_stop_at_the_limit(world, rows):
    """All 780 pairs are within a million metres; the first that are more than 100 are the last."""
    with pytest.raises(TooLargeError, match="more than max_rows_per_response, which is 100"):
        ask(world, "ComputeSignedDistancePairwise", max_distance=[1e6])
    assert sum(rows) <= 3 * LIMIT


def test_a_list_of_all_pairs_is_not_made(world, monkeypatch):
    """The distance at which pairs are looked for grows until they are too many."""
    margins = []
    original = blocks.candidate_rows
    monkeypatch.setattr(blocks, "candidate_rows", lambda s, m: margins.append(m) or original(s, m))
    with pytest.raises(TooLargeError):
        ask(world, "ComputeSignedDistancePairwise", max_distance=[1e6])
    assert max(margins) < 10.0


@pytest.mark.parametrize("distance", [0.85, 1.0])
def test_what_fits_is_answered_alike(world, distance):
    """Seventy-odd neighbours are fewer than 100 rows, though the pairs are more."""
    name = "ComputeSignedDistancePairwise"
    bounded = ask(world, name, max_distance=[distance])
    assert 0 < len(bounded.table.distance) <= LIMIT
    assert bounded == ask(world, name, max_distance=[distance], limit=10**6)


def test_contacts_of_configurations_stop_at_the_limit(world, rows):
    """Twelve balls in one place are 66 pairs, so that the second configuration is too much."""
    frames = [f"f{i}" for i in range(12)]
    poses = np.zeros((50, len(frames), 7))
    poses[..., 6] = 1.0
    options = QueryOptions(what_if=what_if_to_msg(frames, poses))
    for name in ("ComputePointPairPenetration", "FindCollisionCandidates"):
        rows.clear()
        with pytest.raises(TooLargeError, match="rows of the answer: 132 are more"):
            ask(world, name, options)
        assert rows in ([66, 66], [])


def test_configurations_are_counted_before_they_are_made(world):
    """Of 1000 configurations none is looked at where 10 are allowed: none here is a pose."""
    msg = what_if_to_msg(["f0"], np.zeros((1000, 1, 7)))
    with pytest.raises(TooLargeError, match="1000 are more than max_configurations_per_request"):
        options_from_msg(QueryOptions(what_if=msg), world.snapshot.names, max_configurations=10)

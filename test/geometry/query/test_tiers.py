"""The accuracy of queries: the model's, a query's own, and the certificate of an answer."""

from __future__ import annotations

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Convex,
    Cylinder,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    QueryObject,
    SceneGraph,
)
from scene_graph_ros.geometry.accuracy import Accuracy
from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism

SIZE = 0.4
"""Metres: L of the scene's pairs, the length of the cylinder."""


PEBBLE = np.random.default_rng(7).normal(size=(80, 3))
PEBBLE = Convex(vertices=PEBBLE / np.linalg.norm(PEBBLE, axis=1, keepdims=True) * [0.1, 0.2, 0.15])
"""Too many vertices for a proof in short, which would be exact at every tier."""


@pytest.fixture
def model():
    """A scene graph, and a context with pairs that have no closed form, apart and overlapping."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("tiers")
    rng = np.random.default_rng(8)
    poses = []
    for k in range(24):
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame_{k}"))
        shape = Cylinder(0.1, SIZE) if k % 2 else PEBBLE
        instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
        geometry = scene_graph.register_geometry(source, frame, instance)
        scene_graph.assign_role(source, geometry, ProximityProperties())
        X_WF = np.eye(4)
        X_WF[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        X_WF[:3, 0] *= np.linalg.det(X_WF[:3, :3])
        X_WF[:3, 3] = rng.uniform(-0.4, 0.4, 3)
        poses.append(X_WF)
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, np.array(poses))
    return scene_graph, context


@pytest.fixture
def query(model) -> QueryObject:
    """The queries of that scene, exact by default."""
    scene_graph, context = model
    return scene_graph.query_object(context)


def distances(query: QueryObject, **how) -> np.ndarray:
    """Return all signed distances in the order of their ids."""
    return query.compute_signed_distance_pairwise_closest_points(**how).distance


def test_a_looser_tier_gives_other_numbers_within_its_promise(query):
    """Quick and standard differ from exact, by no more than their bounds together."""
    exact = distances(query)
    for tier in (Accuracy.QUICK, Accuracy.STANDARD):
        off = np.abs(distances(query, accuracy=tier) - exact)
        assert 0.0 < off.max() <= (tier.bound + Accuracy.EXACT.bound) * SIZE


@pytest.mark.parametrize("accuracy", ["quick", "standard"])
def test_the_models_tier_is_the_default_of_its_queries(model, accuracy):
    """A context whose tier was set answers as queries do that ask for that tier themselves."""
    scene_graph, context = model
    query = scene_graph.query_object(context)
    asked = distances(query, accuracy=accuracy)
    exact = distances(query)
    scene_graph.set_accuracy(accuracy, context=context)
    assert query.accuracy == accuracy
    np.testing.assert_array_equal(distances(query), asked)
    np.testing.assert_array_equal(distances(query, accuracy="exact"), exact)


def test_a_baked_query_keeps_its_tier(model):
    """What was baked answers at the tier of that moment."""
    scene_graph, context = model
    query = scene_graph.query_object(context)
    baked = query.bake()
    scene_graph.set_accuracy("quick", context=context)
    assert baked.accuracy is Accuracy.EXACT
    assert (distances(baked) != distances(query)).any()


def test_tiers_find_the_same_pairs_to_penetrate(query):
    """How many pairs penetrate, and whether any does, does not depend on the tier."""
    tables = [query.compute_point_pair_penetration(accuracy=tier) for tier in Accuracy]
    assert len(tables[0]) > 10
    for table in tables:
        np.testing.assert_array_equal(table.id_A, tables[0].id_A)
        np.testing.assert_array_equal(table.id_B, tables[0].id_B)
    assert all(query.has_collisions(accuracy=tier) for tier in Accuracy)


@pytest.mark.parametrize("tier", Accuracy)
def test_a_certificate_comes_on_request(query, tier):
    """The column ``gap`` is in all results that were asked for it, and within the promise."""
    table = query.compute_signed_distance_pairwise_closest_points(accuracy=tier, certificate=True)
    assert (table.gap >= 0.0).all()
    assert (table.gap <= (tier.bound + 1e-12) * SIZE).all()
    assert table[0].gap == table.gap[0]
    pair = query.compute_signed_distance_pair_closest_points(
        table[0].id_A, table[0].id_B, accuracy=tier, certificate=True
    )
    assert pair.gap == table[0].gap
    assert "gap" in query.compute_point_pair_penetration(certificate=True).columns


@pytest.mark.parametrize("tier", Accuracy)
def test_what_decided_comes_with_the_certificate(query, tier):
    """Each answer names a mechanism, the same in both queries; the fast path has no large hull."""
    table = query.compute_signed_distance_pairwise_closest_points(accuracy=tier, certificate=True)
    deep = query.compute_point_pair_penetration(accuracy=tier, certificate=True)
    decided = {(pair.id_A, pair.id_B): pair.decided_by for pair in table}
    for pair in deep:
        assert pair.decided_by is decided[pair.id_A, pair.id_B]
    shape = query.inspector().get_shape
    fast = {Mechanism.LIFTED, Mechanism.INNER_BALL, Mechanism.COVER}
    are_simple = [all(shape(id_) is not PEBBLE for id_ in pair) for pair in decided]
    assert any(are_simple)
    assert [mechanism in fast for mechanism in decided.values()] == are_simple


def test_without_request_there_is_no_certificate(query):
    """Results have no column ``gap`` or ``decided_by``, and their records None."""
    table = query.compute_point_pair_penetration()
    assert not {"gap", "decided_by"} & set(table.columns)
    assert table[0].gap is None
    assert table[0].decided_by is None


def test_points_are_exact_at_every_tier(query):
    """Distances of points are the same bit for bit, whatever the tier."""
    p_WQs = np.random.default_rng(2).uniform(-0.5, 0.5, (5, 3))
    exact = query.compute_signed_distance_to_points(p_WQs)
    quick = query.compute_signed_distance_to_points(p_WQs, accuracy="quick")
    np.testing.assert_array_equal(quick.distance, exact.distance)
    first = query.compute_signed_distance_to_point(p_WQs[0], accuracy="quick")
    np.testing.assert_array_equal(first.distance, exact.distance[: len(first)])


@pytest.mark.parametrize(
    "ask",
    [
        lambda q: q.has_collisions(accuracy="fast"),
        lambda q: q.compute_point_pair_penetration(accuracy="fast"),
        lambda q: q.compute_signed_distance_pairwise_closest_points(accuracy="fast"),
        lambda q: q.compute_signed_distance_to_point([0.0, 0.0, 0.0], accuracy="fast"),
        lambda q: q.compute_signed_distance_to_points([[0.0, 0.0, 0.0]], accuracy="fast"),
    ],
)
def test_an_unknown_tier_is_refused_by_every_query(query, ask):
    """The error quotes the value and names the choices."""
    with pytest.raises(QueryArgumentError, match=r"'quick', 'standard', 'exact', not 'fast'"):
        ask(query)

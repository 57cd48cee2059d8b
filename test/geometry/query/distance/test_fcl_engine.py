"""The narrowphase that asks FCL: the same API, tables, order and conventions."""

import itertools
import subprocess
import sys

import numpy as np
import pytest

from benchmarks.accuracy.bodies import KINDS
from benchmarks.accuracy.constructions import known_pairs, KnownPair
from scene_graph_ros.geometry import (
    Box,
    Convex,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import EngineError, QueryArgumentError, UnsupportedPairError
from scene_graph_ros.geometry.query.results import ResultTable

DEPTH_ERROR = 3e-4
"""Metres: FCL's depths of contacts 2 mm deep are off by up to 0.23 mm (docs/accuracy.md)."""

DISTANCE_ERROR = 2e-5
"""Metres: its distances of 2 mm are off by up to 10 um."""

CORNERS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
DENTED = Mesh(
    vertices=np.vstack([CORNERS, [[0.02, 0.02, 0.02]]]),
    faces=[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]],
)
"""A tetrahedron with a pit: a convex mesh would be answered by its hull."""

PAIRS = list(itertools.combinations_with_replacement(KINDS, 2))
PAIRS.remove(("HalfSpace", "HalfSpace"))


def scene(shapes, poses, engine="fcl", triangles=False) -> QueryObject:
    """Return queries of shapes on frames of their own."""
    scene_graph = SceneGraph(engine=engine)
    source = scene_graph.register_source("fcl")
    for k, shape in enumerate(shapes):
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame_{k}"))
        instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
        geometry = scene_graph.register_geometry(source, frame, instance)
        properties = ProximityProperties()
        if triangles and isinstance(shape, Mesh):
            properties.add_property("mesh", "representation", "triangles")
        scene_graph.assign_role(source, geometry, properties)
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, np.array(poses))
    return scene_graph.query_object(context)


def at(*position: float) -> np.ndarray:
    """Return a pose without rotation."""
    X = np.eye(4)
    X[:3, 3] = position
    return X


def assert_fits_together(table: ResultTable, query: QueryObject, known: KnownPair) -> None:
    """Assert what ties the columns of a result with one pair together."""
    pair = table[0]
    distance = pair.distance if hasattr(pair, "distance") else -pair.depth
    if hasattr(pair, "p_ACa"):
        X_WA, X_WB = query.get_pose_in_world(pair.id_A), query.get_pose_in_world(pair.id_B)
        p_WCa = X_WA[:3, :3] @ pair.p_ACa + X_WA[:3, 3]
        p_WCb = X_WB[:3, :3] @ pair.p_BCb + X_WB[:3, 3]
    else:
        p_WCa, p_WCb = pair.p_WCa, pair.p_WCb
    assert np.linalg.norm(pair.nhat_BA_W) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(p_WCa - p_WCb, distance * pair.nhat_BA_W, atol=1e-12)
    assert pair.nhat_BA_W @ known.nhat_BA_W > 0.0


@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_penetration_of_every_pair(kinds: tuple[str, str]) -> None:
    """FCL's depth of constructed contacts comes out, with A, B and normal in our convention."""
    for known in known_pairs(*kinds, -2e-3, 4, np.random.default_rng(5)):
        query = scene([known.shape_A, known.shape_B], [known.X_WA, known.X_WB])
        table = query.compute_point_pair_penetration()
        assert table[0].depth == pytest.approx(2e-3, abs=DEPTH_ERROR)
        assert_fits_together(table, query, known)
        assert query.has_collisions()


@pytest.mark.parametrize("distance", [2e-3, -2e-3])
@pytest.mark.parametrize(
    "kinds", [pair for pair in PAIRS if "HalfSpace" not in pair], ids="-".join
)
def test_signed_distance_of_every_pair(kinds: tuple[str, str], distance: float) -> None:
    """FCL's distance of constructed pairs comes out, with A, B and normal in our convention."""
    for known in known_pairs(*kinds, distance, 4, np.random.default_rng(6)):
        query = scene([known.shape_A, known.shape_B], [known.X_WA, known.X_WB])
        table = query.compute_signed_distance_pairwise_closest_points(0.1)
        assert table[0].distance == pytest.approx(distance, abs=DISTANCE_ERROR)
        assert_fits_together(table, query, known)


def test_both_engines_find_the_same_pairs_in_the_same_order() -> None:
    """A scene of spheres and boxes gives tables with the same ids and columns."""
    rng = np.random.default_rng(3)
    shapes = [Sphere(0.1), Box(0.2, 0.15, 0.1)] * 15
    query = scene(shapes, [at(*p) for p in rng.uniform(-0.3, 0.3, (30, 3))])
    for ask in (
        query.compute_point_pair_penetration,
        lambda **k: query.compute_signed_distance_pairwise_closest_points(0.05, **k),
    ):
        fcl, native = ask(), ask(engine="native")
        assert list(fcl.columns) == list(native.columns)
        assert len(fcl) > 20
        np.testing.assert_array_equal(fcl.id_A, native.id_A)
        np.testing.assert_array_equal(fcl.id_B, native.id_B)


def test_bodies_follow_their_poses() -> None:
    """FCL's objects are kept between queries, and moved: each answer is about the present."""
    scene_graph = SceneGraph(engine="fcl")
    source = scene_graph.register_source("fcl")
    frames = []
    for k in range(2):
        frame = scene_graph.register_frame(source, GeometryFrame(f"f{k}"))
        ball = GeometryInstance(np.eye(4), Sphere(0.1), f"g{k}")
        geometry = scene_graph.register_geometry(source, frame, ball)
        scene_graph.assign_role(source, geometry, ProximityProperties())
        frames.append(frame)
    context = scene_graph.create_default_context()
    query = scene_graph.query_object(context)
    for x, depth in ((0.15, 0.05), (0.18, 0.02), (0.25, None), (0.19, 0.01)):
        context.set_frame_pose(source, frames[1], at(x, 0.0, 0.0))
        found = [pair.depth for pair in query.compute_point_pair_penetration()]
        assert found == ([] if depth is None else [pytest.approx(depth, abs=1e-12)])


def test_engine_can_be_chosen_for_one_query() -> None:
    """``engine="fcl"`` of a query overrides the model's, whose own answers stay."""
    query = scene([Sphere(0.1), Sphere(0.1)], [at(0, 0, 0), at(0.3, 0, 0)], engine="native")
    ask = query.compute_signed_distance_pairwise_closest_points
    assert ask(engine="fcl")[0].distance == pytest.approx(0.1, abs=1e-5)
    assert ask()[0].distance == pytest.approx(0.1, abs=1e-15)


@pytest.mark.parametrize("shape", [Sphere(0.1), Convex(vertices=CORNERS)])
def test_half_space_has_depth_but_no_distance(shape: object) -> None:
    """FCL ends the process when asked how far a half space is, so the pair is refused by name."""
    query = scene([shape, HalfSpace()], [at(0.0, 0.0, -0.05), at(0, 0, 0)])
    assert len(query.compute_point_pair_penetration()) == 1
    with pytest.raises(UnsupportedPairError, match=r"'fcl'.*HALF_SPACE 'geometry_1'.*native"):
        query.compute_signed_distance_pairwise_closest_points(0.1)


def test_mesh_by_its_triangles_collides_but_has_no_depth() -> None:
    """FCL finds that triangles meet; depth and distance are refused by the pair's names."""
    shapes = [DENTED, Sphere(0.02)]
    query = scene(shapes, [at(0, 0, 0), at(0.02, 0.02, 0.0)], triangles=True)
    assert query.has_collisions()
    with pytest.raises(UnsupportedPairError, match=r"MESH 'geometry_0'.*triangles"):
        query.compute_point_pair_penetration()
    apart = scene(shapes, [at(0, 0, 0), at(0.02, 0.02, -0.03)], triangles=True)
    assert not apart.has_collisions()


def test_flat_hull_is_refused() -> None:
    """A hull without volume is no convex body to FCL."""
    flat = Convex(vertices=CORNERS * [1.0, 1.0, 0.0])
    query = scene([flat, Sphere(0.1)], [at(0, 0, 0), at(0, 0, 0)])
    with pytest.raises(UnsupportedPairError, match=r"CONVEX 'geometry_0'.*without volume"):
        query.compute_point_pair_penetration()


def test_what_fcl_lacks_is_refused() -> None:
    """Points, a tier of accuracy and a certificate are refused, not answered by someone else."""
    query = scene([Sphere(0.1), Sphere(0.1)], [at(0, 0, 0), at(0.1, 0, 0)])
    with pytest.raises(EngineError, match=r"points.*engine='native'"):
        query.compute_signed_distance_to_point([0.0, 0.0, 0.0])
    assert len(query.compute_signed_distance_to_point([0.0, 0.0, 0.0], engine="native")) == 2
    with pytest.raises(EngineError, match="'quick'"):
        query.compute_point_pair_penetration(accuracy="quick")
    with pytest.raises(EngineError, match="certificate"):
        query.compute_point_pair_penetration(certificate=True)
    with pytest.raises(QueryArgumentError, match="'native', 'fcl'"):
        query.has_collisions(engine="coal")


def test_fcl_is_loaded_by_the_first_query_that_asks_for_it() -> None:
    """A native query does not import python-fcl; one with ``engine="fcl"`` does."""
    code = """
import sys
import numpy as np
from scene_graph_ros.geometry import *
graph = SceneGraph()
source = graph.register_source("s")
for k in range(2):
    frame = graph.register_frame(source, GeometryFrame(f"f{k}"))
    geometry = graph.register_geometry(source, frame, GeometryInstance(np.eye(4), Sphere(1), "g"))
    graph.assign_role(source, geometry, ProximityProperties())
query = graph.query_object(graph.create_default_context())
query.compute_point_pair_penetration()
assert "fcl" not in sys.modules
query.compute_point_pair_penetration(engine="fcl")
assert "fcl" in sys.modules
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr

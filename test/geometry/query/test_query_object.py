import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    QueryArgumentError,
    RoleError,
    UnknownIdError,
    UnsupportedPairError,
)
from scene_graph_ros.geometry.model.ids import GeometryId


def _translation(*p):
    X = np.eye(4)
    X[:3, 3] = p
    return X


class _Pair:
    """A ball of radius 0.1 and a cube of side 0.2 on frames of their own."""

    def __init__(self):
        self.graph = SceneGraph()
        self.source = self.graph.register_source("pair")
        self.frames, self.ids = [], []
        for name, shape in (("ball", Sphere(0.1)), ("cube", Box(0.2, 0.2, 0.2))):
            frame = self.graph.register_frame(self.source, GeometryFrame(name))
            instance = GeometryInstance(np.eye(4), shape, name)
            self.ids.append(self.graph.register_geometry(self.source, frame, instance))
            self.graph.assign_role(self.source, self.ids[-1], ProximityProperties())
            self.frames.append(frame)
        self.context = self.graph.create_default_context()
        self.query = self.graph.query_object(self.context)

    def move_ball(self, *p):
        self.context.set_frame_poses(self.source, {self.frames[0]: _translation(*p)})


@pytest.fixture(name="pair")
def _pair():
    return _Pair()


def test_ball_against_cube_by_hand(pair):
    """At x = 0.15 the ball is 0.05 deep in the cube's side, all fields follow."""
    pair.move_ball(0.15, 0.02, 0.03)
    (contact,) = pair.query.compute_point_pair_penetration()
    assert (contact.id_A, contact.id_B) == tuple(pair.ids)
    assert contact.depth == pytest.approx(0.05)
    assert contact.p_WCa == pytest.approx([0.05, 0.02, 0.03])
    assert contact.p_WCb == pytest.approx([0.1, 0.02, 0.03])
    assert contact.nhat_BA_W == pytest.approx([1.0, 0.0, 0.0])
    (distance,) = pair.query.compute_signed_distance_pairwise_closest_points()
    assert distance.distance == pytest.approx(-0.05)
    assert distance.p_ACa == pytest.approx([-0.1, 0.0, 0.0])
    assert distance.p_BCb == pytest.approx([0.1, 0.02, 0.03])
    assert distance.is_nhat_BA_W_unique


def test_live_query_follows_and_baked_one_stays(pair):
    """A live query sees the next pose, a baked one keeps the one it was baked at."""
    pair.move_ball(0.3, 0.0, 0.0)
    baked = pair.query.bake()
    assert not pair.query.has_collisions()
    pair.move_ball(0.15, 0.0, 0.0)
    assert pair.query.has_collisions()
    assert not baked.has_collisions()
    assert baked.get_pose_in_world(pair.ids[0])[0, 3] == 0.3
    assert pair.query.get_pose_in_world(pair.ids[0])[0, 3] == 0.15
    assert pair.query.get_pose_in_parent(pair.frames[0])[0, 3] == 0.15
    assert pair.query.inspector().num_geometries() == 2


def test_query_repeated_on_the_same_poses_computes_nothing(pair):
    """The same table is returned until a pose changes; a bake shares what is known."""
    first = pair.query.compute_point_pair_penetration()
    assert pair.query.compute_point_pair_penetration() is first
    assert pair.query.bake().compute_point_pair_penetration() is first
    near = pair.query.compute_signed_distance_pairwise_closest_points(0.1)
    assert pair.query.compute_signed_distance_pairwise_closest_points(0.1) is near
    assert pair.query.compute_signed_distance_pairwise_closest_points(0.2) is not near
    pair.move_ball(0.15, 0.0, 0.0)
    assert pair.query.compute_point_pair_penetration() is not first


def test_touching_is_no_penetration_but_has_a_distance_of_zero(pair):
    """A ball whose surface meets the cube's side is not reported as penetrating."""
    pair.move_ball(0.2, 0.0, 0.0)
    assert len(pair.query.compute_point_pair_penetration()) == 0
    assert not pair.query.has_collisions()
    (record,) = pair.query.compute_signed_distance_pairwise_closest_points(0.0001)
    assert record.distance == pytest.approx(0.0, abs=1e-15)
    assert record.nhat_BA_W == pytest.approx([1.0, 0.0, 0.0])


def test_max_distance_is_inclusive_and_may_be_negative(pair):
    """Only pairs with a signed distance of at most the limit are reported."""
    pair.move_ball(0.5, 0.0, 0.0)
    query = pair.query.compute_signed_distance_pairwise_closest_points
    (record,) = query()
    assert record.distance == pytest.approx(0.3)
    assert len(query(record.distance)) == 1
    assert len(query(record.distance - 1e-9)) == 0
    pair.move_ball(0.15, 0.0, 0.0)
    assert len(query(-0.01)) == 1
    assert len(query(-0.06)) == 0


def test_pair_query_sorts_its_ids_and_ignores_filters(pair):
    """One pair is answered in the order of ids, also when filters hide it from the others."""
    everything = GeometrySet(pair.ids)
    declaration = CollisionFilterDeclaration().exclude_within(everything)
    pair.graph.collision_filter_manager(pair.context).apply(declaration)
    pair.move_ball(0.15, 0.0, 0.0)
    assert len(pair.query.compute_point_pair_penetration()) == 0
    assert len(pair.query.compute_signed_distance_pairwise_closest_points()) == 0
    assert len(pair.query.find_collision_candidates()) == 0
    record = pair.query.compute_signed_distance_pair_closest_points(*reversed(pair.ids))
    assert (record.id_A, record.id_B) == tuple(pair.ids)
    assert record.distance == pytest.approx(-0.05)


def test_pair_query_refuses_unknown_roleless_and_equal_ids(pair):
    """Each refusal names the id that is wrong."""
    instance = GeometryInstance(np.eye(4), Sphere(0.1), "ghost")
    graph = pair.graph
    ghost = graph.register_geometry(pair.source, pair.frames[0], instance, context=pair.context)
    ask = pair.query.compute_signed_distance_pair_closest_points
    with pytest.raises(UnknownIdError, match="999999"):
        ask(pair.ids[0], GeometryId(999999))
    with pytest.raises(RoleError, match=r"ghost.*no proximity role"):
        ask(pair.ids[0], ghost)
    with pytest.raises(UnsupportedPairError, match="against itself"):
        ask(pair.ids[0], pair.ids[0])


def test_two_half_spaces_are_the_only_refusal():
    """A moving half space against an anchored one is refused by name; two anchored ones not."""
    graph = SceneGraph()
    source = graph.register_source("flat")
    ids = []
    for name in ("floor", "wall"):
        instance = GeometryInstance(np.eye(4), HalfSpace(), name)
        ids.append(graph.register_anchored_geometry(source, instance))
        graph.assign_role(source, ids[-1], ProximityProperties())
    query = graph.query_object(graph.create_default_context())
    assert len(query.compute_point_pair_penetration()) == 0
    assert len(query.compute_signed_distance_pairwise_closest_points()) == 0
    with pytest.raises(UnsupportedPairError, match=r"HALF_SPACE.*floor.*HALF_SPACE.*wall"):
        query.compute_signed_distance_pair_closest_points(*ids)
    frame = graph.register_frame(source, GeometryFrame("door"))
    door = graph.register_geometry(source, frame, GeometryInstance(np.eye(4), HalfSpace(), "door"))
    graph.assign_role(source, door, ProximityProperties())
    query = graph.query_object(graph.create_default_context())
    for ask in (
        query.has_collisions,
        query.compute_point_pair_penetration,
        query.compute_signed_distance_pairwise_closest_points,
    ):
        with pytest.raises(UnsupportedPairError, match=r"floor.*door"):
            ask()


def test_same_frame_and_anchored_pairs_are_not_reported():
    """Geometries of one frame, and anchored ones, overlap without being a pair."""
    graph = SceneGraph()
    source = graph.register_source("still")
    frame = graph.register_frame(source, GeometryFrame("body"))
    for k in range(2):
        instance = GeometryInstance(np.eye(4), Sphere(0.1), f"part_{k}")
        geometry = graph.register_geometry(source, frame, instance)
        graph.assign_role(source, geometry, ProximityProperties())
        anchored = GeometryInstance(_translation(5.0, 0, 0), Sphere(0.1), f"rock_{k}")
        rock = graph.register_anchored_geometry(source, anchored)
        graph.assign_role(source, rock, ProximityProperties())
    query = graph.query_object(graph.create_default_context())
    assert not query.has_collisions()
    assert len(query.find_collision_candidates()) == 0
    assert len(query.compute_signed_distance_pairwise_closest_points()) == 4


def test_empty_scene_answers_every_query():
    """Without geometry there are no results, and no errors."""
    graph = SceneGraph()
    query = graph.query_object(graph.create_default_context())
    assert not query.has_collisions()
    assert len(query.find_collision_candidates()) == 0
    assert len(query.compute_point_pair_penetration(derivatives=True)) == 0
    assert len(query.compute_signed_distance_pairwise_closest_points(derivatives=True)) == 0
    assert len(query.compute_signed_distance_to_point([0, 0, 0])) == 0
    assert len(query.compute_signed_distance_to_points(np.zeros((0, 3)))) == 0


def test_point_queries_agree_and_respect_the_threshold(pair):
    """The batch holds, per point, what the single query gives, with the index of the point."""
    points = np.array([[0.5, 0.0, 0.0], [0.0, 0.0, 0.15]])
    batch = pair.query.compute_signed_distance_to_points(points)
    assert batch.point.tolist() == [0, 0, 1, 1]
    assert batch.id_G.tolist() == 2 * [int(i) for i in pair.ids]
    assert batch.distance == pytest.approx([0.4, 0.4, 0.05, 0.05])
    for k, point in enumerate(points):
        single = pair.query.compute_signed_distance_to_point(point)
        assert np.array_equal(single.distance, batch.distance[batch.point == k])
        assert np.array_equal(single.grad_W, batch.grad_W[batch.point == k])
    assert len(pair.query.compute_signed_distance_to_points(points, 0.1)) == 2
    assert len(pair.query.compute_signed_distance_to_point(points[0], 0.1)) == 0


@pytest.mark.parametrize("bad", [[1.0, 2.0], "here", [0.0, 0.0, np.nan], np.zeros((2, 3))])
def test_bad_points_are_refused(pair, bad):
    """A point is three finite numbers."""
    with pytest.raises(QueryArgumentError, match="p_WQ"):
        pair.query.compute_signed_distance_to_point(bad)


@pytest.mark.parametrize("bad", [0, -1, 1.5, True, "two", None])
def test_bad_numbers_of_threads_are_refused(pair, bad):
    """A number of threads is an integer of at least 1."""
    with pytest.raises(QueryArgumentError, match="threads"):
        pair.query.compute_signed_distance_to_points(np.zeros((2, 3)), threads=bad)


@pytest.mark.parametrize("bad", [np.nan, "far", None, True])
def test_bad_limits_are_refused(pair, bad):
    """A limit is a number, possibly infinite."""
    with pytest.raises(QueryArgumentError, match="max_distance"):
        pair.query.compute_signed_distance_pairwise_closest_points(bad)
    with pytest.raises(QueryArgumentError, match="threshold"):
        pair.query.compute_signed_distance_to_points(np.zeros((1, 3)), bad)

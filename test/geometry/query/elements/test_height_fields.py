"""Queries about height fields: the answers of the prism that decides, found by looking at all."""

from concurrent.futures import ThreadPoolExecutor
import gc

from height_prisms import prisms_of
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from searching import times

from scene_graph_ros.geometry import (
    Box,
    Convex,
    GeometryFrame,
    GeometryInstance,
    HeightField,
    PointCloud,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import EngineError, PropertyError, UnsupportedPairError
from scene_graph_ros.geometry.tables.prism_slots import free_slots, leave_slot, SLOTS, take_slot

EXACT = 1e-12


def uniform(rng, rows, cols, size=(1.1, 0.8), floor=-0.4, top=0.3):
    """Return a field of even noise."""
    return HeightField(rng.uniform(0.0, top, (rows, cols)), size, floor)


FIELDS = {
    "rough": lambda rng: uniform(rng, 8, 10),
    "flat": lambda rng: HeightField(np.full((7, 7), 0.1), (1.0, 1.0), -0.3),
    "slope": lambda rng: HeightField(np.add.outer(np.arange(6), np.arange(9)) / 30, (1, 1), -0.2),
    "one cell": lambda rng: HeightField([[0.0, 0.1], [0.05, 0.2]], (0.4, 0.3), -0.2),
    "one row": lambda rng: uniform(rng, 2, 40, size=(3.0, 0.1)),
    "spikes": lambda rng: HeightField(rng.choice([0.0, 0.9], (8, 8), p=[0.9, 0.1]), (1, 1), -0.1),
    "thin": lambda rng: uniform(rng, 6, 6, floor=-1e-6, top=1e-4),
    "tall": lambda rng: uniform(rng, 6, 6, floor=-100.0),
    "fine": lambda rng: uniform(rng, 9, 9, size=(2e-3, 2e-3), floor=-1e-3, top=1e-3),
    "huge": lambda rng: uniform(rng, 6, 6, size=(1e4, 1e4), floor=-1e3, top=1e3),
}


class FieldScene:
    """All shapes beside a field, and the same beside a hull for each of its prisms."""

    def __init__(self, make_scene, field, X_WF):
        self.own, self.hulls = make_scene(copies=1), make_scene(copies=1)
        self.X_WF = X_WF
        (self.field,) = self._add(self.own, [(np.zeros(3), field)])
        self.prisms = self._add(self.hulls, prisms_of(field))

    def _add(self, scene, shapes):
        ids = []
        still = scene.graph.register_source("still")
        frame = scene.graph.register_frame(still, GeometryFrame("field"))
        for k, (center, shape) in enumerate(shapes):
            X = np.eye(4)
            X[:3, 3] = center
            instance = GeometryInstance(X, shape, f"still_{k}")
            instance.set_proximity_properties(ProximityProperties())
            ids.append(scene.graph.register_geometry(still, frame, instance))
        scene.context = scene.graph.create_default_context()
        scene.context.set_frame_poses(still, {frame: self.X_WF})
        scene.query = scene.graph.query_object(scene.context)
        return ids

    def move(self, rng, spread, *, is_upright=False):
        """Give all shapes a random pose about the field."""
        n = len(self.own.context.frame_poses(self.own.source))
        X = np.tile(np.eye(4), (n, 1, 1))
        if not is_upright:
            X[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
        X[:, :3, 3] = rng.uniform(-1.0, 1.0, (n, 3)) * spread
        for scene in (self.own, self.hulls):
            scene.context.set_frame_poses(scene.source, self.X_WF @ X)


def turned(rng, offset=0.3):
    """Return a pose."""
    X = np.eye(4)
    X[:3, :3] = Rotation.random(rng=rng).as_matrix()
    X[:3, 3] = offset
    return X


def spread_of(field):
    """Return a distance from the origin at which shapes are put, m."""
    return np.array([0.6 * field.size[0], 0.6 * field.size[1], 0.4]).clip(0.3)


def rows_with(table, geometry_id):
    """Return the records of a table that are about a geometry."""
    both = (table.id_A == int(geometry_id)) | (table.id_B == int(geometry_id))
    return [table[k] for k in np.flatnonzero(both)]


@pytest.mark.search
@pytest.mark.parametrize("kind", FIELDS)
def test_the_nearest_prism_decides_each_pair(make_scene, kind):
    """As far, or as deep, as that prism is as a hull, which is among the answers by its index."""
    rng = np.random.default_rng(7)
    field = FIELDS[kind](rng)
    scene = FieldScene(make_scene, field, turned(rng))
    size = max(1.0, field.size[0], -field.floor)
    for trial in range(times(3)):
        scene.move(rng, spread_of(field), is_upright=trial % 3 == 1)
        own = scene.own.query.compute_signed_distance_pairwise_closest_points(certificate=True)
        others = scene.hulls.query.compute_signed_distance_pairwise_closest_points()
        records = rows_with(own, scene.field)
        assert len(records) == len(scene.own.ids)
        for record in records:
            is_A = record.id_A == scene.field
            other = scene.own.ids.index(record.id_B if is_A else record.id_A)
            found = rows_with(others, scene.hulls.ids[other])
            distances = {
                each.id_A if each.id_A in scene.prisms else each.id_B: each.distance
                for each in found
                if each.id_A in scene.prisms or each.id_B in scene.prisms
            }
            assert len(distances) == len(scene.prisms)
            least = min(distances.values())
            element = record.element_A if is_A else record.element_B
            assert record.distance == pytest.approx(least, abs=EXACT * size)
            assert distances[scene.prisms[element]] == pytest.approx(least, abs=EXACT * size)
            assert (record.element_B if is_A else record.element_A) == -1
            assert record.gap <= EXACT * size
            p_WA = scene.own.query.get_pose_in_world(record.id_A) @ [*record.p_ACa, 1.0]
            p_WB = scene.own.query.get_pose_in_world(record.id_B) @ [*record.p_BCb, 1.0]
            apart = (p_WA - p_WB)[:3] - record.distance * record.nhat_BA_W
            assert np.abs(apart).max() < 10 * EXACT * size


def test_answers_agree_with_each_other(make_scene):
    """Penetrations, distances, candidates, yes or no, and what is near enough."""
    rng = np.random.default_rng(3)
    scene = FieldScene(make_scene, FIELDS["rough"](rng), turned(rng))
    query = scene.own.query
    for _ in range(4):
        scene.move(rng, np.array([0.6, 0.5, 0.5]))
        far = rows_with(query.compute_signed_distance_pairwise_closest_points(), scene.field)
        deep = rows_with(query.compute_point_pair_penetration(), scene.field)
        near = rows_with(
            query.compute_signed_distance_pairwise_closest_points(max_distance=0.1), scene.field
        )
        assert [-pair.depth for pair in deep] == [p.distance for p in far if p.distance < 0.0]
        assert [p.distance for p in near] == [p.distance for p in far if p.distance <= 0.1]
        touching = {(p.id_A, p.id_B) for p in deep}
        candidates = rows_with(query.find_collision_candidates(), scene.field)
        assert touching <= {(p.id_A, p.id_B) for p in candidates}
        for pair in far:
            one = query.compute_signed_distance_pair_closest_points(pair.id_A, pair.id_B)
            assert one.distance == pair.distance
        assert query.has_collisions() == (len(query.compute_point_pair_penetration()) > 0)


def test_derivatives_are_those_of_a_pose_that_is_moved(make_scene):
    """Against differences, where the distance is smooth."""
    rng = np.random.default_rng(5)
    scene = FieldScene(make_scene, FIELDS["rough"](rng), turned(rng))
    scene.move(rng, np.array([0.4, 0.3, 0.1]))
    query, frames = scene.own.query, scene.own.context.frame_poses(scene.own.source)
    table = query.compute_signed_distance_pairwise_closest_points(derivatives=True)
    checked = 0
    step = 1e-7
    for record in rows_with(table, scene.field):
        is_A = record.id_A == scene.field
        other = record.id_B if is_A else record.id_A
        slope = record.ddistance_dX_WB if is_A else record.ddistance_dX_WA
        row = scene.own.ids.index(other)
        if row >= len(frames):  # the half space stands still
            continue
        for axis in range(3):
            ends = []
            for sign in (1.0, -1.0):
                X = frames.copy()
                X[row, axis, 3] += sign * step
                context = scene.own.context.clone()
                context.set_frame_poses(scene.own.source, X)
                moved = scene.own.graph.query_object(context)
                ends.append(
                    moved.compute_signed_distance_pair_closest_points(other, scene.field).distance
                )
            assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(slope[3 + axis], abs=2e-5)
            checked += 1
    assert checked >= 3 * 6


@pytest.mark.search
@pytest.mark.parametrize("kind", ["rough", "one cell", "flat", "tall"])
def test_points_are_as_far_as_the_nearest_prism(make_scene, kind):
    """Above, beside, below and inside, on corners and edges; also in threads, and up to so far."""
    rng = np.random.default_rng(9)
    field = FIELDS[kind](rng)
    scene = FieldScene(make_scene, field, turned(rng))
    n = times(100)
    corners = np.column_stack(
        [np.repeat(field.x()[:2], 2), np.tile(field.y()[:2], 2), field.heights[:2, :2].T.ravel()]
    )
    p_F = np.concatenate([rng.uniform(-1.0, 1.0, (n, 3)) * spread_of(field), corners])
    p_W = p_F @ scene.X_WF[:3, :3].T + scene.X_WF[:3, 3]
    scene.move(rng, np.array([9.0, 9.0, 9.0]))
    table = scene.own.query.compute_signed_distance_to_points(p_W)
    expected = scene.hulls.query.compute_signed_distance_to_points(p_W)
    own = table.id_G == int(scene.field)
    of_prisms = np.isin(expected.id_G, [int(each) for each in scene.prisms])
    distances = expected.distance[of_prisms].reshape(len(p_W), -1)
    size = max(1.0, -field.floor)
    assert table.distance[own] == pytest.approx(distances.min(axis=1), abs=EXACT * size)
    nearest = distances[np.arange(len(p_W)), table.element[own]]
    assert nearest == pytest.approx(distances.min(axis=1), abs=EXACT * size)
    assert (table.element[~own] == -1).all()
    p_WN = table.p_GN[own] @ scene.X_WF[:3, :3].T + scene.X_WF[:3, 3]
    out = p_WN + table.distance[own][:, np.newaxis] * table.grad_W[own]
    assert np.abs(out - p_W).max() < 1e-11 * size
    few = scene.own.query.compute_signed_distance_to_points(p_W, threshold=0.05)
    assert (few.distance[few.id_G == int(scene.field)] <= 0.05).all()
    assert (few.id_G == int(scene.field)).sum() == (table.distance[own] <= 0.05).sum()


def above(field, shape, height):
    """Return a query about a shape so high above the middle of a field, and both ids."""
    graph = SceneGraph()
    ground, robot = graph.register_source("map"), graph.register_source("robot")
    ids = []
    for source, each, z in ((ground, field, 0.0), (robot, shape, height)):
        frame = graph.register_frame(source, GeometryFrame("frame"))
        X = np.eye(4)
        X[2, 3] = z
        instance = GeometryInstance(X, each, "geometry")
        instance.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_geometry(source, frame, instance))
    return graph.query_object(graph.create_default_context()), ids


@pytest.mark.parametrize("gap", [1.0, 1e-9, 0.0, -1e-9, -0.05])
@pytest.mark.parametrize("rows", [2, 3, 200])
def test_a_box_upon_a_flat_field(rows, gap):
    """The gap, to rounding, also where a hundred prisms are as near as each other."""
    field = HeightField(np.zeros((rows, rows)), (2.0, 2.0), -1.0)
    query, ids = above(field, Box(0.3, 0.2, 0.1), 0.05 + gap)
    pair = query.compute_signed_distance_pair_closest_points(*ids)
    assert pair.distance == pytest.approx(gap, abs=1e-15)
    assert pair.nhat_BA_W == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)


def test_deep_below_the_way_out_is_that_of_one_prism():
    """A ball in the middle of a fine field leaves its deepest prism sideways: half a cell."""
    query, ids = above(HeightField(np.zeros((101, 101)), (1.0, 1.0), -2.0), Sphere(0.1), -1.0)
    pair = query.compute_signed_distance_pair_closest_points(*ids)
    # The deepest point of a right triangle with legs of 1 cm is its inscribed circle's middle.
    inner = 0.01 * (1.0 - np.sqrt(0.5))
    assert pair.distance <= -(0.1 + 0.0)
    assert pair.distance >= -(0.1 + inner)


def test_a_field_far_from_the_origin():
    """Where the field and what is above it are told a million metres away, it is as exact."""
    field = FIELDS["rough"](np.random.default_rng(2))
    near, ids = above(field, Sphere(0.1), 0.5)
    expected = near.compute_signed_distance_pair_closest_points(*ids).distance
    X = np.eye(4)
    X[:3, 3] = [1e6, -2e6, 1e6]
    graph = SceneGraph()
    source, robot = graph.register_source("map"), graph.register_source("robot")
    ids = []
    for owner, shape, z in ((source, field, 0.0), (robot, Sphere(0.1), 0.5)):
        frame = graph.register_frame(owner, GeometryFrame("frame"))
        instance = GeometryInstance(np.eye(4), shape, "geometry")
        instance.set_proximity_properties(ProximityProperties())
        ids.append((owner, frame, graph.register_geometry(owner, frame, instance), z))
    context = graph.create_default_context()
    for owner, frame, _, z in ids:
        X_WF = X.copy()
        X_WF[2, 3] += z
        context.set_frame_poses(owner, {frame: X_WF})
    pair = graph.query_object(context).compute_signed_distance_pair_closest_points(
        ids[0][2], ids[1][2]
    )
    assert pair.distance == pytest.approx(expected, abs=1e-12)


def test_a_cloud_is_as_far_as_its_nearest_ball(make_scene):
    """Of a cloud and a field the nearest ball and prism, in every query, in either order."""
    rng = np.random.default_rng(4)
    field = FIELDS["rough"](rng)
    for trial in range(6):
        points = rng.uniform(-0.6, 0.6, (200, 3)) + np.array([0.0, 0.0, 0.8 * (trial % 3)])
        radii = rng.uniform(0.0, 0.05, 200) if trial % 2 else np.full(200, 0.01)
        query, ids = above(field, PointCloud(points, radii), 0.1)
        pair = query.compute_signed_distance_pair_closest_points(*ids)
        p_W = points + np.array([0.0, 0.0, 0.1])
        alone, (own, _) = above(field, Sphere(0.1), 50.0)
        table = alone.compute_signed_distance_to_points(p_W)
        distances = table.distance[table.id_G == int(own)] - radii
        assert pair.distance == pytest.approx(distances.min(), abs=1e-13)
        assert distances[pair.element_B] == pytest.approx(distances.min(), abs=1e-13)
        elements = table.element[table.id_G == int(own)]
        if distances.min() > 0.0:
            assert pair.element_A == elements[pair.element_B]
        (whole,) = query.compute_signed_distance_pairwise_closest_points()
        assert whole.distance == pair.distance
        assert query.has_collisions() == (pair.distance < 0.0)


def test_what_has_no_answer_says_so():
    """Two fields, engines that know none, and properties of contact surfaces."""
    field = HeightField(np.zeros((2, 2)), (1.0, 1.0), -1.0)
    query, ids = above(field, HeightField(np.ones((3, 3)), (1.0, 1.0), 0.0), -0.5)
    told = r"map/frame/geometry .* robot/frame/geometry .* two height fields"
    for ask in (
        lambda: query.compute_signed_distance_pair_closest_points(*ids),
        query.compute_signed_distance_pairwise_closest_points,
        query.compute_point_pair_penetration,
        query.has_collisions,
    ):
        with pytest.raises(UnsupportedPairError, match=told):
            ask()
    query, ids = above(field, Sphere(0.1), 0.5)
    with pytest.raises(EngineError, match="height fields"):
        query.compute_signed_distance_pairwise_closest_points(engine="fcl")
    properties = ProximityProperties()
    properties.add_property("hydroelastic", "compliance_type", "rigid")
    graph = SceneGraph()
    instance = GeometryInstance(np.eye(4), field, "ground")
    instance.set_proximity_properties(properties)
    with pytest.raises(PropertyError, match="HeightField has no contact surfaces"):
        graph.register_anchored_geometry(graph.register_source("map"), instance)


def test_threads_have_prisms_of_their_own():
    """Four threads get the answers that one gets, and give back what they took."""
    rng = np.random.default_rng(8)
    field = uniform(rng, 40, 40)
    hull = Convex(vertices=0.1 * rng.normal(size=(30, 3)))
    queries = []
    for height in rng.uniform(-0.1, 0.6, 24):
        query, ids = above(field, hull, height)
        queries.append((query.bake(), ids))

    def ask(one):
        query, ids = one
        points = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 3))
        table = query.compute_signed_distance_to_points(points, threads=2)
        pair = query.compute_signed_distance_pair_closest_points(*ids)
        return pair.distance, pair.element_A, table.distance.tolist()

    expected = [ask(each) for each in queries]
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: [ask(each) for each in queries], range(4)):
            assert found == expected
    gc.collect()
    before = free_slots()
    taken = [take_slot() for _ in range(before)]
    with pytest.raises(RuntimeError, match=f"{SLOTS} searches"):
        queries[0][0].compute_signed_distance_to_point((0.0, 0.0, 0.0))
    for slot in taken:
        leave_slot(slot)
    assert free_slots() == before

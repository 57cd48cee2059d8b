"""Queries about voxel grids: the answers of the voxel that decides, found by looking at all."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from searching import times
from voxel_boxes import boxes_of

from scene_graph_ros.geometry import (
    Box,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    PointCloud,
    ProximityProperties,
    SceneGraph,
    Sphere,
    VoxelGrid,
)
from scene_graph_ros.geometry.errors import EngineError, UnsupportedPairError

EXACT = 1e-12


def random_grid(rng, shape, part, voxel, **options):
    """Return a grid in which so large a part is occupied, and as much unknown."""
    states = rng.choice([0, 1, 2], shape, p=[1.0 - 2 * part, part, part])
    return VoxelGrid(states, voxel, **options)


def wall(shape, voxel):
    """Return a grid that is solid below its middle along z."""
    states = np.zeros(shape, np.uint8)
    states[:, :, : shape[2] // 2] = 1
    return VoxelGrid(states, voxel)


GRIDS = {
    "sparse": lambda rng: random_grid(rng, (9, 7, 6), 0.04, 0.13),
    "dense": lambda rng: random_grid(rng, (6, 5, 5), 0.4, 0.2),
    "unknown is free": lambda rng: random_grid(rng, (6, 9, 7), 0.1, 0.1, unknown_is_free=True),
    "unseen": lambda rng: VoxelGrid(np.full((5, 6, 5), 2), 0.18),
    "wall": lambda rng: wall((7, 6, 6), 0.1),
    "one voxel": lambda rng: VoxelGrid([[[1]]], 1 / 3),
    "one row": lambda rng: random_grid(rng, (1, 40, 1), 0.2, 0.05),
    "fine": lambda rng: random_grid(rng, (5, 5, 9), 0.2, 2e-3),
    "huge": lambda rng: random_grid(rng, (5, 6, 5), 0.1, 3e3),
}


class GridScene:
    """All shapes beside a grid, and the same beside a box for each of its solid voxels."""

    def __init__(self, make_scene, grid, X_WF):
        self.own, self.boxes = make_scene(copies=1), make_scene(copies=1)
        self.X_WF = X_WF
        (self.grid,) = self._add(self.own, [(np.zeros(3), grid)])
        boxes, self.elements = boxes_of(grid)
        self.voxels = self._add(self.boxes, boxes)

    def _add(self, scene, shapes):
        ids = []
        still = scene.graph.register_source("still")
        frame = scene.graph.register_frame(still, GeometryFrame("grid"))
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

    def move(self, rng, middle, spread, *, is_aligned=False):
        """Give all shapes a random pose about the grid."""
        n = len(self.own.context.frame_poses(self.own.source))
        X = np.tile(np.eye(4), (n, 1, 1))
        if not is_aligned:
            X[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
        X[:, :3, 3] = middle + rng.uniform(-1.0, 1.0, (n, 3)) * spread
        for scene in (self.own, self.boxes):
            scene.context.set_frame_poses(scene.source, self.X_WF @ X)


def turned(rng):
    """Return a pose."""
    X = np.eye(4)
    X[:3, :3] = Rotation.random(rng=rng).as_matrix()
    X[:3, 3] = 0.3
    return X


def rows_with(table, geometry_id):
    """Return the records of a table that are about a geometry."""
    both = (table.id_A == int(geometry_id)) | (table.id_B == int(geometry_id))
    return [table[k] for k in np.flatnonzero(both)]


def extent(grid):
    """Return the lengths of a grid, m."""
    return np.array(grid.occupancy.shape) * grid.voxel


@pytest.mark.search
@pytest.mark.parametrize("kind", GRIDS)
def test_the_nearest_voxel_decides_each_pair(make_scene, kind):
    """As far, or as deep, as that voxel is as a box, which is among the answers by its index."""
    rng = np.random.default_rng(7)
    grid = GRIDS[kind](rng)
    scene = GridScene(make_scene, grid, turned(rng))
    half = 0.5 * extent(grid)
    size = max(1.0, half.max())
    for trial in range(times(2)):
        scene.move(rng, half, 1.5 * half.clip(0.3), is_aligned=trial % 3 == 1)
        own = scene.own.query.compute_signed_distance_pairwise_closest_points(certificate=True)
        others = scene.boxes.query.compute_signed_distance_pairwise_closest_points()
        records = rows_with(own, scene.grid)
        assert len(records) == len(scene.own.ids)
        voxels = {int(each): k for k, each in enumerate(scene.voxels)}
        for record in records:
            is_A = record.id_A == scene.grid
            other = scene.own.ids.index(record.id_B if is_A else record.id_A)
            of_other = int(scene.boxes.ids[other])
            distances = np.full(len(voxels), np.inf)
            for side, opposite in ((others.id_A, others.id_B), (others.id_B, others.id_A)):
                for row in np.flatnonzero(side == of_other):
                    if int(opposite[row]) in voxels:
                        distances[voxels[int(opposite[row])]] = others.distance[row]
            assert np.isfinite(distances).all()
            element = record.element_A if is_A else record.element_B
            at = scene.elements.tolist().index(element)
            assert record.distance == pytest.approx(distances.min(), abs=EXACT * size)
            assert distances[at] == pytest.approx(distances.min(), abs=EXACT * size)
            assert (record.element_B if is_A else record.element_A) == -1
            assert record.gap <= EXACT * size
            p_WA = scene.own.query.get_pose_in_world(record.id_A) @ [*record.p_ACa, 1.0]
            p_WB = scene.own.query.get_pose_in_world(record.id_B) @ [*record.p_BCb, 1.0]
            apart = (p_WA - p_WB)[:3] - record.distance * record.nhat_BA_W
            assert np.abs(apart).max() < 10 * EXACT * size


def test_answers_agree_with_each_other(make_scene):
    """Penetrations, distances, candidates, yes or no, and what is near enough."""
    rng = np.random.default_rng(3)
    grid = GRIDS["sparse"](rng)
    scene = GridScene(make_scene, grid, turned(rng))
    query = scene.own.query
    for _ in range(3):
        scene.move(rng, 0.5 * extent(grid), 0.6 * extent(grid))
        far = rows_with(query.compute_signed_distance_pairwise_closest_points(), scene.grid)
        deep = rows_with(query.compute_point_pair_penetration(), scene.grid)
        near = rows_with(
            query.compute_signed_distance_pairwise_closest_points(max_distance=0.1), scene.grid
        )
        assert [-pair.depth for pair in deep] == [p.distance for p in far if p.distance < 0.0]
        assert [p.distance for p in near] == [p.distance for p in far if p.distance <= 0.1]
        touching = {(p.id_A, p.id_B) for p in deep}
        candidates = rows_with(query.find_collision_candidates(), scene.grid)
        assert touching <= {(p.id_A, p.id_B) for p in candidates}
        for pair in far:
            one = query.compute_signed_distance_pair_closest_points(pair.id_A, pair.id_B)
            assert one.distance == pair.distance


@pytest.mark.search
@pytest.mark.parametrize("kind", ["sparse", "dense", "one voxel"])
def test_points_are_as_far_as_the_nearest_voxel(make_scene, kind):
    """Beside, inside, on faces, edges and corners; also up to so far, and in threads."""
    rng = np.random.default_rng(9)
    grid = GRIDS[kind](rng)
    scene = GridScene(make_scene, grid, turned(rng))
    corners = rng.integers(0, np.array(grid.occupancy.shape) + 1, (times(20), 3)) * grid.voxel
    p_F = np.concatenate([rng.uniform(-0.3, 1.3, (times(100), 3)) * extent(grid), corners])
    p_W = p_F @ scene.X_WF[:3, :3].T + scene.X_WF[:3, 3]
    scene.move(rng, np.full(3, 9.0), np.ones(3))
    table = scene.own.query.compute_signed_distance_to_points(p_W)
    own = table.id_G == int(scene.grid)
    centers = np.stack(np.unravel_index(scene.elements, grid.occupancy.shape), 1) + 0.5
    gaps = np.abs(p_F[:, np.newaxis] - centers * grid.voxel) - 0.5 * grid.voxel
    outside = np.linalg.norm(np.maximum(gaps, 0.0), axis=2)
    distances = outside + np.minimum(gaps.max(axis=2), 0.0)
    assert table.distance[own] == pytest.approx(distances.min(axis=1), abs=EXACT)
    at = np.searchsorted(scene.elements, table.element[own])
    assert distances[np.arange(len(p_F)), at] == pytest.approx(distances.min(axis=1), abs=EXACT)
    p_WN = table.p_GN[own] @ scene.X_WF[:3, :3].T + scene.X_WF[:3, 3]
    out = p_WN + table.distance[own][:, np.newaxis] * table.grad_W[own]
    assert np.abs(out - p_W).max() < 1e-11
    few = scene.own.query.compute_signed_distance_to_points(p_W, threshold=0.05)
    assert (few.id_G == int(scene.grid)).sum() == (table.distance[own] <= 0.05).sum()


def placed(*shapes):
    """Return a query about shapes, each on a frame of its own at the origin, and their ids."""
    graph = SceneGraph()
    source, ids = graph.register_source("map"), []
    for k, shape in enumerate(shapes):
        frame = graph.register_frame(source, GeometryFrame(f"frame_{k}"))
        instance = GeometryInstance(np.eye(4), shape, f"shape_{k}")
        instance.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_geometry(source, frame, instance))
    context = graph.create_default_context()
    return graph.query_object(context), ids, (context, source)


def test_unknown_is_solid_unless_the_shape_says_that_it_is_free():
    """The same voxels, once with and once without the unknown one beside the ball."""
    states = np.zeros((6, 1, 1), np.uint8)
    states[0], states[3] = 1, 2
    ball = PointCloud([[4.5, 0.5, 0.5]], 0.25)
    distances = []
    for free in (False, True):
        query, ids, _ = placed(VoxelGrid(states, 1.0, unknown_is_free=free), ball)
        distances.append(query.compute_signed_distance_pair_closest_points(*ids).distance)
    assert distances == pytest.approx([0.25, 3.25])


def test_a_query_says_whether_unknown_counts_as_free():
    """Both ways, whatever the shape says; the moment itself stays, and bits are made once."""
    states = np.zeros((6, 1, 1), np.uint8)
    states[0], states[3] = 1, 2
    for free in (False, True):
        grid = VoxelGrid(states, 1.0, unknown_is_free=free)
        query, ids, (context, source) = placed(grid, PointCloud([[4.5, 0.5, 0.5]], 0.25))
        before = query.compute_signed_distance_pair_closest_points(*ids).distance
        for is_free, expected in ((True, 3.25), (False, 0.25)):
            asked = query.with_unknown_voxels(is_free=is_free)
            pair = asked.compute_signed_distance_pair_closest_points(*ids)
            assert pair.distance == pytest.approx(expected)
            assert pair.element_A == (0 if is_free else 3)
            assert states.reshape(-1)[pair.element_A] == (1 if is_free else 2)
            again = query.with_unknown_voxels(is_free=is_free)
            sets = [each.snapshot.voxel_set(ids[0]) for each in (asked, again)]
            assert sets[0] is sets[1]
            assert sets[0].with_unknown(is_free=free) is context.snapshot.voxel_set(ids[0])
        assert query.compute_signed_distance_pair_closest_points(*ids).distance == before
        asked = query.with_unknown_voxels(is_free=True)
        context.set_voxels(source, {ids[0]: np.full((1, 1, 1), 2)})
        assert asked.compute_signed_distance_pair_closest_points(*ids).distance == 3.25
        assert context.snapshot.with_unknown_voxels(is_free=free) is context.snapshot


def test_a_cloud_is_as_far_as_its_nearest_ball_from_the_nearest_voxel():
    """By all pairs of balls and voxels; both elements are told."""
    rng = np.random.default_rng(2)
    for _ in range(10):
        grid = random_grid(rng, (6, 6, 6), 0.05, 0.1)
        points, radii = rng.uniform(-0.3, 0.9, (40, 3)), rng.uniform(0.0, 0.02, 40)
        query, (one, other), _ = placed(grid, PointCloud(points, radii))
        pair = query.compute_signed_distance_pair_closest_points(one, other)
        _, elements = boxes_of(grid)
        centers = (np.stack(np.unravel_index(elements, grid.occupancy.shape), 1) + 0.5) * 0.1
        gaps = np.abs(points[:, np.newaxis] - centers) - 0.05
        outside = np.linalg.norm(np.maximum(gaps, 0.0), axis=2)
        distances = outside + np.minimum(gaps.max(axis=2), 0.0) - radii[:, np.newaxis]
        assert pair.distance == pytest.approx(distances.min(), abs=EXACT)
        at = elements.tolist().index(pair.element_A)
        assert distances[pair.element_B, at] == pytest.approx(distances.min(), abs=EXACT)


def test_a_grid_in_which_nothing_is_solid_is_near_nothing():
    """No pair, no point, no box; asked by name it is refused by its name."""
    for states in (np.zeros((3, 3, 3)), np.zeros((0, 3, 3))):
        grid = VoxelGrid(states.astype(int), 0.1)
        query, ids, _ = placed(grid, Sphere(0.3), PointCloud([[0, 0, 0]], 0.2))
        assert not rows_with(query.compute_signed_distance_pairwise_closest_points(), ids[0])
        assert not rows_with(query.find_collision_candidates(), ids[0])
        assert (query.compute_signed_distance_to_points([[0, 0, 0]]).id_G != int(ids[0])).all()
        assert query.compute_aabb_in_world(ids[0]) is None
        with pytest.raises(UnsupportedPairError, match="shape_0 has no solid voxels"):
            query.compute_signed_distance_pair_closest_points(ids[0], ids[1])


def test_another_engine_is_refused_by_name():
    """No answer that is silently wrong."""
    query, _, _ = placed(VoxelGrid([[[1]]], 0.1), Box(1, 1, 1))
    with pytest.raises(EngineError, match="voxel grids"):
        query.compute_point_pair_penetration(engine="fcl")


def test_voxels_that_are_set_are_those_of_the_moment():
    """Of any shape; a clone keeps the voxels that it had."""
    query, ids, (context, source) = placed(VoxelGrid([[[1]]], 0.5), HalfSpace(), Sphere(0.1))
    before = context.clone()
    context.set_voxels(source, {ids[0]: np.pad([[[1]]], ((8, 0), (0, 0), (2, 0)))})
    pair = query.compute_signed_distance_pair_closest_points(ids[0], ids[1])
    assert (pair.distance, pair.element_A) == (1.0, 8 * 3 + 2)
    lower, upper = query.compute_aabb_in_world(ids[0])
    assert lower.tolist() == [4.0, 0.0, 1.0]
    assert upper.tolist() == [4.5, 0.5, 1.5]
    assert before.voxels(ids[0]).shape == (1, 1, 1)
    assert context.voxels(ids[0]).shape == (9, 1, 3)


def test_a_large_grid_takes_little_memory():
    """An eighth of a byte for a voxel, and 1/63 more, beside what was given."""
    states = np.zeros((256, 256, 256), np.uint8)
    states[100:120, 50:60, 7] = 1
    query, ids, (context, _) = placed(VoxelGrid(states, 0.01), Sphere(0.05))
    placed_voxels = context.snapshot.voxel_set(ids[0]).placed
    assert placed_voxels.bits.words.nbytes <= states.size / 8 * (1 + 1 / 60)
    pair = query.compute_signed_distance_pair_closest_points(*ids)
    assert pair.distance == pytest.approx(np.linalg.norm([1.0, 0.5, 0.07]) - 0.05, abs=EXACT)


def test_what_if_and_clones_have_the_voxels():
    """Of the moment that is asked about, moved by its poses; pickled answers say the same."""
    query, ids, (context, source) = placed(VoxelGrid([[[1]]], 0.5), Sphere(0.25))
    context.set_voxels(source, {ids[0]: [[[0]], [[0]], [[2]]]})
    frame = query.inspector().get_frame_id(ids[1])
    X = np.tile(np.eye(4), (2, 1, 1))
    X[:, :3, 3] = [[2.0, 0.25, 0.25], [1.25, 0.25, 1.0]]

    def distance(asked):
        return asked.compute_signed_distance_pair_closest_points(*ids)

    records = query.ask_what_if([{frame: each} for each in X], distance)
    assert [record.distance for record in records] == pytest.approx([0.25, 0.25], abs=EXACT)
    assert [record.element_A for record in records] == [2, 2]
    free = query.with_unknown_voxels(is_free=True)
    assert free.ask_what_if([{frame: X[0]}], lambda each: each.has_collisions()) == [False]
    assert len(pickle.loads(pickle.dumps(query.find_collision_candidates()))) == 0
    clone = context.clone()
    context.set_voxels(source, {ids[0]: [[[1]]]})
    assert clone.voxels(ids[0]).reshape(-1).tolist() == [0, 0, 2]

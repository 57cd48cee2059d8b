"""Voxel grids against each other, and against height fields: by all pairs of their elements."""

from height_prisms import prisms_of
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from searching import times
from voxel_boxes import boxes_of

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    HeightField,
    ProximityProperties,
    SceneGraph,
    VoxelGrid,
)
from scene_graph_ros.geometry.errors import UnsupportedPairError

EXACT = 1e-12


def grid(rng, counts, voxel, part=0.15):
    """Return a grid in which so large a part is occupied, and as much unknown."""
    return VoxelGrid(rng.choice([0, 1, 2], counts, p=[1.0 - 2 * part, part, part]), voxel)


def hills(rng, counts, size, floor):
    """Return a field of noise above a floor."""
    return HeightField(rng.uniform(-0.1, 0.1, counts), size, floor)


PAIRS = {
    "alike": lambda rng: (grid(rng, (5, 4, 6), 0.1), grid(rng, (4, 5, 3), 0.1)),
    "fine and coarse": lambda rng: (grid(rng, (3, 3, 2), 0.25), grid(rng, (7, 6, 5), 0.04)),
    "full": lambda rng: (VoxelGrid(np.ones((4, 4, 4), int), 0.1), grid(rng, (3, 3, 3), 0.1, 0.5)),
    "one voxel each": lambda rng: (VoxelGrid([[[1]]], 1 / 3), VoxelGrid([[[2]]], 0.1)),
    "wide apart": lambda rng: (grid(rng, (1, 30, 1), 0.1, 0.5), grid(rng, (9, 1, 9), 0.05)),
    "tiny": lambda rng: (grid(rng, (5, 4, 3), 1e-3), grid(rng, (4, 4, 4), 1e-3)),
    "huge": lambda rng: (grid(rng, (5, 4, 3), 2e3), grid(rng, (4, 4, 4), 1e3)),
    "hills": lambda rng: (hills(rng, (4, 5), (0.5, 0.4), -0.3), grid(rng, (5, 3, 4), 0.06)),
    "flat": lambda rng: (HeightField(np.zeros((4, 5)), (1, 1), -1), grid(rng, (4, 4, 2), 0.2)),
    "peaks": lambda rng: (
        HeightField(rng.choice([0.0, 1.0], (5, 5)), (0.2, 0.2), -1e-3),
        grid(rng, (3, 3, 5), 0.1),
    ),
}


def elements_of(shape):
    """Return (center, convex shape) of each element, and the elements' indices."""
    if isinstance(shape, VoxelGrid):
        return boxes_of(shape)
    prisms = prisms_of(shape)
    return prisms, np.arange(len(prisms))


class TwoScenes:
    """Two shapes on two frames, and the same with a geometry for each element."""

    def __init__(self, *shapes):
        self.elements = [elements_of(shape) for shape in shapes]
        wholes = [[(np.zeros(3), shape)] for shape in shapes]
        self.own = self._scene(wholes)
        self.apart = self._scene([parts for parts, _ in self.elements])

    @staticmethod
    def _scene(parts):
        graph = SceneGraph()
        source, frames, ids = graph.register_source("map"), [], []
        for side, shapes in enumerate(parts):
            frame = graph.register_frame(source, GeometryFrame(f"frame_{side}"))
            frames.append(frame)
            ids.append([])
            for k, (center, shape) in enumerate(shapes):
                X = np.eye(4)
                X[:3, 3] = center
                instance = GeometryInstance(X, shape, f"shape_{side}_{k}")
                instance.set_proximity_properties(ProximityProperties())
                ids[-1].append(int(graph.register_geometry(source, frame, instance)))
        context = graph.create_default_context()
        return context, source, frames, ids, graph.query_object(context)

    def answers(self, *poses, **options):
        """Return the records about the two, and all distances of elements, at two poses."""
        for context, source, frames, _, _ in (self.own, self.apart):
            context.set_frame_poses(source, dict(zip(frames, poses, strict=True)))
        records = self.own[-1].compute_signed_distance_pairwise_closest_points(**options)
        ids = self.apart[3]
        table = self.apart[-1].compute_signed_distance_pairwise_closest_points()
        distances = np.full((len(ids[0]), len(ids[1])), np.nan)
        rows = np.searchsorted(ids[0], table.id_A), np.searchsorted(ids[1], table.id_B)
        distances[rows] = table.distance
        return records, distances


def pose(rng, spread, middle=(0.0, 0.0, 0.0), *, is_turned=True):
    """Return a pose that brings a middle so near to the origin."""
    X = np.eye(4)
    if is_turned:
        X[:3, :3] = Rotation.random(rng=rng).as_matrix()
    X[:3, 3] = rng.uniform(-spread, spread, 3) - X[:3, :3] @ middle
    return X


@pytest.mark.search
@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("is_swapped", [False, True])
def test_the_nearest_pair_of_elements_decides(kind, is_swapped):
    """As far, or as deep, as these are from each other, which the answer tells by their index."""
    rng = np.random.default_rng(23)
    shapes = PAIRS[kind](rng)
    scenes = TwoScenes(*shapes[::-1] if is_swapped else shapes)
    size = max(np.abs(center).max() for parts, _ in scenes.elements for center, _ in parts)
    middles = [np.mean([center for center, _ in parts], axis=0) for parts, _ in scenes.elements]
    depths = []
    for trial in range(times(4)):
        spread = size * (1.5 if trial % 2 else 0.03)
        poses = [
            pose(rng, spread, middle, is_turned=is_turned)
            for middle, is_turned in zip(middles, (True, trial % 4 != 3), strict=True)
        ]
        (record,), distances = scenes.answers(*poses, certificate=True)
        assert record.distance == pytest.approx(distances.min(), abs=EXACT * max(size, 1.0))
        at = [
            indices.tolist().index(element)
            for (_, indices), element in zip(
                scenes.elements, (record.element_A, record.element_B), strict=True
            )
        ]
        assert distances[tuple(at)] == pytest.approx(record.distance, abs=EXACT * max(size, 1.0))
        assert record.gap <= EXACT * max(size, 1.0)
        p_WA = poses[0] @ [*record.p_ACa, 1.0]
        p_WB = poses[1] @ [*record.p_BCb, 1.0]
        apart = (p_WA - p_WB)[:3] - record.distance * record.nhat_BA_W
        assert np.abs(apart).max() < 10 * EXACT * max(size, 1.0)
        depths.append(record.distance)
        few, _ = scenes.answers(*poses, max_distance=record.distance - 1e-3 * size)
        assert not len(few)
    assert min(depths) < 0.0


def test_grids_that_touch_and_those_that_are_one():
    """Faces on faces are at 0; of two alike at one place each voxel is as deep as its edge."""
    shape = VoxelGrid(np.ones((6, 5, 4), int), 0.25)
    scenes = TwoScenes(shape, shape)
    beside, above = np.eye(4), np.eye(4)
    beside[0, 3], above[2, 3] = 6 * 0.25, 4 * 0.25 + 2.0**-20
    for X, expected in ((beside, 0.0), (above, 2.0**-20), (np.eye(4), -0.25)):
        (record,), distances = scenes.answers(np.eye(4), X)
        assert record.distance == pytest.approx(expected, abs=1e-15)
        assert distances.min() == pytest.approx(expected, abs=1e-15)


def test_all_queries_agree_about_two_grids():
    """Penetration, candidates, yes or no, and derivatives by differences."""
    rng = np.random.default_rng(5)
    scenes = TwoScenes(grid(rng, (5, 5, 5), 0.1), grid(rng, (4, 4, 4), 0.1))
    query = scenes.own[-1]
    for k in range(6):
        poses = [pose(rng, 0.1), pose(rng, 0.3 + 0.1 * k)]
        (record,), _ = scenes.answers(*poses, derivatives=True)
        deep = query.compute_point_pair_penetration()
        assert [-pair.depth for pair in deep] == [record.distance] * (record.distance < 0.0)
        assert query.has_collisions() == (record.distance < 0.0)
        assert len(query.find_collision_candidates()) >= len(deep)
        step = 1e-7
        for axis in range(3):
            ends = []
            for way in (-step, step):
                moved = poses[1].copy()
                moved[axis, 3] += way
                ends.append(scenes.answers(poses[0], moved)[0][0].distance)
            slope = (ends[1] - ends[0]) / (2 * step)
            assert record.ddistance_dX_WB[3 + axis] == pytest.approx(slope, abs=1e-5)


def test_two_height_fields_are_refused_by_name():
    """The only pair of shapes of many elements that has no answer."""
    field = HeightField(np.zeros((2, 2)), (1.0, 1.0), -1.0)
    query = TwoScenes(field, field).own[-1]
    with pytest.raises(UnsupportedPairError, match=r"shape_0_0 against .*shape_1_0"):
        query.compute_signed_distance_pairwise_closest_points()


def test_a_grid_in_which_nothing_is_solid_is_near_no_other():
    """Free voxels alone, or none."""
    for states in (np.zeros((3, 3, 3), int), np.zeros((0, 3, 3), int)):
        scenes = TwoScenes(VoxelGrid(states, 0.1), VoxelGrid([[[1]]], 0.1))
        records, _ = scenes.answers(np.eye(4), np.eye(4))
        assert not len(records)

"""Fields of many blocks: as far from shapes as the nearest of the tiles they are cut into."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from searching import times

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HeightField,
    ProximityProperties,
    SceneGraph,
    Sphere,
)

TILES, CELLS = 8, 12
LENGTH, FLOOR = 2.0, -0.5
EXACT = 4e-12


def with_proximity(X, shape, name):
    """Return an instance at a pose in its frame."""
    instance = GeometryInstance(X, shape, name)
    instance.set_proximity_properties(ProximityProperties())
    return instance


class Distances:
    """A scene of fields that stand still, and shapes that are put somewhere."""

    def __init__(self, fields, shapes):
        graph = SceneGraph()
        ground, self.robot = (graph.register_source(name) for name in ("map", "robot"))
        for k, (center, field) in enumerate(fields):
            X = np.eye(4)
            X[:2, 3] = center
            graph.register_anchored_geometry(ground, with_proximity(X, field, f"field_{k}"))
        self.ids = []
        for k, shape in enumerate(shapes):
            frame = graph.register_frame(self.robot, GeometryFrame(f"frame_{k}"))
            instance = with_proximity(np.eye(4), shape, f"shape_{k}")
            self.ids.append(graph.register_geometry(self.robot, frame, instance))
        apart = CollisionFilterDeclaration().exclude_within(GeometrySet(self.ids))
        graph.collision_filter_manager().apply(apart)
        self.context = graph.create_default_context()
        self.query = graph.query_object(self.context)

    def at(self, X):
        """Return the distance of each shape to the nearest field."""
        self.context.set_frame_poses(self.robot, X)
        table = self.query.compute_signed_distance_pairwise_closest_points()
        return [
            table.distance[(table.id_A == int(each)) | (table.id_B == int(each))].min()
            for each in self.ids
        ]


def cut(heights):
    """Return the middles and fields of the tiles of a field of TILES x TILES x CELLS x CELLS."""
    width, n = LENGTH / TILES, np.arange(CELLS + 1)
    return [
        (
            ((j + 0.5) * width - 0.5 * LENGTH, (i + 0.5) * width - 0.5 * LENGTH),
            HeightField(heights[np.ix_(i * CELLS + n, j * CELLS + n)], (width, width), FLOOR),
        )
        for i in range(TILES)
        for j in range(TILES)
    ]


@pytest.mark.search
@pytest.mark.parametrize("size", [0.02, 0.3, 4.0])
def test_a_field_is_as_far_as_the_nearest_of_its_tiles(size):
    """In the ground, above it, far above it and beside it, for shapes of one cell to all cells."""
    rng = np.random.default_rng(11)
    x = np.linspace(-1.0, 1.0, TILES * CELLS + 1)
    heights = 0.1 * np.sin(4.0 * x) * np.cos(3.0 * x)[:, np.newaxis]
    heights += rng.normal(0.0, 0.01, heights.shape)
    shapes = [
        Sphere(0.5 * size),
        Box(size, 0.7 * size, 0.2 * size),
        Capsule(0.2 * size, size),
        Ellipsoid(0.5 * size, 0.3 * size, 0.4 * size),
        Convex(vertices=0.5 * size * rng.normal(size=(30, 3))),
        Convex(vertices=0.5 * size * rng.normal(size=(400, 3))),
    ]
    whole = Distances([((0.0, 0.0), HeightField(heights, (LENGTH, LENGTH), FLOOR))], shapes)
    tiles = Distances(cut(heights), shapes)
    X = np.tile(np.eye(4), (len(shapes), 1, 1))
    for trial in range(times(8)):
        X[:, :3, :3] = Rotation.random(len(shapes), rng=rng).as_matrix()
        height = (0.1, 0.5, 5.0)[trial % 3]
        X[:, :3, 3] = rng.uniform(-1.2, 1.2, (len(shapes), 3)) * [1.0, 1.0, height]
        assert whole.at(X) == pytest.approx(tiles.at(X), abs=EXACT)

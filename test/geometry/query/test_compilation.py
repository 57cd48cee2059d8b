"""No query ever compiles: whatever is asked, the kernels that were compiled beforehand answer."""

import contextlib
import os

import numpy as np
import pytest
from warm_kernels import called_kernels, run_tasks

from scene_graph_ros.geometry import (
    Box,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    Mesh,
    ProximityProperties,
    QueryObject,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.accuracy import Accuracy
from scene_graph_ros.geometry.errors import UnsupportedPairError

pytestmark = [
    pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels"),
    pytest.mark.timeout(900),  # alone, on a machine that was not warmed up, it compiles first
]

CORNERS = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
SHAPES = {
    "nothing": [],
    "one ball": [Sphere(0.1)],
    "balls": [Sphere(0.1)] * 3,
    "solids": [Box(1, 2, 3), Cylinder(0.5, 1), Ellipsoid(1, 2, 3), Convex(vertices=CORNERS)],
    "floor": [HalfSpace(), Sphere(1.0)],
    "meshes": [Mesh(vertices=CORNERS, faces=FACES)] * 2,
    "flat and open": [
        Convex(vertices=CORNERS[:3]),
        Convex(vertices=CORNERS[:2]),
        Mesh(vertices=CORNERS, faces=FACES[:2]),
    ],
}


def frames_of(query):
    """Return all frames."""
    return query.inspector().get_all_frame_ids()


def softs_of(query):
    """Return all deformable geometries."""
    return query.inspector().get_all_deformable_geometry_ids()


def every_pair(query, **options):
    """Ask for each pair of geometries by its ids."""
    ids = query.snapshot.proximity.geometry_ids
    for k in range(1, len(ids)):
        query.compute_signed_distance_pair_closest_points(ids[k - 1], ids[k], **options)


def surfaces(query, word):
    """Ask for contact surfaces, which pairs without the properties do not have."""
    with contextlib.suppress(UnsupportedPairError):
        query.compute_contact_surfaces(word)


POINTS = np.zeros((4, 3))
WORDS = ("triangle", "polygon")
ASK = {
    "ask_what_if": [lambda q: q.ask_what_if([{}, {}], QueryObject.has_collisions)],
    "bake": [lambda q: q.bake().has_collisions()],
    "compute_contact_surfaces": [lambda q, word=word: surfaces(q, word) for word in WORDS],
    "compute_contact_surfaces_with_fallback": [
        lambda q, word=word: q.compute_contact_surfaces_with_fallback(word) for word in WORDS
    ],
    "compute_deformable_contact": [lambda q: q.compute_deformable_contact()],
    "compute_point_pair_penetration": [
        lambda q: q.compute_point_pair_penetration(),
        lambda q: q.compute_point_pair_penetration(derivatives=True, certificate=True),
        *(
            lambda q, tier=tier: q.compute_point_pair_penetration(accuracy=tier, certificate=True)
            for tier in Accuracy
        ),
    ],
    "compute_signed_distance_pair_closest_points": [
        every_pair,
        lambda q: every_pair(q, derivatives=True, certificate=True),
    ],
    "compute_signed_distance_pairwise_closest_points": [
        lambda q: q.compute_signed_distance_pairwise_closest_points(),
        lambda q: q.compute_signed_distance_pairwise_closest_points(0),
        lambda q: q.compute_signed_distance_pairwise_closest_points(-0.1),
        lambda q: q.compute_signed_distance_pairwise_closest_points(np.float32(0.5)),
        lambda q: q.compute_signed_distance_pairwise_closest_points(1, derivatives=True),
        *(
            lambda q, tier=tier: q.compute_signed_distance_pairwise_closest_points(
                accuracy=tier, certificate=True
            )
            for tier in Accuracy
        ),
    ],
    "compute_aabb_in_world": [
        lambda q: [q.compute_aabb_in_world(each) for each in q.snapshot.proximity.geometry_ids],
    ],
    "compute_signed_distance_geometry_to_point": [
        lambda q: q.compute_signed_distance_geometry_to_point(
            POINTS[0], GeometrySet(q.snapshot.proximity.geometry_ids)
        ),
    ],
    "compute_signed_distance_to_point": [
        lambda q: q.compute_signed_distance_to_point([0, 0, 1]),
        lambda q: q.compute_signed_distance_to_point(POINTS[0].astype(np.float32), 0),
    ],
    "compute_signed_distance_to_points": [
        lambda q: q.compute_signed_distance_to_points(POINTS),
        lambda q: q.compute_signed_distance_to_points(POINTS[:0]),
        lambda q: q.compute_signed_distance_to_points(np.zeros((3, 4)).T, 0.2),
        lambda q: q.compute_signed_distance_to_points(POINTS, threads=2),
        lambda q: q.compute_signed_distance_to_points(POINTS, 1, threads=3),
    ],
    "find_collision_candidates": [lambda q: q.find_collision_candidates()],
    "get_configurations_in_world": [
        lambda q: [q.get_configurations_in_world(i) for i in softs_of(q)]
    ],
    "get_driven_mesh_configurations_in_world": [
        lambda q: [
            q.get_driven_mesh_configurations_in_world(i, Role.PROXIMITY) for i in softs_of(q)
        ]
    ],
    "get_pose_in_parent": [lambda q: [q.get_pose_in_parent(f) for f in frames_of(q)]],
    "get_pose_in_world": [lambda q: [q.get_pose_in_world(f) for f in frames_of(q)]],
    "has_collisions": [
        lambda q: q.has_collisions(),
        *(lambda q, tier=tier: q.has_collisions(accuracy=tier) for tier in Accuracy),
    ],
    "with_unknown_voxels": [lambda q: q.with_unknown_voxels(is_free=True).has_collisions()],
    "inspector": [lambda q: q.inspector().get_collision_candidates()],
}


class Scene:
    """Shapes on frames, or the first half of them anchored, perhaps with triangles in contact."""

    def __init__(self, shapes, anchored: bool, triangles: bool, filters: bool) -> None:
        graph = SceneGraph()
        self.source = graph.register_source("scene")
        self.frames, ids = [], []
        properties = ProximityProperties()
        if triangles:
            properties.add_property("mesh", "representation", "triangles")
        for k, shape in enumerate(shapes):
            instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
            if anchored and k < (len(shapes) + 1) // 2:
                ids.append(graph.register_anchored_geometry(self.source, instance))
            else:
                frame = graph.register_frame(self.source, GeometryFrame(f"frame_{k}"))
                self.frames.append(frame)
                ids.append(graph.register_geometry(self.source, frame, instance))
        for geometry in ids:
            graph.assign_role(self.source, geometry, properties)
        self.softs = []
        for k in range(2):
            soft = GeometryInstance(np.eye(4), Box(0.2 + 0.1 * k, 0.2, 0.2), f"soft_{k}")
            soft.set_proximity_properties(properties)
            world = graph.world_frame_id()
            self.softs.append(graph.register_deformable_geometry(self.source, world, soft, 0.1))
        if filters:
            few = GeometrySet(ids[:2])
            graph.collision_filter_manager().apply(
                CollisionFilterDeclaration().exclude_within(few)
            )
        self.context = graph.create_default_context()
        self.query = graph.query_object(self.context)

    def moves(self):
        """Move all frames in every way there is, and yield after each."""
        X = np.tile(np.eye(4), (len(self.frames), 1, 1))
        for k, given in enumerate((X, list(X), X.astype(np.float32), X[::-1])):
            X[:, 0, 3] = 0.05 * k
            self.context.set_frame_poses(self.source, given)
            yield self.query
        q_WG = 1.1 * self.query.get_configurations_in_world(self.softs[0])
        for given in (q_WG, q_WG.ravel(), q_WG.tolist(), q_WG.astype(np.float32)):
            self.context.set_configurations(self.source, {self.softs[0]: given})
        yield self.query
        for frame in self.frames[:1]:
            self.context.set_frame_pose(self.source, frame, X[0])
            yield self.query
            yield QueryObject(self.query.snapshot.with_frame_poses({frame: X[0]}))


@pytest.fixture(scope="module", autouse=True)
def _warm():
    """Load what the set-up compiled, and what it compiles of capabilities."""
    run_tasks()


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("anchored", [False, True])
@pytest.mark.parametrize("shapes", SHAPES)
def test_no_query_compiles(shapes: str, anchored: bool, triangles: bool) -> None:
    """Every query, tier and option, of few or many kinds of shapes, moved in any way."""
    before = called_kernels()
    for filters in (False, True):
        scene = Scene(SHAPES[shapes], anchored, triangles, filters and len(SHAPES[shapes]) > 1)
        for query in scene.moves():
            for calls in ASK.values():
                for ask in calls:
                    ask(query)
    assert called_kernels() == before


def test_every_public_query_is_asked() -> None:
    """A query that is added without a line here is one that may compile."""
    names = {
        n for n in vars(QueryObject) if not n.startswith("_") and callable(vars(QueryObject)[n])
    }
    assert names <= ASK.keys()

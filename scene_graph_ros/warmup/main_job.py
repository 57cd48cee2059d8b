"""Calls that compile the kernels of the main job: all shapes, poses, contacts and distances."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    Mesh,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.broadphase.all_pairs import all_candidate_pairs
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs
from scene_graph_ros.geometry.broadphase.pair_memory import PairMemory
from scene_graph_ros.geometry.compiled.held_tuples import compiled_type
from scene_graph_ros.geometry.compiled.kernel import compile_for_callers
from scene_graph_ros.geometry.hydroelastic.bodies import body_of
from scene_graph_ros.geometry.meshes.embedding import embed_points
from scene_graph_ros.geometry.meshes.pieces.leaving import farthest_outside
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.sources import report_of, surface_of
from scene_graph_ros.geometry.meshes.tessellate import tessellate_volume
from scene_graph_ros.geometry.model.hydroelastic_properties import read_hydroelastic_properties
from scene_graph_ros.geometry.narrowphase.apart import contact_apart
from scene_graph_ros.geometry.narrowphase.convex_distance import new_workspace
from scene_graph_ros.geometry.narrowphase.cores.kinds import BOX, IDENTITY
from scene_graph_ros.geometry.narrowphase.lifted_contact_by_kind import OF_KINDS
from scene_graph_ros.geometry.narrowphase.near_contact import near_contact
from scene_graph_ros.geometry.narrowphase.pair import Pair, Workspace
from scene_graph_ros.geometry.query.distance.certificate import certify_pairs
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.distance.local_surface import local_surfaces
from scene_graph_ros.geometry.query.distance.witness_systems import solve_witnesses
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.spatial.elementary import arc_sine, sine_cosine, sines_and_cosines
from scene_graph_ros.geometry.spatial.pose_kernels import check_poses
from scene_graph_ros.geometry.spatial.poses import (
    inverse,
    poses_from_quaternions,
    quaternions_from_poses,
)
from scene_graph_ros.geometry.spatial.quaternion_kernels import poses_from_components_kernel
from scene_graph_ros.geometry.spatial.record_kernels import (
    are_valid,
    judge_time,
    judge_times,
    latest,
    place_records,
)
from scene_graph_ros.geometry.spatial.sums import least_squares
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable
from scene_graph_ros.warmup.bodies import FACES, many_corners, TETRAHEDRON

__all__ = [
    "ask_about_points",
    "ask_main_queries",
    "find_candidates",
    "find_contacts_of_kinds",
    "find_near_contacts",
    "find_pairs",
    "make_bodies",
    "make_models",
    "measure_points",
    "read_meshes",
    "read_poses",
]

_STAMP_SIZE = 8


def _two_spheres() -> tuple[ShapeTable, np.ndarray]:
    table = build_shape_table([Sphere(1.0), Sphere(1.0)], [False, False])
    return table, np.tile(np.eye(4), (2, 1, 1))


def find_pairs() -> None:
    """Solve a pair."""
    table, X_WG = _two_spheres()
    solve_pairs(hold(table), X_WG, np.array([[0, 1]]), 1.0, WITHIN)


def _boxes_as_cores() -> tuple[Pair, Workspace]:
    core = (BOX, -1, 0.0, (0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    return Pair(core, core, IDENTITY, (0.05, 0.06, 0.07), np.zeros(0)), new_workspace()


def find_near_contacts() -> None:
    """Do the longest part of ``find_pairs`` beside it."""
    pair, work = _boxes_as_cores()
    _, is_overlapping, count, lower, size, found = contact_apart(pair, pair.p, 0.0, 0.0, work)
    near_contact(pair, 0.0, count, work, size, (is_overlapping, lower, found))


def find_contacts_of_kinds() -> None:
    """Do another part of it."""
    pair, work = _boxes_as_cores()
    for contact_of_kinds in OF_KINDS.values():
        compile_for_callers(contact_of_kinds, tuple(map(compiled_type, (pair, 0.0, work))))


def measure_points() -> None:
    """Measure points, certify a pair and find its curvatures."""
    table, X_WG = _two_spheres()
    distance_points(table, X_WG, np.zeros((1, 3)), 1.0)
    distance_points(table, X_WG, np.zeros((2, 3)), np.inf)
    mesh = build_shape_table([Mesh(vertices=TETRAHEDRON, faces=FACES)], [False])
    distance_points(mesh, X_WG[:1], np.zeros((1, 3)), np.inf)
    vectors = np.zeros((1, 3))
    certify_pairs(
        table, X_WG, np.array([[0, 1]]), np.zeros(1), vectors, vectors, vectors, np.zeros(1)
    )
    rows, normals, smooth = np.array([0]), np.array([[0.0, 0.0, 1.0]]), np.zeros(1, np.bool_)
    local_surfaces(table, X_WG, rows, vectors, normals, smooth, vectors, np.zeros((1, 4)))
    solve_witnesses(np.zeros((1, 4, 4)), np.zeros((1, 4, 12)), smooth)


def read_meshes() -> None:
    """Unite parts, cut a sheet at them, look for crossings, measure pieces, cut a polygon."""
    triangle = np.array([[0.02, 0.01, -0.1], [0.02, 0.03, 0.2], [0.03, 0.02, 0.2]])
    vertices = np.concatenate([TETRAHEDRON, TETRAHEDRON + 0.01, triangle])
    faces = np.concatenate([FACES, FACES + 4, [[8, 9, 10]]])
    report_of(Mesh(vertices=vertices, faces=faces))
    solid = surface_of(Mesh(vertices=TETRAHEDRON, faces=FACES))
    farthest_outside(solid, solid)
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.2, 0.0], [0.0, 1.0, 0.0]])
    triangles_of_polygons(square, np.arange(4), np.array([4]), "square", [])
    least_squares(square, np.zeros(4), 0.1)
    arc_sine(0.5)


def find_candidates() -> None:
    """Search for pairs in every way there is."""
    table, X_WG = _two_spheres()
    lower, upper = world_boxes(table, X_WG)
    frame, bits = np.arange(2, dtype=np.int32), np.zeros((0, 0), dtype=np.uint8)
    for search in (candidate_pairs, all_candidate_pairs):
        search(lower, upper, np.zeros(2, dtype=np.bool_), X_WG, frame, bits, 0.0)
    pairs = PairMemory(table, frame, bits)
    for _ in range(2):  # the first search, and one that remembers it
        pairs.find(X_WG, 0.0, is_close=True)


def make_models() -> None:
    """Place frames, and make the models of geometry of every capability."""
    _scene_of_all_shapes().snapshot.X_WG  # noqa: B018
    read_poses()
    make_bodies()


def make_bodies() -> None:
    """Make the bodies of compliant and deformable geometry, and their drawings.

    Neither is to wait until the kernels of these capabilities' contact are there.
    """
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties(properties, 0.1, 1e6)
    for shape in (Box(0.1, 0.2, 0.3), Convex(vertices=TETRAHEDRON)):
        hydroelastic = read_hydroelastic_properties(shape, properties, "warm_up")
        assert hydroelastic is not None
        body_of(shape, hydroelastic)
    sines_and_cosines(np.zeros(1))  # of spheres and cylinders
    solid = tessellate_volume(Box(0.2, 0.2, 0.2), 0.1)
    embed_points(solid.vertices, solid.tetrahedra, TETRAHEDRON)


def read_poses() -> None:
    """Read a pose as one comes with a message, in all the ways there are, and invert it."""
    components = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    X = poses_from_quaternions(components[:, :3], components[:, 3:])
    poses_from_components_kernel(components, X, np.array([0]))
    quaternions_from_poses(X)
    check_poses(X)
    inverse(X)
    sine_cosine(0.0)
    data = bytes(_STAMP_SIZE) + components.tobytes()
    numbers, rows = np.array([_STAMP_SIZE]), np.array([0])
    times, newest = np.array([0]), np.array([0])
    are_valid(data, numbers)
    place_records(data, numbers, times, (0, 0, 0), rows, X, newest)
    judge_times(times, rows, newest, (0, 0, 0), np.array([0]))
    judge_time(0, latest(newest), 0, 0)


def _scene_of_all_shapes() -> QueryObject:
    """Return queries of a scene with every shape twice, frames on frames, filters, a floor."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    shapes = [
        Sphere(0.1),
        Capsule(0.1, 0.2),
        Box(0.1, 0.2, 0.3),
        Cylinder(0.1, 0.2),
        Ellipsoid(0.1, 0.2, 0.3),
        Convex(vertices=TETRAHEDRON),
        Convex(vertices=many_corners()),
        Mesh(vertices=TETRAHEDRON, faces=FACES),
        Mesh(vertices=TETRAHEDRON, faces=FACES, scale=(1.0, 1.0, 2.0)),
    ]
    properties = ProximityProperties()
    triangles = ProximityProperties()
    triangles.add_property("mesh", "representation", "triangles")
    frames: list[FrameId] = []
    geometries: list[GeometryId] = []
    for k, shape in enumerate(2 * shapes):
        parent = frames[-1] if k % 4 == 1 else None
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame_{k}"), parent=parent)
        instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
        geometry = scene_graph.register_geometry(source, frame, instance)
        exact = isinstance(shape, Mesh) and k > len(shapes)
        scene_graph.assign_role(source, geometry, triangles if exact else properties)
        frames.append(frame)
        geometries.append(geometry)
    floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
    floor_id = scene_graph.register_anchored_geometry(source, floor)
    scene_graph.assign_role(source, floor_id, properties)
    declaration = CollisionFilterDeclaration().exclude_within(GeometrySet(geometries[:2]))
    scene_graph.collision_filter_manager().apply(declaration)
    context = scene_graph.create_default_context()
    X_PF = np.tile(np.eye(4), (len(frames), 1, 1))
    X_PF[:, :3, 3] = np.random.default_rng(0).uniform(-0.2, 0.2, (len(frames), 3))
    context.set_frame_poses(source, X_PF)
    context.set_frame_poses(source, {frames[0]: X_PF[0]})
    return scene_graph.query_object(context)


def ask_main_queries() -> None:
    """Ask every query of the main job of a scene with every shape."""
    query = _scene_of_all_shapes()
    query.find_collision_candidates()
    query.has_collisions()
    query.compute_point_pair_penetration()
    pairs = query.compute_signed_distance_pairwise_closest_points(0.1)
    query.compute_signed_distance_pairwise_closest_points()
    query.compute_signed_distance_pair_closest_points(pairs[0].id_A, pairs[0].id_B)
    make_models()


def ask_about_points() -> None:
    """Ask the same scene how far points are from it, and for derivatives and certificates."""
    query = _scene_of_all_shapes()
    query.compute_point_pair_penetration(derivatives=True)
    query.compute_signed_distance_pairwise_closest_points(derivatives=True, certificate=True)
    query.compute_signed_distance_to_point([0.0, 0.0, 1.0])
    query.compute_signed_distance_to_points(np.zeros((3, 3)), 0.5)
    query.compute_signed_distance_to_points(np.zeros((50, 3)))

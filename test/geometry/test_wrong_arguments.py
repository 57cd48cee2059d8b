"""Arguments of the wrong type: a documented error that quotes them, and nothing has changed."""

import copy
import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_rigid_hydroelastic_properties,
    CollisionFilterDeclaration,
    Convex,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    DeformableError,
    InvalidShapeError,
    MeshError,
    PropertyError,
    QueryArgumentError,
    UnknownIdError,
)
from scene_graph_ros.geometry.meshes.surface_mesh import read_obj_to_surface_mesh
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.what_if import ask_what_if


@pytest.fixture
def scene():
    """Two balls on frames of their own."""
    graph = SceneGraph()
    source = graph.register_source("s")
    for name in ("a", "b"):
        frame = graph.register_frame(source, GeometryFrame(name))
        ball = GeometryInstance(np.eye(4), Sphere(0.1), name)
        ball.set_proximity_properties(ProximityProperties())
        graph.register_geometry(source, frame, ball)
    return graph


WRONG = np.zeros(3)
"""What can't be hashed, nor be asked whether it equals something."""


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda g, s: g.model_inspector().get_geometry_ids(WRONG), TypeError, "geometry_set"),
        (lambda g, s: g.create_default_context().resolve_set(None, None), TypeError, "None"),
        (lambda g, s: g.exclude_collisions_within(None), TypeError, "not None"),
        (
            lambda g, s: g.exclude_collisions_between(GeometrySet(), None),
            TypeError,
            "not None",
        ),
        (lambda g, s: CollisionFilterDeclaration().allow_between(WRONG, None), TypeError, "array"),
        (lambda g, s: g.remove_frame(s, WRONG), UnknownIdError, "array"),
        (lambda g, s: g.rename_frame(s, WRONG, "x"), UnknownIdError, "array"),
        (
            lambda g, s: g.register_frame(s, GeometryFrame("x"), parent=WRONG),
            UnknownIdError,
            "array",
        ),
        (lambda g, s: g.assign_role(s, [1], ProximityProperties()), UnknownIdError, r"\[1\]"),
        (lambda g, s: g.change_shape(s, {}, Sphere(1.0)), UnknownIdError, "{}"),
        (lambda g, s: ProximityProperties().has_group([1]), PropertyError, r"\[1\]"),
        (lambda g, s: ProximityProperties().has_property("a", [1]), PropertyError, r"\[1\]"),
        (lambda g, s: ProximityProperties().get_property({}, "a"), PropertyError, "{}"),
        (lambda g, s: ProximityProperties().remove_property({}, "a"), PropertyError, "{}"),
        (
            lambda g, s: ProximityProperties().add_property("a", "b", (i for i in ())),
            PropertyError,
            r"\('a', 'b'\): no copy can be kept of <generator",
        ),
        (
            lambda g, s: g.register_deformable_geometry(
                s, g.world_frame_id(), GeometryInstance(np.eye(4), Sphere(0.1), "x"), 10**400
            ),
            DeformableError,
            "resolution_hint must be a positive number of metres, not 1000",
        ),
        (lambda g, s: read_obj_to_surface_mesh("x.obj", 10**400), MeshError, "scale of 'x.obj'"),
        (lambda g, s: read_obj_to_surface_mesh(b"x"), MeshError, "filename .* b'x'"),
        (lambda g, s: FrameId(np.array(["a"])), ValueError, "value .*array"),
        (lambda g, s: GeometryFrame("x", WRONG), ValueError, "frame_group_id .*array"),
        (
            lambda g, s: g.create_default_context().set_frame_pose(s, WRONG, np.eye(4)),
            UnknownIdError,
            "array",
        ),
        (
            lambda g, s: g.model_inspector().get_unchanged_geometry_ids(None),
            TypeError,
            "before .* None",
        ),
        (lambda g, s: Convex(vertices=[[10**400] * 3]), InvalidShapeError, "vertices"),
        (lambda g, s: Convex(vertices=np.eye(4, 3), scale=10**400), InvalidShapeError, "scale"),
        (
            lambda g, s: add_rigid_hydroelastic_properties(ProximityProperties(), 10**400),
            PropertyError,
            "resolution_hint must be finite",
        ),
        (
            lambda g, s: (
                ProximityProperties().get_property_or_default("a", "b", FrameId)
                and ProximityProperties().get_property_or_default([], "b", (i for i in ()))
            ),
            PropertyError,
            r"\[\]",
        ),
        (lambda g, s: ask_what_if(None, [], len), QueryArgumentError, "query .* None"),
        (
            lambda g, s: ask_what_if(g.query_object(g.create_default_context()), [3], len),
            QueryArgumentError,
            r"configurations\[0\] .* 3",
        ),
        (
            lambda g, s: ask_what_if(g.query_object(g.create_default_context()), 3, len),
            QueryArgumentError,
            "configurations .* 3",
        ),
        (
            lambda g, s: ask_what_if(g.query_object(g.create_default_context()), [], "f"),
            QueryArgumentError,
            "question .* 'f'",
        ),
    ],
)
def test_wrong_types_are_quoted(scene, call, error, words):
    """The error says which argument, or quotes it, and is one that the method documents."""
    source = scene.model_inspector().get_source_id_by_name("s")
    with pytest.raises(error, match=words):
        call(scene, source)
    assert scene.model_inspector().num_frames() == 3


@pytest.mark.parametrize("flag", ["derivatives", "certificate"])
def test_flags_are_true_or_false(scene, flag):
    """An array, a number or a word is no flag."""
    query = scene.query_object(scene.create_default_context())
    for value in (WRONG, 1, "no"):
        with pytest.raises(QueryArgumentError, match=f"{flag} must be True or False"):
            query.compute_point_pair_penetration(**{flag: value})
    assert len(query.compute_point_pair_penetration(**{flag: np.True_})) == 1


def test_integers_beyond_all_floats_are_infinite(scene):
    """A limit of 10^400 metres is no limit, and one of -10^400 lets nothing through."""
    query = scene.query_object(scene.create_default_context())
    far = query.compute_signed_distance_pairwise_closest_points(10**400)
    assert len(far) == 1
    assert len(query.compute_signed_distance_pairwise_closest_points(-(10**400))) == 0
    with pytest.raises(QueryArgumentError, match="p_WQ must be numbers"):
        query.compute_signed_distance_to_point([10**400, 0, 0])


@pytest.mark.filterwarnings("error")
def test_short_floats_are_numbers_as_others_are(scene, tmp_path):
    """Without a warning of numpy's that a bound is beyond what they can be."""
    source = scene.model_inspector().get_source_id_by_name("s")
    instance = GeometryInstance(np.eye(4), Sphere(0.2), "short")
    scene.register_deformable_geometry(source, scene.world_frame_id(), instance, np.float32(0.25))
    file = tmp_path / "triangle.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_obj_to_surface_mesh(file, np.float16(2.0)).vertices.max() == 2.0


def test_what_names_nothing_is_not_there(scene):
    """Questions whether something is there are answered for anything."""
    assert not scene.source_is_registered([1])
    assert not scene.collision_filter_manager().is_active({})
    assert not scene.collision_filter_manager().remove_declaration([])


def test_copies_that_would_share_say_what_to_do(scene):
    """A copy is a clone or none at all, and what can't be pickled names what can."""
    context = scene.create_default_context()
    query = scene.query_object(context)
    attempts = [
        (copy.copy, scene, "SceneGraph .*clone"),
        (pickle.dumps, scene, "SceneGraph .*scene file"),
        (copy.copy, context, "Context .*clone"),
        (pickle.dumps, context, "Context .*arrays"),
        (copy.deepcopy, query, "QueryObject .*bake"),
        (pickle.dumps, query, "QueryObject .*bake"),
        (pickle.dumps, query.bake(), "QueryObject .*bake"),
        (copy.deepcopy, query.snapshot, "Snapshot .*share it"),
        (pickle.dumps, scene.model_inspector(), "SceneGraphInspector"),
    ]
    for attempt, thing, words in attempts:
        with pytest.raises(TypeError, match=words):
            attempt(thing)
    assert copy.deepcopy(scene).model_inspector().num_geometries() == 2
    assert copy.deepcopy(context).model_version == context.model_version
    assert isinstance(QueryObject(context).bake(), QueryObject)

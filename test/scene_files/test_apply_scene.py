"""Scenes in the scene graph: what is registered, where, and all of it or nothing."""

import math
import textwrap

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Rgba,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.scene_files import load_scene, load_scene_text, SceneFileError

TETRAHEDRON = "[[0,0,0],[1,0,0],[0,1,0],[0,0,1]]"
FACES = "[[0,2,1],[0,1,3],[0,3,2],[1,2,3]]"


def apply(text, scene_graph=None, **options):
    """Register a scene given as text; return the scene graph and what was loaded."""
    scene_graph = scene_graph or SceneGraph()
    scene = load_scene_text(textwrap.dedent(text), label="f")
    return scene_graph, scene.apply(scene_graph, **options)


def error_of(text, scene_graph=None):
    """Return the message with which a scene is refused when it is registered."""
    with pytest.raises(SceneFileError) as caught:
        apply(text, scene_graph)
    return str(caught.value)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("type: sphere, radius: 0.5", Sphere(0.5)),
        ("type: box, size: [1, 2, 3]", Box(1, 2, 3)),
        ("type: capsule, radius: 0.5, length: 2", Capsule(0.5, 2)),
        ("type: cylinder, radius: 0.5, length: 2", Cylinder(0.5, 2)),
        ("type: ellipsoid, semi_axes: [1, 2, 3]", Ellipsoid(1, 2, 3)),
        ("type: half_space", HalfSpace()),
        (
            f"type: convex, vertices: {TETRAHEDRON}, scale: 2",
            Convex(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], scale=2),
        ),
        (
            f"type: mesh, vertices: {TETRAHEDRON}, faces: {FACES}, scale: [1, -2, 3]",
            Mesh(
                vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                faces=[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
                scale=(1, -2, 3),
            ),
        ),
    ],
)
def test_all_eight_shapes(body, expected):
    """Each shape of a file is the core's shape with those parameters."""
    scene_graph, loaded = apply(
        f"""\
        version: 1
        sources: [{{name: s}}]
        geometries: [{{name: g, source: s, shape: {{{body}}}}}]
        """
    )
    inspector = scene_graph.model_inspector()
    geometry = loaded.geometries["s/world/g"]
    assert inspector.get_shape(geometry) == expected
    assert inspector.is_anchored(geometry)
    assert inspector.get_roles(geometry) == {Role.PROXIMITY, Role.ILLUSTRATION}


SCENE = """\
    version: 1
    name: two
    sources:
      - {name: cell}
      - {name: objects, poses: {type: geometry_msgs/msg/PoseStamped, topic: tracker}}
      - {name: more}
    frames:
      - {name: lid, source: objects, parent: pot, pose: {xyz: [0, 0, 1]}}
      - {name: pot, source: objects, pose: {xyz: [1, 2, 3], quaternion: [0, 0, 1, 0]}}
      - {name: lamp, source: more, pose: {xyz: [5, 0, 0], rpy: [0, 0, 1.5707963267948966]}}
    geometries:
      - {name: floor, source: cell, shape: {type: half_space}}
      - name: pot
        source: objects
        frame: pot
        pose: {xyz: [0.1, 0.2, 0.3]}
        shape: {type: sphere, radius: 0.5}
        color: [0.1, 0.2, 0.3, 0.4]
        roles:
          proximity: {material: {static_friction: 1}, mesh: {representation: triangles}}
          illustration: {}
          perception: {label: {id: 7}, phong: {diffuse: [1, 0, 0]}}
      - {name: lid, source: objects, frame: lid, shape: {type: sphere, radius: 0.5}}
      - {name: lamp, source: more, frame: lamp, shape: {type: sphere, radius: 0.5}}
    collision_filters:
      - {within: [objects, cell/world/floor]}
      - {action: allow, between: [[objects/lid], [cell/world]]}
      - {between: [[more/lamp/lamp], [objects/pot]]}
    effects: {signed_distance: off, point_contact: auto}
    """


def test_sources_frames_and_inputs():
    """Sources know their frames, the type and topic of their poses, and where they start."""
    scene_graph, loaded = apply(SCENE)
    assert loaded.name == "two"
    assert {n: (s.pose_type, s.pose_topic) for n, s in loaded.sources.items()} == {
        "cell": ("", ""),
        "objects": ("geometry_msgs/msg/PoseStamped", "tracker"),
        "more": ("sensor_msgs/msg/MultiDOFJointState", ""),
    }
    assert loaded.effects == {"signed_distance": "off", "point_contact": "auto"}
    inspector = scene_graph.model_inspector()
    frames = loaded.sources["objects"].frames
    assert inspector.get_parent_frame(frames["lid"]) == frames["pot"]
    assert inspector.get_name(frames["pot"]) == "pot"


def test_initial_poses():
    """Frames start where the file says, in their parents."""
    scene_graph, loaded = apply(SCENE)
    context = scene_graph.create_default_context()
    loaded.set_initial_poses(context)
    frames = {**loaded.sources["objects"].frames, **loaded.sources["more"].frames}
    query = scene_graph.query_object(context)
    # The pot is turned by 180 degrees about z, which leaves the lid above it.
    X_WP = np.array([[-1, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    np.testing.assert_allclose(query.get_pose_in_world(frames["pot"]), X_WP, atol=1e-15)
    lid = query.get_pose_in_world(frames["lid"])
    np.testing.assert_allclose(lid[:3, 3], [1, 2, 4], atol=1e-15)
    lamp = query.get_pose_in_world(frames["lamp"])
    np.testing.assert_allclose(lamp[:3, 0], [0, 1, 0], atol=1e-15)


def test_properties_and_colours():
    """Numbers on contact become floats, colours Rgba; a colour of a role beats the geometry's."""
    scene_graph, loaded = apply(SCENE)
    inspector = scene_graph.model_inspector()
    pot = loaded.geometries["objects/pot/pot"]
    proximity = inspector.get_proximity_properties(pot)
    assert proximity.get_property("material", "static_friction", float) == 1.0
    assert proximity.get_property("mesh", "representation", str) == "triangles"
    assert not proximity.has_property("phong", "diffuse")
    shown = inspector.get_illustration_properties(pot)
    assert shown.get_property("phong", "diffuse") == Rgba(0.1, 0.2, 0.3, 0.4)
    seen = inspector.get_perception_properties(pot)
    assert seen.get_property("phong", "diffuse") == Rgba(1, 0, 0)
    assert seen.get_property("label", "id", int) == 7
    np.testing.assert_array_equal(inspector.get_pose_in_frame(pot)[:3, 3], [0.1, 0.2, 0.3])


def test_filters_in_their_order():
    """Members may be sources, frames and geometries; later filters overrule earlier ones."""
    scene_graph, loaded = apply(SCENE)
    filtered = scene_graph.model_inspector().collision_filtered
    paths = ("cell/world/floor", "objects/pot/pot", "objects/lid/lid", "more/lamp/lamp")
    floor, pot, lid, lamp = (loaded.geometries[path] for path in paths)
    assert filtered(pot, lid)
    assert filtered(floor, pot)
    assert not filtered(floor, lid)
    assert filtered(lamp, pot)
    assert not filtered(lamp, lid)
    assert not filtered(lamp, floor)


def test_prefix_goes_before_sources():
    """The same scene can be loaded twice under two prefixes, not under one."""
    scene_graph, _ = apply(SCENE)
    _, second = apply(SCENE, scene_graph, prefix="b_")
    assert set(second.sources) == {"b_cell", "b_objects", "b_more"}
    floor = second.geometries["cell/world/floor"]
    assert scene_graph.model_inspector().get_name(floor) == "b_floor"
    assert error_of(SCENE, scene_graph).startswith("f:4: sources[0].name: ")
    assert scene_graph.model_inspector().num_sources() == 6 + 1  # the world's own


def refused_scene(geometry="", robot="", extra=""):
    """Return a scene with a good geometry, then a bad part that shows only when registered."""
    robots = f"robots: [{robot}]" if robot else ""
    return f"""\
    version: 1
    sources: [{{name: s}}]
    frames: [{{name: f, source: s}}]
    geometries:
      - {{name: good, source: s, frame: f, shape: {{type: sphere, radius: 1}}}}
      {f"- {{name: bad, source: s, {geometry}}}" if geometry else ""}
    {robots}
    {extra}
    """


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            {"geometry": "shape: {type: mesh, file: no.obj}"},
            "f:6: geometries[1].shape: 'no.obj': no such file",
        ),
        (
            {"geometry": "shape: {type: mesh, file: 'package://nobody/a.obj'}"},
            "f:6: geometries[1].shape: package 'nobody' not found",
        ),
        (
            {"geometry": "shape: {type: capsule, radius: 1e-12, length: 1}"},
            "f:6: geometries[1].shape: Capsule: radius must be between",
        ),
        (
            {
                "geometry": "pose: {quaternion: [0, 0, 0, 2]}, shape: {type: half_space}",
            },
            "f:6: geometries[1].pose: pose ",
        ),
        (
            {
                "geometry": "shape: {type: half_space}, roles: {illustration: {phong:"
                " {diffuse: [2, 0, 0]}}}"
            },
            "f:6: geometries[1].shape: Rgba: r must be between 0 and 1",
        ),
        (
            {"robot": "{name: r, urdf: no.urdf}"},
            "f:7: robots[0].urdf: 'no.urdf': no such file",
        ),
        (
            {"extra": "collision_filters: [{within: [s/g]}]"},
            "f:8: collision_filters[0].within[0]: source 's' has no frame 'g'",
        ),
        (
            {"extra": "collision_filters: [{within: [s/f/better]}]"},
            "f:8: collision_filters[0].within[0]: frame 'f' of source 's' has no geometry 'bet",
        ),
    ],
)
def test_everything_or_nothing(parts, message):
    """What is refused late names its place, and leaves nothing of the scene behind."""
    scene_graph, _ = apply(SCENE)
    inspector = scene_graph.model_inspector()
    before = (
        inspector.get_all_source_ids(),
        inspector.get_all_frame_ids(),
        inspector.get_all_geometry_ids(),
    )
    assert error_of(refused_scene(**parts), scene_graph).startswith(message)
    assert before == (
        inspector.get_all_source_ids(),
        inspector.get_all_frame_ids(),
        inspector.get_all_geometry_ids(),
    )


def test_packages_of_a_scene_are_relative_to_it(tmp_path):
    """A scene can say where a package is; a caller's map beats it."""
    folder = tmp_path / "parts"
    folder.mkdir()
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    (folder / "a.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    file = tmp_path / "scene.yaml"
    file.write_text(
        "version: 1\npackages: {stock: parts}\nsources: [{name: s}]\ngeometries:\n"
        "  - {name: g, source: s, shape: {type: mesh, file: package://stock/a.obj}}\n"
    )
    scene_graph = SceneGraph()
    loaded = load_scene(file).apply(scene_graph)
    shape = scene_graph.model_inspector().get_shape(loaded.geometries["s/world/g"])
    assert shape.path == folder / "a.obj"
    with pytest.raises(SceneFileError, match="'stock' is mapped to /nowhere"):
        load_scene(file, package_map={"stock": "/nowhere"}).apply(SceneGraph())


number = st.floats(-5.0, 5.0).map(lambda x: round(x, 6))
size = st.floats(0.01, 2.0).map(lambda x: round(x, 6))


@settings(deadline=None, max_examples=25)
@given(
    xyz=st.lists(number, min_size=3, max_size=3),
    yaw=number,
    sizes=st.lists(size, min_size=3, max_size=3),
)
def test_poses_and_sizes_arrive_as_written(xyz, yaw, sizes):
    """Any pose and size in a file is that of the registered geometry."""
    scene_graph, loaded = apply(
        f"""\
        version: 1
        sources: [{{name: s}}]
        geometries:
          - name: g
            source: s
            pose: {{xyz: {xyz}, rpy: [0, 0, {yaw}]}}
            shape: {{type: box, size: {sizes}}}
        """
    )
    inspector = scene_graph.model_inspector()
    geometry = loaded.geometries["s/world/g"]
    X = inspector.get_pose_in_frame(geometry)
    np.testing.assert_allclose(X[:3, 3], xyz)
    np.testing.assert_allclose(X[:2, 0], [math.cos(yaw), math.sin(yaw)], atol=1e-15)
    assert inspector.get_shape(geometry) == Box(*sizes)

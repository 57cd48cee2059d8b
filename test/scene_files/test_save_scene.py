"""A scene graph that was saved loads to the same world: names, order and bits of every answer."""

from pathlib import Path

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_contact_material,
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    EnvironmentMap,
    ExactRenderEngine,
    TracedRenderEngine,
)
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions
from scene_graph_ros.scene_files import load_scene, save_scene, SceneSaveError

ROOT = Path(__file__).parents[2]
TETRAHEDRON = np.array([[0.1, 0.0, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.0, 0.0, 0.15]])
FACES = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 2]]
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in TETRAHEDRON) + "".join(
    f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES
)


def _loaded(path) -> tuple[SceneGraph, object]:
    scene_graph = SceneGraph()
    scene = load_scene(path).apply(scene_graph)
    context = scene_graph.create_default_context()
    scene.set_initial_poses(context)
    return scene_graph, context


def _answers(scene_graph, context) -> list[bytes]:
    """All columns of all that may be asked, ids by their place in the scene."""
    query = scene_graph.query_object(context)
    inspector = query.inspector()
    place = {int(i): k for k, i in enumerate(inspector.get_all_geometry_ids())}
    paths = [inspector.get_path(i) for i in inspector.get_all_geometry_ids()]
    tables = [
        query.find_collision_candidates(),
        query.compute_point_pair_penetration(derivatives=True, certificate=True),
        query.compute_signed_distance_pairwise_closest_points(0.5),
        query.compute_signed_distance_to_points(np.random.default_rng(0).normal(size=(20, 3))),
    ]
    found = ["\n".join(paths).encode()]
    for table in tables:
        for name, column in table.columns.items():
            if name.startswith("id_"):
                column = np.array([place[int(value)] for value in column], np.int64)
            found.append(name.encode() + column.tobytes())
    return found


@st.composite
def _scenes(draw):
    """A scene graph and a context, of random frames, shapes, roles, names and filters."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    names = st.text("ab é'\"\\#:{}[]-%&*!|>0,?", min_size=1, max_size=6)
    names = names.map(lambda text: text.strip()).filter(bool)
    scene_graph, poses, geometries = SceneGraph(), {}, []

    def pose(spread):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        return poses_from_quaternions([rng.normal(size=3) * spread], [quaternion], "X")[0]

    for source_name in draw(st.lists(names, min_size=1, max_size=3, unique=True)):
        source = scene_graph.register_source(source_name)
        frames = []
        for name in draw(st.lists(names.filter(lambda n: n != "world"), max_size=3, unique=True)):
            parent = frames[rng.integers(len(frames))] if frames and rng.random() < 0.5 else None
            frame = GeometryFrame(name)
            frames.append(scene_graph.register_frame(source, frame, parent=parent))
            poses[frames[-1]] = source, pose(0.2)
        for k in range(draw(st.integers(0, 4))):
            shape = _shape(rng)
            on = frames[rng.integers(len(frames))] if frames and rng.random() < 0.7 else None
            instance = GeometryInstance(pose(0.1), shape, f"{source_name} {k}")
            _give_roles(instance, rng)
            if on is None:
                geometries.append(scene_graph.register_anchored_geometry(source, instance))
            else:
                geometries.append(scene_graph.register_geometry(source, on, instance))
    for _ in range(draw(st.integers(0, 3)) if len(geometries) > 1 else 0):
        a, b = (geometries[i] for i in rng.integers(len(geometries), size=2))
        scene_graph.exclude_collisions_between(GeometrySet(a), GeometrySet(b))
    context = scene_graph.create_default_context()
    for frame, (source, X) in poses.items():
        context.set_frame_poses(source, {frame: X})
    return scene_graph, context


def _shape(rng):
    a, b, c = rng.uniform(0.05, 0.3, size=3)
    return rng.choice(
        [
            *(Sphere(a), Box(a, b, c), Capsule(a, b), Cylinder(a, b), Ellipsoid(a, b, c)),
            Convex(vertices=rng.normal(size=(12, 3)) * a, scale=(1.0, b, c)),
            Mesh(vertices=TETRAHEDRON * a, faces=FACES, scale=b),
            Mesh(contents=OBJ, file_type="obj", scale=c),
            Convex(contents=OBJ, file_type="obj"),
        ]
    )


def _give_roles(instance, rng) -> None:
    proximity, picture = ProximityProperties(), IllustrationProperties()
    if rng.random() < 0.3:
        add_contact_material(proximity, dissipation=rng.random())
        add_rigid_hydroelastic_properties(proximity, resolution_hint=rng.uniform(0.1, 0.2))
    proximity.add_property("user", "numbers", [1.5, 2.0, 1 / 3])
    proximity.add_property("user", "word", "on: yes\t\u2028\x85 \U0001f600 #")
    proximity.add_property("user", "flag", True)
    proximity.add_property("user", "count", int(rng.integers(100)))
    picture.add_property("phong", "diffuse", Rgba(*rng.random(4)))
    for properties, share in ((proximity, 0.8), (picture, 0.5), (PerceptionProperties(), 0.3)):
        if rng.random() < share:
            instance.set_properties(properties)


@given(_scenes())
@settings(deadline=None, max_examples=12, suppress_health_check=list(HealthCheck))
def test_what_was_saved_answers_the_same_bits(tmp_path_factory, scene):
    """Names, order, poses, shapes, properties, filters: and so every answer is the same."""
    scene_graph, context = scene
    file = tmp_path_factory.mktemp("saved") / "scene.yaml"
    save_scene(scene_graph, file, context=context)
    loaded, its_context = _loaded(file)
    assert _answers(loaded, its_context) == _answers(scene_graph, context)
    # What is saved of what was loaded is the same file.
    again = file.with_name("again") / "scene.yaml"
    again.parent.mkdir()
    save_scene(loaded, again, context=its_context)
    assert again.read_text().count("\n") == file.read_text().count("\n")


def test_a_robot_is_saved_where_it_stands(tmp_path):
    """The demo's cell, with its Panda, its cameras, its SRDF's filters: links become frames."""
    scene_graph = SceneGraph()
    scene = load_scene(ROOT / "config/scenes/panda_cell.yaml").apply(scene_graph)
    context = scene_graph.create_default_context()
    scene.set_initial_poses(context)
    file = tmp_path / "cell.yaml"
    save_scene(scene_graph, file, context=context, cameras=scene.cameras.values(), name="cell")
    loaded, its_context = _loaded(file)
    assert _answers(loaded, its_context) == _answers(scene_graph, context)
    cameras = load_scene(file).apply(SceneGraph()).cameras
    for name, camera in scene.cameras.items():
        assert cameras[name].X_PC.tobytes() == camera.X_PC.tobytes()
        assert cameras[name].camera.core.intrinsics == camera.camera.core.intrinsics
        assert cameras[name].outputs == camera.outputs


def test_deformable_and_compliant_geometry(tmp_path):
    """Tetrahedra are written beside, without loss, so what touches them is the same."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("soft things")
    pad = GeometryInstance(np.eye(4), Box(0.2, 0.2, 0.1), "pad")
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties(properties, 0.05, 1e5)
    pad.set_proximity_properties(properties)
    scene_graph.register_anchored_geometry(source, pad)
    sponge = GeometryInstance(np.eye(4), Sphere(0.1), "sponge")
    sponge.set_proximity_properties(ProximityProperties())
    world = scene_graph.world_frame_id()
    soft = scene_graph.register_deformable_geometry(source, world, sponge, 0.1)
    scene_graph.add_renderer("mine", ExactRenderEngine(default_diffuse=(0.5, 0.25, 1 / 3)))
    file = tmp_path / "soft.yaml"
    save_scene(scene_graph, file)
    assert [path.name for path in (tmp_path / "soft_files").iterdir()] == ["sponge.vtk"]
    loaded, context = _loaded(file)
    (again,) = loaded.model_inspector().get_all_deformable_geometry_ids()
    asked = scene_graph.query_object(scene_graph.create_default_context())
    its = loaded.query_object(context)
    before, after = asked.get_configurations_in_world(soft), its.get_configurations_in_world(again)
    assert before.tobytes() == after.tobytes()
    assert loaded.renderer_parameter_yaml("mine") == scene_graph.renderer_parameter_yaml("mine")
    points = [q.compute_deformable_contact()[0].contact_points_W for q in (asked, its)]
    assert points[0].tobytes() == points[1].tobytes()
    # What is deformed has no place in a file.
    moved = scene_graph.create_default_context()
    q_WG = asked.get_configurations_in_world(soft) + 0.01
    moved.set_configurations(source, {soft: q_WG})
    with pytest.raises(SceneSaveError, match=r"'sponge' is deformed.*Remedy"):
        save_scene(scene_graph, tmp_path / "moved.yaml", context=moved)


def _world():
    scene_graph = SceneGraph()
    source = scene_graph.register_source("arm")
    return scene_graph, source, scene_graph.register_frame(source, GeometryFrame("link"))


def _with_slash(scene_graph, source, link):
    scene_graph.rename_frame(source, link, "a/b")


def _of_another_source(scene_graph, source, link):
    hand = scene_graph.register_source("hand")
    frame = scene_graph.register_frame(hand, GeometryFrame("palm"))
    scene_graph.change_parent(hand, frame, link)


def _with_an_array(scene_graph, source, link):
    ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
    properties = ProximityProperties()
    properties.add_property("mine", "table", np.eye(3))
    ball.set_proximity_properties(properties)
    scene_graph.register_geometry(source, link, ball)


def _quick(scene_graph, source, link):
    scene_graph.set_accuracy("quick")


def _twice_a_name(scene_graph, source, link):
    for properties in (ProximityProperties(), IllustrationProperties()):
        ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
        ball.set_properties(properties)
        scene_graph.register_geometry(source, link, ball)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (_with_slash, "'a/b' has a slash"),
        (_of_another_source, "'hand/palm' is below 'arm/link', of another source"),
        (_with_an_array, r"geometry 'ball': the property \('mine', 'table'\) is array"),
        (_quick, "accuracy of the scene graph is 'quick'"),
        (_twice_a_name, "can't say this.*ball"),
    ],
)
def test_what_a_file_cannot_say_is_refused(tmp_path, spoil, said):
    """With what it is and a remedy; nothing is written, and what was there is left."""
    scene_graph, source, link = _world()
    spoil(scene_graph, source, link)
    file = tmp_path / "scene.yaml"
    file.write_text("before")
    with pytest.raises(SceneSaveError, match=said):
        save_scene(scene_graph, file)
    assert file.read_text() == "before"
    assert list(tmp_path.iterdir()) == [file]


def test_a_matrix_is_a_pose_of_its_own():
    """It is given alone, is rigid, and its last row is what it must be."""
    from scene_graph_ros.located import SceneFileError
    from scene_graph_ros.scene_files import load_scene_text

    start = "version: 1\nsources: [{name: a}]\nframes:\n  - {name: f, source: a, pose: "
    rows = "[[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]"
    scene = load_scene_text(f"{start}{{matrix: {rows}]}}}}").apply(SceneGraph())
    (X,) = scene.sources["a"].initial_poses.values()
    assert X.tolist() == [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    for pose, said in (
        (f"matrix: {rows}], xyz: [0, 0, 0]", "give matrix, or xyz"),
        (f"matrix: {rows}, [0, 0, 1, 1]]", "last row of matrix"),
        ("matrix: [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]", "is not rigid"),
    ):
        with pytest.raises(SceneFileError, match=said):
            load_scene_text(f"{start}{{{pose}}}}}").apply(SceneGraph())


def test_light_from_all_around_is_refused_by_name(tmp_path):
    """No file is left behind; without the renderer the scene is saved."""
    sky = EnvironmentMap(np.full((4, 8, 3), 0.5))
    scene_graph = SceneGraph()
    scene_graph.add_renderer("dusk", TracedRenderEngine(environment_map=sky))
    path = tmp_path / "scene.yaml"
    with pytest.raises(SceneSaveError, match="renderer 'dusk' has an environment_map"):
        save_scene(scene_graph, path)
    assert not list(tmp_path.iterdir())
    scene_graph.remove_renderer("dusk")
    save_scene(scene_graph, path)
    assert path.exists()

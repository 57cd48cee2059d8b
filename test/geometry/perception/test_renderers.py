"""Renderers by name, at any time; labels, colours and who draws what."""

from camera_scenes import color_camera, depth_camera, instance, pose, scene_of, WORLD
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Convex,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    Rgba,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    EngineError,
    InvalidPoseError,
    MeshError,
    NameConflictError,
    PropertyError,
    QueryArgumentError,
    UnknownIdError,
)
from scene_graph_ros.geometry.perception import ExactRenderEngine, RenderLabel

AHEAD = pose(p=(0.0, 0.0, 1.0))


def test_names_of_renderers():
    """Renderers are added, listed, described and removed by name."""
    graph = SceneGraph()
    assert graph.renderer_count() == 0
    graph.add_renderer("exact", ExactRenderEngine())
    graph.add_renderer("red", ExactRenderEngine(default_diffuse=Rgba(1.0, 0.0, 0.0)))
    assert graph.registered_renderer_names() == ["exact", "red"]
    assert graph.has_renderer("red")
    assert not graph.has_renderer("blue")
    assert not graph.has_renderer([])
    assert graph.renderer_type_name("red") == "ExactRenderEngine"
    assert graph.renderer_parameter_yaml("red") == (
        "ExactRenderEngine:\n"
        "  default_diffuse: [1.0, 0.0, 0.0, 1.0]\n"
        f"  default_clear_color: [{204 / 255}, {229 / 255}, 1.0, 1.0]\n"
    )
    with pytest.raises(NameConflictError, match="'red' already"):
        graph.add_renderer("red", ExactRenderEngine())
    graph.remove_renderer("red")
    assert graph.renderer_count() == 1
    for ask in (graph.remove_renderer, graph.renderer_type_name, graph.renderer_parameter_yaml):
        with pytest.raises(EngineError, match=r"no renderer named 'red'; renderers: \['exact'\]"):
            ask("red")


@pytest.mark.parametrize("thing", [None, "exact", 3, ExactRenderEngine])
def test_only_renderers_are_renderers(thing):
    """What has no ``render``, or is a class, is refused and quoted."""
    with pytest.raises(EngineError, match="'exact' must be a RenderEngine such as"):
        SceneGraph().add_renderer("exact", thing)


@pytest.mark.parametrize("name", ["", "  ", 7, "a\nb"])
def test_a_renderer_has_a_name(name):
    """The rule is that of all names."""
    with pytest.raises(NameConflictError, match="name of a renderer"):
        SceneGraph().add_renderer(name, ExactRenderEngine())


def test_contexts_have_renderers_of_their_own():
    """With a context, its model changes and no other."""
    graph = SceneGraph()
    context = graph.create_default_context()
    before = graph.query_object(context).bake()
    engine = ExactRenderEngine()
    graph.add_renderer("exact", engine, context=context)
    assert graph.renderer_count() == 0
    assert graph.renderer_count(context=context) == 1
    assert graph.query_object(context).get_render_engine_by_name("exact") is engine
    assert before.get_render_engine_by_name("exact") is None
    assert before.get_render_engine_by_name([]) is None


def test_it_makes_no_difference_when_a_renderer_is_added():
    """Before, between and after the geometry: the same bytes."""
    images = []
    for place in range(3):
        graph = SceneGraph()
        source = graph.register_source("s")
        for step in range(3):
            if step == place:
                graph.add_renderer("exact", ExactRenderEngine())
            if step < 2:
                ball = instance(Sphere(0.2), pose(p=(0.1 * step, 0.0, 1.0 + step)), f"b{step}")
                graph.register_anchored_geometry(source, ball)
        query = graph.query_object(graph.create_default_context())
        images.append(query.render_images(depth_camera(), WORLD, np.eye(4)))
    for other in images[1:]:
        for one, two in zip(images[0], other, strict=True):
            assert one.tobytes() == two.tobytes()


def test_labels_in_an_image():
    """Label images show the given number, DONT_CARE without one, EMPTY where nothing is."""
    left, right = pose(p=(-0.3, 0.0, 1.0)), pose(p=(0.3, 0.0, 1.0))
    query = scene_of(
        [instance(Sphere(0.1), left, "l", label=7), instance(Sphere(0.1), right, "r")]
    )
    label = query.render_label_image(color_camera(), WORLD, np.eye(4))
    assert label.dtype == np.int16
    assert set(np.unique(label)) == {7, RenderLabel.DONT_CARE, RenderLabel.EMPTY}
    assert set(label[:, :15].flat) == {7, RenderLabel.EMPTY}


def test_do_not_render_is_for_labels_only():
    """It is drawn in colour and depth; label images show what is behind it."""
    hidden = instance(Sphere(0.1), AHEAD, "glass", label=RenderLabel.DO_NOT_RENDER)
    query = scene_of([hidden, instance(Sphere(0.3), pose(p=(0.0, 0.0, 2.0)), "behind", label=1)])
    images = query.render_images(depth_camera(), WORLD, np.eye(4))
    assert set(np.unique(images.label)) == {1, RenderLabel.EMPTY}
    assert images.depth[15, 19] == pytest.approx(0.9, abs=1e-3)
    assert images.label[15, 19] == 1


def test_reserved_numbers():
    """The values are those of other systems' label images."""
    values = {"UNSPECIFIED": 32767, "EMPTY": 32766, "DO_NOT_RENDER": 32765, "DONT_CARE": 32764}
    for name, value in values.items():
        assert getattr(RenderLabel, name) == value
        assert getattr(RenderLabel, name).is_reserved()
        assert repr(RenderLabel(value)) == f"RenderLabel({name})"
    assert RenderLabel.MAX_FREE == 32763
    assert not RenderLabel(32763).is_reserved()
    assert repr(RenderLabel(np.int16(5))) == "RenderLabel(5)"


@pytest.mark.parametrize("value", [-1, 32768, 1.0, "one", None, True, 10**30])
def test_no_labels(value):
    """What is no whole number from 0 to 32763, nor reserved, is quoted."""
    with pytest.raises(PropertyError, match="render label"):
        RenderLabel(value)


@pytest.mark.parametrize(
    ("group", "name", "value", "reason"),
    [
        ("label", "id", 32766, "RenderLabel.EMPTY., which no geometry can have"),
        ("label", "id", RenderLabel.UNSPECIFIED, "UNSPECIFIED., which no geometry"),
        ("label", "id", 40000, "between 0 and 32763, not 40000"),
        ("label", "id", 1.5, "whole number, not 1.5"),
        ("phong", "diffuse", "red", "four numbers: 'red'"),
        ("phong", "diffuse", [2.0, 0.0, 0.0], "between 0 and 1, not 2.0"),
        ("phong", "diffuse_map", "/no/wood.png", "texture file '/no/wood.png' does not exist"),
        ("renderer", "accepting", "exact", "set of renderers' names, not 'exact'"),
        ("renderer", "accepting", {1}, "set of renderers' names, not {1}"),
    ],
)
def test_properties_are_checked_when_the_role_is_assigned(group, name, value, reason):
    """Both ways to the role name geometry, property and value, and change nothing."""
    properties = PerceptionProperties()
    properties.add_property(group, name, value)
    graph = SceneGraph()
    source = graph.register_source("s")
    ball = GeometryInstance(np.eye(4), Sphere(1.0), "ball")
    ball.set_perception_properties(properties)
    with pytest.raises(PropertyError, match=f"'ball': .*{reason}"):
        graph.register_anchored_geometry(source, ball)
    assert graph.model_inspector().num_geometries() == 0
    bare = graph.register_anchored_geometry(
        source, GeometryInstance(np.eye(4), Sphere(1.0), "ball")
    )
    with pytest.raises(PropertyError, match=f"'ball': .*{reason}"):
        graph.assign_role(source, bare, properties)


def test_meshes_are_read_when_the_role_is_assigned(tmp_path):
    """A file that is no mesh is refused then, and no image fails later."""
    path = tmp_path / "broken.obj"
    path.write_text("v 0 0 nonsense\n")
    for shape in (Mesh(path), Convex(path)):
        graph = SceneGraph()
        source = graph.register_source("s")
        with pytest.raises(MeshError, match=r"broken\.obj"):
            graph.register_anchored_geometry(source, instance(shape, np.eye(4), "broken"))
        part = graph.register_anchored_geometry(source, GeometryInstance(np.eye(4), shape, "part"))
        with pytest.raises(MeshError, match=r"broken\.obj"):
            graph.assign_role(source, part, PerceptionProperties())
        ball = graph.register_anchored_geometry(source, instance(Sphere(1.0), np.eye(4), "ball"))
        with pytest.raises(MeshError, match=r"broken\.obj"):
            graph.change_shape(source, ball, shape)


def test_geometry_chooses_its_renderers():
    """Only those named draw it; an empty set means all."""
    one, two = ({"renderer": ("accepting", names)} for names in ({"a"}, set()))
    balls = [
        instance(Sphere(0.1), pose(p=(0.3 * k - 0.6, 0, 1)), f"{k}", label=k, **chosen)
        for k, chosen in enumerate((one, two, {}), start=1)
    ]
    graph = SceneGraph()
    source = graph.register_source("s")
    for name in ("a", "b"):
        graph.add_renderer(name, ExactRenderEngine())
    for ball in balls:
        graph.register_anchored_geometry(source, ball)
    query = graph.query_object(graph.create_default_context())
    shown = {
        name: set(
            np.unique(query.render_label_image(color_camera(renderer=name), WORLD, np.eye(4)))
        )
        for name in ("a", "b")
    }
    assert shown["a"] - shown["b"] == {1}
    assert shown["b"] == {2, 3, RenderLabel.EMPTY}


def test_images_follow_roles_and_poses():
    """What is seen changes with poses, roles, shapes and labels; a baked query stays."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("s")
    frame = graph.register_frame(source, GeometryFrame("f"))
    ball = graph.register_geometry(source, frame, instance(Sphere(0.1), np.eye(4), "b", label=4))
    context = graph.create_default_context()
    query = graph.query_object(context)
    camera, X = depth_camera(), np.eye(4)

    def middle(query):
        images = query.render_images(camera, WORLD, X)
        return float(images.depth[15, 19]), int(images.label[15, 19])

    context.set_frame_poses(source, {frame: AHEAD})
    first = query.bake()
    depth, label = middle(query)
    assert (depth, label) == (pytest.approx(0.9, abs=1e-3), 4)
    context.set_frame_poses(source, {frame: pose(p=(0.0, 0.0, 2.0))})
    assert middle(query)[0] == pytest.approx(depth + 1.0, abs=2e-3)
    graph.change_shape(source, ball, Sphere(0.5), context=context)
    assert middle(query)[0] == pytest.approx(1.5, abs=1e-2)
    graph.remove_role(source, ball, Role.PERCEPTION, context=context)
    assert middle(query) == (np.inf, RenderLabel.EMPTY)
    assert middle(first) == (depth, label)


def test_a_camera_on_a_moving_frame():
    """The sensor is at X_WP X_PC X_BS: a camera that follows a ball sees it standing still."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("s")
    frame = graph.register_frame(source, GeometryFrame("f"))
    ball = instance(Sphere(0.1), pose(p=(0.0, 0.0, 1.0)), "ball", label=1)
    graph.register_geometry(source, frame, ball)
    context = graph.create_default_context()
    query = graph.query_object(context)
    back, forth = pose(p=(0.0, 0.25, -0.5)), pose(p=(0.0, -0.25, 0.5))
    expected = query.render_depth_image(depth_camera(), WORLD, np.eye(4))
    for X_WF in (np.eye(4), pose(5, (1.0, 2.0, 3.0))):
        context.set_frame_poses(source, {frame: X_WF})
        image = query.render_depth_image(depth_camera(X_BS=forth), frame, back)
        assert (np.isfinite(image) == np.isfinite(expected)).all()
        np.testing.assert_allclose(image, expected, rtol=1e-6)


def test_colours():
    """A wall square to the axis has its own colour, the rest the renderer's: levels to nearest."""
    wall = instance(Box(0.2, 0.2, 0.2), AHEAD, "wall", phong=("diffuse", Rgba(0.5, 0.25, 1.0)))
    plain = instance(Box(0.2, 0.2, 0.2), pose(p=(0.4, 0.0, 1.0)), "plain")
    query = scene_of([wall, plain])
    image = query.render_color_image(color_camera(), WORLD, np.eye(4))
    assert image.dtype == np.uint8
    assert image.shape == (30, 40, 4)
    found = {tuple(int(c) for c in pixel) for pixel in image.reshape(-1, 4)}
    # 127.5 and 63.75 to nearest, half up; the default 0.9, 0.7, 0.2; the clear colour.
    assert {(128, 64, 255, 255), (230, 179, 51, 255), (204, 229, 255, 255)} <= found


def test_light_falls_off_with_the_angle():
    """A wall turned by 60 degrees about y is half as bright."""
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = Rotation.from_euler("y", 120, degrees=True).as_matrix()
    floor = instance(HalfSpace(), X, "wall", phong=("diffuse", Rgba(0.8, 0.4, 0.21)))
    image = scene_of([floor]).render_color_image(color_camera(), WORLD, np.eye(4))
    assert image[15, 19].tolist() == [102, 51, 27, 255]  # 255 * 0.21 / 2 is 26.8


def test_what_is_asked_is_checked():
    """Cameras of the wrong kind, unknown renderers, frames, poses and kinds are named."""
    query = scene_of([])
    X = np.eye(4)
    with pytest.raises(QueryArgumentError, match="render_depth_image: camera must be a Depth"):
        query.render_depth_image(color_camera(), WORLD, X)
    for ask in (query.render_color_image, query.render_label_image):
        with pytest.raises(QueryArgumentError, match="must be a ColorRenderCamera"):
            ask(depth_camera(), WORLD, X)
    with pytest.raises(QueryArgumentError, match=r"ColorRenderCamera or a Depth.*None"):
        query.render_images(None, WORLD, X)
    with pytest.raises(EngineError, match=r"no renderer named 'vtk'; renderers: \['exact'\]"):
        query.render_color_image(color_camera(renderer="vtk"), WORLD, X)
    with pytest.raises(UnknownIdError, match="no frame is registered"):
        query.render_color_image(color_camera(), "world", X)
    with pytest.raises(InvalidPoseError, match="X_PC of the camera"):
        query.render_color_image(color_camera(), WORLD, np.zeros((4, 4)))
    for kinds in ("depth", [], ["infrared"], 3):
        with pytest.raises(QueryArgumentError, match="kinds must be some of 'color'"):
            query.render_images(depth_camera(), WORLD, X, kinds=kinds)
    with pytest.raises(QueryArgumentError, match="needs a DepthRenderCamera"):
        query.render_images(color_camera(), WORLD, X, kinds=["depth"])


def test_kinds():
    """Images come for the kinds that were asked for, and None for the others."""
    query = scene_of([])
    images = query.render_images(color_camera(), WORLD, np.eye(4))
    assert images.depth is None
    assert images.color is not None
    assert images.label is not None
    images = query.render_images(depth_camera(), WORLD, np.eye(4), kinds=["depth"])
    assert images.color is None
    assert images.label is None
    assert np.isinf(images.depth).all()


def test_the_depth_range_is_narrower_than_the_clipping():
    """Nearer is 0 and farther inf, and the label stays: it was seen."""
    query = scene_of([instance(Sphere(0.1), pose(p=(0, 0, z)), f"b{z}", label=z) for z in (1, 4)])
    camera = depth_camera(depth_range=(2.0, 3.0))
    near = query.render_images(camera, WORLD, np.eye(4))
    assert set(np.unique(near.depth[near.label == 1])) == {0.0}
    beyond = query.render_images(depth_camera(depth_range=(0.5, 0.6)), WORLD, np.eye(4))
    assert np.isinf(beyond.depth[beyond.label == 1]).all()

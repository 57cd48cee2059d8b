"""Light from all around: its directions, how bright it makes a surface, and what is refused."""

from camera_scenes import depth_camera, instance, pose, WORLD
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Rgba, SceneGraph
from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    EnvironmentMap,
    TracedRenderEngine,
)

LENS = CameraIntrinsics(16, 16, 30.0, 30.0, 7.5, 7.5)
AXES = {"+x": (1, 0, 0), "-y": (0, -1, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0)}
SIDES = dict(zip(AXES, ([0.0, 1.0, 1.0], [1, 0, 1], [1, 1, 0], [0.2, 0.5, 0.1]), strict=True))
POLES = {(0, 0, 1): [0.9, 0.3, 0.6], (0, 0, -1): [0.1, 0.7, 0.2]}


def around():
    """Return a map with one colour for the quarter turn about each axis, and for both poles."""
    texture = np.empty((64, 128, 3))
    for quarter, color in enumerate(SIDES.values()):
        texture[:, (np.arange(32) + 32 * quarter - 16) % 128] = color
    texture[:16], texture[-16:] = POLES.values()
    return texture


def levels(light):
    """Return levels, 0 to 255, of linear light: the curve of IEC 61966-2-1."""
    light = np.asarray(light, float)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def image(ahead, bodies=(), **parameters):
    """Return the colours that a camera at the origin sees along an axis."""
    graph = SceneGraph()
    told = {"lights": (), "samples": 64, "max_depth": 2} | parameters
    graph.add_renderer("traced", TracedRenderEngine(**told))
    source = graph.register_source("scene")
    for each in bodies:
        graph.register_anchored_geometry(source, each)
    z = np.array(ahead, float)
    x = np.cross(z, [0.0, 0.0, 1.0] if z[2] == 0.0 else [0.0, 1.0, 0.0])
    X = np.eye(4)
    X[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    camera = depth_camera(LENS, ClippingRange(0.01, 50.0), renderer="traced")
    query = graph.query_object(graph.create_default_context())
    return query.render_images(camera, WORLD, X).color[..., :3].astype(float)


def test_cameras_see_each_side_where_it_is():
    """Along the axes of W, whichever way they look."""
    sky = EnvironmentMap(around())
    for ahead, color in [*((AXES[side], SIDES[side]) for side in AXES), *POLES.items()]:
        seen = image(ahead, environment_map=sky)[5:11, 5:11]
        np.testing.assert_allclose(seen, np.broadcast_to(levels(color), seen.shape), atol=1.0)


def test_columns_run_to_the_right():
    """Between +x and -y, as one looks around; and rows run down."""
    seen = image((1, -1, 0) / np.sqrt(2.0), environment_map=EnvironmentMap(around()))
    np.testing.assert_allclose(seen[8, 1], levels(SIDES["+x"]), atol=1.0)
    np.testing.assert_allclose(seen[8, 14], levels(SIDES["-y"]), atol=1.0)


def wall(color):
    """Return a wall that faces the camera along x."""
    box = Box(0.1, 6.0, 6.0)
    return instance(box, pose(p=(2.0, 0.0, 0.0)), "wall", phong=("diffuse", Rgba(*color)))


def test_light_of_one_from_all_sides_lights_to_full():
    """As much as ``ambient``, whose place it takes; of half of the sky half of that."""
    even = EnvironmentMap(np.full((8, 16, 3), 1.0))
    seen = image((1, 0, 0), [wall((0.5, 1.0, 0.25))], environment_map=even, ambient=9.0)
    np.testing.assert_allclose(seen[8, 8], 255.0 * np.array([0.5, 1.0, 0.25]), atol=2.0)
    above = np.zeros((64, 16, 3))
    above[:32] = 1.0
    seen = image((1, 0, 0), [wall((1, 1, 1))], environment_map=EnvironmentMap(above))
    np.testing.assert_allclose(seen.mean(axis=(0, 1)), levels(0.5), atol=4.0)


def test_without_a_skybox_it_is_light_alone():
    """Behind bodies is the clear colour."""
    dark = EnvironmentMap(np.full((8, 16, 3), 0.5), skybox=False)
    clear = Rgba(1.0, 0.0, 0.0)
    seen = image((-1, 0, 0), [wall((1, 1, 1))], environment_map=dark, default_clear_color=clear)
    np.testing.assert_array_equal(seen, np.broadcast_to([255.0, 0.0, 0.0], seen.shape))
    seen = image((1, 0, 0), [wall((1, 1, 1))], environment_map=dark)
    np.testing.assert_allclose(seen[8, 8], levels(0.5), atol=2.0)


@pytest.mark.parametrize(
    "texture", [np.zeros((4, 4)), np.zeros((1, 4, 3)), np.full((4, 4, 3), -1.0), "sky.hdr", None]
)
def test_what_is_no_map_is_refused(texture):
    """By what it is."""
    with pytest.raises(EngineError, match="EnvironmentMap: texture must be finite numbers"):
        EnvironmentMap(texture)


def test_other_arguments_are_refused():
    """And a map says in the parameters how large it is."""
    with pytest.raises(EngineError, match="texture must be finite"):
        EnvironmentMap(np.full((4, 4, 3), np.nan))
    with pytest.raises(EngineError, match="skybox must be True or False, not 1"):
        EnvironmentMap(np.zeros((4, 4, 3)), 1)
    with pytest.raises(EngineError, match="environment_map must be an EnvironmentMap or None"):
        TracedRenderEngine(environment_map=np.zeros((4, 4, 3)))
    engine = TracedRenderEngine(environment_map=EnvironmentMap(np.zeros((4, 8, 3))))
    assert '"size": [8, 4]' in engine.parameter_yaml()

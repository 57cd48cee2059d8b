"""Light and shadows: colours as light adds up, shadows where closed forms have them."""

import subprocess
import sys

from camera_scenes import depth_camera, instance, pose, random_shapes, WORLD
import numpy as np
from PIL import Image
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import EngineError, PropertyError
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ExactRenderEngine,
    LightParameter,
    TracedRenderEngine,
)

LENS = CameraIntrinsics(48, 36, 40.0, 40.0, 20.3, 19.1)
HEAD = LightParameter()  # along the camera's axis, as the light of exact
PLAIN = {"lights": (HEAD,), "ambient": 0.0, "samples": 4, "max_depth": 2}


def encoded(light):
    """Return levels, 0 to 255, of linear light: the curve of IEC 61966-2-1."""
    light = np.asarray(light, float)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def decoded(level):
    """Return linear light of a number from 0 to 1."""
    level = np.asarray(level, float)
    return np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)


def query_of(bodies, **engines):
    """Return queries of a scene with an exact renderer and traced ones of these parameters."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    for name, parameters in engines.items():
        graph.add_renderer(name, TracedRenderEngine(**parameters))
    source = graph.register_source("scene")
    for one in bodies:
        graph.register_anchored_geometry(source, one)
    return graph.query_object(graph.create_default_context())


def images(query, name, lens=LENS, X=None):
    """Return all images by a renderer."""
    camera = depth_camera(lens, ClippingRange(0.01, 50.0), renderer=name)
    return query.render_images(camera, WORLD, np.eye(4) if X is None else X)


def colored(shape, X, rgb, name):
    """Return an instance of a colour."""
    return instance(shape, X, name, phong=("diffuse", Rgba(*rgb)))


def test_depth_and_label_are_those_of_exact():
    """The same bytes."""
    query = query_of(random_shapes(12, seed=2), traced=PLAIN)
    exact, traced = images(query, "exact"), images(query, "traced")
    assert traced.depth.tobytes() == exact.depth.tobytes()
    assert traced.label.tobytes() == exact.label.tobytes()


@pytest.mark.parametrize("degrees", [0, 60])
def test_light_falls_off_with_the_angle_in_linear_light(degrees):
    """A wall turned by 60 degrees sends half the light back, which sRGB writes as a curve."""
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = Rotation.from_euler("y", 180 - degrees, degrees=True).as_matrix()
    rgb = np.array([0.8, 0.4, 0.2])
    image = images(query_of([colored(HalfSpace(), X, rgb, "wall")], traced=PLAIN), "traced").color
    expected = encoded(decoded(rgb) * np.cos(np.radians(degrees)))
    assert np.abs(image[19, 20, :3] - expected).max() <= 0.51
    assert (image[..., 3] == 255).all()


def test_pixels_are_those_of_exact():
    """Off-centre lens, pixels that are not square, all shapes: inside outlines, colours agree.

    Under the light of exact, whose shares are not linear: so squares that face the camera are
    compared, in their own colours, and where the sky is.
    """
    rng = np.random.default_rng(4)
    bodies = [
        colored(
            Box(0.12, 0.12, 0.02), pose(p=(*rng.uniform(-0.4, 0.4, 2), 1.0 + 0.1 * k)), c, f"{k}"
        )
        for k, c in enumerate(rng.uniform(0.1, 1.0, (12, 3)))
    ]
    query = query_of(bodies, traced=PLAIN)
    for lens in (LENS, CameraIntrinsics(48, 36, 40.0, 40.6, 20.3, 19.1)):
        exact = images(query, "exact", lens).color.astype(float)
        traced = images(query, "traced", lens).color.astype(float)
        # Inside: all neighbours, up to two pixels away, look the same to exact.
        around = [np.roll(exact, (a - 2, b - 2), (0, 1)) for a, b in np.ndindex(5, 5)]
        inside = np.all([(a == exact).all(axis=-1) for a in around], axis=0)
        inside[[0, 1, -2, -1]] = inside[:, [0, 1, -2, -1]] = False
        assert inside.sum() > 400
        assert np.abs(traced - exact)[inside].max() <= 1.0
        # Elsewhere a pixel is a mean of what its samples see.
        assert (np.abs(traced - exact).max(axis=-1) > 60).mean() < 0.05


def test_a_ball_throws_its_shadow_where_geometry_has_it():
    """A point of the floor is dark if its way to the light meets the ball, else it is lit."""
    floor = colored(HalfSpace(), np.eye(4), (1, 1, 1), "floor")
    ball = colored(Sphere(0.3), pose(p=(0.0, 0.0, 0.6)), (1, 0, 0), "ball")
    to_light = np.array([0.5, 0.3, 0.8])
    light = LightParameter(frame="world", direction=-to_light, intensity=0.8)
    query = query_of([floor, ball], traced={**PLAIN, "lights": (light,)})
    X = pose(p=(-0.4, -0.3, 3.0))
    X[:3, :3] = np.diag([1.0, -1.0, -1.0])
    traced = images(query, "traced", X=X)
    u, v = np.meshgrid(np.arange(LENS.width), np.arange(LENS.height))
    d = np.stack([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(u.shape)], -1)
    p = X[:3, 3] + traced.depth[..., None] * (d @ X[:3, :3].T)
    n = to_light / np.linalg.norm(to_light)
    off = np.array([0.0, 0.0, 0.6]) - p
    miss = np.linalg.norm(off - (off @ n)[..., None] * n, axis=-1)
    is_floor = np.abs(p[..., 2]) < 1e-5
    pixel = 3.0 / 40.0
    dark, bright = is_floor & (miss < 0.3 - pixel), is_floor & (miss > 0.3 + pixel)
    # Beside the ball's outline pixels show parts of it.
    seen = np.linalg.norm(np.cross(d @ X[:3, :3].T, X[:3, 3] - [0, 0, 0.6]), axis=-1)
    bright &= seen / np.linalg.norm(d, axis=-1) > 0.3 + pixel
    dark &= seen / np.linalg.norm(d, axis=-1) > 0.3 + pixel
    assert dark.sum() > 15
    assert bright.sum() > 500
    assert (traced.color[dark][:, :3] == 0).all()
    lit = encoded(0.8 * 0.8 / np.linalg.norm(to_light))
    assert np.abs(traced.color[bright][:, :3] - lit).max() <= 0.51


def test_light_comes_from_where_it_says():
    """A point light 0.5 m before a wall is four times one at 1 m; a spot ends at its cone."""
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = np.diag([1.0, -1.0, -1.0])
    wall = colored(HalfSpace(), X, (1, 1, 1), "wall")
    point = LightParameter("point", intensity=0.1, position=(0.0, 0.0, 0.5))
    spot = LightParameter("spot", intensity=0.5, cone_angle=0.2, color=Rgba(0.0, 1.0, 0.0))
    query = query_of(
        [wall],
        point={**PLAIN, "lights": (point,)},
        spot={**PLAIN, "lights": (spot,)},
        sky={**PLAIN, "lights": (), "ambient": 0.25, "samples": 4},
    )
    middle = images(query, "point").color[19, 20, :3]
    assert np.abs(middle - encoded(0.1 / 0.25)).max() <= 0.6  # half a pixel beside the axis
    image = images(query, "spot").color
    assert np.abs(image[19, 20, :3] - [0, encoded(0.5), 0]).max() <= 0.6
    assert (image[19, 31, :3] == 0).all()  # 10.7 / 40 is 0.26 radians
    # The sky's light comes from random places, on the average all of it.
    assert abs(decoded(images(query, "sky").color[..., :3] / 255).mean() - 0.25) < 0.005


def covered(shape, X, path):
    """Return an instance with a picture on it."""
    seen = PerceptionProperties()
    seen.add_property("phong", "diffuse_map", path)
    result = GeometryInstance(X, shape, "body")
    result.set_perception_properties(seen)
    return result


SQUARE = "v -.3 -.3 0\nv .3 -.3 0\nv .3 .3 0\nv -.3 .3 0\nvt 0 0\nvt 2 0\nvt 2 1\nvt 0 1\n"


@pytest.mark.parametrize(
    "shape",
    [
        Sphere(0.35),
        Ellipsoid(0.4, 0.35, 0.3),
        Capsule(0.25, 0.3),
        Cylinder(0.3, 0.5),
        Box(0.4, 0.5, 0.45),
        HalfSpace(),
        None,
    ],
    ids=lambda shape: "mesh" if shape is None else shape.type_name,
)
def test_pictures_are_where_exact_has_them(tmp_path, shape):
    """Fields of four colours, as hues: what light does to all channels alike is divided out."""
    texels = np.zeros((32, 32, 3), np.uint8)
    texels[:16, :16], texels[:16, 16:] = (255, 40, 40), (40, 255, 40)
    texels[16:, :16], texels[16:, 16:] = (40, 40, 255), (255, 255, 40)
    Image.fromarray(texels).save(tmp_path / "fields.png")
    if shape is None:
        (tmp_path / "square.obj").write_text(SQUARE + "f 1/1 2/2 3/3 4/4\n")
        shape = Mesh(tmp_path / "square.obj")
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = Rotation.from_euler("xyz", (130.0, 20.0, 40.0), degrees=True).as_matrix()
    sky = {**PLAIN, "lights": (), "ambient": 1.0}  # the same light everywhere
    query = query_of([covered(shape, X, tmp_path / "fields.png")], traced=sky)
    exact, traced = (
        images(query, name).color[..., :3].astype(float) for name in ("exact", "traced")
    )
    seen = np.isfinite(images(query, "exact").depth) & (images(query, "exact").depth < 5.0)
    hues = [image > 0.6 * image.max(axis=-1, keepdims=True) for image in (exact, traced)]
    same = (hues[0] == hues[1]).all(axis=-1)
    assert seen.sum() > 150
    assert len(np.unique(hues[0][seen], axis=0)) >= 4
    # Where fields meet, and at outlines, a pixel has several samples, and exact one.
    assert same[seen].mean() > 0.8


def test_the_same_seed_gives_the_same_bytes():
    """Another seed does not; bodies may be registered in another order."""
    bodies = random_shapes(8, seed=5)
    soft = {"samples": 4, "seed": 7}
    query = query_of(bodies, a=soft, b={"samples": 4, "seed": 8})
    one, two, other = (images(query, name).color for name in ("a", "a", "b"))
    assert one.tobytes() == two.tobytes()
    assert one.tobytes() != other.tobytes()
    # Noise, not another picture.
    assert np.abs(one.astype(float) - other).mean() < 12.0


def test_what_is_transparent_is_seen_through():
    """A pane of alpha 0.25 before a wall: by chance at each path, so on the average."""
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = np.diag([1.0, -1.0, -1.0])
    pane = colored(HalfSpace(), X, (1.0, 0.0, 0.0, 0.25), "pane")
    gone = colored(Sphere(0.2), pose(p=(0, 0, 0.6)), (1.0, 1.0, 1.0, 0.0), "gone")
    back = pose(p=(0.0, 0.0, 2.0))
    back[:3, :3] = X[:3, :3]
    wall = colored(HalfSpace(), back, (0.0, 0.0, 1.0), "wall")
    sky = {**PLAIN, "lights": (), "ambient": 0.5, "samples": 16}
    light = decoded(images(query_of([pane, gone, wall], traced=sky), "traced").color / 255.0)
    red, _, blue, _ = light.mean(axis=(0, 1))
    # The sky lights the pane; through 3/4 of it the wall, which is seen through 3/4 of it.
    assert abs(red - 0.25 * 0.5) < 0.02
    assert abs(blue - 0.75 * 0.75 * 0.5) < 0.04


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"samples": 0}, "samples must be a whole number from 1 to 65536, not 0"),
        ({"samples": 2.5}, "samples must be a whole number"),
        ({"max_depth": 1}, "max_depth must be a whole number from 2"),
        ({"seed": -1}, "seed must be a whole number from 0"),
        ({"ambient": float("nan")}, "ambient must be a number from 0"),
        ({"lights": "sun"}, "lights must be at most 64 LightParameter, not 'sun'"),
        ({"lights": (1,)}, "lights must be at most 64 LightParameter"),
    ],
)
def test_parameters_are_checked(fields, words):
    """By name and value."""
    with pytest.raises(EngineError, match=f"TracedRenderEngine: {words}"):
        TracedRenderEngine(**fields)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"type": "sun"}, "type must be one of directional, point, spot, not 'sun'"),
        ({"frame": "hand"}, "frame must be one of world, camera, not 'hand'"),
        ({"intensity": -1}, "intensity must be a number from 0"),
        ({"direction": (0, 0, 0)}, "direction must be three numbers, not all 0"),
        ({"position": (0, float("inf"), 0)}, "position must be three numbers"),
        ({"position": 3}, "position must be three numbers of at most 1e.09, not 3"),
        ({"cone_angle": 2.0}, "cone_angle must be a number from 0.001 to 1.5708, not 2.0"),
    ],
)
def test_lights_are_checked(fields, words):
    """By name and value."""
    with pytest.raises(EngineError, match=f"LightParameter: {words}"):
        LightParameter(**fields)
    with pytest.raises(PropertyError, match="not three or four numbers"):
        LightParameter(color="red")


def test_parameters_are_told_as_yaml():
    """All of them, in a form that YAML reads."""
    yaml = pytest.importorskip("yaml")
    told = yaml.safe_load(TracedRenderEngine(samples=9, lights=(HEAD,)).parameter_yaml())
    parameters = told["TracedRenderEngine"]
    assert (parameters["samples"], parameters["seed"], parameters["ambient"]) == (9, 0, 0.2)
    assert parameters["lights"][0]["direction"] == [0.0, 0.0, 1.0]


def test_without_mitsuba_the_remedy_is_named():
    """Nothing of it is imported before an image is traced, and its absence is an error by name."""
    code = (
        "import sys; sys.modules['mitsuba'] = None\n"
        "import importlib.util; importlib.util.find_spec = lambda name: None\n"
        "from scene_graph_ros.geometry.perception import TracedRenderEngine\n"
        "try: TracedRenderEngine()\n"
        "except ValueError as error: print(error)"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "mitsuba, which is not installed: pip install mitsuba==3.9.1" in done.stdout

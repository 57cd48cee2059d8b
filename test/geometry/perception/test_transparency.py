"""Bodies that are seen through: in colour images alone, one layer each, from near to far."""

from concurrent.futures import ThreadPoolExecutor
import itertools

from camera_scenes import (
    color_camera,
    depth_camera,
    instance,
    pose,
    random_shapes,
    scene_of,
    seen,
    SHAPES,
    WORLD,
)
import numpy as np
from PIL import Image
import pytest

from scene_graph_ros.geometry import (
    Box,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ExactRenderEngine,
    RenderLabel,
)
from scene_graph_ros.geometry.perception.exact import color

LENS = CameraIntrinsics(40, 30, 35.0, 31.0, 18.7, 15.2)
SKY = np.array([204.0, 229.0, 255.0])
RED, GREEN, BLUE = (1.0, 0.2, 0.0), (0.1, 0.8, 0.3), (0.0, 0.25, 0.9)
MIDDLE = (15, 19)


def wall(z, rgb, alpha, name, size=0.4):
    """Return a wall square to the axis whose near side is at z: light falls on it fully."""
    body = Box(size, size, 0.1)
    return instance(body, pose(p=(0, 0, z + 0.05)), name, phong=("diffuse", Rgba(*rgb, alpha)))


def look(bodies, camera=None):
    """Return red, green and blue as floats."""
    image = scene_of(bodies).render_color_image(camera or color_camera(LENS), WORLD, np.eye(4))
    assert (image[..., 3] == 255).all()
    return image[..., :3].astype(float)


def over(*layers):
    """Return the colour of layers (rgb 0 to 1, alpha) from near to far, before the sky."""
    result, left = np.zeros(3), 1.0
    for rgb, alpha in layers:
        result, left = result + left * alpha * 255.0 * np.array(rgb), left * (1.0 - alpha)
    return result + left * SKY


def test_layers_are_mixed_from_near_to_far():
    """By their alphas, whatever their order of registration; the same bytes."""
    layers = [(1.0, RED, 0.5), (1.3, GREEN, 0.25), (1.6, BLUE, 0.75)]
    expected = over(*((rgb, alpha) for _, rgb, alpha in layers))
    images = set()
    for order in itertools.permutations(layers):
        image = look([wall(*layer, str(k)) for k, layer in enumerate(order)])
        assert np.abs(image[MIDDLE] - expected).max() <= 1.0
        images.add(image.tobytes())
    assert len(images) == 1


@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_depth_and_label_take_them_for_opaque(alpha):
    """The same bytes for any alpha, also for 0: then a body is not in colour images."""
    pane = instance(
        Sphere(0.2), pose(p=(0, 0, 1)), "pane", label=3, phong=("diffuse", Rgba(*RED, alpha))
    )
    back = wall(2.0, BLUE, 1.0, "back")
    images = scene_of([pane, back]).render_images(depth_camera(LENS), WORLD, np.eye(4))
    solid = instance(Sphere(0.2), pose(p=(0, 0, 1)), "pane", label=3)
    other = scene_of([solid, back]).render_images(depth_camera(LENS), WORLD, np.eye(4))
    assert images.depth.tobytes() == other.depth.tobytes()
    assert images.label.tobytes() == other.label.tobytes()
    assert images.label[MIDDLE] == 3
    assert RenderLabel.EMPTY in images.label
    if alpha == 0.0:
        assert (images.color[..., :3] == look([back])).all()


def test_what_is_behind_something_opaque_is_not_seen():
    """An opaque wall hides a pane; a pane hides a share of the wall."""
    hidden = look([wall(1.0, RED, 1.0, "a"), wall(1.5, GREEN, 0.5, "b")])
    assert np.abs(hidden[MIDDLE] - over((RED, 1.0))).max() <= 0.5
    shown = look([wall(1.5, RED, 1.0, "a"), wall(1.0, GREEN, 0.5, "b")])
    assert np.abs(shown[MIDDLE] - over((GREEN, 0.5), (RED, 1.0))).max() <= 1.0


def test_at_one_place_the_smaller_id_is_nearer():
    """Two panes with one near side; a pane on an opaque wall shows only if it is first."""
    pair = [wall(1.0, RED, 0.5, "a"), wall(1.0, GREEN, 0.5, "b")]
    assert np.abs(look(pair)[MIDDLE] - over((RED, 0.5), (GREEN, 0.5))).max() <= 1.0
    first = [wall(1.0, RED, 0.5, "a"), wall(1.0, GREEN, 1.0, "b")]
    assert np.abs(look(first)[MIDDLE] - over((RED, 0.5), (GREEN, 1.0))).max() <= 1.0
    last = [wall(1.0, GREEN, 1.0, "a"), wall(1.0, RED, 0.5, "b")]
    assert np.abs(look(last)[MIDDLE] - over((GREEN, 1.0))).max() <= 0.5


def test_a_body_is_one_layer_whatever_it_is_made_of():
    """A box and the mesh of its triangles look alike: its far side is not seen through it."""
    corners = np.array(list(itertools.product((-0.2, 0.2), repeat=3)))
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    X, glass = pose(3, (0.0, 0.0, 1.0)), ("diffuse", Rgba(*RED, 0.5))
    box = look([instance(Box(0.4, 0.4, 0.4), X, "box", phong=glass)])
    mesh = look([instance(Mesh(vertices=corners, faces=faces), X, "mesh", phong=glass)])
    assert (box != SKY).any(axis=-1).sum() > 100
    assert np.abs(box - mesh).max() <= 1.0


def test_all_shapes_in_random_places():
    """Each body alone gives its layer, by depth and opaque colour; sorted, they give the image."""
    rng = np.random.default_rng(8)
    shapes = [*SHAPES.values()] * 2
    places = [
        pose(k, np.add(rng.uniform(-0.1, 0.1, 3), (0, 0, 0.6 + 0.05 * k))) for k in range(16)
    ]
    places[5][:3, 3], places[13][:3, 3] = (0.0, 0.0, 1.0), (0.0, 0.1, 1.2)
    colors, alphas = rng.uniform(0.2, 1.0, (16, 3)), rng.choice([0.2, 0.5, 0.8, 1.0], 16)

    def body(k, alpha):
        look = ("diffuse", Rgba(*colors[k], alpha))
        return instance(shapes[k], places[k], f"{k}", phong=look)

    layers = []
    for k in range(16):
        alone = [body(k, 1.0)]
        depth, _ = seen(scene_of(alone), lens=LENS)
        layers.append((depth, look(alone)))
    depth, own = np.array([d for d, _ in layers]), np.array([c for _, c in layers])
    order = np.argsort(depth, axis=0, kind="stable")
    left, expected = np.ones(depth.shape[1:]), np.zeros((*depth.shape[1:], 3))
    for nth in order:
        picked = np.take_along_axis(depth, nth[None], axis=0)[0]
        share = np.where(np.isfinite(picked), alphas[nth], 0.0) * left
        expected += share[..., None] * np.take_along_axis(own, nth[None, ..., None], axis=0)[0]
        left -= share
    expected += left[..., None] * SKY
    image = look([body(k, alphas[k]) for k in range(16)])
    # Half a level of each layer's own image, and half of the sum.
    assert np.abs(image - expected).max() <= 1.5
    assert (np.isfinite(depth).sum(axis=0) > 2).mean() > 0.15


def test_bands_of_rows_make_no_difference(monkeypatch):
    """An image with many layers is made in parts, with the same bytes."""
    bodies = [
        instance(one.shape(), one.pose(), one.name(), phong=("diffuse", Rgba(0.9, 0.5, 0.1, 0.3)))
        for one in random_shapes(20, seed=4, ahead=0.8)
    ]
    whole = look(bodies)
    monkeypatch.setattr(color, "_MOST_LAYERS", 200)
    assert look(bodies).tobytes() == whole.tobytes()
    assert len(np.unique(whole[..., 1])) > 50


def test_other_pixels_keep_their_bytes():
    """A pane changes no pixel that does not see it."""
    bodies = random_shapes(12, seed=6)
    pane = wall(0.5, RED, 0.5, "pane", size=0.1)
    without, image = look(bodies), look([*bodies, pane])
    _, rows = seen(scene_of([pane]), lens=LENS)
    assert (rows >= 0).any()
    assert (image == without)[rows < 0].all()
    assert (image != without)[rows >= 0].any()


def test_a_picture_may_have_holes(tmp_path):
    """Alpha of its texels multiplies that of the body: half of it is open, the rest shows half."""
    texels = np.full((16, 16, 4), 255, np.uint8)
    texels[:, 8:, 3] = 0
    Image.fromarray(texels).save(tmp_path / "holes.png")
    properties = PerceptionProperties()
    properties.add_property("phong", "diffuse_map", tmp_path / "holes.png")
    properties.add_property("phong", "diffuse", Rgba(*RED, 0.5))
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = np.diag([1.0, -1.0, -1.0])  # z towards the camera, x to the right
    pane = GeometryInstance(X, HalfSpace(), "pane")
    pane.set_perception_properties(properties)
    image = look([pane])
    # The picture covers a square metre from x = 0 on: at z = 1, pixels 18.7 to 53.7.
    assert np.abs(image[14, 21:35] - over((RED, 0.5))).max() <= 1.0
    assert (image[14, 39:] == SKY).all()


def test_the_default_colour_may_be_transparent():
    """That of a renderer, for bodies without a colour; and a camera inside sees the far side."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine(default_diffuse=Rgba(*GREEN, 0.5)))
    source = graph.register_source("s")
    graph.register_anchored_geometry(source, instance(Sphere(0.5), np.eye(4), "around"))
    query = graph.query_object(graph.create_default_context())
    image = query.render_color_image(color_camera(LENS), WORLD, np.eye(4))
    assert np.abs(image[MIDDLE][:3] - over((GREEN, 0.5))).max() <= 1.0


def test_many_threads_of_one_scene_agree():
    """Eight cameras at a time: the same bytes as one after the other."""
    bodies = [
        instance(one.shape(), one.pose(), one.name(), phong=("diffuse", Rgba(0.9, 0.5, 0.1, 0.5)))
        for one in random_shapes(10, seed=9)
    ]
    query = scene_of(bodies)
    camera = color_camera(LENS, ClippingRange(0.01, 10.0))

    def shoot(k):
        return query.render_color_image(camera, WORLD, pose(p=(0.01 * k, 0.0, 0.0))).tobytes()

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(shoot, range(16))) == [shoot(k) for k in range(16)]

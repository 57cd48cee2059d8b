"""Meshes in colour images have the colours of their files, exactly, unless they are given one."""

from camera_scenes import depth_camera, instance, pose, scene_of, WORLD
import numpy as np
import pytest

from scene_graph_ros.geometry import Mesh, Rgba
from scene_graph_ros.geometry.perception import CameraIntrinsics, ImageKind

LENS = CameraIntrinsics(8, 8, 8.0, 8.0, 3.5, 3.5)
DEFAULT = (0.9, 0.7, 0.2)
# Four upright stripes across the view at z = 1, facing the camera: two pixels wide each.
STRIPES = """mtllib stripes.mtl
v -0.5 -0.5 0
v -0.25 -0.5 0
v 0 -0.5 0
v 0.25 -0.5 0
v 0.5 -0.5 0
v -0.5 0.5 0
v -0.25 0.5 0
v 0 0.5 0
v 0.25 0.5 0
v 0.5 0.5 0
usemtl a
f 1 2 7 6
usemtl b
f 2 3 8 7
usemtl unknown
f 3 4 9 8
usemtl a
f 4 5 10 9
"""
MTL = "newmtl a\nKd 0.8 0.4 0.2\nnewmtl b\nKd 0.1 0.6 1\n"
A, B = (0.8, 0.4, 0.2), (0.1, 0.6, 1.0)

pytestmark = pytest.mark.filterwarnings(
    "ignore::scene_graph_ros.geometry.meshes.color_warnings.MeshColorWarning"
)


@pytest.fixture
def mesh(tmp_path):
    """Stripes of two materials, and one of a material that its file does not have."""
    (tmp_path / "stripes.obj").write_text(STRIPES)
    (tmp_path / "stripes.mtl").write_text(MTL)
    return Mesh(tmp_path / "stripes.obj")


def levels(*colors):
    """Return a row of the image: each colour on two pixels, rounded to nearest, opaque."""
    rows = [[int(255.0 * share + 0.5) for share in color] + [255] for color in colors]
    return np.repeat(np.array(rows, np.uint8), 2, axis=0)


def look(*bodies, X=None):
    """Return the colour image, of all kinds in one pass."""
    query = scene_of(bodies)
    images = query.render_images(depth_camera(LENS), WORLD, np.eye(4) if X is None else X)
    (alone,) = (
        i
        for i in query.render_images(
            depth_camera(LENS), WORLD, np.eye(4) if X is None else X, kinds=[ImageKind.COLOR]
        )
        if i is not None
    )
    np.testing.assert_array_equal(alone, images.color)
    return images.color


AHEAD = pose(p=(0.0, 0.0, 1.0))


def test_stripes(mesh):
    """Each pixel has its triangle's colour; what the file has no colour for, the default one."""
    image = look(instance(mesh, AHEAD, "stripes"))
    for row in image:
        np.testing.assert_array_equal(row, levels(A, B, DEFAULT, A))


def test_light_falls_on_them_as_on_all(mesh):
    """Turned by 60 degrees about the middle line, half of it: cos 60 = 1/2."""
    turned = pose(p=(0.0, 0.0, 1.0))
    turned[:3, :3] = [[0.5, 0.0, 3**0.5 / 2], [0.0, 1.0, 0.0], [-(3**0.5) / 2, 0.0, 0.5]]
    image = look(instance(mesh, turned, "stripes"))
    # The pixels beside the middle see b and the stripe without a colour.
    expected = levels(*(np.array(c) / 2 for c in (B, DEFAULT)))[[0, 2]]
    np.testing.assert_array_equal(image[3, 3:5], expected)


def test_a_colour_that_is_given_counts_more(mesh):
    """The property ("phong", "diffuse") is of the whole body."""
    blue = Rgba(0.0, 0.0, 1.0)
    image = look(instance(mesh, AHEAD, "stripes", phong=("diffuse", blue)))
    np.testing.assert_array_equal(image, np.broadcast_to([0, 0, 255, 255], (8, 8, 4)))


def test_bodies_of_one_file_may_differ(mesh):
    """One has a colour of its own, another the file's, a third is something else: side by side."""
    given = instance(mesh, pose(p=(0.0, 0.5, 1.0)), "given", phong=("diffuse", Rgba(0, 1, 0)))
    plain = instance(mesh, pose(p=(0.0, -0.5, 1.0)), "plain")
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) * 0.01
    other = instance(Mesh(vertices=vertices, faces=[[0, 1, 2]]), pose(p=(0, 0, 3)), "hidden")
    image = look(other, given, plain)
    np.testing.assert_array_equal(image[0], levels(A, B, DEFAULT, A))
    np.testing.assert_array_equal(image[-1], np.broadcast_to([0, 255, 0, 255], (8, 4)))


def test_a_mirrored_mesh_has_its_colours_mirrored(mesh):
    """From left to right."""
    image = look(instance(mesh.with_scale((-1.0, 1.0, 1.0)), AHEAD, "stripes"))
    np.testing.assert_array_equal(image[0], levels(A, DEFAULT, B, A))

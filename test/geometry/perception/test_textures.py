"""Pictures on surfaces: each pixel has the colour that the picture has at the point it sees."""

import base64
import itertools
import json
import re

from camera_scenes import color_camera, depth_camera, instance, pose, rays, scene_of, seen, WORLD
import numpy as np
from pictured_files import huge_png
from PIL import Image
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    Rgba,
    RoleAssign,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.meshes import textures
from scene_graph_ros.geometry.perception import CameraIntrinsics, ClippingRange

LENS = CameraIntrinsics(80, 60, 70.0, 66.0, 38.3, 30.1)
CLIPPING = ClippingRange(0.01, 100.0)
N = 16
SQUARE = """v -0.5 -0.5 0
v 0.5 -0.5 0
v 0.5 0.5 0
v -0.5 0.5 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
"""


def covered(shape, X, path, scale=None, diffuse=None, name="body"):
    """Return an instance with a picture on it."""
    seen = PerceptionProperties()
    seen.add_property("phong", "diffuse_map", path)
    if scale is not None:
        seen.add_property("phong", "diffuse_scale", scale)
    if diffuse is not None:
        seen.add_property("phong", "diffuse", diffuse)
    result = GeometryInstance(X, shape, name)
    result.set_perception_properties(seen)
    return result


@pytest.fixture
def ramp(tmp_path):
    """A picture of N x N texels: red grows by 10 a texel to the right, green by 10 upwards."""
    texels = np.zeros((N, N, 3), np.uint8)
    texels[..., 0] = 10 * np.arange(N)
    texels[..., 1] = 10 * np.arange(N)[::-1, None]
    texels[..., 2] = 200
    Image.fromarray(texels).save(tmp_path / "ramp.png")
    return tmp_path / "ramp.png"


def ramp_at(u, v):
    """Return the colour (..., 3) of the ramp, straight between the centres of its texels."""
    return np.stack([10 * (N * u - 0.5), 10 * (N * v - 0.5), np.full_like(u, 200.0)], axis=-1)


def inner(*coordinates):
    """Tell where no coordinate is within a texel of the picture's edge, where it repeats."""
    return np.all([(c > 1 / N) & (c < 1 - 1 / N) for c in coordinates], axis=0)


def tilted(angles, p):
    """Return a pose by angles in degrees about x, y, z."""
    X = pose(p=p)
    X[:3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    return X


def points_on_plane(X_WG):
    """Return x and y, in G, of where the rays of the pixels meet the plane z = 0 of G.

    Where the ray d meets it: n . (t d - p) = 0, so t = n . p / n . d.
    """
    R, p = X_WG[:3, :3], X_WG[:3, 3]
    d, n = rays(LENS), X_WG[:3, 2]
    t = (n @ p) / (d @ n)
    p_GQ = (t[..., None] * d - p) @ R
    return p_GQ[..., 0], p_GQ[..., 1], t, abs(n[2])


def image_of(*bodies, X=None):
    """Return the colour image, as floats, and what is seen."""
    query = scene_of(bodies)
    image = query.render_color_image(color_camera(LENS, CLIPPING), WORLD, np.eye(4))
    _, rows = seen(query, lens=LENS, clipping=CLIPPING)
    assert (image[..., 3] == 255).all()
    return image[..., :3].astype(float), rows


OBLIQUE = tilted((150.0, 20.0, 35.0), (0.05, -0.03, 1.1))


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (-1.0, 0.7, 1.0)])
def test_perspective_is_exact(tmp_path, ramp, scale):
    """On a square seen obliquely, a ramp's colour follows from the ray and the plane alone."""
    (tmp_path / "square.obj").write_text(SQUARE)
    image, rows = image_of(covered(Mesh(tmp_path / "square.obj", scale), OBLIQUE, ramp))
    x, y, _, light = points_on_plane(OBLIQUE)
    u, v = x / scale[0] + 0.5, y / scale[1] + 0.5
    shown = (rows == 0) & inner(u, v)
    assert shown.sum() > 700
    assert np.abs(image - light * ramp_at(u, v))[shown].max() <= 0.5 + 1e-9


def test_a_checkerboard_on_a_plane(tmp_path):
    """A half space has one picture per square metre, or as many as its scale says, along x and y.

    Fields are 8 texels wide; pixels within a texel of an edge are mixed, and left out.
    """
    fields = np.add.outer(np.arange(16) // 8, np.arange(16) // 8) % 2
    Image.fromarray((255 * fields).astype(np.uint8)).save(tmp_path / "board.png")
    X = tilted((100.0, 0.0, 30.0), (0.0, 0.5, 0.0))
    image, rows = image_of(covered(HalfSpace(), X, tmp_path / "board.png", (4.0, 2.0)))
    x, y, t, light = points_on_plane(X)
    u, v = 8 * x, 4 * y  # fields: two to a picture
    clear = np.abs([u - np.round(u), v - np.round(v)]).min(axis=0) > 1 / 8
    shown = (rows == 0) & clear & (t < 3.0)
    # The field at the lower left, of small x and y, is in the lower row of the file: white.
    white = (np.floor(u) + np.floor(v)) % 2 == 0
    assert shown.sum() > 300
    assert 0.3 < white[shown].mean() < 0.7
    expected = np.where(white, 255.0 * light, 0.0)
    assert np.abs(image - expected[..., None])[shown].max() <= 0.5 + 1e-9


def test_colour_and_picture_are_multiplied(ramp):
    """By the property diffuse; without one, the picture's own colour."""
    X = pose(p=(0.0, 0.0, 1.0))
    X[:3, :3] = np.diag([1.0, -1.0, -1.0])
    plain, _ = image_of(covered(Box(1.0, 1.0, 0.5), X, ramp))
    tinted, rows = image_of(
        covered(Box(1.0, 1.0, 0.5), X, ramp, diffuse=Rgba(0.5, 1.0, 0.25)),
    )
    assert (rows == 0).sum() > 1000
    apart = np.abs(tinted - plain * (0.5, 1.0, 0.25))[rows == 0]
    assert apart.max() <= 0.5 + 0.5


def coordinates(kind, p):
    """Return (u, v) at a point of a surface by the rules that docs/cameras.md states."""
    x, y, z = np.moveaxis(p, -1, 0)
    around = np.arctan2(y, x) / (2 * np.pi) + 0.5
    if kind == "sphere":
        return around, np.arcsin(np.clip(z / 0.3, -1, 1)) / np.pi + 0.5
    if kind == "ellipsoid":
        q = p / (0.4, 0.3, 0.2)
        turn = np.arctan2(q[..., 1], q[..., 0]) / (2 * np.pi) + 0.5
        return turn, np.arcsin(np.clip(q[..., 2], -1, 1)) / np.pi + 0.5
    if kind == "capsule":  # radius 0.2, length 0.3: the way over it is 0.3 + 0.2 pi long
        above = np.where(z > 0.15, 0.15 + 0.2 * np.arcsin(np.clip((z - 0.15) / 0.2, -1, 1)), z)
        way = np.where(z < -0.15, -0.15 + 0.2 * np.arcsin(np.clip((z + 0.15) / 0.2, -1, 1)), above)
        return around, way / (0.3 + 0.2 * np.pi) + 0.5
    if kind == "cylinder":  # radius 0.25, length 0.5
        upper, lower = z > 0.25 - 1e-9, z < -0.25 + 1e-9
        u = np.where(upper, x / 0.5 + 0.5, np.where(lower, -x / 0.5 + 0.5, around))
        return u, np.where(upper | lower, y / 0.5 + 0.5, z / 0.5 + 0.5)
    # A box of 0.4, 0.5, 0.3: right is +y on the face +x, -x on +y, +x on +z.
    on_x, on_y = np.abs(x) > 0.2 - 1e-9, np.abs(y) > 0.25 - 1e-9
    u = np.where(on_x, np.sign(x) * y / 0.5, np.sign(z) * x / 0.4)
    u = np.where(on_y & ~on_x, -np.sign(y) * x / 0.4, u) + 0.5
    return u, np.where(on_x | on_y, z / 0.3, y / 0.5) + 0.5


@pytest.mark.parametrize(
    ("kind", "shape"),
    [
        ("sphere", Sphere(0.3)),
        ("ellipsoid", Ellipsoid(0.4, 0.3, 0.2)),
        ("capsule", Capsule(0.2, 0.3)),
        ("cylinder", Cylinder(0.25, 0.5)),
        ("box", Box(0.4, 0.5, 0.3)),
    ],
)
@pytest.mark.parametrize("turned", [(70.0, 20.0, 35.0), (-120.0, 10.0, 200.0)])
def test_where_shapes_have_the_picture(ramp, kind, shape, turned):
    """Point by point, from the depth that is seen: all faces, ends and both halves."""
    X = tilted(turned, (0.02, 0.01, 0.9))
    body = covered(shape, X, ramp)
    image, rows = image_of(body)
    depth, _ = seen(scene_of([body]), lens=LENS, clipping=CLIPPING)
    depth = np.where(rows == 0, depth, 1.0)
    p_GQ = (depth[..., None] * rays(LENS) - X[:3, 3]) @ X[:3, :3]
    u, v = coordinates(kind, p_GQ)
    shown = (rows == 0) & inner(u, v)
    assert shown.sum() > 250
    expected = ramp_at(u, v)
    # What light does is measured on blue, which is 200 everywhere: so it cancels.
    light = image[..., 2:] / 200.0
    apart = np.abs(image[..., :2] - light * expected[..., :2])[shown]
    assert apart.max() <= 0.5 + 0.5 * expected[..., :2][shown].max() / 200.0 + 1e-6
    assert light[shown].min() > 0.0


TO_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
"""A point (x, z, -y) of a glTF file, whose +Y is up, is read as (x, y, z)."""


def test_files_with_coordinates(tmp_path, ramp):
    """DAE, GLB and glTF files, with a transform that mirrors, show the same as OBJ."""
    import trimesh

    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    body = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    white = trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 255, 255, 255])
    body.visual = trimesh.visual.TextureVisuals(uv=uv, material=white)
    (tmp_path / "square.obj").write_text(SQUARE)
    expected, rows = image_of(covered(Mesh(tmp_path / "square.obj"), OBLIQUE, ramp))
    scene = trimesh.Scene()
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    body.apply_transform(mirror)
    body.faces = body.faces[:, ::-1]
    scene.add_geometry(body, transform=mirror)
    scene.apply_transform(TO_Y_UP)
    (tmp_path / "square.glb").write_bytes(scene.export(file_type="glb"))
    for name, data in scene.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    tree = json.loads((tmp_path / "model.gltf").read_text())
    for buffer in tree["buffers"]:  # as data, since files beside it are not looked for
        data = base64.b64encode((tmp_path / buffer["uri"]).read_bytes()).decode()
        buffer["uri"] = f"data:application/octet-stream;base64,{data}"
    (tmp_path / "square.gltf").write_text(json.dumps(tree))
    (tmp_path / "square.dae").write_text(DAE)
    for kind in ("glb", "gltf", "dae"):
        image, found = image_of(covered(Mesh(tmp_path / f"square.{kind}"), OBLIQUE, ramp))
        assert (found == rows).all()
        assert np.abs(image - expected).max() <= 1.0, kind
    assert (rows == 0).sum() > 700


DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert><diffuse>
<color>1 1 1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">-0.5 -0.5 0 0.5 -0.5 0 0.5 0.5 0 -0.5 0.5 0
</float_array><technique_common><accessor source="#pa" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<source id="t"><float_array id="ta" count="8">0 0 1 0 1 1 0 1</float_array><technique_common>
<accessor source="#ta" count="4" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="2" material="m"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#t" offset="1" set="0"/><p>0 0 1 1 2 2 0 0 2 2 3 3</p>
</triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="m" target="#m"/></technique_common>
</bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def test_the_same_bytes_in_any_order(tmp_path, ramp):
    """Bodies with pictures, one of them twice, and bodies without; depth and label as without."""
    Image.new("RGB", (3, 5), (250, 20, 30)).save(tmp_path / "red.jpg", quality=95)
    (tmp_path / "square.obj").write_text(SQUARE)
    mesh = Mesh(tmp_path / "square.obj", 0.5)
    upper, lower = tilted((180, 10, 0), (0.2, 0.0, 1.0)), tilted((170, 0, 30), (0.0, 0.2, 1.2))
    make = [
        lambda: covered(Sphere(0.2), pose(p=(-0.2, 0.0, 1.0)), ramp, name="a"),
        lambda: covered(mesh, upper, tmp_path / "red.jpg", name="b"),
        lambda: covered(mesh, lower, ramp, (2.0, 3.0), name="c"),
        lambda: instance(Box(0.1, 0.2, 0.3), pose(5, (0.0, -0.2, 0.8)), "d"),
    ]
    results = set()
    for order in itertools.islice(itertools.permutations(make), 0, 24, 5):
        bodies = [one() for one in order]  # with ids in this order
        images = scene_of(bodies).render_images(depth_camera(LENS, CLIPPING), WORLD, np.eye(4))
        results.add(tuple(image.tobytes() for image in images))
    assert len(results) == 1
    bare = [instance(one.shape(), one.pose(), one.name()) for one in bodies]
    without = scene_of(bare).render_images(depth_camera(LENS, CLIPPING), WORLD, np.eye(4))
    assert images.depth.tobytes() == without.depth.tobytes()
    assert images.label.tobytes() == without.label.tobytes()


def test_a_picture_that_goes_away_stays_in_the_scene(ramp):
    """It was read when the role was assigned; its file is not looked for again."""
    query = scene_of([covered(Sphere(0.3), pose(p=(0, 0, 1.0)), ramp)])
    ramp.unlink()
    image = query.render_color_image(color_camera(LENS, CLIPPING), WORLD, np.eye(4))
    assert len(np.unique(image[..., 0])) > 20


def test_grey_of_sixteen_bits(tmp_path):
    """Levels are those of 8 bits to nearest: 257 k is k."""
    grey = np.full((2, 2), 257 * 77 + 100, np.uint16)
    Image.fromarray(grey).save(tmp_path / "deep.png")
    assert (textures.read_texture(tmp_path / "deep.png").texels == [77, 77, 77, 255]).all()


def _refusals(folder):
    good = folder / "good.png"
    Image.new("RGB", (2, 2)).save(good)
    (folder / "text.png").write_text("no picture")
    good_bytes = np.random.default_rng(1).integers(0, 255, (50, 50, 3)).astype(np.uint8)
    Image.fromarray(good_bytes).save(folder / "whole.png")
    (folder / "cut.png").write_bytes((folder / "whole.png").read_bytes()[:2000])
    Image.new("RGB", (2, 2)).save(folder / "picture.bmp")
    (folder / "huge.png").write_bytes(huge_png())
    (folder / "bare.obj").write_text(re.sub("/[1-4]", "", SQUARE))
    (folder / "half.obj").write_text(SQUARE + "f 1 2 3\n")
    (folder / "nan.obj").write_text(SQUARE.replace("vt 1 0", "vt nan 0"))
    return [
        (Sphere(1.0), folder / "none.png", None, r"none\.png' does not exist"),
        (Sphere(1.0), folder, None, "is a folder"),
        (Sphere(1.0), folder / "text.png", None, r"text\.png' is no readable PNG or JPEG"),
        (Sphere(1.0), folder / "cut.png", None, r"cut\.png' is unreadable"),
        (Sphere(1.0), folder / "picture.bmp", None, "is no readable PNG or JPEG"),
        (
            Sphere(1.0),
            folder / "huge.png",
            None,
            r"huge\.png': 8193 x 8192 are more than 67108864",
        ),
        (Sphere(1.0), 7, None, "path of an image file, not 7"),
        (Sphere(1.0), "", None, "path of an image file, not ''"),
        (Sphere(1.0), good, (1.0,), r"two numbers .* not \(1.0,\)"),
        (Sphere(1.0), good, 2.0, "two numbers .* not 2.0"),
        (Sphere(1.0), good, (1.0, 0.0), "two numbers that are not 0"),
        (Sphere(1.0), good, (1.0, float("nan")), "two numbers"),
        (Sphere(1.0), good, (1.0, 1e300), "at most 1e"),
        (Sphere(1.0), None, (1.0, 1.0), "comes with"),
        (Convex(vertices=np.eye(4)[:, :3]), good, None, "a hull has no texture coordinates"),
        (Mesh(vertices=np.eye(3), faces=[[0, 1, 2]]), good, None, "no texture coordinates; files"),
        (Mesh(folder / "bare.obj"), good, None, r"bare\.obj' has no texture coordinates"),
        (Mesh(folder / "half.obj"), good, None, "triangle 2 has no texture coordinates"),
        (Mesh(folder / "nan.obj"), good, None, "triangle 0 has no texture coordinates"),
    ]


def test_what_is_refused_when_the_role_is_assigned(tmp_path):
    """With the geometry's name, the property and the file, both ways, and nothing changes."""
    for shape, path, scale, reason in _refusals(tmp_path):
        properties = PerceptionProperties()
        if path is not None:
            properties.add_property("phong", "diffuse_map", path)
        if scale is not None:
            properties.add_property("phong", "diffuse_scale", scale)
        body = GeometryInstance(np.eye(4), shape, "body")
        body.set_perception_properties(properties)
        graph = SceneGraph()
        source = graph.register_source("s")
        with pytest.raises(PropertyError, match=f"'body': .*diffuse_.*{reason}"):
            graph.register_anchored_geometry(source, body)
        assert graph.model_inspector().num_geometries() == 0
        bare = GeometryInstance(np.eye(4), shape, "body")
        geometry = graph.register_anchored_geometry(source, bare)
        with pytest.raises(PropertyError, match=f"'body': .*diffuse_.*{reason}"):
            graph.assign_role(source, geometry, properties)


def test_pictures_of_what_people_see_are_checked_as_well(tmp_path, ramp):
    """By the role's name: a missing file, a mesh without coordinates, now and by another shape."""
    properties = IllustrationProperties()
    properties.add_property("phong", "diffuse_map", ramp)
    graph = SceneGraph()
    source = graph.register_source("s")
    body = GeometryInstance(np.eye(4), Sphere(1.0), "body")
    body.set_illustration_properties(properties)
    geometry = graph.register_anchored_geometry(source, body)
    bare = Mesh(vertices=np.eye(3), faces=[[0, 1, 2]])
    with pytest.raises(PropertyError, match=r"illustration properties of geometry 'body': .*no t"):
        graph.change_shape(source, geometry, bare)
    lost = IllustrationProperties()
    lost.add_property("phong", "diffuse_map", tmp_path / "lost.png")
    with pytest.raises(PropertyError, match=r"illustration .*'body': .*lost.png' does not exist"):
        graph.assign_role(source, geometry, lost, RoleAssign.REPLACE)


def test_deformable_geometry_has_no_picture(ramp):
    """It is refused by name: its surface has no coordinates."""
    graph = SceneGraph()
    source = graph.register_source("s")
    body = covered(Box(1.0, 1.0, 1.0), np.eye(4), ramp, name="jelly")
    body.set_proximity_properties(ProximityProperties())
    with pytest.raises(PropertyError, match=r"'jelly': .*deformable geometry has no texture"):
        graph.register_deformable_geometry(source, graph.world_frame_id(), body, 1.0)

"""What a page is told: all at first, then what changed, and nothing twice."""

from __future__ import annotations

from types import SimpleNamespace

from browser_page import (
    MESH,
    MOTION,
    PageClient,
    PICTURE,
    PLAN,
    POSES,
    read_blocks,
    SCENE,
    TEXTURE,
    TIME,
    VERTICES,
)
import numpy as np
from pictured_files import png, write_obj
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Role,
    Sphere,
)
from scene_graph_ros.views.browser.blocks import motion_block, plan_block
from scene_graph_ros.views.browser.cursor import Cursor
from scene_graph_ros.views.browser.drawing import Drawing
from scene_graph_ros.views.browser.motions import MotionTold
from scene_graph_ros.views.browser.wishes import Wish

CORNERS = np.vstack([np.zeros(3), np.eye(3)])
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


class Reader(PageClient):
    """A page without a connection."""

    def __init__(self, drawing):
        self.cursor, self.drawing = Cursor(), drawing
        self.forget()

    def see(self, moment, wish=Wish()):  # noqa: B008 - a value that never changes
        """Take the message of a moment; return the kinds of its blocks."""
        message = self.cursor.message(moment, wish, self.drawing)
        self.learn(message)
        return [kind for kind, _ in read_blocks(message)]


@pytest.fixture
def drawing():
    """What pages share; nothing deformable here that could not be shown."""
    return Drawing(lambda geometry_id, error: pytest.fail(str(error)))


@pytest.fixture
def page(drawing):
    """A page that knows nothing yet."""
    return Reader(drawing)


def test_each_shape_has_a_form_and_a_size(stage, page):
    """Half axes, edges, radius twice and length; triangles where the viewer has no form."""
    shapes = {
        "ball": (Sphere(0.1), "ellipsoid", [0.1, 0.1, 0.1]),
        "egg": (Ellipsoid(0.1, 0.2, 0.3), "ellipsoid", [0.1, 0.2, 0.3]),
        "box": (Box(0.1, 0.2, 0.3), "box", [0.1, 0.2, 0.3]),
        "can": (Cylinder(0.1, 0.4), "cylinder", [0.1, 0.1, 0.4]),
        "pill": (Capsule(0.1, 0.4), "capsule", [0.1, 0.1, 0.4]),
        "floor": (HalfSpace(), "half_space", [0.0, 0.0, 0.0]),
        "gem": (Convex(vertices=CORNERS, scale=2.0), "mesh", [1.0, 1.0, 1.0]),
        "sheet": (Mesh(vertices=CORNERS, faces=FACES, scale=3.0), "mesh", [1.0, 1.0, 1.0]),
    }
    for k, (name, (shape, _, _)) in enumerate(shapes.items()):
        stage.add(name, shape, (k, 0.0, 0.0), roles=("illustration",))
    assert page.see(stage.moment()) == [TIME, MESH, MESH, SCENE, POSES]
    for k, (name, (shape, form, size)) in enumerate(shapes.items()):
        item = page.named(name)
        assert (item["form"], item["size"], item["shape"]) == (form, size, shape.type_name)
        assert item["path"] == ["illustration", "arm", f"{name}_frame", name]
        assert item["color"] == [0.25, 0.5, 0.75, 1.0]
        assert page.position(name) == [k, 0, 0]
    # The scale is in the vertices.
    for name, scale in (("gem", 2.0), ("sheet", 3.0)):
        vertices, triangles, *_ = page.meshes[page.named(name)["mesh"]]
        assert sorted(vertices.sum(axis=1).tolist()) == [0, scale, scale, scale]
        assert len(triangles) == 4


def test_only_what_changed_is_told(stage, page):
    """Nothing moved: the time alone. One moved: its pose alone. One gone: its number alone."""
    stage.add("ball", Sphere(0.1))
    stage.add("box", Box(1, 2, 3), (5, 0, 0))
    page.see(stage.moment())
    assert page.see(stage.moment()) == [TIME]
    assert page.time == (2.0, 2.0, 2.0)
    stage.move("ball", (0.0, 0.0, 1e6 + 1e-3))
    moved = stage.moment()
    assert page.see(moved) == [TIME, POSES]
    assert page.position("ball") == [0.0, 0.0, 1e6 + 1e-3]
    number = page.named("ball")["number"]
    stage.remove("ball")
    assert page.see(stage.moment()) == [TIME, SCENE]
    assert page.scenes[-1]["vanished"] == [number]
    assert page.scenes[-1]["appeared"] == []
    assert [item["path"][3] for item in page.items.values()] == ["box"]


def test_a_page_that_missed_much_is_told_the_difference(stage, drawing):
    """A late and a slow page end up with the same as one that saw each moment."""
    pages = [Reader(drawing) for _ in range(3)]
    rng = np.random.default_rng(7)
    names = []
    for step in range(30):
        if step % 3 == 0:
            names.append(f"g{step}")
            stage.add(names[-1], Sphere(float(rng.uniform(0.1, 1.0))))
        if step % 5 == 4:
            stage.remove(names.pop(int(rng.integers(len(names)))))
        for name in rng.choice(names, size=min(2, len(names))):
            stage.move(name, rng.normal(size=3))
        moment = stage.moment()
        pages[0].see(moment)
        if step % 7 == 6:
            pages[1].see(moment)
    last = stage.moment()
    for each in pages:
        each.see(last)
        assert sorted(item["path"][3] for item in each.items.values()) == sorted(names)
        assert each.items == pages[0].items
        for name in names:
            assert each.position(name) == pages[0].position(name)
    assert len(pages[0].items) == 10 - 6


def test_roles_are_chosen_and_each_geometry_has_an_item_for_each(stage, page):
    """Unless it is said, what people are to see, or what collides where there is none of that."""
    stage.add("ghost", Sphere(0.1), roles=("proximity",))
    page.see(stage.moment())
    assert page.scenes[-1]["roles"] == ["proximity"]
    stage.add("ball", Sphere(0.2))
    page.see(stage.moment())
    assert page.scenes[-1]["roles"] == ["illustration"]
    assert page.scenes[-1]["counts"] == {"illustration": 1, "proximity": 2, "perception": 0}
    assert [item["path"][3] for item in page.items.values()] == ["ball"]
    both = Wish((Role.ILLUSTRATION, Role.PROXIMITY))
    page.see(stage.moment(), both)
    assert sorted(item["path"][0::3] for item in page.items.values()) == [
        ["illustration", "ball"],
        ["proximity", "ball"],
        ["proximity", "ghost"],
    ]
    colliding = page.named("ghost")
    assert colliding["color"][3] < 1.0
    page.see(stage.moment(), Wish(()))
    assert page.items == {}


def test_meshes_are_told_once_and_forgotten_with_their_last_item(stage, page):
    """Two items of one shape share a mesh; another shape has its own."""
    for name in ("one", "two"):
        stage.add(name, Mesh(vertices=CORNERS, faces=FACES), roles=("illustration",))
    stage.add("other", Mesh(vertices=2 * CORNERS, faces=FACES), roles=("illustration",))
    assert page.see(stage.moment()).count(MESH) == 2
    shared = page.named("one")["mesh"]
    assert page.named("two")["mesh"] == shared != page.named("other")["mesh"]
    stage.remove("one")
    assert MESH not in page.see(stage.moment())
    assert page.scenes[-1]["meshes_gone"] == []
    stage.remove("two")
    page.see(stage.moment())
    assert page.scenes[-1]["meshes_gone"] == [shared]
    stage.add("three", Mesh(vertices=CORNERS, faces=FACES), roles=("illustration",))
    assert page.see(stage.moment()).count(MESH) == 1


def test_pictures_are_told_once_and_forgotten_with_their_last_item(stage, page, tmp_path):
    """A mesh of two pictures, a ball that has one of them, and a plane with the other.

    Triangles of one picture stand together; forms that have a picture become triangles.
    """
    only = {"roles": ("illustration",), "rgba": None}
    for name, color in (("a", (10, 20, 30)), ("b", (40, 50, 60))):
        (tmp_path / f"{name}.png").write_bytes(png(np.full((1100, 2, 3), color, np.uint8)))
    path = write_obj(tmp_path, [(None, "b.png"), (None, "a.png"), ((1, 1, 1), None)])
    stage.add("sheet", Mesh(path), **only)
    stage.add("ball", Sphere(0.1), picture=tmp_path / "a.png", **only)
    stage.add("floor", HalfSpace(), picture=tmp_path / "b.png", scale=(2.0, 1.0), **only)
    assert page.see(stage.moment()).count(TEXTURE) == 2
    # Of more than 1024 pixels along a side, every two are one.
    colors = {n: (*t[0].shape, *t[0][0, 0].tolist()) for n, t in page.textures.items()}
    assert sorted(colors.values()) == [(550, 1, 4, *c, 255) for c in ((10, 20, 30), (40, 50, 60))]
    of_ball, triangles, _, numbers, places, normals = page.meshes[page.named("ball")["mesh"]]
    assert np.abs(np.linalg.norm(of_ball, axis=1) - 0.1).max() < 1e-6
    assert np.abs(0.1 * normals.reshape(-1, 3, 3) - of_ball[triangles]).max() < 1e-6
    (number,) = np.unique(numbers)
    assert colors[number][3:6] == (10, 20, 30)
    assert (places.min(), places.max()) == (0.0, 1.0)
    sheet = page.meshes[page.named("sheet")["mesh"]]
    assert sheet[3].tolist() == [0, 0, *sorted(2 * list(colors))]
    floor = page.named("floor")
    assert colors[floor["texture"]][3:6] == (40, 50, 60)
    assert floor["repeats"] == [2.0, 1.0]
    stage.remove("sheet")
    assert TEXTURE not in page.see(stage.moment())
    stage.remove("ball")
    page.see(stage.moment())
    assert page.scenes[-1]["textures_gone"] == [number]
    assert list(page.textures) == [floor["texture"]]


def test_a_collision_mesh_is_shown_as_the_hull_that_it_means(stage, page):
    """An L of two boxes has a notch, its hull has none: other vertices, and another mesh."""
    notch = np.vstack([CORNERS, [(0.1, 0.1, 0.1)]])
    faces = [(0, 2, 1), (0, 1, 3), (2, 0, 3), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
    stage.add("l", Mesh(vertices=notch, faces=faces))
    page.see(stage.moment(), Wish((Role.ILLUSTRATION, Role.PROXIMITY)))
    shown = page.meshes[page.named("l", "illustration")["mesh"]]
    colliding = page.meshes[page.named("l", "proximity")["mesh"]]
    assert (len(shown[0]), len(colliding[0])) == (5, 4)


def test_a_mesh_that_cannot_be_read_hides_no_other(stage, page, tmp_path):
    """It is listed with the reason, and without triangles."""
    path = tmp_path / "bad.obj"
    path.write_text("v one two three\n")
    stage.add("bad", Mesh(path), roles=("illustration",))
    stage.add("ball", Sphere(0.1))
    page.see(stage.moment())
    assert "bad.obj" in page.named("bad")["reason"]
    assert page.position("ball") == [0, 0, 0]


def test_contacts_are_told_to_those_who_ask(stage, page):
    """Two balls of radius 1 whose middles are 1.5 apart overlap by 0.5, half-way between them."""
    stage.add("a", Sphere(1.0))
    stage.add("b", Sphere(1.0), (1.5, 0, 0))
    page.see(stage.moment())
    assert page.contacts is None
    page.see(stage.moment(), Wish(contacts=True))
    points, ids, normals, depths = page.contacts
    assert ids.tolist() == [[int(stage.geometries[name]) for name in "ab"]]
    assert {entry["geometry"] for entry in page.items.values()} == set(ids.ravel())
    assert points.tolist() == [pytest.approx([0.75, 0, 0], abs=1e-12)]
    # Out of B into A, towards -x.
    assert normals.tolist() == [pytest.approx([-1, 0, 0], abs=1e-6)]
    assert depths.tolist() == [pytest.approx(0.5, abs=1e-6)]
    stage.move("b", (3.0, 0, 0))
    page.see(stage.moment(), Wish(contacts=True))
    assert [len(each) for each in page.contacts] == [0, 0, 0, 0]


def test_surfaces_are_told_with_contacts(stage, page):
    """Where a moment has some: a triangle, its pressures, and which of them is red."""
    stage.add("ball", Sphere(1.0))
    vertices = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])
    table = SimpleNamespace(
        vertices_W=vertices,
        pressure=np.array([0.0, 500.0, 2000.0]),
        corners=np.array([(0, 1, 2)]),
        vertex_start=np.array([0, 3]),
        num_faces=np.array([1]),
    )
    stage.pressed = (table, 1000.0)
    page.see(stage.moment())
    assert page.surfaces is None
    page.see(stage.moment(), Wish(contacts=True))
    scale, corners, pressures = page.surfaces
    assert (scale, corners.tolist()) == (1000.0, vertices.tolist())
    assert pressures.tolist() == [0, 500, 2000]


def test_what_deforms_is_told_by_its_vertices(stage, page):
    """Its triangles once, its vertices whenever they are elsewhere; never a pose."""
    stage.add_soft("pad", Box(0.25, 0.5, 1.0))
    assert page.see(stage.moment()) == [TIME, MESH, SCENE, VERTICES]
    item = page.named("pad")
    assert (item["form"], item["number"] in page.poses) == ("vertices", False)
    vertices, triangles = page.vertices[item["number"]], page.meshes[item["mesh"]][1]
    assert triangles.max() == len(vertices) - 1
    assert np.abs(vertices).max(axis=0) == pytest.approx([0.125, 0.25, 0.5], abs=1e-6)
    # Closed: each edge is there once in each direction.
    edges = {(t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3)}
    assert edges == {(b, a) for a, b in edges}
    assert page.see(stage.moment()) == [TIME]
    stage.deform("pad", lambda q_GV: 2.0 * q_GV + (1e6, 0.0, 0.0))
    # A context of its own makes another configuration of the same numbers.
    assert page.see(stage.moment()) == [TIME, VERTICES]
    expected = 2.0 * vertices + (1e6, 0.0, 0.0)
    assert page.vertices[item["number"]] == pytest.approx(expected, abs=1e-6)
    stage.remove("pad")
    stage.add("ball", Sphere(0.1))
    page.see(stage.moment())
    assert page.scenes[-1]["meshes_gone"] == [item["mesh"]]
    assert [each["path"][3] for each in page.items.values()] == ["ball"]


def test_a_picture_is_told_to_those_who_ask_when_it_is_another(stage, page, drawing):
    """Nothing where the camera sees nothing; made once for all pages."""
    stage.hang("eye", b"a picture")
    stage.hang("other", b"another")
    look, other = Wish(camera="eye"), Wish(camera="other")
    moment = stage.moment()
    assert PICTURE not in page.see(moment)
    assert page.scenes[-1]["cameras"] == ["eye", "other"]
    assert page.see(moment, look)[-1] == PICTURE
    assert page.picture == b"a picture"
    second = Reader(drawing)
    second.see(moment, look)
    assert second.picture is not None
    assert drawing.picture(moment, "eye") is drawing.picture(moment, "eye")
    assert PICTURE not in page.see(stage.moment(), look)
    stage.hang("eye", b"")
    page.see(stage.moment(), look)
    assert page.picture == b""
    page.see(stage.moment(), other)
    assert page.picture == b"another"
    assert PICTURE not in page.see(stage.moment())
    assert page.see(stage.moment(), other)[-1] == PICTURE


def test_a_motion_is_told_once_to_its_page(stage, drawing):
    """A ghost, then a plan beside the same ghost; numbers arrive as they were, in any count."""
    stage.add("ball", Sphere(0.5))
    X = np.tile(np.eye(4), (3, 2, 1, 1))
    X[:, :, :3, 3] = np.arange(18).reshape(3, 2, 3)
    X[1, 0, :3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    held = motion_block({"number": 1}, np.array([7, 2**40]), X[0])
    plan = plan_block({"plan": 1, "times": [0.0, 0.5, 1.0]}, np.array([7, 2**40]), X)
    cursor, page = Cursor(), Reader(drawing)
    for told, kinds in (
        (MotionTold(), []),
        (MotionTold(held), [MOTION]),
        (MotionTold(held), []),
        (MotionTold(held, plan), [PLAN]),
        (MotionTold(motion_block({"held": None}), plan), [MOTION]),
    ):
        message = b"".join(cursor.told(stage.moment(), Wish(), drawing, told).blocks)
        page.learn(message)
        found = [kind for kind, _ in read_blocks(message)]
        assert [kind for kind in found if kind in (MOTION, PLAN)] == kinds
    assert page.motion == {"held": None} and page.ghost == {}
    assert page.plan == {"plan": 1, "times": [0.0, 0.5, 1.0]}
    positions, rotations = page.played[2**40]
    np.testing.assert_array_equal(positions, X[:, 1, :3, 3])
    np.testing.assert_allclose(page.played[7][1][1], [0.0, 0.0, 0.5**0.5, 0.5**0.5], atol=1e-7)
    np.testing.assert_allclose(rotations, np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)), atol=1e-7)

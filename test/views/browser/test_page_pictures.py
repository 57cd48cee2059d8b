"""Pictures in the page: each pixel has the colour of the point of a body that is there.

Where points are in the page follows from its camera, and colours from pictures by construction and
from the light that the page's shader states.
"""

from __future__ import annotations

from chromium import find_chromium, REMEDY, Tab
import numpy as np
from pictured_files import BLUE, board, GREEN, png, RED, WHITE, write_obj
import pytest

from scene_graph_ros.geometry import Box, HalfSpace, Mesh, Sphere
from scene_graph_ros.views.browser import shared_meshes
from scene_graph_ros.views.browser.page_file import PageFile
from scene_graph_ros.views.browser.server import BrowserView

WIDTH, HEIGHT = 480, 360
FIELDS = {(0.25, 0.75): RED, (0.75, 0.75): GREEN, (0.25, 0.25): BLUE, (0.75, 0.25): WHITE}
"""The middles (u, v) of the fields of the picture, and their colours."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason=REMEDY),
]


class Eye:
    """The page's camera, once it has made a body fill the view: see page/camera.js."""

    def __init__(self, reach, target=(0.0, 0.0, 0.0)):
        """Look at a body that reaches so far from its origin, by half of its box's diagonal."""
        azimuth, elevation = -0.9, 0.45
        away = 0.75 * np.sqrt(3.0) * reach / np.sin(0.4)
        level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        self.back = np.cos(elevation) * level + (0.0, 0.0, np.sin(elevation))
        self.right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        self.place = np.array(target) + away * self.back

    def pixel(self, p_W):
        """Return the row and column that see a point."""
        d = np.array(p_W) - self.place
        ahead = -(d @ self.back)
        focal = 0.5 * HEIGHT / np.tan(0.4)
        x, y = d @ self.right, d @ np.cross(self.back, self.right)
        return int(0.5 * HEIGHT - focal * y / ahead), int(0.5 * WIDTH + focal * x / ahead)

    def lit(self, color, p_W, normal):
        """Return a colour as the shader lights it."""
        view = self.place - p_W
        light = 0.42 + 0.18 * normal[2] + 0.4 * max(normal @ view / np.linalg.norm(view), 0.0)
        return np.array(color) * light


@pytest.fixture(scope="module")
def browser():
    """A browser, once for all tests."""
    tab = Tab(WIDTH, HEIGHT)
    yield tab
    tab.close()


def picture_of(browser, count):
    """Return the picture of the page without its panels, once it knows ``count`` items."""
    browser.wait_for(f"document.body?.dataset.items === '{count}'")
    hide = "[...document.body.children].filter((e) => e.id !== 'view')"
    browser.value(f"{hide}.forEach((e) => {{ e.style.display = 'none'; }})")
    drawn = int(browser.value("document.body.dataset.pictures") or 0)
    browser.value("window.dispatchEvent(new Event('resize'))")
    browser.wait_for(f"Number(document.body.dataset.pictures) > {drawn}")
    return browser.picture()[..., :3].astype(float)


@pytest.fixture
def look(browser, stage):
    """Show the stage; return the picture of the page without its panel."""
    views, failures = [], []

    def start(count):
        view = BrowserView(
            "127.0.0.1",
            0,
            rate=100.0,
            wanted=lambda: view.offer(stage.moment()),
            failed=failures.append,
        )
        views.append(view)
        view.start()
        browser.open("about:blank")
        browser.problems.clear()
        browser.open(view.link)
        return picture_of(browser, count)

    yield start
    for view in views:
        view.end()
    assert not failures
    assert browser.problems == []


@pytest.fixture
def folder(tmp_path):
    """Have a picture of four fields, and one of one colour."""
    (tmp_path / "board.png").write_bytes(png(board(width=64)))
    (tmp_path / "other.png").write_bytes(png(np.full((4, 4, 3), (10, 100, 250), np.uint8)))
    return tmp_path


UP = np.array([0.0, 0.0, 1.0])


def test_the_pictures_of_a_mesh_file(look, stage, folder):
    """Three squares of an OBJ file: four fields, a plain colour, and a picture times a colour."""
    path = write_obj(
        folder, [(None, "board.png"), ((0.2, 0.4, 0.6), None), ((0.6, 1.0, 0.2), "other.png")]
    )
    stage.add("sheet", Mesh(path), roles=("illustration",), rgba=None)
    image = look(1)
    eye = Eye(np.hypot(3.0, 1.0))
    places = {(u, v, 0.0): color for (u, v), color in FIELDS.items()}
    places[1.5, 0.5, 0.0] = 255.0 * np.array([0.2, 0.4, 0.6])
    places[2.5, 0.5, 0.0] = np.array([0.6, 1.0, 0.2]) * (10, 100, 250)
    for p, color in places.items():
        expected = eye.lit(color, np.array(p), UP)
        assert np.abs(image[eye.pixel(p)] - expected).max() <= 3.0, p


def test_a_box_and_the_ground_with_pictures_of_their_own(look, stage, folder):
    """By ("phong", "diffuse_map"): on each face of a box, and many times on the ground."""
    picture = folder / "board.png"
    only = {"roles": ("illustration",), "rgba": None}
    stage.add("box", Box(1.0, 1.0, 1.0), picture=picture, **only)
    stage.add("ground", HalfSpace(), (0.0, 0.0, -0.6), picture=picture, scale=(2.0, 4.0), **only)
    image = look(2)
    eye = Eye(np.sqrt(0.75))
    for (u, v), color in FIELDS.items():
        on_faces = {
            (0.5, u - 0.5, v - 0.5): (1.0, 0.0, 0.0),
            (u - 0.5, -0.5, v - 0.5): (0.0, -1.0, 0.0),
            (u - 0.5, v - 0.5, 0.5): (0.0, 0.0, 1.0),
        }
        for p, normal in on_faces.items():
            expected = eye.lit(color, np.array(p), np.array(normal))
            assert np.abs(image[eye.pixel(p)] - expected).max() <= 3.0, p
    # A picture is 0.5 m by 0.25 m on the ground; the page gives that no light, and lets it fade.
    seen = set()
    for k, j in np.ndindex(8, 16):
        for (u, v), color in FIELDS.items():
            p = np.array((0.5 * (u + k - 4), 0.25 * (v + j - 8), -0.6))
            row, column = eye.pixel(p)
            is_before_the_box = p[0] > 0.6 or p[1] < -0.6
            if is_before_the_box and 3 < row < HEIGHT - 3 and 3 < column < WIDTH - 3:
                assert np.abs(image[row, column] - color).max() <= 8.0, p
                seen.add((color, p[0] > 0.6))
    assert len(seen) == 8


def test_a_ball_with_a_picture_and_a_color(look, stage, folder):
    """Once around, its middle towards x; the colour multiplies it."""
    ball, tint = Sphere(0.5), (0.5, 1.0, 0.75)
    stage.add("ball", ball, picture=folder / "board.png", roles=("illustration",), rgba=tint)
    image = look(1)
    eye = Eye(0.5)
    places = {(-0.6, 0.3): RED, (-0.6, -0.3): BLUE, (0.1, 0.4): GREEN, (0.1, -0.2): WHITE}
    for (longitude, latitude), color in places.items():
        level = np.array([np.cos(longitude), np.sin(longitude), 0.0])
        normal = np.cos(latitude) * level + np.sin(latitude) * UP
        expected = eye.lit(np.array(color) * tint, 0.5 * normal, normal)
        # Light changes within a pixel where the ball turns away, towards white.
        most = 8.0 if color == WHITE else 3.0
        assert np.abs(image[eye.pixel(0.5 * normal)] - expected).max() <= most, (color, expected)


def test_what_is_behind_a_picture_with_alpha(look, stage, folder):
    """A field without alpha shows what is below it; one with alpha hides it."""
    fields = [[(*RED, 255), (*GREEN, 0)], [(*BLUE, 0), (*WHITE, 255)]]
    (folder / "holes.png").write_bytes(png(board(fields)))
    mesh = Mesh(write_obj(folder, [((1.0, 1.0, 1.0), None)]))
    only = {"roles": ("illustration",)}
    stage.add("upper", mesh, (0.0, 0.0, 0.0), picture=folder / "holes.png", rgba=None, **only)
    stage.add("lower", mesh.with_scale(3.0), (-1.0, -1.0, -0.1), rgba=(1.0, 1.0, 0.0), **only)
    image = look(2)
    # Both boxes: what reaches farthest is 3 times the square's diagonal from (-1, -1, -0.1).
    eye = Eye(3.0 * np.sqrt(2.0), (-1.0, -1.0, -0.1))
    for (u, v), hides in {
        (0.25, 0.75): RED,
        (0.75, 0.25): WHITE,
        (0.75, 0.75): None,
        (0.25, 0.25): None,
    }.items():
        p = np.array((u, v, 0.0))
        expected = eye.lit(hides or (255, 255, 0), p, UP)
        assert np.abs(image[eye.pixel(p)] - expected).max() <= 3.0, p


def test_a_picture_that_is_damaged_on_its_way(look, browser, stage, folder, monkeypatch):
    """The page says so, and shows what it is on in its own colour."""
    monkeypatch.setattr(shared_meshes, "png", lambda levels: b"no picture")
    tint = (0.5, 1.0, 0.75)
    stage.add(
        "ball", Sphere(0.5), picture=folder / "board.png", roles=("illustration",), rgba=tint
    )
    image = look(1)
    eye, p = Eye(0.5), np.array((0.0, 0.0, 0.5))
    assert np.abs(image[eye.pixel(p)] - eye.lit(255.0 * np.array(tint), p, UP)).max() <= 8.0
    (problem,) = browser.problems
    assert "a picture can't be shown: " in problem
    browser.problems.clear()


def test_in_a_file_whose_time_is_moved(browser, stage, folder):
    """Onward, back and onward again: a mesh has its picture, alone and beside a ball."""
    only = {"picture": folder / "board.png", "roles": ("illustration",), "rgba": None}
    page = PageFile(lambda *what: pytest.fail(str(what)))
    stage.add(
        "sheet", Mesh(write_obj(folder, [(None, "board.png")])), roles=("illustration",), rgba=None
    )
    page.add(stage.moment(), 0.0)
    stage.add("ball", Sphere(0.1), (-1.0, 0.0, 0.0), **only)
    page.add(stage.moment(), 0.1)
    (folder / "page.html").write_text(page.html())
    browser.open("about:blank")
    browser.problems.clear()
    browser.open((folder / "page.html").as_uri())
    eye = Eye(np.sqrt(2.0))
    for key, count in ((None, 1), ("Right", 2), ("Left", 1), ("Right", 2)):
        browser.value(f"window.dispatchEvent(new KeyboardEvent('keydown', {{key: 'Arrow{key}'}}))")
        image = picture_of(browser, count)
        for (u, v), color in FIELDS.items():
            p = np.array((u, v, 0.0))
            assert np.abs(image[eye.pixel(p)] - eye.lit(color, p, UP)).max() <= 3.0, (key, p)
    assert browser.problems == []

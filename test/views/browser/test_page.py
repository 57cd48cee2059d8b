"""The page in a real browser: what a person sees of a scene that changes."""

from __future__ import annotations

import threading

from chromium import find_chromium, REMEDY, Tab
import numpy as np
import pytest

from scene_graph_ros.geometry import Mesh, Sphere
from scene_graph_ros.views.browser.page_file import PageFile
from scene_graph_ros.views.browser.server import BrowserView
from scene_graph_ros.views.moment import Trouble
from scene_graph_ros.views.png import png

SIZE = (700, 320)
PANEL = 300
"""Pixels from the left that the panel covers."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason=REMEDY),
]


@pytest.fixture(scope="module")
def browser():
    """A browser, once for all tests."""
    tab = Tab(*SIZE)
    yield tab
    tab.close()


@pytest.fixture
def tab(browser):
    """A browser that shows nothing; the page is to complain about nothing."""
    browser.open("about:blank")
    browser.problems.clear()
    yield browser
    assert browser.problems == []


class Shown:
    """A view of a stage, offered when it is wanted or something is done."""

    def __init__(self, stage, port=0):
        self.stage, self._lock = stage, threading.Lock()
        self.failures = []
        self.view = BrowserView(
            "127.0.0.1", port, rate=100.0, wanted=self.offer, failed=self.failures.append
        )
        self.view.start()

    def offer(self, change=None):
        """Show how the stage is, after a change of it."""
        with self._lock:
            if change is not None:
                change()
            self.view.offer(self.stage.moment())


@pytest.fixture
def show(stage):
    """Show the stage, which has a red ball; and end what was started."""
    stage.add("ball", Sphere(0.5), rgba=(1.0, 0.0, 0.0))
    views = []

    def start(port=0):
        views.append(Shown(stage, port))
        return views[-1]

    yield start
    for shown in views:
        shown.view.end()
        assert not shown.failures


def of_color(tab, channel):
    """Return the middle (x, y) of what is mostly red (0), green (1) or blue (2), and its area."""
    picture = tab.picture().astype(int)
    others = [k for k in range(3) if k != channel]
    mask = picture[..., channel] > 60 + 2 * picture[..., others].max(axis=2)
    mask[:, :PANEL] = False
    y, x = np.nonzero(mask)
    return (x.mean(), y.mean(), len(x)) if len(x) else (None, None, 0)


def wait_for_items(tab, count):
    """Wait until the page has so many items, and has drawn them."""
    tab.wait_for(f"document.body?.dataset.items === '{count}'")
    drawn = int(tab.value("document.body.dataset.pictures") or 0)
    tab.value("window.dispatchEvent(new Event('resize'))")
    tab.wait_for(f"Number(document.body.dataset.pictures) > {drawn}")


def wait_until_seen(tab, condition):
    """Look until a condition holds of what is red, and return that."""
    for _ in range(200):
        seen = of_color(tab, 0)
        if condition(*seen):
            return seen
    raise AssertionError(f"the page shows {seen}; {tab.problems}")


def test_a_ball_is_where_it_is_moves_and_vanishes(tab, stage, show):
    """Seen from the side: at first in the middle, as large as it is; then to the right; then not.

    The page shows as a whole what is there when it is opened, at 0.75 of the distance at which a
    ball of half the diagonal of its box, 0.87 m, fills the height: at 1.67 m. With 0.8 rad from
    bottom to top a ball of 0.5 m, which is seen under asin(0.5 / 1.67), is 115 pixels in radius.
    """
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 1)
    x, y, area = of_color(tab, 0)
    distance = 0.75 * np.sqrt(0.75) / np.sin(0.4)
    radius = np.tan(np.arcsin(0.5 / distance)) / np.tan(0.4) * SIZE[1] / 2
    # Its left part is behind the panel: the disc is cut at PANEL.
    u = np.arange(PANEL, SIZE[0]) + 0.5 - SIZE[0] / 2
    height = 2 * np.sqrt(np.maximum(radius**2 - u**2, 0.0))
    height = np.minimum(height, SIZE[1])
    assert area == pytest.approx(height.sum(), rel=0.03)
    assert x == pytest.approx(SIZE[0] / 2 + (u * height).sum() / height.sum(), abs=2.0)
    assert y == pytest.approx(SIZE[1] / 2, abs=2.0)
    # The camera is at azimuth -0.9 rad: its right is (0.78, 0.62, 0).
    shown.offer(lambda: stage.move("ball", (0.78, 0.62, 0.0)))
    moved = wait_until_seen(tab, lambda x, y, area: area and x > SIZE[0] / 2 + 100)
    assert moved[1] == pytest.approx(SIZE[1] / 2, abs=5.0)
    shown.offer(lambda: stage.remove("ball"))
    wait_until_seen(tab, lambda x, y, area: area == 0)


def test_names_are_listed_and_hide_what_they_name(tab, stage, show):
    """A click on a box hides the ball, and its frame's box says so; the filter finds names."""
    stage.add("other", Sphere(0.1), (3.0, 0.0, 0.0), rgba=(0.0, 1.0, 0.0))
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 2)
    names = "[...document.querySelectorAll('#tree .name')].map((each) => each.textContent)"
    assert tab.value(names) == ["arm", "ball_frame", "ball", "other_frame", "other"]
    tab.value("document.querySelector('.leaf input').click()")
    wait_until_seen(tab, lambda x, y, area: area == 0)
    assert of_color(tab, 1)[2] > 0
    boxes = "[...document.querySelectorAll('#tree input')].map((b) => b.checked)"
    assert tab.value(boxes) == [True, False, False, True, True]
    tab.value(
        "(() => { const field = document.querySelector('#filter'); field.value = 'OTHER';"
        " field.dispatchEvent(new Event('input')); })()"
    )
    assert tab.value(names) == ["arm", "other_frame", "other"]


def test_a_name_is_text_whatever_is_in_it(tab, stage, show):
    """Markup in a name is shown, not followed."""
    evil = "<img src=x onerror=\"document.body.dataset.evil='1'\">"
    stage.add(evil, Sphere(0.1))
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 2)
    assert tab.value("document.querySelectorAll('#tree img').length") == 0
    assert tab.value("document.body.dataset.evil") is None
    assert evil in tab.value("document.querySelector('#tree').textContent")


def test_contacts_are_shown_unless_they_are_unticked(tab, stage, show):
    """Two balls that overlap: how many is told, and a mark is seen through them."""
    stage.add("other", Sphere(0.5), (0.6, 0.0, 0.0), rgba=(0.0, 0.0, 1.0))
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 2)
    count = "document.querySelector('#contact-count').textContent"
    assert tab.wait_for(f"{count} === '1'")
    blue = of_color(tab, 2)[2]
    tab.value("document.querySelector('#contacts').click()")
    tab.wait_for(f"{count} === '-'")
    assert of_color(tab, 2)[2] > blue


def test_what_diagnostics_say_is_listed_while_they_do(tab, stage, show):
    """With its level; as text, and nothing once all is well."""
    stage.troubles = (Trouble("error", "effect: <b>x</b>", "failed"),)
    shown = show()
    tab.open(shown.view.link)
    rows = "[...document.querySelectorAll('#troubles p')].map((p) => [p.className, p.textContent])"
    tab.wait_for(f"{rows}.length === 1")
    assert tab.value(rows) == [["error", "effect: <b>x</b>: failed"]]

    def heal():
        stage.troubles = ()

    shown.offer(heal)
    tab.wait_for("document.querySelector('#troubles').hidden")


OBJ = """mtllib colors.mtl
v -1 0 -1
v 0 0 -1
v 0 0 1
v -1 0 1
v 1 0 -1
v 1 0 1
usemtl leaf
f 1 2 3 4
usemtl sky
f 2 5 6 3
"""
MTL = "newmtl leaf\nKd 0 1 0\nnewmtl sky\nKd 0 0 1\n"


def test_a_mesh_has_the_colors_of_its_file(tab, stage, show, tmp_path):
    """A sheet whose left half is green and whose right half is blue, and the same in one red."""
    (tmp_path / "sheet.obj").write_text(OBJ)
    (tmp_path / "colors.mtl").write_text(MTL)
    sheet = Mesh(tmp_path / "sheet.obj")
    stage.add("sheet", sheet, (0.0, -1.0, 0.0), roles=("illustration",), rgba=None)
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 2)
    left, right = of_color(tab, 1), of_color(tab, 2)
    assert left[2] > 1000
    assert right[2] > 1000
    # Seen from the front right: x goes to the right.
    assert left[0] < right[0]
    ball = of_color(tab, 0)[2]
    stage.add("red", sheet, (0.0, -1.0, 0.0), roles=("illustration",), rgba=(1.0, 0.0, 0.0))
    shown.offer(lambda: stage.remove("sheet"))
    wait_until_seen(tab, lambda x, y, area: area > ball + 1000)
    assert of_color(tab, 1)[2] == of_color(tab, 2)[2] == 0


def test_a_click_tells_what_is_there(tab, stage, show):
    """The one in front, where it is, what it touches and how deep; Escape or elsewhere: none."""
    stage.add("other", Sphere(0.5), (0.6, 0.0, 0.0), rgba=(0.0, 0.0, 1.0))
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 2)
    said = "document.querySelector('#selection').textContent"

    def click(x, y):
        for kind, buttons in (("pointerdown", 1), ("pointerup", 0)):
            place = f"clientX: {x}, clientY: {y}, button: 0, buttons: {buttons}, pointerId: 1"
            tab.value(
                f"document.querySelector('#view').dispatchEvent(new PointerEvent('{kind}',"
                f" {{{place}, bubbles: true}}))"
            )

    x, y, _ = of_color(tab, 2)
    click(x, y)
    tab.wait_for(f"{said}.includes('arm/other_frame/other')")
    assert "0.6000 0.0000 0.0000 m" in tab.value(said)
    tab.value("document.querySelector('#contacts').click()")
    tab.wait_for(f"{said}.includes('tick contacts')")
    tab.value("document.querySelector('#contacts').click()")
    # Two balls of radius 0.5, 0.6 apart.
    tab.wait_for(f"{said}.includes('400 mmarm/ball_frame/ball')")
    shown.offer(lambda: stage.move("other", (0.8, 0.0, 0.0)))
    tab.wait_for(f"{said}.includes('0.8000 0.0000') && {said}.includes('200 mm')")
    hidden = "document.querySelector('#selection').hidden"
    tab.value("window.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape'}))")
    tab.wait_for(hidden)
    click(x, y)
    tab.wait_for(f"!{hidden}")
    click(SIZE[0] - 3, 3)
    tab.wait_for(hidden)
    click(x, y)
    tab.wait_for(f"!{hidden}")
    shown.offer(lambda: stage.remove("other"))
    tab.wait_for(hidden)


def test_what_a_camera_sees_is_in_a_corner(tab, stage, show):
    """When the camera is chosen; another picture takes its place, nothing hides it."""

    def hang(*rgb):
        stage.hang("eye", png(np.full((60, 80, 3), rgb, np.uint8)))

    hang(0, 255, 0)
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 1)
    assert of_color(tab, 1)[2] == 0
    choose = (
        "document.querySelector('#camera').value = '{}';"
        " document.querySelector('#camera').dispatchEvent(new Event('change'))"
    )
    tab.value(choose.format("eye"))
    tab.wait_for("document.querySelector('#picture canvas').width === 80")
    seen = of_color(tab, 1)
    assert seen[2] == pytest.approx(80 * 60, rel=0.05)
    assert seen[0] > SIZE[0] - 110
    assert seen[1] > SIZE[1] - 110
    shown.offer(lambda: hang(0, 0, 255))
    for _ in range(200):
        if of_color(tab, 2)[2]:
            break
    assert of_color(tab, 2)[2] == pytest.approx(80 * 60, rel=0.05)
    shown.offer(lambda: stage.hang("eye", b""))
    tab.wait_for("document.querySelector('figcaption').textContent === 'eye: no picture'")
    assert of_color(tab, 2)[2] == 0
    tab.value(choose.format(""))
    tab.wait_for("document.querySelector('#picture').hidden")


def test_a_drag_turns_the_view(tab, stage, show):
    """What is beside the middle goes elsewhere; the page asks the node for nothing."""
    stage.add("other", Sphere(0.1), (0.0, 1.0, 1.0), rgba=(0.0, 1.0, 0.0))
    shown = show()
    tab.open(shown.view.link)
    wait_for_items(tab, 2)
    before = of_color(tab, 1)
    assert before[2] > 0
    tab.press(500, 160, to=(560, 160))
    for _ in range(200):
        after = of_color(tab, 1)
        if after[2] == 0 or abs(after[0] - before[0]) > 5:
            break
    else:
        raise AssertionError(f"still at {after}")


def test_the_page_comes_back_with_the_node(browser, stage, show):
    """It says that it is not connected, keeps what it has, and shows another world afterwards."""
    browser.open("about:blank")
    shown = show()
    browser.open(shown.view.link)
    wait_for_items(browser, 1)
    shown.view.end()
    status = "document.querySelector('#status').textContent"
    browser.wait_for(f"{status} !== 'connected'")
    assert browser.value("document.body.dataset.items") == "1"
    stage.add("other", Sphere(0.1))
    again = show(int(shown.view.address.rstrip("/").rpartition(":")[2]))
    browser.wait_for(f"{status} === 'connected'")
    wait_for_items(browser, 2)
    assert again.view.has_pages()
    # Attempts that were refused meanwhile, and nothing else.
    assert all("ERR_CONNECTION_REFUSED" in problem for problem in browser.problems)


@pytest.fixture
def file(stage, tmp_path):
    """A page in a file: a red ball goes to the right for two seconds, 0.01 m a moment."""
    stage.add("ball", Sphere(0.5), rgba=(1.0, 0.0, 0.0))
    stage.add("guest", Sphere(0.1), roles=("proximity",))
    page = PageFile(lambda *what: pytest.fail(str(what)))
    for k in range(101):
        stage.move("ball", (0.0078 * k, 0.0062 * k, 0.0))
        page.add(stage.moment(), 0.02 * k)
    path = tmp_path / "page.html"
    path.write_text(page.html())
    return path


def go_to(tab, seconds):
    """Move the time line."""
    tab.value(
        "(() => { const line = document.querySelector('#timeline input');"
        f"line.value = {seconds}; line.dispatchEvent(new Event('input')); }})()"
    )


def test_a_file_shows_any_time_of_its_time_line(tab, file):
    """To the right and back again, before and after whole moments; the label says when."""
    tab.open(file.as_uri())
    wait_for_items(tab, 1)
    begin = of_color(tab, 0)
    for k in (20, 70, 30, 0):
        go_to(tab, 0.02 * k)
        label = tab.value("document.querySelector('#timeline output').textContent")
        assert label == f"{0.02 * k:.2f} of 2.00 s"
        seen = wait_until_seen(
            tab, lambda x, y, area, k=k: area and abs(x - begin[0] - 2.26 * k) < 30.0
        )
        assert seen[1] == pytest.approx(begin[1], abs=30.0)


def test_a_file_shows_roles_and_contacts_that_are_asked_for(tab, file):
    """The ball and its guest collide at first, and no longer at the end."""
    tab.open(file.as_uri())
    wait_for_items(tab, 1)
    count = "document.querySelector('#contact-count').textContent"
    tab.wait_for(f"{count} === '1'")
    go_to(tab, 2.0)
    tab.wait_for(f"{count} === '0'")
    tab.value("document.querySelector('[data-role=proximity]').click()")
    wait_for_items(tab, 3)
    tab.value("document.querySelector('[data-role=illustration]').click()")
    wait_for_items(tab, 2)


def test_a_file_is_played_to_its_end(tab, file):
    """Ten times as fast, and from the beginning again."""
    tab.open(file.as_uri())
    wait_for_items(tab, 1)
    tab.value("document.querySelector('#timeline select').value = '10'")
    label = "document.querySelector('#timeline output').textContent"
    button = "document.querySelector('#timeline button')"
    for _ in range(2):
        # A click turns it into the button that pauses, and the end back again.
        assert tab.value(f"{button}.click(), {button}.textContent") == "Pause"
        tab.wait_for(f"{button}.textContent === 'Play'")
        assert tab.value(label) == "2.00 of 2.00 s"


def test_arrows_go_from_moment_to_moment(tab, file):
    """Two on and one back; at the beginning none is before."""
    tab.open(file.as_uri())
    wait_for_items(tab, 1)
    label = "document.querySelector('#timeline output').textContent"
    for key, seconds in (("Left", 0.0), ("Right", 0.02), ("Right", 0.04), ("Left", 0.02)):
        tab.value(f"window.dispatchEvent(new KeyboardEvent('keydown', {{key: 'Arrow{key}'}}))")
        assert tab.value(label) == f"{seconds:.2f} of 2.00 s"


def test_a_damaged_file_says_so(tab, file):
    """Another byte in the compressed data."""
    text = file.read_text()
    at = text.index('"data":"') + 60
    file.write_text(text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :])
    tab.open(file.as_uri())
    assert tab.wait_for(
        "document.querySelector('#status')?.textContent.match(/^damaged: .+/)?.[0]"
    )

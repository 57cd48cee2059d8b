"""A page in one file: what it has in it is what a page was told, each block once."""

from __future__ import annotations

import base64
import hashlib
import itertools
import re

import numpy as np
from page_files import FileReader
import pytest

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.views.browser import drawing, page_file
from scene_graph_ros.views.browser.gate import Gate
from scene_graph_ros.views.browser.page_file import PageFile


@pytest.fixture
def page():
    """A page of nothing so far; nothing is left out of it."""
    left_out = []
    yield PageFile(lambda *what: left_out.append(what))
    assert not left_out


def test_each_moment_is_as_it_was_wherever_one_begins(stage, page):
    """150 moments of a ball that moves, and of another that comes and goes, in any order."""
    stage.add("ball", Sphere(0.5))
    expected = []
    for k in range(150):
        stage.move("ball", (0.001 * k, 0.0, 0.0))
        if k == 40:
            stage.add("guest", Sphere(0.1), (0.0, 0.2, 0.0), roles=("proximity",))
        if k == 100:
            stage.remove("guest")
        page.add(stage.moment(), 5.0 + 0.1 * k)
        expected.append((0.001 * k, 40 <= k < 100))
    assert (page.count(), page.seconds()) == (150, pytest.approx(14.9))
    reader = FileReader(page.html())
    assert np.allclose(reader.content["times"], 0.1 * np.arange(150), atol=1e-6)
    assert list(reader.content["wholes"]) == ["0", "64", "128"]
    for index in (149, 0, 63, 64, 65, 40, 39, 100, 99, 128, 127):
        reader.go(index)
        x, has_guest = expected[index]
        for role in ("illustration", "proximity"):
            ball = reader.named("ball", role)
            assert reader.poses[ball["number"]][0].tolist() == [x, 0.0, 0.0]
        assert (reader.named("guest") is not None) == has_guest
        assert len(reader.contacts[-1]) == has_guest


def test_a_block_is_in_the_file_once(stage, page):
    """What does not change costs a time and a few numbers."""
    stage.add("ball", Sphere(0.5))
    moments = [stage.moment() for _ in range(130)]
    for k, moment in enumerate(moments):
        page.add(moment, float(k))
    reader = FileReader(page.html())
    # 130 times; one scene, which every whole moment has; one place; no contacts.
    assert len(reader.content["begins"]) - 1 == 130 + 3
    assert len(set(map(tuple, reader.content["wholes"].values()))) == 3


def test_no_name_ends_the_script(stage, page):
    """Names are text, whatever they look like."""
    name = "</script><!--<script>"
    stage.add(name, Sphere(0.5))
    page.add(stage.moment(), 0.0)
    html = page.html()
    assert html.count("</script>") == html.count("<script ") == 2
    reader = FileReader(html)
    reader.go(0)
    assert reader.named(name, "illustration") is not None


def test_the_file_needs_no_other(stage, page):
    """Neither modules nor styles nor anything else is loaded; each module is there once."""
    stage.add("ball", Sphere(0.5))
    page.add(stage.moment(), 0.0)
    html = page.html()
    assert not re.search(r"^\s*(import|export)\b", html, re.MULTILINE)
    assert not re.search(r"""(src|href)=["'](?!data:,)""", html)
    modules = re.findall(r"^const (\w+)Module = ", html, re.MULTILINE)
    assert len(modules) == len(set(modules)) > 10
    assert modules[-1] == "main"


def test_the_file_has_the_policy_of_the_live_page(stage, page):
    """Its own script and style by their hashes, and no connection at all."""
    stage.add("ball", Sphere(0.5))
    page.add(stage.moment(), 0.0)
    html = page.html()
    found = re.search(r'<meta http-equiv="Content-Security-Policy" content="([^"]+)">', html)
    ours = dict(part.strip().split(" ", 1) for part in found[1].split(";"))
    live = Gate("127.0.0.1", "").answer("/", "127.0.0.1:1", None).headers()
    theirs = dict(
        part.strip().split(" ", 1) for part in live["Content-Security-Policy"].split(";")
    )
    # A page can't say of itself who may frame it.
    assert ours.keys() == theirs.keys() - {"frame-ancestors"}
    assert ours["connect-src"] == "'none'"
    for name, tag in (("script-src", '<script type="module">'), ("style-src", "<style>")):
        content = html.split(tag)[1].split("</")[0] if "style" in name else None
        content = content or html.split(tag)[1].rsplit("</script>", 1)[0]
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert ours[name] == f"'sha256-{digest}'"
    same = ours.keys() - {"connect-src", "script-src", "style-src"}
    assert all(ours[name] == theirs[name] for name in same)
    assert html.index("Content-Security-Policy") < html.index("<style>") < html.index("<script")


def test_of_many_contacts_the_deepest_are_shown(stage, page, monkeypatch):
    """Five balls in a row of overlapping pairs of different depths, and room for six of ten."""
    monkeypatch.setattr(drawing, "MOST_CONTACTS", 6)
    places = np.cumsum([0.0, 0.1, 0.11, 0.12, 0.13])
    for k, x in enumerate(places):
        stage.add(f"ball{k}", Sphere(0.5), (x, 0.0, 0.0))
    page.add(stage.moment(), 0.0)
    assert page.most_contacts() == 10
    reader = FileReader(page.html())
    reader.go(0)
    # The depth of two is 1 m less their distance.
    every = sorted(1.0 - (b - a) for a, b in itertools.combinations(places, 2))
    shown = reader.contacts[-1]
    assert np.allclose(sorted(shown.tolist()), every[-6:], atol=1e-6)


def test_a_page_is_full_when_a_browser_could_not_unpack_more(stage, page, monkeypatch):
    """Each moment has a place of its own; who adds moments asks."""
    stage.add("ball", Sphere(0.5))
    page.add(stage.moment(), 0.0)
    monkeypatch.setattr(page_file, "MOST_BYTES", 2000)
    moments = 0
    while not page.is_full():
        moments += 1
        stage.move("ball", (0.01 * moments, 0.0, 0.0))
        page.add(stage.moment(), 0.1 * moments)
    # A moment of one body is some hundred bytes.
    assert 1 <= moments <= 30
    assert page.count() == moments + 1

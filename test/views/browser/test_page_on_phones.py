"""The page on a phone, 390 pixels wide: the scene first, and the panel when it is asked for."""

from __future__ import annotations

from chromium import find_chromium, REMEDY, Tab
import pytest

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.views.browser.server import BrowserView

SIZE = (390, 844)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason=REMEDY),
]


def box(tab, selector):
    """Return left, top, right and bottom of an element, pixels."""
    sides = ("left", "top", "right", "bottom")
    found = f"document.querySelector({selector!r}).getBoundingClientRect()"
    return [tab.value(f"{found}.{side}") for side in sides]


def test_the_panel_leaves_the_scene_free_and_unfolds(stage):
    """Folded it is one line; unfolded it scrolls, and nothing of it is beyond the screen."""
    stage.add("ball", Sphere(0.5), rgba=(1.0, 0.0, 0.0))
    view = BrowserView(
        "127.0.0.1", 0, rate=100.0, wanted=lambda: view.offer(stage.moment()), failed=print
    )
    view.start()
    tab = Tab(*SIZE)
    try:
        tab.open(view.link)
        tab.wait_for("document.body?.dataset.items === '1'")
        assert box(tab, "#panel")[3] < 0.1 * SIZE[1]
        left, top, right, bottom = box(tab, "#fold")
        assert min(right - left, bottom - top) >= 32  # a finger's
        assert tab.value("document.querySelector('#fold').ariaExpanded") == "false"
        tab.value("document.querySelector('#fold').click()")
        assert 0.1 * SIZE[1] < box(tab, "#panel")[3] <= 0.5 * SIZE[1]
        assert tab.value("document.documentElement.scrollWidth") <= SIZE[0]
        assert tab.value(
            "(p => p.scrollHeight >= p.clientHeight)(document.querySelector('#panel'))"
        )
        tab.value("document.querySelector('#tree summary, #tree .leaf').scrollIntoView()")
        assert box(tab, "#tree")[2] <= SIZE[0]
        tab.value("document.querySelector('#fold').click()")
        assert box(tab, "#panel")[3] < 0.1 * SIZE[1]
        assert tab.problems == []
    finally:
        tab.close()
        view.end()

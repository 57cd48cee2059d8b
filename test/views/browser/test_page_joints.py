"""Sliders and pictures of the page where names are long and a processor draws."""

from __future__ import annotations

from chromium import find_chromium, REMEDY, Tab
import pytest

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.views.browser.server import BrowserView
from scene_graph_ros.views.sliders import Slider

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason=REMEDY),
]

_IS_CUT = """[...document.querySelectorAll("#joints .name")].map((name) =>
  name.scrollWidth > name.clientWidth || name.scrollHeight > name.clientHeight)"""


@pytest.fixture
def tab(stage):
    """A page with a ball and two joints, one with a name of 60 characters."""
    stage.add("ball", Sphere(0.5), rgba=(1.0, 0.0, 0.0))
    names = ("panda_finger_joint1", 3 * "left_front_shoulder_" + "_")
    stage.sliders = tuple(Slider("panda", name, -1.0, 1.0, "rad") for name in names)
    stage.slide(0.0, 0.5)
    view = BrowserView("127.0.0.1", 0, rate=100.0, wanted=lambda: view.offer(stage.moment()))
    view.start()
    tab = Tab(700, 600)
    tab.open(view.address)
    tab.wait_for("document.querySelectorAll('#joints .name').length === 2")
    yield tab
    assert tab.problems == []
    tab.close()
    view.end()


def test_names_of_joints_are_whole_and_software_draws_without_smoothing(tab):
    """Nothing is cut off; this browser draws by SwiftShader, as its flags say."""
    assert tab.value(_IS_CUT) == [False, False]
    smooth = (
        "document.querySelector('#view').getContext('webgl2').getContextAttributes().antialias"
    )
    assert tab.value(smooth) is False

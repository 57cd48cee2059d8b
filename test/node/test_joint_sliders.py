"""Joints that a page moves: over real sockets and DDS, and in a real browser."""

from __future__ import annotations

import json
import math
from pathlib import Path
import re

from browser_page import PageClient
from chromium import find_chromium, REMEDY, Tab
from node_harness import wait_until
import pytest
from sensor_msgs.msg import JointState
from websockets.exceptions import InvalidStatus

from scene_graph_ros.node.runtime.parameter_checks import validate

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper"><visual><origin xyz="0.5 0 0"/><geometry><sphere radius="0.1"/></geometry>
  </visual></link>
  <link name="tool"><visual><geometry><sphere radius="0.05"/></geometry></visual></link>
  <link name="finger"/>
  <link name="wheel"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-1.5" upper="3" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="tool"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.25" effort="1" velocity="1"/></joint>
  <joint name="follower" type="prismatic"><parent link="tool"/><child link="finger"/>
    <mimic joint="slide"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="turn" type="continuous"><parent link="tool"/><child link="wheel"/></joint>
</robot>
"""


@pytest.fixture(scope="module")
def link(start_node, tmp_path_factory):
    """The address, with its token, of a node with an arm in the plane z = 0."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "arm.urdf").write_text(URDF)
    scene = folder / "arm.yaml"
    scene.write_text("version: 1\nrobots:\n  - {name: arm, urdf: arm.urdf}\n")
    node = start_node(
        {
            "scene": scene,
            "browser": True,
            "browser_port": 0,
            "browser_token": "secret",
            "browser_control": True,
        }
    )
    node.wait_for_output("browser view at ")
    file = Path(re.search(r"browser view at .* by (/\S+)", node.output())[1])
    return re.search(r'href="(http[^"]+)"', file.read_text())[1]


@pytest.fixture
def page(link):
    """A page with the token."""
    address, query = link.split("?")
    page = PageClient(address, query=f"?{query}")
    page.wish(["illustration"])
    yield page
    page.close()


def upper(page):
    """Return where the ball on the upper arm is, None before that is known."""
    found = [item for item in page.items.values() if item["path"][2] == "arm/upper"]
    found = found or [item for item in page.items.values() if "upper" in item["path"][2]]
    pose = page.poses.get(found[0]["number"]) if found else None
    return None if pose is None else pose[0].tolist()


def test_a_page_moves_joints_within_their_limits(page, client):
    """What it asks for is published, so that others hear it, too; a follower has no slider."""
    page.take_until(lambda: page.sliders)
    listed = page.scenes[-1]["sliders"]
    assert [(s["joint"], s["lower"], s["upper"], s["unit"]) for s in listed] == [
        ("shoulder", -1.5, 3.0, "rad"),
        ("slide", 0.0, 0.25, "m"),
        ("turn", -math.pi, math.pi, "rad"),
    ]
    assert {s["robot"] for s in listed} == {"arm"}
    assert page.sliders == {"positions": [0.0, 0.0, 0.0], "refused": {}}
    page.move("arm", "shoulder", 0.75)
    page.take_until(lambda: page.sliders["positions"][0] == 0.75)
    # The node publishes from the first move on.
    listener = client.listen(JointState, "/joint_states")
    where = page.take_until(lambda: upper(page) and upper(page)[1] > 0.1 and upper(page))
    assert where == pytest.approx([0.5 * math.cos(0.75), 0.5 * math.sin(0.75), 0.0], abs=1e-12)
    page.move("arm", "slide", 7.0)
    page.take_until(lambda: page.sliders["positions"][1] == 0.25)
    page.move("arm", "shoulder", -1e308)
    page.take_until(lambda: page.sliders["positions"][0] == -1.5)
    wait_until(lambda: listener.count >= 1, "the messages")
    newest = listener.newest
    assert (list(newest.name), list(newest.position)) == (["shoulder"], [-1.5])
    client.forget(listener)


def test_what_is_not_there_moves_nothing(page):
    """A robot and joints of other names, and a follower: the page stays."""
    page.take_until(lambda: page.sliders)
    for names in (("nobody", "shoulder"), ("arm", "knee"), ("arm", "follower"), ("", "")):
        page.move(*names, 0.5)
    page.move("arm", "turn", 0.125)
    page.take_until(lambda: page.sliders["positions"][2] == 0.125)


def test_without_the_token_nothing_is_moved(link, start_node):
    """Neither by a page without it, nor in a node that takes none; nor by rubbish."""
    address = link.split("?")[0]
    with pytest.raises(InvalidStatus):
        PageClient(address)
    assert "give a browser_token" in validate({"browser_control": True})[0]
    assert validate({"browser_control": True, "browser_token": "secret"}) == []
    node = start_node({"browser": True, "browser_port": 0}, remaps=["__node:=shy"])
    node.wait_for_output("browser view at ")
    page = PageClient(re.search(r"browser view at (http\S+)", node.output())[1])
    page.take()
    assert page.scenes[-1]["sliders"] == []
    page.move("arm", "shoulder", 0.5)
    assert page.wait_closed() == (1008, "joints can't be moved here")
    page.close()
    assert node.stop() == 0


@pytest.mark.parametrize("position", ["0.5", "NaN", "1e999", "true", '"0.5"', "1" * 400])
def test_rubbish_is_no_move(link, position):
    """Whoever sends it is cut off, except for a number."""
    address, query = link.split("?")
    page = PageClient(address, query=f"?{query}")
    page.socket.send(f'{{"robot": "arm", "joint": "turn", "position": {position}}}')
    if position == "0.5":
        page.take_until(lambda: page.sliders and page.sliders["positions"][2] == 0.5)
        page.close()
    else:
        assert page.wait_closed()[0] == 1008


def test_a_robot_that_somebody_else_moves_is_left_alone(page, client):
    """The page is told who; when that one has left, the joints can be moved again."""
    page.take_until(lambda: page.sliders and not page.sliders["refused"])
    publisher = client.publisher(JointState, "/joint_states")
    reason = page.take_until(lambda: page.sliders["refused"].get("arm"))
    assert reason.endswith("publishes /joint_states")
    wait_until(publisher.get_subscription_count, "the node")
    message = JointState(name=["turn"], position=[1.25])
    message.header.stamp = client.now()
    publisher.publish(message)
    page.take_until(lambda: page.sliders["positions"][2] == 1.25)
    page.move("arm", "turn", -1.0)
    page.wish(["proximity"])
    page.take_until(lambda: page.scenes[-1]["roles"] == ["proximity"])
    assert page.sliders["positions"][2] == 1.25
    client.destroy(publisher)
    page.take_until(lambda: not page.sliders["refused"])
    page.move("arm", "turn", -1.0)
    page.take_until(lambda: page.sliders["positions"][2] == -1.0)


@pytest.mark.slow
@pytest.mark.skipif(find_chromium() is None, reason=REMEDY)
def test_a_slider_in_a_browser_moves_the_robot(link, page):
    """A person drags it by the mouse; another page sees the arm there, and the slider says so."""
    page.take_until(lambda: page.sliders)
    page.move("arm", "shoulder", 0.0)
    tab = Tab(700, 700)
    try:
        tab.open(link)
        tab.wait_for("document.querySelectorAll('#joints input').length === 3")
        tab.wait_for("document.querySelector('#joints output').textContent === '0.000 rad'")
        box = json.loads(
            tab.value(
                "JSON.stringify(document.querySelector('#joints input').getBoundingClientRect())"
            )
        )
        y = box["top"] + box["height"] / 2
        # The thumb is at a third of the way from -1.5 to 3.
        x = box["left"] + box["width"] * (1.5 / 4.5)
        tab.press(x, y, to=(box["right"] - 1, y))
        moved = page.take_until(
            lambda: page.sliders["positions"][0] > 2.5 and page.sliders["positions"][0]
        )
        assert moved <= 3.0
        tab.wait_for("document.querySelector('#joints output').textContent > '2.5'")
        publisher_gone = "!document.querySelector('#joints input').disabled"
        assert tab.value(publisher_gone)
        assert tab.problems == []
    finally:
        tab.close()

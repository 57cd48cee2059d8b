"""A Panda's hand that a person drags in a real browser, and the motion there."""

from __future__ import annotations

import json
import re

from chromium import find_chromium, REMEDY, Tab
from node_harness import wait_until
import numpy as np
import pytest
from trajectory_robot import TrajectoryRobot

from msg_adapters.trajectories import joint_trajectory_from_msg

CELL = "config/scenes/panda_cell.yaml"
NAMES = (*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1")
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02]
PANEL = 300
"""Pixels from the left that the panel covers."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason=REMEDY),
]

STATE = "JSON.parse(document.querySelector('#motion').dataset.state ?? '{}')"


@pytest.fixture(scope="module")
def node(start_node):
    """A node whose pages may do all."""
    return start_node(
        {
            "scene": CELL,
            "browser": True,
            "browser_port": 0,
            "browser_token": "secret",
            "browser_control": True,
            "browser_execute": True,
        }
    )


@pytest.fixture(scope="module")
def robot(client, node):
    """The robot."""
    robot = TrajectoryRobot(client, NAMES, START)
    yield robot
    robot.close()


@pytest.fixture(scope="module")
def tab(node, robot):
    """The page, which holds the robot's hand and shows nothing but handles."""
    address = re.search(r"browser view at (http[^,\s]+)", node.output())[1]
    tab = Tab(900, 600)
    tab.open(f"{address}?token=secret")
    tab.wait_for("document.body?.dataset.items > 0 && !document.querySelector('#motion').hidden")
    choose(tab, "link", json.dumps(["panda", "panda_hand"], separators=(",", ":")))
    tab.wait_for(f"{STATE}.number === 0")
    tab.value("document.documentElement.dataset.theme = 'dark'")
    tab.value("document.querySelector('[data-role=illustration]').click()")
    tab.value("document.querySelector('#contacts').click()")
    tab.wait_for("document.body.dataset.items === '0'")
    yield tab
    assert tab.problems == []
    tab.close()


def choose(tab, name, value):
    """Choose an option, as a person does."""
    tab.value(
        f"""(() => {{ const each = document.querySelector('[name={name}]');
        each.value = {json.dumps(value)}; each.dispatchEvent(new Event("change")); }})()"""
    )
    assert tab.value(f"document.querySelector('[name={name}]').value") == value


def middle(tab, is_it):
    """Wait for what is coloured so, and return its middle (x, y) on the page."""

    def found():
        picture = tab.picture()[:, PANEL:, :3].astype(int)
        y, x = np.nonzero(is_it(*np.moveaxis(picture, 2, 0)))
        return (PANEL + x.mean(), y.mean()) if len(x) > 5 else None

    return wait_until(found, "what is coloured so")


def ball(tab):
    """Return where the ball in the middle of the handles is."""
    return middle(tab, lambda r, g, b: (np.minimum(np.minimum(r, g), b) > 150) & (abs(r - b) < 12))


def moved(tab, by):
    """Do something that moves the handles; wait for the node's answer to the last of it."""
    before = tab.value(f"{STATE}.number")
    by()
    tab.wait_for(f"{STATE}.number > {before}")
    wait_until(lambda: settled(tab), "the answer to the last")


def settled(tab):
    """Tell whether the newest drag has been answered."""
    numbers = [tab.value(f"{STATE}.number") for _ in range(3)]
    return numbers[0] == numbers[-1]


def reach(tab):
    """Return the sentence about the hand."""
    return tab.value("document.querySelector('#motion .reach').textContent")


@pytest.mark.parametrize("way", ["mouse", "finger"])
def test_the_ball_moves_the_hand_in_the_plane_of_the_screen(tab, way):
    """It is where it was dragged to, on the screen, and the hand has come with it."""
    x, y = ball(tab)
    drag = tab.press if way == "mouse" else tab.touch
    moved(tab, lambda: drag(x, y, to=(x + 40, y - 25)))
    assert ball(tab) == pytest.approx((x + 40, y - 25), abs=4.0)
    assert reach(tab) == "reached, and free"
    moved(tab, lambda: drag(x + 40, y - 25, to=(x, y)))
    assert ball(tab) == pytest.approx((x, y), abs=4.0)


def test_an_arrow_moves_it_along_itself_and_a_ring_turns_it(tab):
    """The blue arrow's tip goes down the screen as the hand does; rings leave the ball there."""
    x, y = ball(tab)
    tip = middle(tab, lambda r, g, b: (b > 150) & (b - r > 60) & (np.indices(b.shape)[0] > y + 45))
    assert tip[0] == pytest.approx(x, abs=12.0) and tip[1] > y + 45
    moved(tab, lambda: tab.press(*tip, to=(tip[0] + 30, tip[1] + 20)))
    below = ball(tab)
    assert below[0] == pytest.approx(x, abs=4.0) and y + 8 < below[1] < y + 32
    # Right of the ball is first the red ring, then the green one.
    where = []
    for channel, other in ((0, 1), (1, 0)):
        found = middle(
            tab,
            lambda r, g, b, channel=channel, other=other: (
                ((r, g)[channel] - (r, g)[other] > 70)
                & (abs(np.indices(b.shape)[0] - below[1]) < 3)
                & (np.indices(b.shape)[1] + PANEL - below[0] > 20)
            ),
        )
        where.append(found)
    assert where[0][0] < where[1][0]
    for at in where:
        moved(tab, lambda at=at: tab.press(*at, to=(at[0], at[1] + 15)))
        assert ball(tab) == pytest.approx(below, abs=4.0)


def test_keys_move_it_too(tab):
    """Up by one centimetre, and turned by five degrees."""
    x, y = ball(tab)
    tab.value("document.querySelector('#view').focus()")
    for _ in range(5):
        moved(tab, lambda: tab.key("PageUp"))
    higher = ball(tab)
    assert higher[0] == pytest.approx(x, abs=4.0) and higher[1] < y - 5


def test_a_motion_is_played_before_it_can_be_executed(tab, robot):
    """The button for it comes on at its end; then the robot goes where the hand was dragged."""
    assert tab.value("document.querySelector('[name=execute]').disabled")
    assert reach(tab) == "reached, and free"
    tab.value("document.querySelector('[name=plan]').click()")
    tab.wait_for(f"{STATE}.plan === 1")
    assert tab.value(f"{STATE}.isPlayed || document.querySelector('[name=execute]').disabled")
    tab.wait_for(f"{STATE}.isPlayed")
    said = tab.value("document.querySelector('#motion .keeps').textContent")
    assert re.fullmatch(r"[\d.]+ s; everything keeps [\d.]+ mm, the way at least .* mm .*", said)
    # The line is seen, in green or red.
    middle(tab, lambda r, g, b: (abs(r - g) > 100) & (b < 60))
    tab.value("document.querySelector('[name=execute]').click()")
    tab.wait_for(f"{STATE}.executing")
    _, points = joint_trajectory_from_msg(robot.heard.newest)
    goal = points.positions[-1]
    wait_until(lambda: np.abs(robot.q[:7] - goal).max() < 1e-9, "the robot's arrival")
    tab.wait_for(f"!{STATE}.executing")
    assert not tab.value("document.querySelector('#motion .bad').textContent")

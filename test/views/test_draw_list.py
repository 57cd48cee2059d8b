"""What a reader was shown, and what changed since."""

from __future__ import annotations

import numpy as np
import pytest

from scene_graph_ros.geometry import HalfSpace, Rgba, Sphere
from scene_graph_ros.views.draw_list import DrawItem, DrawList, Shown

RED = Rgba(1.0, 0.0, 0.0)


def item(geometry_id, radius=1.0, group="proximity/arm/hand"):
    """Return a ball to draw."""
    return DrawItem(geometry_id, group, Sphere(radius), RED)


def poses(*heights):
    """Return a pose at each height."""
    X_WG = np.tile(np.eye(4), (len(heights), 1, 1))
    X_WG[:, 2, 3] = heights
    return X_WG


def follow(shown, listed, X_WG):
    """Return what changes, as lists."""
    appeared, vanished, moved = shown.follow(listed, X_WG)
    return appeared.tolist(), sorted(vanished), moved.tolist()


def test_all_is_new_at_first_and_then_only_what_moves():
    """A pose that is bit for bit the same is no move."""
    listed, shown = DrawList([item(3), item(4), item(5)]), Shown()
    assert follow(shown, listed, poses(0, 1, 2)) == ([0, 1, 2], [], [0, 1, 2])
    assert follow(shown, listed, poses(0, 1, 2)) == ([], [], [])
    assert follow(shown, listed, poses(0, 1.5, 2)) == ([], [], [1])
    assert follow(shown, listed, poses(0, np.nextafter(1.5, 2), 2)) == ([], [], [1])


def test_a_new_list_tells_what_came_went_and_looks_different():
    """What is in both lists as it was keeps its pose, whatever row it has now."""
    shown = Shown()
    follow(shown, DrawList([item(3), item(4), item(5)]), poses(0, 1, 2))
    # 4 goes, 5 gets another size, 6 is new, and 3 is moved, in another order.
    listed = DrawList([item(6), item(5, radius=2.0), item(3)])
    changes = follow(shown, listed, poses(3, 2, 0.5))
    assert changes == ([0, 1], [("proximity/arm/hand", 4)], [0, 1, 2])
    assert follow(shown, listed, poses(3, 2, 0.5)) == ([], [], [])


def test_a_geometry_in_two_groups_is_two_items():
    """Each role of a geometry comes and goes by itself."""
    both = [item(3), item(3, group="illustration/arm/hand")]
    shown = Shown()
    assert follow(shown, DrawList(both), poses(0, 0)) == ([0, 1], [], [0, 1])
    vanished = [("illustration/arm/hand", 3)]
    assert follow(shown, DrawList(both[:1]), poses(0)) == ([], vanished, [])


def test_what_comes_back_before_anybody_was_told_has_not_vanished():
    """It is new, as its look may be another, but not to be deleted after it was drawn."""
    shown = Shown()
    shown.set_items([item(3), item(4)])
    shown.set_items([item(3)])
    shown.set_items([item(3), item(4)])
    assert shown.take_vanished() == []
    assert shown.moved(poses(0, 1)).tolist() == [0, 1]


def test_two_readers_of_a_list_do_not_disturb_each_other():
    """A list is shared; what was shown is each reader's own."""
    listed = DrawList([item(3), item(4)])
    first, second = Shown(), Shown()
    follow(first, listed, poses(0, 0))
    follow(first, listed, poses(1, 0))
    assert follow(second, listed, poses(1, 0)) == ([0, 1], [], [0, 1])
    assert follow(first, listed, poses(1, 2)) == ([], [], [1])


def test_half_spaces_are_told_by_their_rows():
    """They have no end, so that every viewer has to treat them otherwise."""
    floor = DrawItem(9, "proximity/cell/world", HalfSpace(), None)
    assert DrawList([item(3), floor, item(4)]).half_spaces.tolist() == [1]


def test_wrong_lists_and_poses_are_refused():
    """The same geometry twice, and poses that are not one for each item."""
    with pytest.raises(ValueError, match="same group and geometry id"):
        DrawList([item(3), item(3, radius=2.0)])
    shown = Shown()
    with pytest.raises(ValueError, match=r"2 items .* not \(1, 4, 4\)"):
        shown.follow(DrawList([item(3), item(4)]), poses(0))

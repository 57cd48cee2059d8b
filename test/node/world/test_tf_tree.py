"""The tree of transforms: chains through frames of anybody, composed at one time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.node.world import tf_tree
from scene_graph_ros.node.world.tf_tree import HISTORY, MissingTransformError, STATIC, TfTree


def at(x, yaw=0.0):
    """Return a pose at x, turned about z."""
    return pose_from_xyz_rpy((x, 0.0, 0.0), (0.0, 0.0, yaw))


def placed_x(tree, frame, base="map"):
    """Return the position of a frame along x, and its stamp."""
    X, stamp = tree.place(frame, base)
    return float(X[0, 3]), stamp


@pytest.fixture
def tree():
    """Map -> odom moves slowly, odom -> base fast, base -> cup is static."""
    tree = TfTree()
    tree.put("cup", "base", at(1.0), 5, is_static=True)
    for stamp in (100, 200):
        tree.put("odom", "map", at(0.01 * stamp), stamp, is_static=False)
    for stamp in (100, 150, 180, 220):
        tree.put("base", "odom", at(0.1 * stamp), stamp, is_static=False)
    return tree


def test_a_chain_is_composed_at_the_newest_time_that_all_of_it_has(tree):
    """At 200 the base is half way from 18 to 22: 2 + 20 + 1; what is static has no say."""
    assert placed_x(tree, "cup") == (pytest.approx(23.0), 200)
    assert placed_x(tree, "cup", "base") == (1.0, STATIC)


def test_the_newest_of_each_is_another_answer():
    """Then the parts are of several times, and the stamp is that of the oldest."""
    tree = TfTree(interpolates=False)
    tree.put("odom", "map", at(2.0), 200, is_static=False)
    tree.put("base", "odom", at(22.0), 220, is_static=False)
    assert placed_x(tree, "base") == (24.0, 200)


def test_frames_of_two_branches_and_from_below(tree):
    """The chain goes up to the frame that both have above them, and down again."""
    tree.put("lamp", "map", at(-4.0), 0, is_static=True)
    assert placed_x(tree, "cup", "lamp") == (pytest.approx(27.0), 200)
    assert placed_x(tree, "map", "cup") == (pytest.approx(-23.0), 200)
    assert placed_x(tree, "cup", "cup") == (0.0, STATIC)


def test_turns_are_interpolated_the_short_way():
    """Half way from 170 to -170 degrees is 180, not 0."""
    tree = TfTree()
    tree.put("a", "map", at(0.0, math.radians(170)), 0, is_static=False)
    tree.put("a", "map", at(0.0, math.radians(-170)), 20, is_static=False)
    tree.put("b", "a", at(1.0), 10, is_static=False)
    X, _ = tree.place("b", "map")
    np.testing.assert_allclose(X[:3, 3], [-1.0, 0.0, 0.0], atol=1e-12)


def test_transforms_out_of_order_are_put_between_the_others(tree):
    """What comes late makes what is between two times more exact; the newest holds."""
    assert not tree.put("base", "odom", at(0.0), 180, is_static=False)
    assert tree.put("base", "odom", at(19.0), 200, is_static=False)
    assert placed_x(tree, "cup")[0] == pytest.approx(2.0 + 19.0 + 1.0)
    assert tree.newest("base") == 220


@pytest.mark.parametrize(
    ("frame", "base", "words"),
    [
        ("cup", "earth", "'cup' hangs on 'map', which no transform places in anything"),
        ("ghost", "map", "no transform places 'ghost' in anything"),
        ("cup", "stray", "hangs on 'map', .* and 'stray' on 'nowhere'"),
    ],
)
def test_what_is_missing_in_a_chain_is_named(tree, frame, base, words):
    """The frame at which it ends, on both sides."""
    tree.put("stray", "nowhere", at(0.0), 0, is_static=True)
    with pytest.raises(MissingTransformError, match=words):
        tree.place(frame, base)


def test_a_time_before_all_that_is_kept_is_named(tree):
    """A transform that began later than the newest of another can't be known then."""
    tree.put("late", "base", at(0.0), 300, is_static=False)
    with pytest.raises(MissingTransformError, match="'late' in 'base' is not known"):
        tree.place("late", "map")
    tree.put("odom", "map", at(3.0), 400, is_static=False)
    tree.put("base", "odom", at(3.0), 400, is_static=False)
    tree.put("late", "base", at(3.0), 400, is_static=False)
    assert placed_x(tree, "late") == (9.0, 400)


def test_loops_end():
    """Two frames that hang on each other have no place."""
    tree = TfTree()
    tree.put("a", "b", at(1.0), 0, is_static=True)
    tree.put("b", "a", at(1.0), 0, is_static=True)
    with pytest.raises(MissingTransformError):
        tree.place("a", "map")


def test_a_frame_gets_another_parent_by_what_is_newer(tree):
    """An object that was grasped; what is older than that changes nothing."""
    assert tree.put("cup", "map", at(7.0), 300, is_static=False)
    assert placed_x(tree, "cup") == (7.0, 300)
    assert not tree.put("cup", "base", at(1.0), 250, is_static=False)


def test_old_transforms_are_forgotten():
    """Ten seconds are kept; after the clock jumped back nothing later is."""
    tree = TfTree()
    for k in range(40):
        tree.put("a", "map", at(k), k * HISTORY // 10, is_static=False)
    assert len(tree._edges["a"].stamps) == 11
    tree.forget(35 * HISTORY // 10)
    assert placed_x(tree, "a") == (35.0, 35 * HISTORY // 10)
    tree.forget(0)
    with pytest.raises(MissingTransformError):
        tree.place("a", "map")


def test_a_flood_of_frames_takes_bounded_memory_and_leaves_those_that_are_known(monkeypatch):
    """Of what is heard twice a history, and silent then; new frames are taken again after it."""
    monkeypatch.setattr(tf_tree, "_MOST_FRAMES", 100)
    monkeypatch.setattr(tf_tree, "_MOST_IN_ALL", 500)
    tree, step = TfTree(), HISTORY // 100
    tree.put("lid", "map", at(3.0), STATIC, is_static=True)
    for k in range(100):
        tree.put("base", "map", at(k), k * step, is_static=False)
        for n in range(10):
            tree.put(f"flood{n}", "map", at(0.0), k * step, is_static=False)
            tree.put(f"flood{k}_{n}", "map", at(0.0), k * step, is_static=False)
    kept = sum(len(edge.stamps) for edge in tree._edges.values())
    assert kept == tree._count <= 500 + 2 * 100
    assert len(tree._edges) == 100
    assert placed_x(tree, "base") == (99.0, 99 * step)
    assert not tree.put("late", "map", at(1.0), 99 * step, is_static=False)
    assert not tree.put("fixed", "map", at(1.0), STATIC, is_static=True)
    assert placed_x(tree, "base") == (99.0, 99 * step)
    later = 100 * step + HISTORY
    tree.put("base", "map", at(7.0), later, is_static=False)
    assert tree.put("late", "map", at(1.0), later, is_static=False)
    assert set(tree._edges) == {"lid", "base", "late"}
    assert placed_x(tree, "lid") == (3.0, STATIC)
    assert sum(len(edge.stamps) for edge in tree._edges.values()) == tree._count

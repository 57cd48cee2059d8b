"""Masks of degrees of freedom: sets of them, arrays cut and put back, joints and groups."""

import numpy as np
import pytest

from scene_graph_ros.planning import CollisionCheckerError, DofMask
from scene_graph_ros.scene_files import load_kinematic_tree

URDF = """<robot name="r"><link name="world"/><link name="a"/><link name="b"/><link name="c"/>
  <joint name="base" type="planar"><parent link="world"/><child link="a"/></joint>
  <joint name="lift" type="prismatic"><parent link="a"/><child link="b"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="twin" type="prismatic"><parent link="b"/><child link="c"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="lift"/></joint></robot>"""


def test_masks_are_sets():
    """With the laws of sets."""
    one, other = DofMask([True, True, False, False]), DofMask([True, False, True, False])
    assert one.union(other) == DofMask([True, True, True, False])
    assert one.intersect(other) == DofMask([True, False, False, False])
    assert one.subtract(other) == DofMask([False, True, False, False])
    assert one.complement() == DofMask([False, False, True, True])
    assert one.subtract(other) == one.intersect(other.complement())
    assert (one.size, one.count, one.complement().count) == (4, 2, 2)
    assert len({one, DofMask(np.array([1, 1, 0, 0], dtype=bool)), other}) == 2
    assert one != [True, True, False, False]
    assert DofMask([]).size == 0


def test_arrays_are_cut_and_put_back():
    """One and many, and the places of both ways."""
    mask = DofMask([False, True, False, True])
    full = np.arange(8.0).reshape(2, 4)
    assert mask.get_from_array(full[0]).tolist() == [1.0, 3.0]
    assert mask.get_from_array(full).tolist() == [[1.0, 3.0], [5.0, 7.0]]
    put = mask.set_in_array([-1.0, -3.0], full)
    assert put.tolist() == [[0.0, -1.0, 2.0, -3.0], [4.0, -1.0, 6.0, -3.0]]
    assert full[0, 1] == 1.0
    assert mask.set_in_array(mask.get_from_array(full), full).tolist() == full.tolist()
    assert mask.get_selected_to_full_index().tolist() == [1, 3]
    assert mask.get_full_to_selected_index() == [None, 0, None, 1]


def test_joints_by_name(tmp_path):
    """A planar one has three positions, one that follows another has none."""
    path = tmp_path / "r.urdf"
    path.write_text(URDF)
    tree = load_kinematic_tree(path)
    assert DofMask.make_from_model(tree, ["base"]).selected.tolist() == [True, True, True, False]
    assert DofMask.make_from_model(tree, ["lift", "twin"]).selected.tolist() == [False] * 3 + [
        True
    ]
    assert DofMask.make_from_model(tree, []).count == 0
    with pytest.raises(CollisionCheckerError, match="there is no joint 'lifft'"):
        DofMask.make_from_model(tree, ["lifft"])
    for wrong in ([3], [None], [["lift"]]):
        with pytest.raises(CollisionCheckerError, match="there is no joint"):
            DofMask.make_from_model(tree, wrong)
    for wrong in (3, None):
        with pytest.raises(CollisionCheckerError, match=f"of must be .*, not {wrong}"):
            DofMask.make_from_model(tree, wrong)
    with pytest.raises(CollisionCheckerError, match="tree must be a KinematicTree, not 'arm'"):
        DofMask.make_from_model("arm", ["lift"])


@pytest.mark.parametrize(
    "selected", [[0, 1], [[True]], "yes", None, [True, None], [[True], []], [[]]]
)
def test_what_is_no_mask_is_refused(selected):
    """Numbers are no truth values."""
    with pytest.raises(CollisionCheckerError, match="DofMask: selected must be True or False"):
        DofMask(selected)


def test_other_sizes_are_refused():
    """Of masks and of arrays."""
    mask = DofMask([True, False])
    for question in ("union", "intersect", "subtract"):
        with pytest.raises(CollisionCheckerError, match="other must be a DofMask of 2"):
            getattr(mask, question)(DofMask([True]))
    with pytest.raises(CollisionCheckerError, match="get_from_array: full_array must be numbers"):
        mask.get_from_array([1.0, 2.0, 3.0])
    with pytest.raises(
        CollisionCheckerError, match="set_in_array: selected_values must be numbers"
    ):
        mask.set_in_array([1.0, 2.0], [0.0, 0.0])
    with pytest.raises(CollisionCheckerError, match="don't go into"):
        mask.set_in_array(np.ones((3, 1)), np.zeros((2, 2)))

"""When an array counts as free: nobody but one local variable refers to it."""

import sys

import numpy as np

from scene_graph_ros.geometry.model.references import UNSHARED


def test_a_local_array_is_free_and_one_that_others_hold_is_not():
    """On every interpreter, however its calls take arguments; a view holds its array, too."""
    array = np.zeros(3)
    assert sys.getrefcount(array) == UNSHARED
    view = array[1:]
    assert sys.getrefcount(array) > UNSHARED
    del view
    held = [array]
    assert sys.getrefcount(array) > UNSHARED
    del held
    assert sys.getrefcount(array) == UNSHARED

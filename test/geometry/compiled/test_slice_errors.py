"""Assignments to slices that do not fit raise; kernels have no code that writes numbers."""

import numba
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import kernel

pytestmark = pytest.mark.compiled


@pytest.fixture
def fills(tmp_path, monkeypatch):
    """Kernels that are compiled for this test: one that assigns to a slice, and a caller."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path))

    @kernel
    def fill(target, source):
        target[1:] = source

    @kernel
    def fill_twice(target, source):
        fill(target, source)
        target[1:, 0] = source[0, 0]
        target[1:] = source

    return fill, fill_twice


def test_what_fits_is_assigned(fills):
    """Also where one row stands for all, or where both are the same array."""
    fill, fill_twice = fills
    a = np.zeros((4, 3))
    fill_twice(a, np.arange(3.0)[np.newaxis])
    assert a.tolist() == [[0.0, 0.0, 0.0], *[[0.0, 1.0, 2.0]] * 3]
    b = np.arange(12.0).reshape(4, 3)
    fill(b, b[:-1])
    assert b[1:].tolist() == np.arange(9.0).reshape(3, 3).tolist()


def test_what_does_not_fit_raises_and_no_text_is_compiled(fills):
    """Neither in a kernel nor, by way of it, in its callers."""
    fill, fill_twice = fills
    with pytest.raises(ValueError, match="cannot assign slice"):
        fill_twice(np.zeros((4, 3)), np.zeros((2, 3)))
    (code,) = fill_twice.overloads.values()
    (called,) = fill.callees.results.values()
    for library in (code.library, called.library):
        names = [f.name for f in library._final_module.functions]
        assert names
        assert not any("unicode" in name for name in names)


def test_functions_of_others_keep_the_shapes():
    """In the same process, before and after ours are compiled."""

    def fill_others(target, source):
        target[1:] = source

    with pytest.raises(ValueError, match=r"of shape \(3,\) from input of shape \(2,\)"):
        numba.njit(fill_others)(np.zeros(4), np.zeros(2))

"""Kernels that are called by their address."""

import os

import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.entry_points import entry_point
from scene_graph_ros.geometry.compiled.kernel import compilation_count, lean_kernel


def _weighed(values, factor, start):
    total = start[0]
    for value in values:
        total += factor * value
    if total < 0.0:
        raise ValueError("a sum below zero")
    return total, (start[1], total > 1.0)


_WEIGHED = entry_point(_weighed, (np.zeros(1), 0.0, (0.0, 0)))
_weighed_at = _WEIGHED.call


@lean_kernel
def _twice(address, values, factor):
    first, (place, _) = _weighed_at(address, (values, factor, (0.0, 7)))
    second, (other, is_large) = _weighed_at(address, (values, 0.5 * factor, (first, place)))
    return second, other, is_large


@lean_kernel
def _with_whole_numbers(address, values):
    return _weighed_at(address, (values, 2, (0.0, 7)))


def test_gives_what_the_function_gives():
    """Numbers, tuples and arrays go in and out as they are."""
    assert _twice(_WEIGHED.address(), np.array([1.0, 2.0]), 4.0) == (18.0, 7, True)
    assert _twice(_WEIGHED.address(), np.array([1.0, 2.0]), 0.0) == (0.0, 7, False)


def test_its_errors_are_raised():
    """An error of the called reaches Python through its caller."""
    with pytest.raises(ValueError, match="a sum below zero"):
        _twice(_WEIGHED.address(), np.array([-1.0]), 1.0)


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_other_types_do_not_compile():
    """An integer's bytes are not read as a double's."""
    with pytest.raises(Exception, match=r"_weighed takes .*float64.* not .*int64"):
        _with_whole_numbers(_WEIGHED.address(), np.zeros(1))


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_is_compiled_once_for_all():
    """Its address stays, and its callers do not have it compiled."""
    _twice(_WEIGHED.address(), np.zeros(1), 1.0)
    before = compilation_count()
    address = _WEIGHED.address()
    _twice(address, np.zeros(3), 2.0)
    assert _WEIGHED.address() == address
    assert compilation_count() == before

"""Tuples that kernels take as one array are those that were held."""

from typing import NamedTuple

import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.tables.holding import Holding


class Inner(NamedTuple):
    """Arrays of one type."""

    first: np.ndarray
    second: np.ndarray


class Outer(NamedTuple):
    """Arrays of several types, and a tuple."""

    flags: np.ndarray
    inner: Inner
    pairs: np.ndarray


def make(flags, first, second, pairs):
    """Return arrays of the types that kernels are compiled for."""
    return Outer(
        np.array(flags, np.bool_),
        Inner(np.array(first, float), np.array(second, float)),
        np.array(pairs, np.int64).reshape(-1, 2),
    )


HOLDING = Holding("an Outer", lambda: make([], [], [], []))
_borrowed = HOLDING.borrowed


@lean_kernel
def _read(places):
    outer = _borrowed(places)
    outer.inner.first[0] += 1.0
    return outer.flags[1], outer.inner.first[0], outer.inner.second[2], outer.pairs[1, 0]


def test_kernel_reads_and_writes_what_is_held():
    """Each array is in its place, whatever was held since, and it is the array itself."""
    held = make([0, 1], [2.0], [0.0, 0.0, 5.0], [1, 2, 3, 4])
    other = make([1, 0], [7.0], [0.0, 0.0, 8.0], [5, 6, 9, 8])
    places, others = HOLDING.places(held), HOLDING.places(other)
    assert _read(places) == (True, 3.0, 5.0, 3)
    assert _read(others) == (False, 8.0, 8.0, 9)
    assert _read(places) == (True, 4.0, 5.0, 3)
    assert held.inner.first[0] == 4.0


def test_what_kernels_were_not_compiled_for_is_refused():
    """A read-only array, or one of another type, is an error with the name of what is wanted."""
    held = make([0, 1], [2.0], [3.0], [1, 2])
    with pytest.raises(TypeError, match="an Outer"):
        HOLDING.places(held._replace(pairs=held.pairs.astype(float)))
    frozen = held.flags.copy()
    frozen.setflags(write=False)
    with pytest.raises(TypeError, match="an Outer"):
        HOLDING.places(held._replace(flags=frozen))

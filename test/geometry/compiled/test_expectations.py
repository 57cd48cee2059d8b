"""What is rare is told to the compiler, and changes nothing else."""

import os

import numba
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.expectations import is_rare
from scene_graph_ros.geometry.compiled.kernel import kernel


@kernel
def _count_above(numbers, limit):
    count = 0
    for number in numbers:
        if is_rare(number > limit):
            count += 1
    return count


@pytest.mark.parametrize("limit", [-np.inf, 0.25, 0.999, np.inf])
def test_a_condition_stays_what_it_is_however_often_it_holds(limit):
    """Also where the hint is wrong all the time."""
    numbers = np.random.default_rng(1).random(1000)
    assert _count_above(numbers, limit) == np.count_nonzero(numbers > limit)


@pytest.mark.parametrize("number", [np.nan, -np.nan])
def test_nan_is_above_nothing(number):
    """A comparison with nan is false, and stays so."""
    assert _count_above(np.array([number]), -np.inf) == 0


def _weighed(number):
    if is_rare(not 1e-200 < number < 1e200):
        return np.sqrt(number) + 1.0
    return number


def _plain(number):
    if not 1e-200 < number < 1e200:
        return np.sqrt(number) + 1.0
    return number


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
@pytest.mark.parametrize(("function", "is_told"), [(_weighed, True), (_plain, False)])
def test_the_compiler_is_told(function, is_told):
    """LLVM gives the branch the weights of what it was told to expect, 2000 to 1.

    A kernel that comes out of the cache is machine code only, so these are none.
    """
    compiled = numba.njit(function)
    assert compiled(4.0) == 4.0
    (text,) = compiled.inspect_llvm().values()
    assert ("i32 2000" in text) == is_told

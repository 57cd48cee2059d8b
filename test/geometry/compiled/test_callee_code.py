"""Kernels that only kernels call have no machine code; those that Python calls, too, have."""

import numba.core.config
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled import cache, callee_code
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel

pytestmark = pytest.mark.skipif(
    bool(numba.core.config.DISABLE_JIT), reason="nothing is compiled without numba's compiler"
)


@pytest.fixture(name="folder", autouse=True)
def _folder(tmp_path, monkeypatch):
    """Place the cache in a folder of the test's own."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def _declared():
    """Declare kernels as a new process does: one that refuses, and two layers above it."""

    @kernel
    def root_of(x):
        if x < 0.0:
            raise ValueError("roots are of what is not negative")
        return np.sqrt(np.full(2, x))

    @kernel
    def sum_of_roots(x):
        return root_of(x)[0] + root_of(x)[1]

    @kernel
    def twice(x):
        return 2.0 * sum_of_roots(x)

    return root_of, sum_of_roots, twice


def _compiled(*kernels):
    return [sum(each.stats.cache_misses.values()) for each in kernels]


def _wrapper(dispatcher):
    (result,) = dispatcher.callees.results.values()
    names = [function.name for function in result.library._final_module.functions]
    return [name for name in names if "cpython" in name or "cfunc" in name]


def test_what_kernels_call_has_no_machine_code(folder):
    """Nor a wrapper for Python; the next process finds all that it needs."""
    for is_first in (True, False):
        kernels = _declared()
        root_of, sum_of_roots, twice = kernels
        assert twice(4.0) == 8.0
        assert [len(each.overloads) for each in kernels] == [0, 0, 1]
        assert _compiled(*kernels) == [is_first] * 3
        if is_first:
            assert _wrapper(root_of) == _wrapper(sum_of_roots) == []
    assert len(list(folder.rglob("*.nbi"))) == 3


def test_what_python_calls_later_is_compiled_for_it_once():
    """From the bitcode of what it calls; what calls it goes on as before."""
    for compiled_before in ([1, 2, 1], [0, 0, 0]):
        kernels = _declared()
        _, sum_of_roots, twice = kernels
        assert twice(4.0) == 8.0
        assert sum_of_roots(9.0) == 6.0
        assert twice(9.0) == 12.0
        assert _compiled(*kernels) == compiled_before


def test_large_kernels_are_merged_where_python_calls(monkeypatch):
    """Callers only declare them; what is called along two ways is there once."""
    monkeypatch.setattr(callee_code, "_LARGE", 0)
    for is_first in (True, False):

        @kernel
        def leaf(x):
            if x < 0.0:
                raise ValueError("not of what is negative")
            return np.sqrt(np.full(2, x))[1]

        @inlined_kernel
        def inlined(x):
            return leaf(x) + 1.0

        @kernel
        def left(x):
            return inlined(x) * 2.0

        @kernel
        def right(x):
            return leaf(x) + left(x)

        @kernel
        def top(x):
            return left(x) - right(x)

        assert top(4.0) == -2.0
        with pytest.raises(ValueError, match="not of what is negative"):
            top(-1.0)
        kernels = (leaf, inlined, left, right, top)
        assert _compiled(*kernels) == [is_first] * 5
        if is_first:
            (of_right,) = right.callees.results.values()
            defined = {each.name for each in of_right.library.get_defined_functions()}
            (of_leaf,), (of_left,) = (each.callees.results.values() for each in (leaf, left))
            names = {each.fndesc.llvm_func_name for each in (of_leaf, of_left)}
            assert names.isdisjoint(defined)
            assert len(of_right.library.late) == 2


@pytest.mark.parametrize("calls_first", [0, 1, 2])
def test_what_a_merged_kernel_raises_reaches_python(calls_first):
    """Whichever layer is compiled first, and also where all are loaded."""
    for _ in range(2):
        kernels = _declared()
        for each in (kernels[calls_first], *kernels):
            with pytest.raises(ValueError, match="roots are of what is not negative"):
                each(-1.0)


def test_a_kernel_of_other_types_is_another_one():
    """Each is compiled for its callers, and none for Python."""

    @lean_kernel
    def larger(x, y=1):
        return x if x > y else y

    @lean_kernel
    def both(x, k):
        return larger(x) + larger(k, y=3)

    assert both(0.5, 2) == 4.0
    assert len(larger.callees.results) == 2
    assert not larger.overloads
    assert larger(5) == 5


def test_kernels_are_written_while_others_are_compiled(folder):
    """All of them are there when that ends, also where it ends with an error."""
    with cache.written_behind():
        assert _declared()[2](4.0) == 8.0
    kernels = _declared()
    assert kernels[2](4.0) == 8.0
    assert _compiled(*kernels) == [0, 0, 0]
    with pytest.raises(ValueError, match="not negative"), cache.written_behind():
        kernels[1](-1.0)
    kernels = _declared()
    assert kernels[1](1.0) == 2.0
    assert _compiled(*kernels) == [0, 0, 0]
    assert not list(folder.rglob("*.tmp"))

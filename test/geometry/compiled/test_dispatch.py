"""A function that calls what a table names for the kinds of its arguments."""

import pytest

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel


@inlined_kernel
def _half(of_x):
    return 0.5 * of_x


@inlined_kernel
def _sum(of_x, of_y):
    return of_x + of_y


@inlined_kernel
def _product(of_y, half):
    return half * of_y


@inlined_kernel
def _nothing():
    return -1.0


PAIRS = {(0, 1): _sum, (2, 2): _product}


@by_kind(lean_kernel, ["i", "j"], PAIRS, otherwise=_nothing, given={"half": _half})
def _of_pairs(i, j, of_x, of_y):
    """Return what the table says."""


@by_kind(lean_kernel, ["kinds[1]"], {4: _sum, 5: _half, 6: _sum})
def _of_kind(kinds, of_x, of_y):
    """Return what the table says, which is complete."""


def test_the_kernel_of_the_kinds_is_called_with_what_it_names():
    """Parameters by their names, in its own order, and what is made of them."""
    assert _of_pairs(0, 1, 3.0, 5.0) == 8.0
    assert _of_pairs(2, 2, 3.0, 5.0) == 7.5
    assert _of_pairs(1, 0, 3.0, 5.0) == _of_pairs(2, 1, 3.0, 5.0) == -1.0


def test_a_complete_table_needs_no_other_case():
    """What several kinds share comes last: it is what unknown ones would get, too."""
    assert [_of_kind((0, kind), 3.0, 5.0) for kind in (4, 5, 6)] == [8.0, 1.5, 8.0]


def test_the_function_keeps_its_name_and_description():
    """Of the head that stands in the source, where a profile or a message points to it."""
    assert _of_pairs.__name__ == "_of_pairs"
    assert _of_pairs.__doc__ == "Return what the table says."
    written = getattr(_of_pairs, "py_func", _of_pairs)
    assert written.__code__.co_filename == __file__


def test_a_kernel_that_takes_what_nobody_gives_is_an_error():
    """When the function is made, not when it is called."""

    def question(of_x):
        """Be asked."""

    with pytest.raises(TypeError, match="takes 'of_y', which nobody gives it"):
        by_kind(inlined_kernel, ["of_x"], {0: _sum})(question)

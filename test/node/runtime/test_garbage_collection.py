"""Python's collector rests while a scene is made, in a process of the node's alone."""

from __future__ import annotations

import gc

import pytest

from scene_graph_ros.node.runtime.garbage_collection import (
    at_rest,
    keep_what_is_there,
    LARGE,
    look_at_all_again,
    start_without,
)


@pytest.fixture(autouse=True)
def as_a_program_begins():
    """The collector looks at all; that of the tests passes over what their modules hold."""
    gc.unfreeze()
    yield
    gc.freeze()


@pytest.fixture
def own_process():
    """A process that began as the node's does."""
    keep_what_is_there()
    yield
    look_at_all_again()


def test_a_large_change_is_never_looked_through(own_process):
    """No collection while it is made, and none of what it left; small ones leave no such mark."""
    before = gc.get_freeze_count()
    with at_rest():
        assert not gc.isenabled()
        small = [[] for _ in range(10)]
    assert gc.isenabled()
    assert gc.get_freeze_count() == before
    with at_rest():
        large = [[] for _ in range(2 * LARGE)]
    assert gc.isenabled()
    assert gc.get_freeze_count() >= before + len(large) + len(small)


def test_a_start_is_never_looked_through():
    """The collector is off until all is there, and passes over that when it is on."""
    start_without()
    assert not gc.isenabled()
    made = [[] for _ in range(LARGE)]
    keep_what_is_there()
    try:
        assert gc.isenabled()
        assert gc.get_freeze_count() >= len(made)
    finally:
        look_at_all_again()


def test_a_change_that_fails_leaves_the_collector_at_work(own_process):
    """It is on again, whatever was raised."""
    with pytest.raises(RuntimeError, match="no"), at_rest():
        raise RuntimeError("no")
    assert gc.isenabled()


def test_another_programs_collector_is_left_alone():
    """Where the process did not begin so, it stays on and looks at all."""
    assert gc.get_freeze_count() == 0
    with at_rest():
        assert gc.isenabled()
        large = [[] for _ in range(2 * LARGE)]
    assert gc.get_freeze_count() == 0
    assert len(large) == 2 * LARGE

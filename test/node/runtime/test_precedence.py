"""Who updates goes before; who stands back goes on as soon as that one waits, or after a while."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
import threading

import pytest

from scene_graph_ros.node.runtime.precedence import Precedence
from scene_graph_ros.node.world.handles import new_token
from scene_graph_ros.node.world.world import World

DEADLINE = 60.0
"""Seconds after which a test gives up: far more than anything takes on a busy machine."""


@pytest.fixture
def pool():
    """A thread."""
    with ThreadPoolExecutor(1) as pool:
        yield pool


@pytest.mark.parametrize("end", ["taken", "left"])
def test_others_stand_back_until_precedence_is_given_up(pool, end):
    """Be it at the end, or for as long as the one who has it waits."""
    precedence, order = Precedence(DEADLINE, step=0.0), []

    def stand_back():
        precedence.stand_back()
        order.append("the other")

    with precedence.taken():
        other = pool.submit(stand_back)
        order.append("the update")
        if end == "left":
            with precedence.left():
                other.result(DEADLINE)
            order.append("the next update")
    other.result(DEADLINE)
    assert order == ["the update", "the other", "the next update"][: 3 if end == "left" else 2]


def test_nobody_stands_back_for_nothing():
    """Without an update, and after one that failed, a step goes on at once."""
    precedence = Precedence(DEADLINE, step=0.0)
    precedence.stand_back()
    with pytest.raises(ZeroDivisionError), precedence.taken():
        raise ZeroDivisionError
    precedence.stand_back()


def test_others_go_on_after_a_while_where_updates_never_end():
    """A thread that never waits does not keep the scene from being changed."""
    precedence = Precedence(1e-3, step=0.0)
    with precedence.taken():
        precedence.stand_back()


def test_others_stand_back_once_a_step():
    """Who asks after each little thing does not wait each time."""
    precedence = Precedence(DEADLINE, step=DEADLINE)
    precedence.stand_back()
    with precedence.taken():
        precedence.stand_back()


def test_an_edit_stands_back_between_its_steps(pool):
    """Neither the change begins while the world is updated, nor after it what prepares effects."""
    precedence, done = Precedence(DEADLINE, step=0.0), []
    world, has_changed = World(precedence=precedence), threading.Event()
    update = ExitStack()

    def change(edit):
        edit.add_source("a", token=new_token())
        done.append("change")
        update.enter_context(precedence.taken())
        has_changed.set()

    with precedence.taken():
        edited = pool.submit(world.edit, change, lambda snapshot: done.append("preparation"))
        done.append("update")
    assert has_changed.wait(DEADLINE)
    done.append("update")
    update.close()
    assert edited.result(DEADLINE)[1].scene_version == 1
    assert done == ["update", "change", "update", "preparation"]

"""A thread beside the updates: nobody waits longer than they said, and the newest wins."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from scene_graph_ros.node.effects.answer_thread import AnswerThread, Found

DEADLINE = 60.0
"""Seconds after which a test gives up: far more than anything takes on a busy machine."""

AT_ONCE = 0.0


class Question:
    """Answers with the snapshot's number, once it may; tells of what was late."""

    def __init__(self):
        self.may_answer = threading.Event()
        self.is_late = threading.Event()
        self.asked = []

    def __call__(self, snapshot):
        """Wait until it may, and answer."""
        self.asked.append(snapshot.number)
        assert self.may_answer.wait(DEADLINE)
        if snapshot.number < 0:
            raise ZeroDivisionError(f"of {snapshot.number}")
        return snapshot.number


@pytest.fixture
def question():
    """A question that has to wait."""
    question = Question()
    yield question
    question.may_answer.set()


@pytest.fixture
def thread(question):
    """A thread for the question."""
    thread = AnswerThread(question, question.is_late.set)
    yield thread
    thread.close()


def snapshot(number):
    """Return what stands for a snapshot."""
    return SimpleNamespace(number=number)


def test_an_answer_in_time_is_given_once_for_each_snapshot(question, thread):
    """Asked again about the same snapshot, nothing is computed."""
    question.may_answer.set()
    first, second = snapshot(1), snapshot(2)
    assert thread.ask(first, DEADLINE) == 1
    assert thread.ask(first, AT_ONCE) == 1
    assert thread.ask(second, DEADLINE) == 2
    assert question.asked == [1, 2]
    assert not question.is_late.is_set()


def test_nobody_waits_for_what_is_late_and_the_newest_wins(question, thread):
    """While the first is looked at, later ones are passed over; the first is told of and kept."""
    first, last = snapshot(1), snapshot(3)
    assert thread.ask(first, AT_ONCE) is None
    assert thread.ask(snapshot(2), DEADLINE) is None
    assert thread.ask(last, DEADLINE) is None
    assert thread.newest is None
    question.may_answer.set()
    assert question.is_late.wait(DEADLINE)
    assert thread.ask(first, AT_ONCE) == 1
    assert thread.newest == Found(first, 1)
    assert thread.ask(last, DEADLINE) == 3
    assert question.asked == [1, 3]
    assert thread.seconds() > 0.0


def test_what_goes_wrong_is_raised_where_it_was_asked(question, thread):
    """At once, or when a late one is taken; the next question is answered."""
    question.may_answer.set()
    with pytest.raises(ZeroDivisionError, match="of -1"):
        thread.ask(snapshot(-1), DEADLINE)
    question.may_answer.clear()
    assert thread.ask(snapshot(-2), AT_ONCE) is None
    question.may_answer.set()
    assert question.is_late.wait(DEADLINE)
    with pytest.raises(ZeroDivisionError, match="of -2"):
        thread.ask(snapshot(4), DEADLINE)
    assert thread.ask(snapshot(4), DEADLINE) == 4

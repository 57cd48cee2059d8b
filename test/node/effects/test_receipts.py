"""Who is waited for before another message goes out: everybody shortly, the stuck one once."""

from __future__ import annotations

import pytest

from scene_graph_ros.node.effects.receipts import Receipts

DEPTH = 3


class Topic:
    """A topic with readers who acknowledge, or don't, and a clock that a test moves."""

    def __init__(self):
        self.now = 100.0
        self.is_in = False
        self.asked = 0
        self.receipts = Receipts(self._are_all_in, DEPTH, lambda: self.now)

    def _are_all_in(self):
        self.asked += 1
        return self.is_in

    def send(self, count=1, seconds=0.0):
        """Send as many messages as nobody has to be waited for, some time after each other."""
        for _ in range(count):
            assert not self.receipts.is_on_its_way()
            self.receipts.sent()
            self.now += seconds


@pytest.fixture
def topic():
    """A topic, at whose readers nothing has arrived yet."""
    return Topic()


def test_what_is_kept_may_be_sent_without_waiting(topic):
    """As many messages as the topic keeps; the next would take the place of the first."""
    topic.send(DEPTH)
    assert topic.receipts.is_on_its_way()
    topic.is_in = True
    assert not topic.receipts.is_on_its_way()
    topic.is_in = False
    topic.send(DEPTH)
    assert topic.receipts.is_on_its_way()


def test_nobody_is_asked_about_what_was_acknowledged(topic):
    """The middleware is asked until all have the last message, and not again."""
    topic.send()
    assert not topic.receipts.is_on_its_way()
    topic.is_in = True
    for _ in range(10):
        assert not topic.receipts.is_on_its_way()
    assert topic.asked == 2


def test_a_stuck_reader_is_waited_for_once_and_shortly(topic):
    """After a fifth of a second the others go on, and are not held up again."""
    topic.send(DEPTH)
    topic.now += 0.19
    assert topic.receipts.is_on_its_way()
    topic.now += 0.02
    topic.send(1000, seconds=0.001)


def test_at_the_usual_rate_nobody_waits_at_all(topic):
    """At so many messages a second that patience ends before there is need of it."""
    topic.send(1000, seconds=0.1)


def test_everything_is_repeated_while_one_is_left_behind(topic):
    """Once a second, as it can't be known whether the others have got it."""
    topic.send(DEPTH + 1, seconds=0.1)
    repeats = 0
    for _ in range(100):
        topic.send(seconds=0.1)
        repeats += topic.receipts.take_repeat()
    assert repeats in (9, 10)


def test_one_that_missed_nothing_is_not_told_anew(topic):
    """A reader that acknowledges late, when nothing it needs is gone, has missed nothing."""
    topic.send(DEPTH, seconds=1.0)
    topic.is_in = True
    assert not topic.receipts.is_on_its_way()
    assert not topic.receipts.take_missed()
    assert not topic.receipts.take_repeat()


def test_one_that_is_back_has_missed_something_once(topic):
    """And from then on readers are waited for again."""
    topic.send(DEPTH + 2, seconds=0.1)
    topic.is_in = True
    assert not topic.receipts.is_on_its_way()
    assert topic.receipts.take_missed()
    assert not topic.receipts.take_missed()
    topic.is_in = False
    topic.now += 10.0
    assert not topic.receipts.take_repeat()
    topic.send(DEPTH)
    assert topic.receipts.is_on_its_way()


def test_one_that_is_back_is_told_once_more(topic):
    """Five seconds later, as it may have given up the sender before it got what it was told."""
    topic.send(DEPTH + 2, seconds=0.1)
    topic.is_in = True
    assert not topic.receipts.is_on_its_way()
    assert topic.receipts.take_missed()
    topic.now += 4.9
    assert not topic.receipts.take_missed()
    topic.now += 0.2
    assert topic.receipts.take_missed()
    topic.now += 100.0
    assert not topic.receipts.take_missed()


def test_a_newcomer_may_be_the_one_that_was_given_up(topic):
    """The first one after that is told twice that it has missed something, others are not."""
    topic.receipts.note_newcomer()
    assert not topic.receipts.take_missed()
    topic.send(DEPTH + 2, seconds=0.1)
    topic.is_in = True
    assert not topic.receipts.is_on_its_way()
    topic.now += 100.0
    assert topic.receipts.take_missed()
    for _ in range(2):
        topic.receipts.note_newcomer()
    assert topic.receipts.take_missed()
    assert not topic.receipts.take_missed()
    topic.now += 5.1
    assert topic.receipts.take_missed()
    topic.receipts.note_newcomer()
    assert not topic.receipts.take_missed()

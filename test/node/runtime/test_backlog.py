"""Work in the order of its coming: as much at once as may be, what is exclusive one by one."""

from __future__ import annotations

import pytest

from msg_adapters.errors import TooLargeError
from scene_graph_ros.node.runtime.backlog import Backlog


def backlog(at_once=2, most=3, most_bytes=100):
    """Return a backlog, and what adds something by name: ``(name)`` or ``(name, True)``."""
    result = Backlog(at_once=at_once, most_requests=lambda: most, most_bytes=most_bytes)

    def add(name, is_exclusive=False, size=1):
        result.add_request(lambda: name, lambda: size, is_exclusive=is_exclusive)

    return result, add


def names(works):
    """Return the names of works."""
    return [work.do() for work in works]


def test_as_much_as_may_is_done_at_once_in_the_order_of_its_coming():
    """Two of three begin; the third when one of them has ended."""
    work, add = backlog()
    for name in "abc":
        add(name)
    begun = [work.take(), work.take()]
    assert names(begun) == ["a", "b"]
    assert work.take() is None
    work.done(begun[1])
    assert work.take().do() == "c"
    assert work.take() is None


def test_exclusive_requests_are_passed_by_while_one_runs():
    """They keep their place for when it ends."""
    work, add = backlog(most=10)
    for name in ("edit", "change", "ask", "more"):
        add(name, name in {"edit", "change"})
    edit, ask = work.take(), work.take()
    assert names([edit, ask]) == ["edit", "ask"]
    work.done(edit)
    assert work.take().do() == "change"


def test_what_is_too_much_is_not_taken():
    """Those that run don't count; what is no request is always taken, and is not counted."""
    work, add = backlog(at_once=1, most=2)
    work.add(lambda: "post")
    add("a")
    add("b", True)
    for is_exclusive in (False, True):
        with pytest.raises(TooLargeError, match=r"2 requests wait already, .* is 2"):
            add("c", is_exclusive)
    work.add(lambda: "another")
    post = work.take()
    assert post.do() == "post"
    with pytest.raises(TooLargeError):
        add("c")
    work.done(post)
    assert work.take().do() == "a"
    add("c")
    with pytest.raises(TooLargeError):
        add("d")


def test_what_waits_is_limited_in_bytes():
    """However large, one may wait; those that come while others wait are within the limit."""
    work, add = backlog(at_once=1, most=10)
    add("huge", size=1000)
    add("large", size=60)
    add("small", size=40)
    with pytest.raises(TooLargeError, match=r"100 bytes wait already; with 1 more .* is 100"):
        add("straw")
    for name in ("huge", "large"):
        begun = work.take()
        assert begun.do() == name
        work.done(begun)
    add("straw", size=60)
    with pytest.raises(TooLargeError):
        add("another")

"""Attributes that threads make: one of them does, and all get the same."""

from __future__ import annotations

from pathlib import Path
import threading

import pytest

import scene_graph_ros.node
from scene_graph_ros.node.runtime.made_once import made_once

THREADS = 4


class Thing:
    """Has an attribute that takes as long to make as a test wants."""

    def __init__(self):
        self.made = 0
        self.begun, self.go = threading.Event(), threading.Event()

    @made_once
    def part(self) -> object:
        """What is made."""
        self.made += 1
        self.begun.set()
        self.go.wait()
        return object()


def test_threads_that_come_at_once_get_the_same():
    """The others come while one is at it, and wait."""
    thing, found = Thing(), []
    threads = [threading.Thread(target=lambda: found.append(thing.part)) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    assert thing.begun.wait(60.0)
    assert found == []
    thing.go.set()
    for thread in threads:
        thread.join()
    assert thing.made == 1
    assert found == [thing.part] * THREADS


def test_things_do_not_wait_for_each_other():
    """While one is being made, another is made."""
    slow, fast = Thing(), Thing()
    thread = threading.Thread(target=lambda: slow.part)
    thread.start()
    assert slow.begun.wait(60.0)
    fast.go.set()
    assert fast.part is fast.part
    slow.go.set()
    thread.join()
    assert slow.made == fast.made == 1


def test_a_class_shows_what_it_will_make():
    """Whoever looks at the class, such as help(), makes nothing."""
    assert isinstance(Thing.part, made_once)
    assert Thing.part.__doc__ == "What is made."


def test_the_node_keeps_to_it():
    """What threads share is not left to functools, which makes it once for each of them."""
    folder = Path(scene_graph_ros.node.__file__).parent
    sources = list(folder.rglob("*.py"))
    assert len(sources) > 40
    users = [
        str(path.relative_to(folder)) for path in sources if "cached_property" in path.read_text()
    ]
    assert users == ["runtime/made_once.py"]


def test_what_could_not_be_made_is_made_by_the_next():
    """An error is nobody's attribute."""

    class Moody:
        def __init__(self):
            self.mood = [ValueError("not now"), "here"]

        @made_once
        def part(self) -> str:
            """Raise, then return."""
            mood = self.mood.pop(0)
            if isinstance(mood, Exception):
                raise mood
            return mood

    moody = Moody()
    with pytest.raises(ValueError, match="not now"):
        _ = moody.part
    assert moody.part == moody.part == "here"

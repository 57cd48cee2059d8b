"""Calls that many ask for are made now and then, and none is forgotten."""

from __future__ import annotations

import threading

from scene_graph_ros.views.browser import seldom
from scene_graph_ros.views.browser.seldom import Seldom


def test_who_comes_within_a_period_shares_a_call(monkeypatch):
    """The first is served at once, all others by one call at the end of the period."""
    now, timers, calls = [100.0], [], []

    class Timer:
        daemon = False

        def __init__(self, wait, function):
            self.wait, self.function = wait, function

        def start(self):
            timers.append(self)

    monkeypatch.setattr(seldom.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(seldom.threading, "Timer", Timer)
    ask = Seldom(lambda: calls.append(now[0]), 0.5)
    for _ in range(1000):
        ask()
        now[0] += 0.0004
    assert calls == [100.0]
    assert len(timers) == 1
    now[0] = 100.5
    timers[0].function()
    assert calls == [100.0, 100.5]
    ask()
    assert len(timers) == 2
    now[0] = 101.5
    timers[1].function()
    now[0] = 103.0
    ask()
    assert calls == [100.0, 100.5, 101.5, 103.0]


def test_a_call_that_comes_late_is_made():
    """By a thread of its own."""
    made = threading.Semaphore(0)
    ask = Seldom(made.release, 0.01)
    for _ in range(2):
        ask()
    for _ in range(2):
        assert made.acquire(timeout=60.0)

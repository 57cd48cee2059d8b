"""What is said while kernels are compiled: nothing at first, then counts, ever more seldom."""

from types import SimpleNamespace

import pytest

from scene_graph_ros.geometry import compile_progress
from scene_graph_ros.geometry.compile_progress import CompileProgress, SILENCE
from scene_graph_ros.geometry.compiled.readiness import KernelCompilationWarning


class Clock:
    """A clock that the test turns, and a timer that it lets ring."""

    def __init__(self):
        self.now = 100.0
        self.timers = []

    def monotonic(self):
        return self.now

    def timer(self, seconds, function):
        ring = self.now + seconds, function
        return SimpleNamespace(daemon=False, start=lambda: self.timers.append(ring))

    def ring(self):
        (due, function), *self.timers = self.timers
        self.now = max(self.now, due)
        function()


@pytest.fixture
def clock(monkeypatch):
    """Time of the module under test."""
    clock = Clock()
    monkeypatch.setattr(compile_progress.time, "monotonic", clock.monotonic)
    monkeypatch.setattr(compile_progress.threading, "Timer", clock.timer)
    monkeypatch.setattr(compile_progress, "cache_problem", lambda: "")
    monkeypatch.delenv(SILENCE, raising=False)
    return clock


def test_a_long_kernel_is_told_of_after_a_second(clock, capsys):
    """Also while the first one is still compiled; later lines come at 10 s, 20 s, 40 s."""
    progress = CompileProgress()
    with pytest.warns(KernelCompilationWarning, match="kernel first has to be compiled first"):
        progress.began("first")
    assert not capsys.readouterr().err
    clock.ring()
    line = capsys.readouterr().err
    assert line.startswith("scene_graph_ros: compiling, 0 kernels in 1 s")
    assert SILENCE in line
    said = []
    for second in range(2, 100):
        clock.now = 100.0 + second
        progress.ended("one")
        progress.began("another")
        said += [second] * bool(capsys.readouterr().err)
    assert said == [10, 20, 40, 80]


def test_what_is_quick_is_not_told(clock, capsys, recwarn):
    """Two kernels within a second: a warning, and no line."""
    progress = CompileProgress()
    progress.began("a")
    progress.ended("a")
    clock.now += 0.9
    progress.began("b")
    progress.ended("b")
    assert not capsys.readouterr().err
    assert len(recwarn) == 1


@pytest.mark.parametrize("how", ["variable", "others"])
def test_it_can_be_silenced(clock, capsys, monkeypatch, recwarn, how):
    """By a variable of the environment, and where a node says it in its log."""
    progress = CompileProgress()
    if how == "variable":
        monkeypatch.setenv(SILENCE, "off")
    else:
        progress.is_left_to_others = True
    progress.began("a")
    clock.ring()
    assert not capsys.readouterr().err
    assert len(recwarn) == (how == "variable")

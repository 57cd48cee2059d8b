"""Turns of the engines in the speed benchmark, and what of them goes into which table."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.speed import measure as measuring
from benchmarks.speed import report
from benchmarks.speed.measure import MAX_TURNS, measure, SLOW, STREAK
from benchmarks.speed.rows import ROWS
from benchmarks.speed.scenes import Scene

ROW = ROWS[0]
SETS = 4


class Clock:
    """A clock that goes on when an engine works."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        """Return the time in seconds."""
        return self.now


class Engine:
    """Takes ``cold`` seconds after another engine has worked, ``warm`` after itself."""

    asked: list[tuple[str, int]]

    def __init__(self, name: str, clock: Clock, cold: float, warm: float) -> None:
        self.name, self._clock, self._times = name, clock, (cold, warm)
        self._k = 0

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """See Engine of the benchmark."""

    def move(self, k: int) -> None:
        """See Engine of the benchmark."""
        self._k = k

    def candidates(self) -> int:
        """Let time go by and note who was asked, with which poses."""
        is_warm = bool(self.asked) and self.asked[-1][0] == self.name
        self._clock.now += self._times[is_warm]
        self.asked.append((self.name, self._k))
        return 7

    def count(self, row: str, result: int) -> int:
        """See Engine of the benchmark."""
        return result


@pytest.fixture
def scene():
    """Return a scene of the size that the goals are about, of which only the size counts."""
    n = report.MAIN_SIZE
    X_WF = np.tile(np.eye(4), (SETS, 1, 1, 1))
    return Scene(report.MIXED, "a scene", [None] * n, X_WF, np.zeros((1, 3)))


@pytest.fixture
def clock(monkeypatch):
    """Put a clock into the benchmark that goes only where an engine works."""
    one = Clock()
    monkeypatch.setattr(measuring, "time", one)
    monkeypatch.setattr(Engine, "asked", [], raising=False)
    return one


@pytest.fixture
def measured(clock, scene):
    """Return what is measured of an engine of ours and two peers, one quick after itself only."""
    times = {"scene_graph_ros": (5e-3, 2e-3), "Coal": (40e-3, 1e-3), "FCL": (10e-3, 3e-3)}
    engines = [Engine(name, clock, cold, warm) for name, (cold, warm) in times.items()]
    return measure(engines, ROW, scene, 100.0, print)


def test_the_first_of_each_streak_is_apart(measured):
    """The figures of an engine are those after itself; those after another stand beside them."""
    assert [m.turns for m in measured] == [MAX_TURNS] * 3
    assert [m.rounds for m in measured] == [MAX_TURNS * (STREAK - 1)] * 3
    figures = [(m.low_ms, m.median_ms, m.high_ms) for m in measured]
    np.testing.assert_allclose(figures, np.tile([[2.0], [1.0], [3.0]], 3))
    first = [(m.first_low_ms, m.first_median_ms, m.first_high_ms) for m in measured]
    np.testing.assert_allclose(first, np.tile([[5.0], [40.0], [10.0]], 3))
    assert [m.found for m in measured] == [7.0] * 3


def test_every_query_has_new_poses(measured):
    """No two queries of an engine after each other have the same poses."""
    for m in measured:
        mine = [k for name, k in Engine.asked if name == m.engine]
        assert len(mine) > 1 + MAX_TURNS * STREAK
        assert np.abs(np.diff(mine)).tolist() == [1] * (len(mine) - 1)


def test_tables_compare_with_the_fastest_peer_of_their_own(measured):
    """After itself one peer is the fastest, after other work another one."""
    title = ROW.title
    line = f"| {title} | 2 | Coal: 1 | 0.5 | {ROW.goal:.0f} |"
    assert report.summary_table(measured).splitlines()[2:] == [line]
    line = f"| {title} | 5 | FCL: 10 | 2 | 2.5 |"
    assert report.first_table(measured).splitlines()[2:] == [line]


def test_ratios_stand_by_the_size(measured):
    """A line for each row, with what was not measured marked."""
    (m, *_) = measured
    twice = [*measured, m._replace(size=2 * m.size)]
    lines = report.ratio_table(twice).splitlines()
    assert lines[0] == f"| fastest peer / ours, N = | {m.size} | {2 * m.size} |"
    assert lines[2:] == [f"| {ROW.title} | **0.5** | — |"]


def test_measurements_are_read_as_they_were_written(measured, tmp_path):
    """The file has all figures."""
    report.write(measured, {report.MIXED: "mixed shapes"}, "", tmp_path)
    for read, m in zip(report.read(tmp_path / "performance.csv"), measured, strict=True):
        assert read[:4] == m[:4]
        assert (read.rounds, read.turns) == (m.rounds, m.turns)
        assert read.first_median_ms == pytest.approx(m.first_median_ms)


@pytest.mark.parametrize(("seconds", "length"), [(1e-3, 2), (0.1, 4), (10.0, STREAK)])
def test_streaks_are_shorter_where_time_is_short(clock, scene, seconds, length):
    """There are several turns, and in each of them a query after the engine's own, at least."""
    engines = [Engine(name, clock, 4e-3, 4e-3) for name in ("scene_graph_ros", "Drake")]
    for m in measure(engines, ROW, scene, seconds, print):
        assert m.turns >= 2
        assert m.rounds == m.turns * (length - 1)


def test_an_engine_alone_has_no_other_work_before_it(clock, scene):
    """Its queries all count, and none is said to be after other work."""
    (m,) = measure([Engine("scene_graph_ros", clock, 5e-3, 1e-3)], ROW, scene, 100.0, print)
    assert (m.rounds, m.turns) == (MAX_TURNS * STREAK, 0)
    assert m.high_ms == pytest.approx(1.0)
    assert np.isnan(m.first_median_ms)
    assert len(report.first_table([m]).splitlines()) == 2


def test_a_slow_engine_is_not_asked_again(clock, scene):
    """What took too long twice is the only figure; that of the second time."""
    slow = Engine("Drake", clock, 3.0 * SLOW, 2.0 * SLOW)
    quick = Engine("scene_graph_ros", clock, 1e-3, 1e-3)
    _, m = measure([quick, slow], ROW, scene, 1.0, print)
    assert (m.rounds, m.turns) == (1, 0)
    assert m.median_ms == pytest.approx(2e3 * SLOW)
    assert [name for name, _ in Engine.asked].count("Drake") == 2


def test_engines_settle_before_time_is_taken(clock, scene):
    """What gets quicker in its first queries is measured as it is then."""
    engine = Engine("Coal", clock, 1e-3, 1e-3)
    ask = engine.candidates

    def candidates():
        if len(Engine.asked) < 100:
            clock.now += 1e-3
        return ask()

    engine.candidates = candidates
    (m,) = measure([engine], ROW, scene, 100.0, print)
    assert (m.low_ms, m.high_ms) == pytest.approx((1.0, 1.0))

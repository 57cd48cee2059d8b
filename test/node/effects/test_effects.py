"""Effects beside each other: what goes wrong with one is its own, counted and told."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
from types import SimpleNamespace
from typing import ClassVar

from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, SceneGraph, Sphere
from scene_graph_ros.node.diagnostics import Diagnostics, Monitor
from scene_graph_ros.node.effects import state as states
from scene_graph_ros.node.effects.declarations import EffectDeclaration
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.world.world import World


class Fine:
    """An effect that does its work."""

    def __init__(self, host):
        self.updates = 0
        self.is_closed = False

    def is_heard(self):
        """Somebody listens."""
        return True

    def has_work(self):
        """There always is some."""
        return True

    def prepare(self, snapshot):
        """Nothing takes long."""

    def update(self, snapshot):
        """Count."""
        self.updates += 1

    def vanish(self, snapshot):
        """Leave nothing behind."""

    def close(self):
        """End."""
        self.is_closed = True

    def counters(self):
        """Return how often it worked."""
        return {"updates": self.updates}


class Prepared(Fine):
    """An effect that remembers which scenes it was prepared for."""

    versions: ClassVar[list[int]] = []

    def prepare(self, snapshot):
        """Remember the scene's version, or fail."""
        self.versions.append(snapshot.scene_version)
        if snapshot.scene_version == 2:
            raise ZeroDivisionError("in prepare")


class Deaf(Prepared):
    """An effect that nobody listens to."""

    def is_heard(self):
        """Nobody does."""
        return False


class Failing(Fine):
    """An effect that fails in what its class attribute names."""

    fails_in = "update"

    def _fail(self, where):
        if where == self.fails_in:
            raise ZeroDivisionError(f"in {where}")

    def __init__(self, host):
        super().__init__(host)
        self._fail("start")

    def has_work(self):
        """Fail or say yes."""
        self._fail("has_work")
        return True

    def update(self, snapshot):
        """Fail or count."""
        self._fail("update")
        super().update(snapshot)

    def close(self):
        """Fail or end."""
        self._fail("close")
        super().close()


class Host:
    """A node of which the effects need its logger alone."""

    def __init__(self):
        self.errors = []
        self.warnings = []
        logger = SimpleNamespace(
            error=self.errors.append,
            warning=self.warnings.append,
            info=lambda text: None,
            debug=lambda text: None,
        )
        self.node = SimpleNamespace(
            get_logger=lambda: logger, resolve_topic_name=lambda topic: topic
        )
        self.min_update_rate = 10.0

    def parameter(self, name):
        """Return the one parameter that effects are judged by."""
        assert name == "min_update_rate"
        return self.min_update_rate


def declared(name, kind):
    """Return the declaration of an effect that is always asked for."""
    return EffectDeclaration(
        name, lambda demand: "asked for", "anything", (), f"{__name__}:{kind}"
    )


@pytest.fixture
def world():
    """A world with a ball."""
    graph = SceneGraph()
    source = graph.register_source("s")
    ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
    ball.set_proximity_properties(ProximityProperties())
    graph.register_anchored_geometry(source, ball)
    return World(graph)


@pytest.fixture
def host():
    """A host that remembers what was logged."""
    return Host()


class Clock:
    """Steady seconds that pass only where a test says so."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        """Return the time."""
        return self.now


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """The clock by which is judged how long ago something was told."""
    clock = Clock()
    monkeypatch.setattr(states, "time", clock)
    return clock


@pytest.fixture
def effects(host):
    """An effect that fails between two that don't."""
    effects = Effects(
        host, [declared("before", "Fine"), declared("bad", "Failing"), declared("after", "Fine")]
    )
    effects.open()
    return effects


@pytest.mark.parametrize("where", ["start", "has_work", "update"])
def test_one_that_fails_does_not_cost_the_others(effects, host, world, clock, monkeypatch, where):
    """They publish at each update; it is logged under its name, and counted."""
    monkeypatch.setattr(Failing, "fails_in", where)
    for _ in range(3):
        effects.update(world.snapshot)
    assert effects.running("before").updates == 3
    assert effects.running("after").updates == 3
    _, report, _ = effects.reports()
    assert report.failures == (1 if where == "start" else 3)
    assert report.failure == f"ZeroDivisionError: in {where}"
    # What keeps failing is told once a second.
    (error,) = host.errors
    assert error.startswith("effect bad failed:\n")
    assert f"ZeroDivisionError: in {where}" in error
    clock.now += 1.0
    for _ in range(2):
        effects.update(world.snapshot)
    assert len(host.errors) == (1 if where == "start" else 2)


def test_one_that_works_again_is_well(effects, world, monkeypatch):
    """Its failures stay counted; what was wrong is no more."""
    effects.update(world.snapshot)
    monkeypatch.setattr(Failing, "fails_in", "")
    effects.update(world.snapshot)
    _, report, _ = effects.reports()
    assert (report.failures, report.failure, report.count) == (1, "", 1)


def test_all_are_closed_though_one_fails_in_it(effects, host, world, monkeypatch):
    """The end of one is not in the way of another's."""
    monkeypatch.setattr(Failing, "fails_in", "close")
    effects.update(world.snapshot)
    last = effects.running("after")
    effects.close()
    assert last.is_closed
    assert len(host.errors) == 1


def test_diagnostics_say_which_one_fails(effects, world):
    """Its entry is an error with the reason and a count; those of the others are well."""
    effects.update(world.snapshot)
    diagnostics = Diagnostics("scene_graph")
    status = diagnostics.world(Monitor(), 0, scene_version=0, values={})
    message = diagnostics.message(stamp=0, world=status, sources=[], effects=effects.reports())
    _, before, bad, after = message.status
    assert bad.level == DiagnosticStatus.ERROR
    assert bad.message == "failed: ZeroDivisionError: in update"
    assert {"failures": "1"}.items() <= {v.key: v.value for v in bad.values}.items()
    assert before.level == after.level == DiagnosticStatus.OK


def test_an_effect_that_takes_too_long_is_named_in_the_log_and_in_diagnostics(world, host):
    """One warning with the figure however often it is slow; all is well again when it is not.

    Any time at all is too long for a rate of 1e12 Hz, and none for one of 1e-6 Hz.
    """
    effects = Effects(host, [declared("costly", "Fine")])
    effects.open()
    host.min_update_rate = 1e12
    for _ in range(3):
        effects.update(world.snapshot)
    (warning,) = host.warnings
    assert warning.startswith("effect costly: an update takes ")
    assert "min_update_rate" in warning
    (report,) = effects.reports()
    assert "longer than the 1e-12 s of min_update_rate" in report.warning
    (status,) = statuses(effects)
    assert (status.level, status.message) == (DiagnosticStatus.WARN, report.warning)
    host.min_update_rate = 1e-6
    effects.update(world.snapshot)
    (status,) = statuses(effects)
    assert (status.level, status.message) == (DiagnosticStatus.OK, "asked for")


def statuses(effects):
    """Return the entries of effects in the diagnostics."""
    diagnostics = Diagnostics("node")
    world = diagnostics.world(Monitor(), 0, scene_version=0, values={})
    message = diagnostics.message(stamp=0, world=world, sources=[], effects=effects.reports())
    return [status for status in message.status if ": effect" in status.name]


def test_effects_are_prepared_for_a_scene_before_it_counts(world, host):
    """Once for each edit, in its thread, if heard; one that can't be costs no edit."""
    effects = Effects(host, [declared("early", "Prepared"), declared("deaf", "Deaf")])
    effects.open()
    effects.update(world.snapshot)
    Prepared.versions.clear()
    for version in (1, 2, 3):
        _, snapshot = world.edit(
            lambda edit, version=version: edit.add_source(f"s{version}", token=1), effects.prepare
        )
        assert snapshot.scene_version == version
        assert Prepared.versions[-1] == version
    assert Prepared.versions == [1, 2, 3]
    assert effects.running("early").updates == 1


def test_a_request_that_comes_while_the_scene_is_followed_counts(world, host):
    """What was found out before it does not write over what it changed."""
    recorded = []

    def asked_by(demand):
        count = demand.requests.get("answers", 0)
        if not recorded:
            recorded.append(pool.submit(effects.record, "answers", 0.0))
            # It is done at once where nothing holds it up.
            wait(recorded, 0.2)
        return f"{count} so far" if count else ""

    effects = Effects(host, [EffectDeclaration("answers", asked_by, "a request")])
    effects.open()
    with ThreadPoolExecutor(1) as pool:
        effects.update(world.snapshot)
        recorded[0].result(60.0)
    (report,) = effects.reports()
    assert (report.is_on, report.reason, report.count) == (True, "1 so far", 1)


def test_an_effect_waits_for_its_kernels(world, host):
    """Until they are ready it is off, neither imported nor prepared, and a warning says why."""
    lacks = {"new": "they are being compiled: 1 of 2"}
    declarations = [
        declared("before", "Prepared"),
        EffectDeclaration(
            "new", lambda demand: "asked for", "anything", (), f"{__name__}:Prepared", "new"
        ),
    ]
    effects = Effects(host, declarations, lambda group: lacks.get(group, ""))
    effects.open()
    Prepared.versions.clear()
    effects.update(world.snapshot)
    effects.prepare(world.snapshot)
    assert len(Prepared.versions) == 1
    assert effects.running("before").updates == 1
    assert effects.running("new") is None
    _, report = effects.reports()
    assert not report.is_on
    assert report.reason == "not yet: they are being compiled: 1 of 2; asked for"
    assert not any("new" in text for text in host.warnings)
    _, status = statuses(effects)
    assert (status.level, status.message) == (DiagnosticStatus.WARN, report.reason)

    lacks.clear()
    effects.come_on(world.snapshot)
    assert len(Prepared.versions) == 2
    assert effects.running("new") is None
    effects.update(world.snapshot)
    assert effects.running("new").updates == 1
    _, status = statuses(effects)
    assert (status.level, status.message) == (DiagnosticStatus.OK, "asked for")


def test_a_scene_that_could_not_be_followed_is_followed_by_the_next_update(world, host):
    """The error is the update's; effects behind the one that it met come on a little later."""
    faults = [OSError("a file is gone")]

    def lack(group):
        if group and faults:
            raise faults.pop()
        return ""

    first = EffectDeclaration(
        "first", lambda demand: "asked for", "anything", (), f"{__name__}:Fine", "new"
    )
    effects = Effects(host, [first, declared("second", "Fine")], lack)
    effects.open()
    with pytest.raises(OSError, match="a file is gone"):
        effects.update(world.snapshot)
    effects.update(world.snapshot)
    assert [effects.running(name).updates for name in ("first", "second")] == [1, 1]

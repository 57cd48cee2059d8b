"""Answers of effects: found once for all who publish them, under the name of who finds them."""

from __future__ import annotations

import importlib
import inspect
import re
from types import SimpleNamespace

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, SceneGraph, Sphere
from scene_graph_ros.node.effects import manager
from scene_graph_ros.node.effects.declarations import (
    AnswerDeclaration,
    camera_effect,
    EffectDeclaration,
    EFFECTS,
)
from scene_graph_ros.node.effects.demand import Demand
from scene_graph_ros.node.effects.effect import Effect
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.effects.state import Answer, load, Question
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

TO_FIND, TO_PUBLISH = 5.0, 2.0
"""Seconds of a clock that only what is tested moves on."""


class Clock:
    """Stands for the module of that name, in the module that measures."""

    now = 0.0

    def perf_counter(self):
        """Return the time."""
        return self.now

    monotonic = perf_counter


CLOCK = Clock()


class Finder:
    """A question that takes its time, and fails where it is told to."""

    asked: list  # of snapshots, in each test
    fails = False

    def __call__(self, snapshot):
        """Answer with the number of the snapshot."""
        self.asked.append(snapshot)
        CLOCK.now += TO_FIND
        if self.fails:
            raise ZeroDivisionError("in finding")
        return f"of {snapshot.sequence}"

    def counters(self, answer):
        """Return the answer itself."""
        return {"answer": answer}


class Teller:
    """An effect that publishes an answer of another."""

    def __init__(self, host):
        self.host, self.told = host, []

    def is_heard(self):
        """Somebody listens."""
        return self.host.is_heard

    has_work = is_heard

    def prepare(self, snapshot):
        """Remember for which scene."""
        self.host.prepared.append(snapshot)

    def update(self, snapshot):
        """Publish, which takes time as well."""
        self.told.append(self.host.answer("found", snapshot))
        CLOCK.now += TO_PUBLISH

    def vanish(self, snapshot):
        """Leave nothing behind."""

    def close(self):
        """End."""

    def counters(self):
        """Return how often it published."""
        return {"messages": len(self.told)}


class Host:
    """A node with an effect that finds something out, between two that publish it."""

    def __init__(self, asked_by=lambda demand: "asked for"):
        self.is_heard, self.prepared, self.errors = True, [], []
        logger = SimpleNamespace(
            error=self.errors.append,
            warning=lambda text: None,
            info=lambda text: None,
            debug=lambda text: None,
        )
        self.node = SimpleNamespace(
            get_logger=lambda: logger, resolve_topic_name=lambda topic: topic
        )

        def teller(name):
            return EffectDeclaration(
                name,
                lambda demand: "asked for",
                "anything",
                factory=f"{__name__}:Teller",
                needs=("found",),
            )

        finder = EffectDeclaration(
            "finder", asked_by, "anything", answer=AnswerDeclaration("found", f"{__name__}:Finder")
        )
        self.effects = Effects(self, [teller("before"), finder, teller("after")])
        self.effects.open()

    def parameter(self, name):
        """Return the one parameter that effects are judged by."""
        return {"min_update_rate": 10.0}[name]

    def answer(self, name, snapshot):
        """Return what an effect found out."""
        return self.effects.answer(name, snapshot)


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """A clock that nothing else moves on."""
    monkeypatch.setattr(CLOCK, "now", 0.0)
    monkeypatch.setattr(manager, "time", CLOCK)
    monkeypatch.setattr(Finder, "asked", [], raising=False)
    return CLOCK


@pytest.fixture
def world():
    """A world with a ball."""
    graph = SceneGraph()
    ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
    ball.set_proximity_properties(ProximityProperties())
    graph.register_anchored_geometry(graph.register_source("s"), ball)
    return World(graph)


def test_an_answer_is_found_once_for_all_who_publish_it(world):
    """And again for the next snapshot alone, however often one is published."""
    host = Host()
    first = world.snapshot
    host.effects.update(first)
    host.effects.update(first)
    second = world.commit([], None)
    host.effects.update(second)
    assert Finder.asked == [first, second]
    expected = [f"of {snapshot.sequence}" for snapshot in (first, first, second)]
    assert host.effects.running("before").told == expected
    assert host.effects.running("after").told == expected


def test_who_was_due_before_poses_were_read_publishes_what_they_are(world):
    """An update begins with who listens, and ends with what there is to say by then."""
    host = Host()
    due = host.effects.due(world.snapshot)
    moved = world.commit([], None)
    host.is_heard = False
    host.effects.update(moved, due)
    assert Finder.asked == [moved]
    assert [state.declaration.name for state in due] == ["before", "after"]
    assert host.effects.due(moved) == []
    host.effects.update(moved, ())
    assert len(host.effects.running("after").told) == 1


def test_who_is_due_is_asked_again_about_another_scene(world):
    """An edit between the look and the update may have switched effects."""
    host = Host()
    due = host.effects.due(world.snapshot)
    host.is_heard = False
    _, changed = world.edit(lambda edit: edit.add_source("t", token=1))
    host.effects.update(changed, due)
    assert Finder.asked == []


def test_its_time_is_booked_under_the_name_of_who_finds_it(world):
    """Whoever asks first, its own time is that of publishing, in each of its updates."""
    host = Host()
    host.effects.update(world.snapshot)
    host.effects.update(world.snapshot)
    before, finder, after = host.effects.reports()
    assert (finder.count, finder.mean_seconds) == (1, TO_FIND)
    for teller in (before, after):
        assert (teller.count, teller.mean_seconds, teller.max_seconds) == (
            2,
            TO_PUBLISH,
            TO_PUBLISH,
        )
    assert finder.counters["computed"] == 1
    assert finder.counters["answer"] == f"of {world.snapshot.sequence}"


def test_an_answer_that_fails_is_the_fault_of_who_finds_it(world, monkeypatch):
    """It is tried once for a snapshot; who publishes goes on without, and is well."""
    monkeypatch.setattr(Finder, "fails", True)
    host = Host()
    host.effects.update(world.snapshot)
    before, finder, after = host.effects.reports()
    assert host.effects.running("before").told == host.effects.running("after").told == [None]
    assert (before.failures, finder.failures, after.failures) == (0, 1, 0)
    assert finder.failure == "ZeroDivisionError: in finding"
    assert len(Finder.asked) == len(host.errors) == 1
    monkeypatch.setattr(Finder, "fails", False)
    host.effects.update(world.commit([], None))
    _, finder, _ = host.effects.reports()
    assert (finder.failures, finder.failure) == (1, "")


def test_what_nobody_asks_for_is_not_found(world):
    """There is no answer of an effect that is off; who would publish it goes on without."""
    host = Host(asked_by=lambda demand: "")
    host.effects.update(world.snapshot)
    assert host.effects.running("before").told == [None]
    assert Finder.asked == []


def test_what_is_published_is_found_before_a_scene_counts(world):
    """In the thread of the edit, where somebody listens, and before the effect is prepared."""
    host = Host()
    host.effects.update(world.snapshot)
    Finder.asked.clear()
    _, snapshot = world.edit(lambda edit: edit.add_source("t", token=1), host.effects.prepare)
    assert [each.scene_version for each in Finder.asked] == [snapshot.scene_version]
    assert [each.scene_version for each in host.prepared] == [snapshot.scene_version] * 2
    host.is_heard = False
    world.edit(lambda edit: edit.add_source("u", token=1), host.effects.prepare)
    assert (len(Finder.asked), len(host.prepared)) == (1, 2)


def test_what_can_not_be_found_beforehand_is_prepared_without(world, monkeypatch):
    """The edit counts, and who publishes has its own part ready."""
    host = Host()
    host.effects.update(world.snapshot)
    monkeypatch.setattr(Finder, "fails", True)
    _, snapshot = world.edit(lambda edit: edit.add_source("t", token=1), host.effects.prepare)
    assert [each.scene_version for each in host.prepared] == [snapshot.scene_version] * 2


def test_an_answer_tells_what_it_costs_at_the_tier_of_accuracy(world):
    """The mean is over answers of one tier."""
    answer = Answer(Finder())
    answer.about(world.snapshot)
    assert answer.counters()["accuracy"] == world.snapshot.query.accuracy
    world.set_accuracy("quick")
    answer.about(world.snapshot)
    counters = answer.counters()
    assert (counters["accuracy"], counters["computed"]) == ("quick", 2)


def test_an_asker_counts_once_for_each_scene():
    """Two effects that are asked for by the same thing look for it once."""
    counted = []

    def count(inspector, noun):
        counted.append((inspector, noun))
        return len(noun)

    demand = Demand("a scene", {})
    assert [demand.count(count, "ball"), demand.count(count, "ball")] == [4, 4]
    assert counted == [("a scene", "ball")]


CAMERA = """
version: 1
sources: [{name: s}]
cameras: [{name: eye, source: s, size: [4, 3], fov_y: 1, images: [depth]}]
"""


def declared():
    """Return all effects that the node has, and that of a camera."""
    (camera,) = load_scene_text(CAMERA).apply(SceneGraph()).cameras.values()
    return [*EFFECTS, camera_effect(camera)]


def test_each_answer_has_a_name_of_its_own():
    """And what an effect needs is the answer of one."""
    names = [each.answer.name for each in EFFECTS if each.answer is not None]
    assert len(set(names)) == len(names) > 0
    assert {need for each in declared() for need in each.needs} == set(names)


@pytest.mark.parametrize("effect", declared(), ids=lambda effect: effect.name)
def test_what_is_declared_is_what_an_effect_has_to_be(effect):
    """Its classes have all methods, with the parameters by which they are called."""
    answer = "" if effect.answer is None else effect.answer.question
    for name, protocol in ((effect.factory, Effect), (answer, Question)):
        for method, wanted in _methods(protocol).items() if name else ():
            found = getattr(load(name), method)
            assert inspect.isfunction(found), (name, method)
            assert [*inspect.signature(found).parameters][1:] == wanted, (name, method)


@pytest.mark.parametrize("effect", declared(), ids=lambda effect: effect.name)
def test_an_effect_asks_for_what_it_lists(effect):
    """What is prepared for a scene is what the effect's file names in its updates."""
    factory = effect.factory.partition(":")[0]
    source = inspect.getsource(importlib.import_module(factory)) if factory else ""
    assert set(re.findall(r"\.answer\(\s*\"([^\"]+)\"", source)) == set(effect.needs)


def _methods(protocol):
    """Return the names of the parameters of each method of a protocol."""
    return {
        name: [*inspect.signature(method).parameters][1:]
        for name, method in vars(protocol).items()
        if inspect.isfunction(method) and name not in ("__init__", "__subclasshook__")
    }

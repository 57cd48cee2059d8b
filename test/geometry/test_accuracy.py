"""The settings of pairwise queries: tiers of accuracy, engines."""

import itertools
import sys

import pytest

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.accuracy import Accuracy, as_accuracy, as_engine, Engine
from scene_graph_ros.geometry.errors import EngineError, QueryArgumentError


def test_default_is_exact_and_native() -> None:
    """Who says nothing gets the exact tier of this package's own kernels."""
    scene_graph = SceneGraph()
    assert scene_graph.accuracy is Accuracy.EXACT
    assert scene_graph.engine is Engine.NATIVE


@pytest.mark.parametrize("accuracy", ["quick", Accuracy.STANDARD, "exact"])
def test_model_keeps_the_tier_it_was_made_with(accuracy: str) -> None:
    """The scene graph and its clones have the tier that was asked for, as string or member."""
    scene_graph = SceneGraph(accuracy=accuracy)
    assert scene_graph.accuracy == accuracy
    assert scene_graph.clone().accuracy == accuracy


def test_each_tier_is_at_least_a_hundred_times_tighter_than_the_one_before() -> None:
    """The tiers' bounds descend in the order in which they are declared."""
    bounds = [tier.bound for tier in Accuracy]
    assert all(100.0 * b <= a for a, b in itertools.pairwise(bounds))


def test_contexts_have_a_tier_of_their_own() -> None:
    """Changing the model leaves contexts alone; changing a context leaves the model alone."""
    scene_graph = SceneGraph(accuracy="standard")
    context = scene_graph.create_default_context()
    before = context.snapshot
    scene_graph.set_accuracy("quick")
    assert context.snapshot.state.accuracy is Accuracy.STANDARD
    scene_graph.set_accuracy("exact", context=context)
    assert scene_graph.accuracy is Accuracy.QUICK
    assert context.snapshot.state.accuracy is Accuracy.EXACT
    assert before.state.accuracy is Accuracy.STANDARD


@pytest.mark.parametrize("value", ["fast", "", None, 1e-6, True])
def test_unknown_tier_is_refused_with_the_choices(value: object) -> None:
    """The error quotes the value and lists the names of all tiers."""
    with pytest.raises(QueryArgumentError) as caught:
        as_accuracy(value)
    assert repr(value) in str(caught.value)
    assert all(tier.value in str(caught.value) for tier in Accuracy)


def test_refused_tier_changes_nothing() -> None:
    """After set_accuracy raised, the model has the tier it had."""
    scene_graph = SceneGraph(accuracy="standard")
    with pytest.raises(QueryArgumentError):
        scene_graph.set_accuracy("perfect")
    assert scene_graph.accuracy is Accuracy.STANDARD


def test_unknown_engine_is_refused_with_the_choices() -> None:
    """The error quotes the value and lists the names of all engines."""
    with pytest.raises(QueryArgumentError, match=r"'native', 'fcl'.*'bullet'"):
        SceneGraph(engine="bullet")


def test_engine_that_is_not_installed_is_named_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without python-fcl, asking for it says which package to install."""
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    with pytest.raises(EngineError, match="pip install python-fcl"):
        as_engine("fcl")
    assert as_engine("native") is Engine.NATIVE


def test_choosing_an_engine_does_not_load_it() -> None:
    """``set_engine`` only notes the choice: the module is imported by the first query."""
    loaded = "fcl" in sys.modules
    SceneGraph().set_engine("fcl")
    assert ("fcl" in sys.modules) == loaded

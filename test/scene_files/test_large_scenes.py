"""Scenes of many frames take work in proportion to them: counted in calls, not in seconds."""

from __future__ import annotations

import sys

import pytest

from scene_graph_ros.check import main
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.steps import calling_between_steps
from scene_graph_ros.scene_files import load_scene_text

HEAD = "version: 1\nsources: [{name: s}]\nframes:\n"


def calls(action):
    """Count the calls, also of what is built in, that an action makes."""
    count = 0

    def tally(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(tally)
    try:
        action()
    finally:
        sys.setprofile(None)
    return count


def chain(count, *, parents_first):
    """Return frames in a row, each the parent of the next."""
    lines = [
        f"  - {{name: f{i}, source: s, parent: {f'f{i - 1}' if i else 'world'}}}\n"
        for i in range(count)
    ]
    return HEAD + "".join(lines if parents_first else reversed(lines))


@pytest.mark.parametrize("parents_first", [True, False])
def test_frames_in_a_chain_take_work_in_proportion(parents_first):
    """Twice as long a chain takes about twice the calls, in whichever order it is written.

    Where each frame's ancestors are walked through anew it is four times as many.
    """

    def work(count):
        text = chain(count, parents_first=parents_first)
        return calls(lambda: load_scene_text(text).apply(SceneGraph()))

    work(10)
    assert work(1200) < 2.5 * work(600)


@pytest.mark.parametrize("parents_first", [True, False])
def test_a_chain_is_registered_parents_first(parents_first):
    """Whatever the order in the file, each frame hangs on the one before it."""
    graph = SceneGraph()
    source = load_scene_text(chain(50, parents_first=parents_first)).apply(graph).sources["s"]
    inspector = graph.model_inspector()
    parents = [inspector.get_parent_frame(source.frames[f"f{i}"]) for i in range(50)]
    assert parents == [inspector.world_frame_id(), *(source.frames[f"f{i}"] for i in range(49))]


def test_the_checker_asks_of_no_pair_by_itself(tmp_path, monkeypatch, capsys):
    """Filtered pairs are counted where they are kept: a robot of 3000 links has 4.5 million."""

    def refuse(*arguments):
        raise AssertionError("a pair was asked about")

    monkeypatch.setattr(SceneGraphInspector, "collision_filtered", refuse)
    path = tmp_path / "scene.yaml"
    shape = "shape: {type: sphere, radius: 0.1}"
    lines = [f"  - {{name: g{i}, source: s, frame: f{i}, {shape}}}\n" for i in range(4)]
    filters = "collision_filters:\n  - {within: [s/f0/g0, s/f1/g1, s/f3/g3]}\n"
    path.write_text(chain(4, parents_first=True) + "geometries:\n" + "".join(lines) + filters)
    assert main([str(path)]) == 0
    assert "3 filtered pairs" in capsys.readouterr().out


def test_a_scene_is_read_and_registered_in_steps():
    """Between any two values of the file, frames and geometries something else may go before."""
    count = 20
    shapes = "".join(
        f"  - {{name: g{i}, source: s, frame: f{i}, shape: {{type: sphere, radius: 0.1}}}}\n"
        for i in range(count)
    )
    text = chain(count, parents_first=True) + "geometries:\n" + shapes
    steps = []
    with calling_between_steps(lambda: steps.append("reading")):
        scene = load_scene_text(text)
    # Each frame is a mapping of three names and values, each geometry of four and one more.
    assert len(steps) > count * (1 + 6 + 1 + 8)
    steps.clear()
    graph = SceneGraph()
    with calling_between_steps(lambda: steps.append(graph.model_inspector().num_geometries())):
        scene.apply(graph)
    # Before each frame, then before each geometry.
    assert steps == [0] * count + list(range(count))

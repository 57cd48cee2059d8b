"""The rule for names: text of one line, and paths that mean one thing."""

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryFrame, GeometryInstance, SceneGraph, Sphere
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.names import InvalidNameError

GOOD = ["a", "é☃", "two words", "a\tb", "arm-left", "1", "~", "x" * 255]
BAD = [
    ("", "empty"),
    (" \t\n", "empty"),
    ("x" * 256, "at most 255"),
    ("a\nb", "printable"),
    ("a\x00", "printable"),
    ("a\u202eb", "printable"),
    ("\ud800", "printable"),
    ("/a", "'/'"),
    ("a/", "'/'"),
    (7, "must be text"),
]


def named(what, name):
    """Make something of a kind with a name, and return the name it got."""
    if what == "frame":
        return GeometryFrame(name).name()
    if what == "geometry":
        return GeometryInstance(np.eye(4), Sphere(1.0), name).name()
    graph = SceneGraph()
    return graph.model_inspector().get_name(graph.register_source(name))


@pytest.mark.parametrize("what", ["source", "frame", "geometry"])
@pytest.mark.parametrize("name", GOOD)
def test_good_names_stay_as_they_are(what, name):
    """Less the blanks at their ends."""
    assert named(what, f" {name}\n") == name


@pytest.mark.parametrize("what", ["source", "frame", "geometry"])
@pytest.mark.parametrize(("name", "rule"), BAD)
def test_bad_names_are_refused_with_the_rule(what, name, rule):
    """In one line of bounded length; an empty source is given a name by the model."""
    if (what, name) == ("source", ""):
        assert named(what, name).startswith("source_")
        return
    with pytest.raises(NameConflictError, match=rule) as raised:
        named(what, name)
    assert f"the name of a {what} must" in str(raised.value)
    assert len(str(raised.value)) < 250
    assert "\n" not in str(raised.value)


def test_slashes_are_inside_names_of_frames_and_geometry_only():
    """Robots have them in the names of links; in paths a source's name ends at the first."""
    name = "LFoot/FSR/CenterFront_sensor"
    assert named("frame", name) == named("geometry", name) == name
    with pytest.raises(InvalidNameError, match="no '/' in it"):
        named("source", "cell/arm")


def test_whatever_is_looked_for_is_not_there():
    """To look for a name that nothing can have is no fault of the name."""
    inspector = SceneGraph().model_inspector()
    with pytest.raises(UnknownIdError):
        inspector.get_source_id_by_name("cell/arm")

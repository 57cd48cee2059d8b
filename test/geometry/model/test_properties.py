"""Property groups: what may be added, changed, read and removed."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_contact_material,
    IllustrationProperties,
    make_phong_illustration_properties,
    PerceptionProperties,
    ProximityProperties,
    Rgba,
    Role,
)
from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.perception_properties import read_perception_properties
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.model.render_label import RenderLabel


@pytest.fixture(name="properties")
def _properties():
    result = ProximityProperties()
    result.add_property("group", "count", 7)
    result.add_property("group", "length", 7.0)
    result.add_property("other", "name", "seven")
    return result


def test_added_properties_are_found(properties):
    """Values come back with their types; groups are made on demand."""
    assert properties.get_property("group", "count") == 7
    assert properties.get_property("group", "length", float) == 7.0
    assert properties.get_property("other", "name", str) == "seven"
    assert properties.get_group_names() == {"group", "other"}
    assert properties.num_groups() == 2
    assert properties.get_properties_in_group("group") == {"count": 7, "length": 7.0}


def test_default_group(properties):
    """The default group is one like others, under a name of its own."""
    group = ProximityProperties.default_group_name()
    properties.add_property(group, "count", 1)
    assert properties.get_property(group, "count") == 1
    assert properties.get_property("group", "count") == 7


def test_adding_twice_is_refused(properties):
    """The error has group, name and the value that is there."""
    with pytest.raises(PropertyError, match=r"\('group', 'count'\) exists already: 7"):
        properties.add_property("group", "count", 8)
    assert properties.get_property("group", "count") == 7


@pytest.mark.parametrize(("group", "name"), [("", "a"), ("a", ""), (None, "a"), ("a", 3)])
def test_group_and_name_must_be_text(group, name):
    """Empty or other names are refused."""
    with pytest.raises(PropertyError, match="non-empty text"):
        ProximityProperties().add_property(group, name, 1)


def test_update_adds_or_replaces(properties):
    """A new property is added; one of the same type gets the new value."""
    properties.update_property("group", "count", 8)
    properties.update_property("group", "new", "x")
    assert properties.get_properties_in_group("group") == {"count": 8, "length": 7.0, "new": "x"}


@pytest.mark.parametrize("value", [7.0, "7", True, None, [7]])
def test_update_with_another_type_is_refused(properties, value):
    """The type of a property never changes."""
    with pytest.raises(PropertyError, match=r"'count'\) is of type int"):
        properties.update_property("group", "count", value)


@pytest.mark.parametrize(
    ("group", "name", "words"),
    [("none", "count", "no property group 'none'"), ("group", "none", "group has")],
)
def test_reading_what_is_missing(properties, group, name, words):
    """A missing group and a missing property are told apart, and what there is is listed."""
    with pytest.raises(PropertyError, match=words):
        properties.get_property(group, name)


def test_reading_with_another_type_is_refused(properties):
    """The expected type must be the exact type."""
    with pytest.raises(PropertyError, match="is 7 of type int, not float"):
        properties.get_property("group", "count", float)


def test_default_value(properties):
    """The default is for missing properties only, and fixes the type."""
    assert properties.get_property_or_default("group", "count", 3) == 7
    assert properties.get_property_or_default("group", "none", 3) == 3
    assert properties.get_property_or_default("none", "count", "x") == "x"
    assert properties.get_property_or_default("group", "length", None) == 7.0
    with pytest.raises(PropertyError, match="of type int, not str"):
        properties.get_property_or_default("group", "count", "x")


def test_has_and_remove(properties):
    """Removing tells whether there was something; the group stays."""
    assert properties.has_property("group", "count")
    assert properties.remove_property("group", "count")
    assert not properties.has_property("group", "count")
    assert not properties.remove_property("group", "count")
    assert not properties.remove_property("none", "count")
    assert properties.remove_property("other", "name")
    assert properties.has_group("other")
    assert not properties.has_group("none")
    with pytest.raises(PropertyError, match="no property group 'none'"):
        properties.get_properties_in_group("none")


def test_numpy_scalars_become_python_values():
    """A numpy number is stored as the Python number a reader expects."""
    properties = ProximityProperties()
    properties.add_property("g", "x", np.float64(0.5))
    assert properties.get_property("g", "x", float) == 0.5


def test_values_are_copied_in():
    """Changing a list, a dict or an array afterwards does not change the property."""
    properties = ProximityProperties()
    array, members = np.zeros(3), {"a": [1]}
    properties.add_property("g", "array", array)
    properties.add_property("g", "dict", members)
    array[0] = 1.0
    members["a"].append(2)
    assert properties.get_property("g", "array").tolist() == [0.0, 0.0, 0.0]
    assert properties.get_property("g", "dict") == {"a": [1]}


def test_colour_reads_as_array():
    """An Rgba can be read as its four channels."""
    properties = make_phong_illustration_properties((0.1, 0.2, 0.3, 0.4))
    assert properties.get_property("phong", "diffuse", Rgba) == Rgba(0.1, 0.2, 0.3, 0.4)
    assert properties.get_property("phong", "diffuse", np.ndarray).tolist() == [0.1, 0.2, 0.3, 0.4]


def test_copy_is_independent(properties):
    """A copy can be changed on its own, and is equal until then."""
    other = properties.copy()
    assert other == properties
    other.update_property("group", "count", 9)
    assert other != properties
    assert properties.get_property("group", "count") == 7


def test_equality_needs_type_values_and_arrays():
    """Sets of different roles or of values of different type differ; arrays compare by entries."""
    a, b = ProximityProperties(), ProximityProperties()
    a.add_property("g", "x", np.ones(2))
    b.add_property("g", "x", np.ones(2))
    assert a == b
    assert ProximityProperties() != IllustrationProperties()
    a.add_property("g", "y", 1)
    b.add_property("g", "y", 1.0)
    assert a != b


def test_read_only_copy_refuses_changes(properties):
    """What a registered geometry has can only be replaced as a whole."""
    frozen = properties.read_only_copy()
    for change in (
        lambda: frozen.add_property("g", "x", 1),
        lambda: frozen.update_property("group", "count", 1),
        lambda: frozen.remove_property("group", "count"),
    ):
        with pytest.raises(PropertyError, match="read-only"):
            change()
    frozen.copy().add_property("g", "x", 1)


def test_roles_of_the_classes():
    """Each class stands for one role; the base for none, and cannot be made."""
    assert ProximityProperties.role is Role.PROXIMITY
    assert IllustrationProperties.role is Role.ILLUSTRATION
    assert PerceptionProperties.role is Role.PERCEPTION
    with pytest.raises(TypeError, match="abstract"):
        GeometryProperties()


@pytest.mark.parametrize("channel", range(4))
@pytest.mark.parametrize("value", [-0.01, 1.01, float("nan"), "1", None, True])
def test_colour_channels_are_between_0_and_1(channel, value):
    """The channel out of range is named with its value."""
    channels = [0.5] * 4
    channels[channel] = value
    with pytest.raises(PropertyError, match=f"Rgba: {'rgba'[channel]} must") as caught:
        Rgba(*channels)
    assert repr(value) in str(caught.value)


def test_colour_values():
    """Opacity is 1 by default; a colour is made from what has three or four numbers."""
    assert Rgba(0, 1, 0.5).a == 1.0
    assert Rgba.from_value((0, 1, 0.5)) == Rgba(0, 1, 0.5)
    assert Rgba.from_value(np.array((0, 1, 0.5, 0.2))) == Rgba(0, 1, 0.5, 0.2)
    assert Rgba.from_value(Rgba(0, 1, 0.5)) == Rgba(0, 1, 0.5)
    assert Rgba(0, 1, 0.5, 0.2).as_array().tolist() == [0.0, 1.0, 0.5, 0.2]
    for bad in ((1, 2), 3, "red", "100", (1, "x", 0)):
        with pytest.raises(PropertyError, match="Rgba"):
            Rgba.from_value(bad)


@pytest.mark.parametrize(
    "act",
    [
        lambda: Rgba(-0.1, 0.0, 0.0),
        lambda: Rgba.from_value("red"),
        lambda: RenderLabel(32764 + 4),
        lambda: add_contact_material(ProximityProperties(), dissipation=-1.0),
        lambda: ProximityProperties().add_property("", "size", 1.0),
    ],
)
def test_values_out_of_range_are_value_errors(act):
    """And PropertyErrors and KeyErrors as before."""
    for kind in (ValueError, PropertyError, KeyError):
        with pytest.raises(kind):
            act()


def test_what_is_missing_or_there_already_is_no_value_error():
    """A name is wrong, not a value."""
    properties = ProximityProperties()
    properties.add_property("group", "size", 1.0)
    for act in (
        lambda: properties.get_property("group", "none"),
        lambda: properties.add_property("group", "size", 2.0),
        lambda: properties.update_property("group", "size", "x"),
    ):
        with pytest.raises(PropertyError) as raised:
            act()
        assert not isinstance(raised.value, ValueError)


def test_reserved_labels_as_plain_numbers_are_these_labels():
    """As messages and scene files have no other way to give them; the others are refused."""
    for number, label in ((32764, "DONT_CARE"), (32765, "DO_NOT_RENDER")):
        properties = PerceptionProperties()
        properties.add_property("label", "id", number)
        found = read_perception_properties(properties, "box").label
        assert found is not None and repr(found) == f"RenderLabel({label})"
    for number in (32766, 32767):
        properties = PerceptionProperties()
        properties.add_property("label", "id", number)
        with pytest.raises(ValueError, match="which no geometry can have"):
            read_perception_properties(properties, "box")

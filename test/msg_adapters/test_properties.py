"""Typed properties in both directions."""

from collections.abc import Callable
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from msg_adapters import properties as adapters
from msg_adapters.errors import MessageError
from scene_graph_msgs.msg import Property, RoleProperties
from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.properties import (
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.roles import Role

VALUES = [
    (True, Property.BOOL),
    (False, Property.BOOL),
    (-7, Property.INTEGER),
    (7.5, Property.DOUBLE),
    ("compliant", Property.STRING),
    (Rgba(0.125, 0.25, 0.5, 0.75), Property.RGBA),
    (("a", "b"), Property.STRING_ARRAY),
]


@pytest.mark.parametrize(("value", "kind"), VALUES)
def test_a_value_keeps_its_type(
    value: Any, kind: int, over_the_wire: Callable[[Any], Any]
) -> None:
    """Each type has its own constant, and comes back as what it was."""
    msg = over_the_wire(adapters.property_to_msg("group", "name", value))
    assert (msg.group, msg.name, msg.type) == ("group", "name", kind)
    back = adapters.property_from_msg(msg)
    assert back == value and type(back) is type(value)


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (np.array([1.5, 2.5]), Property.DOUBLE_ARRAY),
        (np.array([3, 4]), Property.INTEGER_ARRAY),
        (np.array([1.5, 2.5], dtype=np.float32), Property.DOUBLE_ARRAY),
    ],
)
def test_arrays_keep_their_numbers(
    value: np.ndarray, kind: int, over_the_wire: Callable[[Any], Any]
) -> None:
    """Numbers come back equal, floating or not as before."""
    msg = over_the_wire(adapters.property_to_msg("group", "name", value))
    assert msg.type == kind
    np.testing.assert_array_equal(adapters.property_from_msg(msg), value)


@pytest.mark.parametrize("value", [np.float32(0.5), np.float64(0.5), np.int32(3), np.bool_(True)])
def test_numbers_of_numpy_become_those_of_python(value: Any) -> None:
    """What the field checks of rclpy would refuse is converted before."""
    back = adapters.property_from_msg(adapters.property_to_msg("g", "n", value))
    assert back == value and isinstance(back, (bool, int, float))


@given(st.one_of(st.floats(allow_nan=False), st.integers(-(2**63), 2**63 - 1), st.text()))
def test_any_number_or_text_survives_a_round_trip(value: Any) -> None:
    """Whatever the value, it comes back equal and of the same type."""
    back = adapters.property_from_msg(adapters.property_to_msg("g", "n", value))
    assert back == value and type(back) is type(value)


@pytest.mark.parametrize(
    "cls", [ProximityProperties, IllustrationProperties, PerceptionProperties]
)
def test_the_properties_of_a_role_survive_the_wire(
    cls: type, over_the_wire: Callable[[Any], Any]
) -> None:
    """All groups and values of each role come back as the class of that role."""
    properties = cls()
    properties.add_property("hydroelastic", "compliance_type", "rigid")
    properties.add_property("material", "static_friction", 0.75)
    properties.add_property("material", "dynamic_friction", 0.5)
    msg = over_the_wire(adapters.properties_to_msg(properties))
    assert [(p.group, p.name) for p in msg.properties] == [
        ("hydroelastic", "compliance_type"),
        ("material", "dynamic_friction"),
        ("material", "static_friction"),
    ]
    assert adapters.properties_from_msg(msg) == properties


def test_the_roles_have_the_documented_numbers() -> None:
    """1, 2 and 3, and nothing else is a role."""
    numbers = {role: adapters.role_to_msg(role) for role in Role if role is not Role.UNASSIGNED}
    assert numbers == {Role.PROXIMITY: 1, Role.ILLUSTRATION: 2, Role.PERCEPTION: 3}
    assert [adapters.role_from_msg(number) for number in (1, 2, 3)] == list(numbers)
    for number in (0, 4):
        with pytest.raises(MessageError, match=f"role {number}"):
            adapters.role_from_msg(number)
        with pytest.raises(MessageError, match=f"role {number}"):
            adapters.properties_from_msg(RoleProperties(role=number))


@pytest.mark.parametrize(
    ("msg", "words"),
    [
        (Property(type=99), "99"),
        (Property(type=Property.DOUBLE), "DOUBLE takes 1 of doubles"),
        (Property(type=Property.RGBA, doubles=[0.1, 0.2, 0.3]), "RGBA takes 4 of doubles"),
        (Property(type=Property.BOOL, integers=[2]), "0 or 1"),
        (Property(type=Property.STRING, strings=["a", "b"]), "STRING takes 1"),
    ],
)
def test_a_property_without_its_value_is_refused(msg: Property, words: str) -> None:
    """The error names group, name and what the type takes."""
    msg.group, msg.name = "phong", "diffuse"
    with pytest.raises(MessageError, match=words) as error:
        adapters.property_from_msg(msg)
    assert "('phong', 'diffuse')" in str(error.value)


def test_a_property_given_twice_is_refused() -> None:
    """The core's error says which."""
    twice = [adapters.property_to_msg("g", "n", 1), adapters.property_to_msg("g", "n", 2)]
    with pytest.raises(PropertyError, match="'n'"):
        adapters.properties_from_msg(RoleProperties(role=1, properties=twice))


@pytest.mark.parametrize("value", [{"a": 1}, b"bytes", None, [object()], [1, "a"]])
def test_values_that_messages_do_not_carry_are_refused(value: Any) -> None:
    """Nothing is silently turned into text."""
    with pytest.raises(MessageError, match="don't carry"):
        adapters.property_to_msg("g", "n", value)

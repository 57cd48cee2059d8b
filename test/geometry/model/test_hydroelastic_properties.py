"""Reading the hydroelastic properties of a geometry as a whole."""

import math

import pytest

from scene_graph_ros.geometry import Box, HalfSpace, ProximityProperties, Sphere
from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.hydroelastic_properties import read_hydroelastic_properties


def _properties(**values):
    properties = ProximityProperties()
    for name, value in values.items():
        properties.add_property("hydroelastic", name, value)
    return properties


@pytest.mark.parametrize(
    "values", [{}, {"compliance_type": "undefined"}, {"hydroelastic_modulus": 1e6}]
)
def test_without_a_compliance_type_there_are_none(values):
    """Also where other properties of the group are there."""
    assert read_hydroelastic_properties(Sphere(1.0), _properties(**values), "pad") is None


def test_rigid():
    """A rigid geometry has no modulus and no margin, whatever was given."""
    given = _properties(compliance_type="rigid", resolution_hint=0.1, margin=0.01)
    result = read_hydroelastic_properties(Sphere(1.0), given, "pad")
    assert tuple(result) == (False, 0.1, 0.0, None, 0.0)
    given = _properties(compliance_type="rigid")
    assert not read_hydroelastic_properties(Box(1.0, 1.0, 1.0), given, "pad").is_compliant
    assert not read_hydroelastic_properties(HalfSpace(), given, "pad").is_compliant


def test_compliant():
    """Integers count as numbers; a half space has a slab."""
    given = _properties(compliance_type="compliant", hydroelastic_modulus=7, resolution_hint=1,
                        margin=0)  # fmt: skip
    result = read_hydroelastic_properties(Sphere(1.0), given, "pad")
    assert tuple(result) == (True, 1.0, 7.0, None, 0.0)
    given = _properties(compliance_type="compliant", hydroelastic_modulus=7.0, slab_thickness=0.5,
                        margin=0.1)  # fmt: skip
    result = read_hydroelastic_properties(HalfSpace(), given, "floor")
    assert tuple(result) == (True, None, 7.0, 0.5, 0.1)


COMPLIANT = {"compliance_type": "compliant", "hydroelastic_modulus": 1e6, "resolution_hint": 0.1}


@pytest.mark.parametrize(
    ("shape", "values", "missing"),
    [
        (Sphere(1.0), {"compliance_type": "rigid"}, "resolution_hint"),
        (Sphere(1.0), COMPLIANT | {"resolution_hint": None}, "resolution_hint"),
        (Box(1.0, 1.0, 1.0), COMPLIANT | {"hydroelastic_modulus": None}, "hydroelastic_modulus"),
        (HalfSpace(), COMPLIANT, "slab_thickness"),
    ],
)
def test_what_is_missing_is_named_with_its_geometry(shape, values, missing):
    """The message says which property of which geometry."""
    given = _properties(**{name: value for name, value in values.items() if value is not None})
    with pytest.raises(PropertyError, match=f"'{missing}'.*'pad' is missing"):
        read_hydroelastic_properties(shape, given, "pad")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("compliance_type", "soft", "'rigid', 'compliant', not 'soft'"),
        ("compliance_type", 1, "not 1"),
        ("hydroelastic_modulus", 0.0, "finite and positive, not 0.0"),
        ("hydroelastic_modulus", math.inf, "finite and positive"),
        ("hydroelastic_modulus", "1e6", "must be a number"),
        ("hydroelastic_modulus", True, "must be a number"),
        ("resolution_hint", -0.1, "finite and positive"),
        ("margin", -1e-3, "finite and at least 0"),
        ("margin", math.nan, "finite and at least 0"),
    ],
)
def test_what_is_no_such_value_is_named(name, value, words):
    """The message has geometry, property and value."""
    with pytest.raises(PropertyError, match=f"'{name}'.*'pad'.*{words}"):
        read_hydroelastic_properties(
            Sphere(1.0), _properties(**(COMPLIANT | {name: value})), "pad"
        )

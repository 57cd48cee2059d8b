"""The helpers that fill in properties of contact."""

import math

import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_compliant_hydroelastic_properties_for_half_space,
    add_contact_material,
    add_rigid_hydroelastic_properties,
    IllustrationProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.contact_properties import uses_triangles

BAD_POSITIVE = [0.0, -1.0, math.nan, math.inf, "1", None, True]


@pytest.fixture(name="properties")
def _properties():
    return ProximityProperties()


def test_rigid(properties):
    """A rigid geometry needs no more than its type."""
    add_rigid_hydroelastic_properties(properties)
    assert properties.get_properties_in_group("hydroelastic") == {"compliance_type": "rigid"}


def test_rigid_with_resolution(properties):
    """Resolution and margin are optional."""
    add_rigid_hydroelastic_properties(properties, resolution_hint=0.02, margin=0.001)
    assert properties.get_properties_in_group("hydroelastic") == {
        "compliance_type": "rigid",
        "resolution_hint": 0.02,
        "margin": 0.001,
    }


def test_compliant(properties):
    """A compliant geometry has resolution and modulus."""
    add_compliant_hydroelastic_properties(
        properties, resolution_hint=0.02, hydroelastic_modulus=1e7
    )
    assert properties.get_properties_in_group("hydroelastic") == {
        "compliance_type": "compliant",
        "resolution_hint": 0.02,
        "hydroelastic_modulus": 1e7,
    }


def test_compliant_half_space(properties):
    """A half space has the thickness of its slab instead of a resolution."""
    add_compliant_hydroelastic_properties_for_half_space(
        properties, slab_thickness=0.1, hydroelastic_modulus=1e7
    )
    assert properties.get_properties_in_group("hydroelastic") == {
        "compliance_type": "compliant",
        "slab_thickness": 0.1,
        "hydroelastic_modulus": 1e7,
    }


def test_one_compliance_only(properties):
    """A second declaration is refused."""
    add_rigid_hydroelastic_properties(properties)
    with pytest.raises(PropertyError, match="compliance_type"):
        add_compliant_hydroelastic_properties(properties, 0.1, 1e6)


@pytest.mark.parametrize(
    ("add", "group", "last"),
    [
        (
            lambda p: add_compliant_hydroelastic_properties(p, 0.1, 1e6),
            "hydroelastic",
            "hydroelastic_modulus",
        ),
        (
            lambda p: add_compliant_hydroelastic_properties_for_half_space(p, 0.1, 1e6),
            "hydroelastic",
            "slab_thickness",
        ),
        (
            lambda p: add_contact_material(p, dissipation=0.1, point_stiffness=1e5),
            "material",
            "point_contact_stiffness",
        ),
    ],
)
def test_one_that_is_there_already_keeps_all_others_out(properties, add, group, last):
    """A helper adds all its properties, or names the one in its way and adds none."""
    properties.add_property(group, last, 1.0)
    with pytest.raises(PropertyError, match=last):
        add(properties)
    assert properties.get_properties_in_group(group) == {last: 1.0}


@pytest.mark.parametrize("other", [IllustrationProperties(), None, {}])
def test_contact_is_for_the_proximity_role(other):
    """Properties of another role, which no contact reads, are refused."""
    with pytest.raises(PropertyError, match="ProximityProperties, not of"):
        add_rigid_hydroelastic_properties(other)


@pytest.mark.parametrize(
    ("name", "value"),
    [("hydroelastic_modulus", value) for value in BAD_POSITIVE]
    # A resolution of None is none given.
    + [("resolution_hint", value) for value in BAD_POSITIVE if value is not None],
)
def test_bad_number_is_refused_and_nothing_added(properties, name, value):
    """The number is named, and the properties are as before."""
    arguments = {"resolution_hint": 0.1, "hydroelastic_modulus": 1e6, name: value}
    with pytest.raises(PropertyError, match=name):
        add_compliant_hydroelastic_properties(properties, **arguments)
    assert properties.num_groups() == 0


def test_negative_margin_is_refused(properties):
    """A margin may be zero, not negative."""
    with pytest.raises(PropertyError, match="margin must be finite and at least 0"):
        add_rigid_hydroelastic_properties(properties, margin=-0.001)


def test_contact_material(properties):
    """All material properties go to their group."""
    add_contact_material(
        properties,
        dissipation=0.5,
        point_stiffness=1e4,
        static_friction=0.9,
        dynamic_friction=0.8,
    )
    assert properties.get_properties_in_group("material") == {
        "hunt_crossley_dissipation": 0.5,
        "point_contact_stiffness": 1e4,
        "static_friction": 0.9,
        "dynamic_friction": 0.8,
    }


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"static_friction": 0.5}, "come together"),
        ({"static_friction": 0.5, "dynamic_friction": 0.6}, "must not exceed"),
        ({"static_friction": -0.5, "dynamic_friction": -0.6}, "static_friction"),
        ({"dissipation": -1.0}, "dissipation"),
        ({"point_stiffness": 0.0}, "point_stiffness"),
    ],
)
def test_bad_material_is_refused_and_nothing_added(properties, arguments, words):
    """Each rule has its words."""
    with pytest.raises(PropertyError, match=words):
        add_contact_material(properties, **arguments)
    assert properties.num_groups() == 0


def test_mesh_representation(properties):
    """A mesh means its hull unless the property says triangles."""
    assert not uses_triangles(properties)
    properties.add_property("mesh", "representation", "convex_hull")
    assert not uses_triangles(properties)
    properties.update_property("mesh", "representation", "triangles")
    assert uses_triangles(properties)
    properties.update_property("mesh", "representation", "voxels")
    with pytest.raises(PropertyError, match="'voxels'"):
        uses_triangles(properties)

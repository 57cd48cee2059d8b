"""Helpers that put the properties of contact into their groups. They compute nothing."""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = [
    "CONVEX_HULL",
    "HYDROELASTIC_GROUP",
    "MATERIAL_GROUP",
    "MESH_GROUP",
    "PIECES",
    "REPRESENTATION",
    "TRIANGLES",
    "add_compliant_hydroelastic_properties",
    "add_compliant_hydroelastic_properties_for_half_space",
    "add_contact_material",
    "add_rigid_hydroelastic_properties",
    "uses_triangles",
]

HYDROELASTIC_GROUP = "hydroelastic"
MATERIAL_GROUP = "material"
MESH_GROUP = "mesh"
PIECES = "pieces"
REPRESENTATION = "representation"
CONVEX_HULL = "convex_hull"
TRIANGLES = "triangles"


def uses_triangles(properties: ProximityProperties) -> bool:
    """Tell whether a Mesh with these properties means its triangles instead of its hull.

    In pieces it means those of their hulls. Raises PropertyError if ``("mesh",
    "representation")`` is neither of the two words, or one hull and pieces are asked for.
    """
    in_pieces = properties.has_property(MESH_GROUP, PIECES)
    default = TRIANGLES if in_pieces else CONVEX_HULL
    word = properties.get_property_or_default(MESH_GROUP, REPRESENTATION, default)
    if word not in (CONVEX_HULL, TRIANGLES):
        raise PropertyValueError(
            f"property ({MESH_GROUP!r}, {REPRESENTATION!r}) must be {CONVEX_HULL!r} or"
            f" {TRIANGLES!r}, not {word!r}"
        )
    if in_pieces and word == CONVEX_HULL:
        raise PropertyValueError(
            f"property ({MESH_GROUP!r}, {REPRESENTATION!r}) = {CONVEX_HULL!r} means one hull, and"
            f" ({MESH_GROUP!r}, {PIECES!r}) several: leave one of them out"
        )
    return bool(word == TRIANGLES)


def _number(name: str, value: Any, *, at_least: float | None = None) -> float:
    """Return a finite number above zero, or at least ``at_least`` where that is given."""
    number = as_float(value)
    if number is None:
        raise PropertyValueError(f"{name} must be a number, not {quoted(value)}")
    accepted = number > 0.0 if at_least is None else number >= at_least
    if not math.isfinite(number) or not accepted:
        bound = "positive" if at_least is None else f"at least {at_least:g}"
        raise PropertyValueError(f"{name} must be finite and {bound}, not {quoted(value)}")
    return number


def _compliance(
    compliance_type: str, resolution_hint: float | None, margin: float | None
) -> dict[str, Any]:
    values: dict[str, Any] = {"compliance_type": compliance_type}
    if resolution_hint is not None:
        values["resolution_hint"] = _number("resolution_hint", resolution_hint)
    if margin is not None:
        values["margin"] = _number("margin", margin, at_least=0.0)
    return values


def _add_all(properties: Any, group: str, values: Mapping[str, Any]) -> None:
    """Add every property or, if there is one of them already, none."""
    if not isinstance(properties, ProximityProperties):
        raise PropertyValueError(
            f"contact is a matter of ProximityProperties, not of {properties!r}"
        )
    for name in values:
        if properties.has_property(group, name):
            old = properties.get_property(group, name)
            raise PropertyError(f"property ({group!r}, {name!r}) exists already: {old!r}")
    for name, value in values.items():
        properties.add_property(group, name, value)


def add_rigid_hydroelastic_properties(
    properties: ProximityProperties,
    resolution_hint: float | None = None,
    *,
    margin: float | None = None,
) -> None:
    """Declare a geometry rigid for contact surfaces.

    ``resolution_hint`` (m) is the wanted edge length of its mesh, needed by curved shapes;
    ``margin`` (m) thickens the shape. Raises PropertyError for values out of range, or if the
    properties have a compliance already; then nothing is added.
    """
    _add_all(properties, HYDROELASTIC_GROUP, _compliance("rigid", resolution_hint, margin))


def add_compliant_hydroelastic_properties(
    properties: ProximityProperties,
    resolution_hint: float,
    hydroelastic_modulus: float,
    *,
    margin: float | None = None,
) -> None:
    """Declare a geometry compliant for contact surfaces.

    ``resolution_hint`` (m) is the wanted edge length of its mesh, ``hydroelastic_modulus`` (Pa)
    the pressure at its deepest point, ``margin`` (m) thickens the shape. Raises PropertyError as
    the rigid sibling does.
    """
    values = _compliance("compliant", resolution_hint, margin)
    values["hydroelastic_modulus"] = _number("hydroelastic_modulus", hydroelastic_modulus)
    _add_all(properties, HYDROELASTIC_GROUP, values)


def add_compliant_hydroelastic_properties_for_half_space(
    properties: ProximityProperties,
    slab_thickness: float,
    hydroelastic_modulus: float,
    *,
    margin: float | None = None,
) -> None:
    """Declare a half space compliant: a slab of ``slab_thickness`` (m) on rigid ground.

    Raises PropertyError as the rigid sibling does.
    """
    values = _compliance("compliant", None, margin)
    values["slab_thickness"] = _number("slab_thickness", slab_thickness)
    values["hydroelastic_modulus"] = _number("hydroelastic_modulus", hydroelastic_modulus)
    _add_all(properties, HYDROELASTIC_GROUP, values)


def add_contact_material(
    properties: ProximityProperties,
    *,
    dissipation: float | None = None,
    point_stiffness: float | None = None,
    static_friction: float | None = None,
    dynamic_friction: float | None = None,
) -> None:
    """Add the material that contact results carry: dissipation (s/m), stiffness (N/m), friction.

    Friction coefficients come together, the static one at least as large as the dynamic one.
    Raises PropertyError otherwise, for values that are negative or not finite, or if one of them
    is there already; then nothing is added.
    """
    if (static_friction is None) != (dynamic_friction is None):
        raise PropertyValueError(
            "static_friction and dynamic_friction come together, not"
            f" {static_friction!r} and {dynamic_friction!r}"
        )
    values: dict[str, float] = {}
    if dissipation is not None:
        values["hunt_crossley_dissipation"] = _number("dissipation", dissipation, at_least=0.0)
    if point_stiffness is not None:
        values["point_contact_stiffness"] = _number("point_stiffness", point_stiffness)
    if static_friction is not None:
        values["static_friction"] = _number("static_friction", static_friction, at_least=0.0)
        values["dynamic_friction"] = _number("dynamic_friction", dynamic_friction, at_least=0.0)
        if values["dynamic_friction"] > values["static_friction"]:
            raise PropertyValueError(
                f"dynamic_friction {dynamic_friction!r} must not exceed static_friction"
                f" {static_friction!r}"
            )
    _add_all(properties, MATERIAL_GROUP, values)

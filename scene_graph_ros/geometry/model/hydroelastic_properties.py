"""A geometry's properties of contact surfaces, read and checked as a whole."""

from __future__ import annotations

import enum
import math
from typing import NamedTuple

from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.contact_properties import HYDROELASTIC_GROUP
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.shapes.element_shape import ElementShape
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = [
    "Compliance",
    "HydroelasticProperties",
    "read_hydroelastic_properties",
    "refuse_elements",
]

_CURVED = (ShapeKind.SPHERE, ShapeKind.CAPSULE, ShapeKind.CYLINDER, ShapeKind.ELLIPSOID)


class Compliance(enum.Enum):
    """The values of the property ``compliance_type``; ``undefined`` is as good as none."""

    UNDEFINED = "undefined"
    RIGID = "rigid"
    COMPLIANT = "compliant"


class HydroelasticProperties(NamedTuple):
    """The hydroelastic properties of one geometry; those that do not apply to it are None or 0."""

    is_compliant: bool
    resolution_hint: float | None
    """Metres."""
    modulus: float
    """Pascals; 0 if rigid."""
    slab_thickness: float | None
    """Metres; of a compliant half space."""
    margin: float
    """Metres; 0 if rigid, for a rigid surface has no field that could be continued outside."""


def read_hydroelastic_properties(
    shape: Shape, properties: ProximityProperties, name: str
) -> HydroelasticProperties | None:
    """Return the hydroelastic properties of a geometry, or None if it has no compliance type.

    Args:
        shape: of the geometry; tells which properties are needed.
        properties: of its proximity role.
        name: of the geometry, for messages.

    Raises:
        PropertyError: one that is needed is missing, or one that is there is no such value; names
            geometry and property.

    """
    word = properties.get_property_or_default(HYDROELASTIC_GROUP, "compliance_type", None)
    if word is None or word == Compliance.UNDEFINED.value:
        return None
    if word not in [compliance.value for compliance in Compliance]:
        words = ", ".join(repr(compliance.value) for compliance in Compliance)
        raise PropertyValueError(
            f"{_label('compliance_type', name)} must be of {words}, not {word!r}"
        )
    is_compliant = word == Compliance.COMPLIANT.value
    hint = _number(properties, "resolution_hint", name)
    if hint is None and shape.kind in _CURVED:
        raise _missing("resolution_hint", name, f"the curved surface of {shape!r}")
    if not is_compliant:
        return HydroelasticProperties(False, hint, 0.0, None, 0.0)
    modulus = _number(properties, "hydroelastic_modulus", name)
    if modulus is None:
        raise _missing("hydroelastic_modulus", name, "a compliant geometry")
    slab = None
    if shape.kind == ShapeKind.HALF_SPACE:
        slab = _number(properties, "slab_thickness", name)
        if slab is None:
            raise _missing("slab_thickness", name, "a compliant half space")
    margin = _number(properties, "margin", name, may_be_zero=True)
    return HydroelasticProperties(True, hint, modulus, slab, margin or 0.0)


def refuse_elements(shape: Shape, properties: ProximityProperties, name: str) -> None:
    """Raise PropertyError for a shape of many elements that is to have contact surfaces."""
    word = properties.get_property_or_default(HYDROELASTIC_GROUP, "compliance_type", None)
    if isinstance(shape, ElementShape) and word not in (None, Compliance.UNDEFINED.value):
        raise PropertyError(
            f"{_label('compliance_type', name)} must not be there: a {shape.type_name} has no"
            " contact surfaces"
        )


def _label(name: str, geometry: str) -> str:
    return f"property ({HYDROELASTIC_GROUP!r}, {name!r}) of geometry {geometry!r}"


def _missing(name: str, geometry: str, why: str) -> PropertyError:
    return PropertyError(f"{_label(name, geometry)} is missing: {why} needs it")


def _number(
    properties: ProximityProperties, name: str, geometry: str, *, may_be_zero: bool = False
) -> float | None:
    """Return a property that is a finite number above zero (or at zero), None if not there."""
    value = properties.get_property_or_default(HYDROELASTIC_GROUP, name, None)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PropertyValueError(f"{_label(name, geometry)} must be a number, not {value!r}")
    number = float(value)
    if not math.isfinite(number) or number < 0.0 or (number == 0.0 and not may_be_zero):
        bound = "at least 0" if may_be_zero else "positive"
        raise PropertyValueError(
            f"{_label(name, geometry)} must be finite and {bound}, not {value!r}"
        )
    return number

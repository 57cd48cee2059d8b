"""A scene's own values of contact, for geometry that has none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scene_graph_ros.geometry.model.contact_properties import (
    add_contact_material,
    HYDROELASTIC_GROUP,
    MATERIAL_GROUP,
)
from scene_graph_ros.geometry.model.hydroelastic_properties import Compliance
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.element_shape import ElementShape
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["DefaultProximityProperties", "SceneGraphConfig"]

_FRICTION = ("static_friction", "dynamic_friction")
_LENGTHS_AND_MODULUS = {
    "hydroelastic_modulus": False,
    "resolution_hint": False,
    "slab_thickness": False,
    "margin": True,
}
"""Whether each may be 0."""


@one_line()
@dataclass(frozen=True, kw_only=True)
class DefaultProximityProperties:
    """Properties that geometry with the proximity role gets where it has none of its own.

    A value of None adds nothing, so that a scene without values is as if there were no defaults.
    Raises PropertyValueError, which names the value, for those that no geometry could have.
    """

    compliance_type: str = "undefined"
    """Of contact surfaces: "rigid", "compliant" or, for points alone, "undefined"."""
    hydroelastic_modulus: float | None = None
    """Pa."""
    resolution_hint: float | None = None
    """m."""
    slab_thickness: float | None = None
    """m, of half spaces."""
    margin: float | None = None
    """m, at least 0."""
    dynamic_friction: float | None = None
    """Without a unit; both frictions come together."""
    static_friction: float | None = None
    hunt_crossley_dissipation: float | None = None
    """s/m."""
    relaxation_time: float | None = None
    """s, at least 0."""
    point_stiffness: float | None = None
    """N/m."""

    def __post_init__(self) -> None:
        """Check all values, by the rules of one geometry's."""
        words = [each.value for each in Compliance]
        given: object = self.compliance_type
        if not isinstance(given, str) or given not in words:
            raise PropertyValueError(
                f"compliance_type must be of {', '.join(map(repr, words))}, not"
                f" {quoted(self.compliance_type)}"
            )
        for name, may_be_zero in (*_LENGTHS_AND_MODULUS.items(), ("relaxation_time", True)):
            self._check(name, may_be_zero)
        add_contact_material(
            ProximityProperties(),
            dissipation=self.hunt_crossley_dissipation,
            point_stiffness=self.point_stiffness,
            static_friction=self.static_friction,
            dynamic_friction=self.dynamic_friction,
        )

    def _check(self, name: str, may_be_zero: bool) -> None:
        given = getattr(self, name)
        value = 1.0 if given is None else as_float(given)
        if value is None or not (0.0 < value < float("inf") or (may_be_zero and value == 0.0)):
            bound = "at least 0" if may_be_zero else "positive"
            raise PropertyValueError(f"{name} must be finite and {bound}, not {quoted(given)}")

    def groups(self) -> Mapping[str, Mapping[str, Any]]:
        """Return the values that are given, by group and name."""
        hydroelastic = {name: getattr(self, name) for name in _LENGTHS_AND_MODULUS}
        if self.compliance_type != Compliance.UNDEFINED.value:
            hydroelastic["compliance_type"] = self.compliance_type
        names = (*_FRICTION, "hunt_crossley_dissipation", "relaxation_time")
        material = {name: getattr(self, name) for name in names}
        material["point_contact_stiffness"] = self.point_stiffness
        return {
            group: {
                name: value if isinstance(value, str) else float(value)
                for name, value in values.items()
                if value is not None
            }
            for group, values in ((HYDROELASTIC_GROUP, hydroelastic), (MATERIAL_GROUP, material))
        }

    def filled(
        self, properties: ProximityProperties, shape: Shape, *, is_deformable: bool
    ) -> ProximityProperties:
        """Return a geometry's properties, read-only, with the values that they lack.

        Deformable geometry, clouds, height fields and voxel grids have no contact surfaces, so
        they get materials alone. One friction of its own keeps both of the scene's away.
        """
        groups = self.groups()
        if not any(groups.values()):
            return properties.read_only_copy()
        result = properties.copy()
        for group, values in groups.items():
            if group == HYDROELASTIC_GROUP and (is_deformable or isinstance(shape, ElementShape)):
                continue
            has_friction = any(properties.has_property(MATERIAL_GROUP, each) for each in _FRICTION)
            for name, value in values.items():
                is_own = properties.has_property(group, name)
                if not is_own and not (has_friction and name in _FRICTION):
                    result.add_property(group, name, value)
        return result.read_only_copy()


@one_line()
@dataclass(frozen=True, kw_only=True)
class SceneGraphConfig:
    """What a scene graph sets for all of its geometry. Raises PropertyValueError."""

    default_proximity_properties: DefaultProximityProperties = field(
        default_factory=DefaultProximityProperties
    )

    def __post_init__(self) -> None:
        """Check the kind of the defaults."""
        given = self.default_proximity_properties
        if not isinstance(given, DefaultProximityProperties):
            raise PropertyValueError(
                "default_proximity_properties must be DefaultProximityProperties, not"
                f" {quoted(given)}"
            )

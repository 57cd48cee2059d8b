"""The demand for effects: scene, requests and parameters."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable, Mapping
from types import MappingProxyType
from typing import Any

from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.model.contact_properties import HYDROELASTIC_GROUP
from scene_graph_ros.geometry.model.hydroelastic_properties import Compliance

__all__ = ["CLOUDS", "Demand", "count_clouds", "count_compliant", "count_deformable", "count_role"]

CLOUDS = "clouds"
"""The group of kernels that measures clouds."""


def _no_parameter(name: str) -> Any:
    raise KeyError(name)


class Demand:
    """The places of demand for effects: a scene, requests so far, parameters.

    Nothing in here is about one effect: each asks its own question of the scene.
    """

    def __init__(
        self,
        inspector: Any,
        requests: Mapping[str, int],
        cameras: Container[str] = (),
        parameter: Callable[[str], Any] = _no_parameter,
        kept: Mapping[str, int] = MappingProxyType({}),
        imaging: Container[str] = (),
    ) -> None:
        """``inspector`` introspects the model, ``requests`` counts those of each query.

        ``kept`` counts the node's other possessions, such as regions, by kind. ``cameras`` are
        the names of the scene's cameras, ``imaging`` those of sources that send images of depth;
        ``parameter`` returns the value of one of the node's.
        """
        self._inspector = inspector
        self._counts: dict[Hashable, int] = {}
        self.requests, self.cameras, self.parameter = requests, cameras, parameter
        self.kept, self.imaging = kept, imaging

    def count(self, count: Callable[..., int], *arguments: Hashable) -> int:
        """Return the result of ``count``, which gets an inspector; counted once."""
        key = (count, arguments)
        if key not in self._counts:
            self._counts[key] = count(self._inspector, *arguments)
        return self._counts[key]


def count_role(inspector: Any, role: Role) -> int:
    """Count the geometries with a role."""
    return int(inspector.num_geometries_with_role(role))


def count_compliant(inspector: Any) -> int:
    """Count the rigid geometries that their proximity role makes compliant in contact."""
    property_of_interest = (HYDROELASTIC_GROUP, "compliance_type", None)
    given = [
        (geometry_id, inspector.get_properties(geometry_id, Role.PROXIMITY))
        for geometry_id in inspector.get_all_geometry_ids(Role.PROXIMITY)
    ]
    return sum(
        properties.get_property_or_default(*property_of_interest) == Compliance.COMPLIANT.value
        for geometry_id, properties in given
        if properties.has_group(HYDROELASTIC_GROUP) and not inspector.is_deformable(geometry_id)
    )


def count_deformable(inspector: Any) -> int:
    """Count the deformable geometries with the proximity role."""
    deformable = inspector.get_all_deformable_geometry_ids()
    return len({*deformable} & {*inspector.get_all_geometry_ids(Role.PROXIMITY)})


def count_clouds(inspector: Any) -> int:
    """Count the clouds, height fields and voxel grids with the proximity role."""
    return len(
        {
            *inspector.get_all_cloud_ids(),
            *inspector.get_all_height_field_ids(),
            *inspector.get_all_voxel_grid_ids(),
        }
        & {*inspector.get_all_geometry_ids(Role.PROXIMITY)}
    )

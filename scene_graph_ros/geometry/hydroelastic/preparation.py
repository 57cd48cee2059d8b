"""Making bodies when geometry is registered, for who wants errors then and not at a query."""

from __future__ import annotations

from scene_graph_ros.geometry.hydroelastic.bodies import body_of
from scene_graph_ros.geometry.model.hydroelastic_properties import read_hydroelastic_properties
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["prepare_body"]


def prepare_body(shape: Shape, properties: ProximityProperties, name: str) -> None:
    """Make and keep the body of a geometry, if its properties ask for one.

    Raises PropertyError for hydroelastic properties that are missing or wrong, and MeshError for
    a shape that has no surface or volume; both name the geometry.
    """
    hydroelastic = read_hydroelastic_properties(shape, properties, name)
    if hydroelastic is not None:
        body_of(shape, hydroelastic)

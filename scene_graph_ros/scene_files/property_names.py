"""Properties of a scene file that nothing reads: mistyped, as far as that can be told.

Groups that are not ours are the user's own, with all their properties.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import difflib
from typing import Any

from scene_graph_ros.geometry.model.contact_properties import (
    HYDROELASTIC_GROUP,
    MATERIAL_GROUP,
    MESH_GROUP,
)
from scene_graph_ros.geometry.model.deformable import DEFORMABLE_GROUP
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.scene_files.scene_file import SceneFile

__all__ = ["KNOWN_PROPERTIES", "property_warnings"]

KNOWN_PROPERTIES: Mapping[str, tuple[str, ...]] = {
    HYDROELASTIC_GROUP: (
        "compliance_type",
        "hydroelastic_modulus",
        "margin",
        "resolution_hint",
        "slab_thickness",
    ),
    MATERIAL_GROUP: (
        "dynamic_friction",
        "hunt_crossley_dissipation",
        "point_contact_stiffness",
        "relaxation_time",
        "static_friction",
    ),
    MESH_GROUP: ("repair_tolerance", "representation", "solid"),
    DEFORMABLE_GROUP: ("embedded_mesh",),
    "phong": ("diffuse", "diffuse_map", "diffuse_scale"),
    "label": ("id",),
    "renderer": ("accepting",),
}
"""The properties that this package reads, by group."""

_NEAR = 0.75
"""How alike two names of groups are, by difflib's ratio, of which one is taken for mistyped."""

_ROLES = ("proximity", "illustration", "perception")


def property_warnings(scene: SceneFile) -> Iterator[str]:
    """Yield a sentence, with its place, for each property that its known group does not have.

    So it is for a group that is nearly called as a known one.
    """
    for place, groups in _all_properties(scene):
        for group, values in groups.items():
            if group not in KNOWN_PROPERTIES:
                near = difflib.get_close_matches(group, KNOWN_PROPERTIES, n=1, cutoff=_NEAR)
                if near:
                    where = scene.document.location(*place, group)
                    yield (
                        f"{where}: no group of properties that anything reads; did you mean"
                        f" {near[0]!r}?"
                    )
                continue
            known = KNOWN_PROPERTIES[group]
            for name in values:
                if name not in known:
                    where = scene.document.location(*place, group, name)
                    hint = suggestion(name, known) or f"; it has {', '.join(known)}"
                    yield f"{where}: group {quoted(group)} has no property {quoted(name)}{hint}"


def _all_properties(
    scene: SceneFile,
) -> Iterator[tuple[tuple[str | int, ...], Mapping[str, Mapping[str, Any]]]]:
    """Yield the properties of the file, each with its place."""
    for index, geometry in enumerate(scene.spec.geometries):
        for role in _ROLES:
            yield ("geometries", index, "roles", role), getattr(geometry.roles, role) or {}
    for index, robot in enumerate(scene.spec.robots):
        yield ("robots", index, "proximity"), robot.proximity
        yield ("robots", index, "perception"), robot.perception or {}

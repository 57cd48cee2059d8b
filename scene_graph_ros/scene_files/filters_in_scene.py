"""Collision filters of a scene file, and the geometries that their references mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scene_graph_ros.geometry import CollisionFilterDeclaration, GeometrySet
from scene_graph_ros.scene_files.application import Application

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.ids import GeometryId

__all__ = ["apply_filters"]


def apply_filters(to: Application) -> None:
    """Apply all, in the order of the file."""
    manager = to.scene_graph.collision_filter_manager()
    for index, spec in enumerate(to.spec.collision_filters):
        named = [*(spec.within or []), *(name for names in spec.between or [] for name in names)]
        if not to.takes(*(name.partition("/")[0] for name in named)):
            continue
        declaration = CollisionFilterDeclaration()
        place: tuple[str | int, ...] = ("collision_filters", index)
        if spec.within is not None:
            members = _members(to, spec.within, *place, "within")
            method = f"{spec.action}_within"
            getattr(declaration, method)(members)
        else:
            assert spec.between is not None
            sets = [
                _members(to, names, *place, "between", i) for i, names in enumerate(spec.between)
            ]
            method = f"{spec.action}_between"
            getattr(declaration, method)(*sets)
        with to.located(*place):
            manager.apply(declaration)


def _members(to: Application, references: list[str], *path: str | int) -> GeometrySet:
    """Return the geometries that "source", "source/frame" or "source/frame/name" mean."""
    result = GeometrySet()
    for index, reference in enumerate(references):
        source_name, _, rest = reference.partition("/")
        source = to.source(source_name)
        frame_name, _, name = rest.partition("/")
        place = (*path, index)
        if not rest:
            result.add(source.frames.values(), _anchored(to, source_name))
        elif name:
            result.add(_geometry(to, source_name, frame_name, name, *place))
        elif frame_name == "world":
            result.add(_anchored(to, source_name))
        else:
            result.add(to.frame_id(source, frame_name, *place))
    return result


def _anchored(to: Application, source: str) -> list[GeometryId]:
    start = f"{source}/world/"
    return [gid for path, gid in to.geometries.items() if path.startswith(start)]


def _geometry(to: Application, source: str, frame: str, name: str, *path: str | int) -> GeometryId:
    full = f"{source}/{frame}/{name}"
    if full in to.geometries:
        return to.geometries[full]
    frame_id = to.frame_id(to.source(source), frame, *path)
    inspector = to.scene_graph.model_inspector()
    for geometry_id in inspector.get_geometries(frame_id):
        if inspector.get_name(geometry_id) == name:
            return geometry_id
    raise to.scene.document.error(
        f"frame {frame!r} of source {source!r} has no geometry {name!r}", *path
    )

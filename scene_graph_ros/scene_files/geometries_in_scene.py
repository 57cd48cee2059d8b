"""Frames and geometries of a scene file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scene_graph_ros.geometry import GeometryFrame, GeometryInstance
from scene_graph_ros.geometry.errors import NameConflictError, SceneGraphError
from scene_graph_ros.geometry.model.perception_properties import (
    check_appearance,
    check_illustration,
)
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.scene_files.application import Application
from scene_graph_ros.scene_files.instances import (
    find_embedded_mesh,
    find_picture,
    instance_from_spec,
    pose_from_spec,
)
from scene_graph_ros.scene_files.loaded_scene import LoadedSource
from scene_graph_ros.scene_files.schema import DeformableSpec, FrameSpec

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
    from scene_graph_ros.geometry.model.ids import FrameId, GeometryId

__all__ = ["add_frames", "add_geometries"]


def add_frames(to: Application) -> None:
    """Register all frames, each after its parent."""
    names = {(frame.source, frame.name) for frame in to.spec.frames}
    waiting: dict[tuple[str, str], list[tuple[int, FrameSpec]]] = {}
    for index, frame in enumerate(to.spec.frames):
        if not to.takes(frame.source):
            continue
        parent = (frame.source, frame.parent)
        if parent in names and frame.parent not in to.source(frame.source).frames:
            waiting.setdefault(parent, []).append((index, frame))
            continue
        ready = [(index, frame)]
        while ready:
            at, one = ready.pop()
            _add_frame(to, one, at)
            ready += reversed(waiting.pop((one.source, one.name), []))
    # The checker refused loops, so each frame's parent came.
    assert not waiting


def _add_frame(to: Application, frame: FrameSpec, index: int) -> None:
    between_steps()
    source = to.source(frame.source)
    parent = to.frame_id(source, frame.parent, "frames", index, "parent")
    with to.located("frames", index, "name"):
        frame_id = to.scene_graph.register_frame(
            source.source_id, GeometryFrame(frame.name), parent=parent
        )
    with to.located("frames", index, "pose"):
        source.initial_poses[frame_id] = pose_from_spec(frame.pose, f"of frame {frame.name!r}")
    source.frames[frame.name] = frame_id


def add_geometries(to: Application) -> None:
    """Register all geometries on frames that are there, and note the bodies that they need."""
    for index, spec in enumerate(to.spec.geometries):
        between_steps()
        if not to.takes(spec.source):
            continue
        source = to.source(spec.source)
        frame_id = to.frame_id(source, spec.frame, "geometries", index, "frame")
        with to.located("geometries", index, "pose"):
            X_FG = pose_from_spec(spec.pose, f"of geometry {spec.name!r}")
        with to.located("geometries", index, "shape"):
            instance = instance_from_spec(spec, X_FG, to.resolve, is_seen=bool(to.spec.cameras))
        _find_picture(to, instance, index, deforms=spec.deformable is not None)
        if spec.frame == "world":
            instance.set_name(to.prefix + spec.name)
        if spec.deformable is not None:
            geometry_id = _add_deformable(to, spec.deformable, source, instance, index)
        else:
            geometry_id = _add_rigid(to, source, frame_id, instance, index)
        to.geometries[f"{spec.source}/{spec.frame}/{spec.name}"] = geometry_id


def _find_picture(
    to: Application, instance: GeometryInstance, index: int, *, deforms: bool
) -> None:
    """Have the picture that a geometry is covered with read now, so that errors have a place."""
    for role, properties, check in (
        ("perception", instance.perception_properties(), check_appearance),
        ("illustration", instance.illustration_properties(), check_illustration),
    ):
        if properties is not None and properties.has_property("phong", "diffuse_map"):
            with to.located("geometries", index, "roles", role, "phong", "diffuse_map"):
                find_picture(properties, to.resolve)
                check(instance.shape(), properties, instance.name(), deforms=deforms)


def _add_rigid(
    to: Application,
    source: LoadedSource,
    frame_id: FrameId,
    instance: GeometryInstance,
    index: int,
) -> GeometryId:
    place = ("geometries", index, "roles", "proximity", "hydroelastic")
    to.note_body(instance.shape(), instance.proximity_properties(), instance.name(), *place)
    with to.located("geometries", index, "name"):
        return to.scene_graph.register_geometry(source.source_id, frame_id, instance)


def _add_deformable(
    to: Application,
    spec: DeformableSpec,
    source: LoadedSource,
    instance: GeometryInstance,
    index: int,
) -> GeometryId:
    for role in ("proximity", "illustration", "perception"):
        with to.located("geometries", index, "roles", role, "deformable"):
            find_embedded_mesh(instance, role, to.resolve)
    world = to.scene_graph.model_inspector().world_frame_id()
    try:
        return to.scene_graph.register_deformable_geometry(
            source.source_id,
            world,
            instance,
            spec.resolution_hint,
            reference_mesh=None if spec.mesh is None else _tetrahedra(to, spec.mesh, index),
        )
    except SceneGraphError as error:
        is_name = isinstance(error, NameConflictError)
        place = "name" if is_name else "deformable"
        raise to.scene.document.error(str(error), "geometries", index, place) from error


def _tetrahedra(to: Application, address: str, index: int) -> VolumeMesh:
    """Return the mesh of a file; raises SceneFileError with the place of a missing one."""
    from scene_graph_ros.geometry.meshes.volume_io import load_volume_mesh

    with to.located("geometries", index, "deformable", "mesh"):
        return load_volume_mesh(to.resolve(address))

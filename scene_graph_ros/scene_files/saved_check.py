"""Whether a scene file that is to be written loads to the world that it was made of."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import tempfile
from typing import Any, TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files.saved_values import (
    plain_value,
    SavedFiles,
    SceneSaveError,
    shape_of_now,
)
from scene_graph_ros.scene_files.scene import load_scene_text

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.ids import FrameId
    from scene_graph_ros.geometry.model.snapshot import Snapshot
    from scene_graph_ros.geometry.model.state import GeometryState

__all__ = ["check_saved"]

_PATHS = {("deformable", "embedded_mesh"), ("phong", "diffuse_map")}
"""Properties that are files: by whichever path they are named."""


def check_saved(saved: Snapshot, text: str, files: SavedFiles) -> None:
    """Raise SceneSaveError, naming the object, unless ``text`` loads to the saved scene.

    It is read in a folder of its own, with the files that are to be beside it.
    """
    with tempfile.TemporaryDirectory() as folder:
        beside = SavedFiles(Path(folder) / files.scene.name)
        beside.contents = files.contents
        beside.write()
        scene_graph = SceneGraph()
        try:
            loaded = load_scene_text(text, label=files.scene.name, base=beside.scene)
            scene = loaded.apply(scene_graph)
            context = scene_graph.create_default_context()
            scene.set_initial_poses(context)
        except (SceneFileError, SceneGraphError) as error:
            raise SceneSaveError(f"{files.scene}: a scene file can't say this: {error}") from error
        for what, before, after in _differences(saved, context.snapshot):
            if before != after:
                raise SceneSaveError(
                    f"{files.scene}: a scene file can't say this: {what} would not be the same"
                )


def _differences(saved: Snapshot, loaded: Snapshot) -> Iterator[tuple[str, Any, Any]]:
    """Yield each thing that has to be the same, as it is and as it was saved."""
    for what, of in (
        ("the sources", lambda each: list(each.state.source_names.values())),
        ("the frames", lambda each: list(map(each.inspector.get_path, each.state.frames))),
        ("the geometries", lambda each: list(map(each.inspector.get_path, each.state.geometries))),
    ):
        yield what, of(saved), of(loaded)
    a, b = saved.state, loaded.state
    for one, other in zip(list(a.frames)[1:], list(b.frames)[1:], strict=True):
        name = f"frame {saved.inspector.get_path(one)!r}"
        yield f"the parent of {name}", _parent(a, one), _parent(b, other)
        X, X_loaded = saved.pose_in_parent(one), loaded.pose_in_parent(other)
        yield f"the pose of {name}", X.tobytes(), X_loaded.tobytes()
    for record, its in zip(a.geometries.values(), b.geometries.values(), strict=True):
        now = record._replace(shape=shape_of_now(saved, record.id))
        yield from _geometry(f"geometry {saved.inspector.get_path(record.id)!r}", now, its)
    yield "the collision filters", _excluded(a), _excluded(b)
    for name, engine in a.renderers.items():
        same = b.renderers.get(name)
        text = None if same is None else same.parameter_yaml()
        yield f"the renderer {name!r}", engine.parameter_yaml(), text


def _parent(state: GeometryState, frame: FrameId) -> str:
    return state.frames[state.frames[frame].parent_id].name


def _excluded(state: GeometryState) -> Any:
    return state.filters.excluded_rows(list(state.geometries)).tolist()


def _geometry(label: str, one: Any, other: Any) -> Iterator[tuple[str, Any, Any]]:
    yield f"the pose of {label}", one.X_FG.tobytes(), other.X_FG.tobytes()
    yield f"the shape of {label}", _shape(one.shape), _shape(other.shape)
    for role in (Role.PROXIMITY, Role.ILLUSTRATION, Role.PERCEPTION):
        before, after = (_plain(each.properties.get(role), label) for each in (one, other))
        yield f"the {role.name.lower()} properties of {label}", before, after
    yield f"the reference mesh of {label}", _mesh(one.deformable), _mesh(other.deformable)


def _shape(shape: Any) -> Any:
    """Return a value that is equal where shapes are; contents of a file are the file."""
    if not isinstance(shape, MeshShape):
        return shape
    source: Any = None
    if shape.contents is not None:
        source = shape.contents
    elif shape.path is not None:
        source = Path(shape.path).read_bytes()
    else:
        source = _bytes(shape.vertices), _bytes(shape.faces)
    return type(shape), tuple(shape.scale), source, shape.file_type


def _bytes(array: Any) -> bytes | None:
    return None if array is None else np.ascontiguousarray(array).tobytes()


def _plain(properties: Any, label: str) -> Any:
    if properties is None:
        return None
    return {
        (group, name): Path(value).name
        if (group, name) in _PATHS and isinstance(value, (str, Path))
        else plain_value(value, label)
        for group in sorted(properties.get_group_names())
        for name, value in properties.get_properties_in_group(group).items()
    }


def _mesh(deformable: Any) -> Any:
    if deformable is None:
        return None
    mesh, reference = deformable.mesh, deformable.reference
    return mesh.vertices.tobytes(), mesh.tetrahedra.tobytes(), reference.q_WG.tobytes()

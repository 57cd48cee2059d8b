"""Values of a model in the words of scene files, without losing a bit; and as text."""

from __future__ import annotations

from collections.abc import Mapping
import enum
import json
import math
from pathlib import Path
import re
import tempfile
from typing import Any, TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    HeightField,
    Mesh,
    PointCloud,
    Rgba,
    Shape,
    Sphere,
    VoxelGrid,
)
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.voxel_runs import to_runs

__all__ = [
    "SavedFiles",
    "SceneSaveError",
    "as_line",
    "plain_value",
    "pose_to_spec",
    "properties_to_spec",
    "shape_of_now",
    "shape_to_spec",
    "volume_mesh_bytes",
]

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh


class SceneSaveError(SceneGraphError, ValueError):
    """A model has something that a scene file can't say."""


class SavedFiles:
    """Files beside a scene file; written when the scene is known to be one."""

    def __init__(self, scene: Path) -> None:
        """Put them into a folder beside the file, called as it is."""
        self.scene = scene
        self.folder = scene.with_name(f"{scene.stem}_files")
        self.contents: dict[str, bytes] = {}

    def add(self, stem: str, ending: str, contents: bytes) -> str:
        """Note a file, and return how the scene calls it."""
        clean = re.sub(r"[^A-Za-z0-9_-]", "_", stem)[:80]
        name = f"{clean}.{ending}"
        number = 1
        while self.contents.get(name, contents) != contents:
            number += 1
            name = f"{clean}_{number}.{ending}"
        self.contents[name] = contents
        return f"{self.folder.name}/{name}"

    def write(self) -> None:
        """Write all of them. Raises OSError."""
        if self.contents:
            self.folder.mkdir(exist_ok=True)
        for name, contents in self.contents.items():
            (self.folder / name).write_bytes(contents)


def pose_to_spec(X: np.ndarray[Any, Any]) -> dict[str, Any]:
    """Return a pose ``(4, 4)``, also the identity: without one, zeros have a sign."""
    return {"matrix": X[:3].tolist()}


def shape_of_now(snapshot: Snapshot, geometry_id: GeometryId) -> Shape:
    """Return a geometry's shape; a cloud or field as it is in a snapshot."""
    shape = snapshot.inspector.get_shape(geometry_id)
    if isinstance(shape, HeightField):
        return HeightField(snapshot.height_set(geometry_id).heights, shape.size, shape.floor)
    if isinstance(shape, VoxelGrid):
        free = shape.unknown_is_free
        now = snapshot.voxel_set(geometry_id).occupancy
        return VoxelGrid(now, shape.voxel, unknown_is_free=free)
    if not isinstance(shape, PointCloud):
        return shape
    points = snapshot.point_set(geometry_id)
    return PointCloud(points.points, points.radii)


def shape_to_spec(shape: Shape, name: str, files: SavedFiles) -> dict[str, Any]:
    """Return a shape; contents of mesh files are written beside. Raises SceneSaveError."""
    match shape:
        case Sphere():
            return {"type": "sphere", "radius": shape.radius}
        case Box():
            return {"type": "box", "size": [shape.width, shape.depth, shape.height]}
        case Capsule():
            return {"type": "capsule", "radius": shape.radius, "length": shape.length}
        case Cylinder():
            return {"type": "cylinder", "radius": shape.radius, "length": shape.length}
        case Ellipsoid():
            return {"type": "ellipsoid", "semi_axes": [shape.a, shape.b, shape.c]}
        case HalfSpace():
            return {"type": "half_space"}
        case PointCloud():
            radius = shape.radius
            known = radius.tolist() if isinstance(radius, np.ndarray) else radius
            return {"type": "point_cloud", "radius": known, "points": shape.points.tolist()}
        case HeightField():
            return {
                "type": "height_field",
                "heights": shape.heights.tolist(),
                "size": list(shape.size),
                "floor": shape.floor,
            }
        case VoxelGrid():
            return {
                "type": "voxel_grid",
                "voxel": shape.voxel,
                "unknown_is_free": shape.unknown_is_free,
                "counts": list(shape.occupancy.shape),
                "runs": to_runs(shape.occupancy).tolist(),
            }
        case Mesh() | Convex():
            return _mesh_to_spec(shape, name, files)
    raise SceneSaveError(f"geometry {name!r}: a scene file has no shape {shape.type_name}")


def _mesh_to_spec(shape: MeshShape, name: str, files: SavedFiles) -> dict[str, Any]:
    spec: dict[str, Any] = {"type": "mesh" if isinstance(shape, Mesh) else "convex"}
    if shape.path is not None:
        spec["file"] = str(shape.path)
    elif shape.contents is not None:
        spec["file"] = files.add(name, shape.file_type, shape.contents)
    else:
        assert shape.vertices is not None
        spec["vertices"] = shape.vertices.tolist()
        if shape.faces is not None:
            spec["faces"] = shape.faces.tolist()
    if tuple(shape.scale) != (1.0, 1.0, 1.0):
        spec["scale"] = list(shape.scale)
    return spec


def volume_mesh_bytes(mesh: VolumeMesh) -> bytes:
    """Return a mesh as a .vtk file, without loss."""
    from scene_graph_ros.geometry.meshes.volume_io import save_volume_mesh

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mesh.vtk"
        save_volume_mesh(file, mesh)
        return file.read_bytes()


def properties_to_spec(groups: Mapping[str, Mapping[str, Any]], label: str) -> dict[str, Any]:
    """Return properties by group and name. Raises SceneSaveError for values no file can hold."""
    return {
        group: {
            name: plain_value(value, f"{label}: the property ({group!r}, {name!r})")
            for name, value in values.items()
        }
        for group, values in groups.items()
    }


def plain_value(value: Any, label: str) -> Any:
    """Return a property as numbers, text, truth values or a list of one of them."""
    if isinstance(value, enum.Enum):
        value = value.value
    if isinstance(value, Rgba):
        return [value.r, value.g, value.b, value.a]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, (bool, str)):
        return value
    if isinstance(value, int):
        return int(value)  # also of a label, which is an int with a name
    if isinstance(value, float) and math.isfinite(value):
        return value
    if isinstance(value, (list, tuple)) and value:
        return [plain_value(each, label) for each in value]
    raise SceneSaveError(
        f"{label} is {quoted(value)}, but a scene file holds numbers, text, true or false, and"
        " lists of one of these. Remedy: remove the property, or set it on what is loaded"
    )


_UNPRINTED = re.compile(
    "[^\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)


def as_line(value: Any) -> str:
    """Return a value as JSON in one line, which is YAML, too; floats are as exact as they are."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    return _UNPRINTED.sub(lambda match: f"\\u{ord(match[0]):04x}", text)

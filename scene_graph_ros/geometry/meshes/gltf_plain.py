"""A plain glTF file: all that is left in it is read right by trimesh.

Positions are floats, primitives triangles (or points) with an index, morph targets and instances
are carried out, and the whole is turned from +Y up, as glTF has it, to +Z up: (x, y, z) becomes
(x, -z, y). An extension that is required and not known is refused by its name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.gltf_accessors import Accessors, entry
from scene_graph_ros.geometry.meshes.gltf_draco import decoded_draco, DRACO
from scene_graph_ros.geometry.meshes.gltf_file import document_of
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS, MAX_PLACES
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.sums import length
from scene_graph_ros.geometry.tolerances import QUATERNION_NORM_DEFECT

__all__ = ["plain_gltf"]

_INSTANCING = "EXT_mesh_gpu_instancing"
_KNOWN = ("KHR_mesh_quantization", "KHR_lights_punctual", DRACO, _INSTANCING)
_OF_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_")
"""What says only how a surface looks; what cameras do not know of it they leave out."""

_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6
_LINES = (1, 2, 3)

_Z_UP = [1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1]
"""By columns: the matrix of a node that turns +Y up to +Z up."""

_LAST_ROW = 1e-6
"""How far the last row of a matrix may be from (0, 0, 0, 1), which single precision rounds."""

_PACKED = 0.02
"""By how much the length of a quaternion of bytes, as instances may have it, is off."""

_NONSENSE = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


def plain_gltf(contents: bytes, file_type: str, name: str) -> bytes:
    """Return the contents of a GLB file in plain words; see above. Materials stay as they are.

    Args:
        contents: of a file that has passed ``check_promises``.
        file_type: "gltf" or "glb".
        name: the mesh's name in messages.

    Raises:
        MeshError: the document or its data are not as the standard says, or a required extension,
            or a skin, is not known.

    """
    try:
        tree = document_of(contents, file_type)
        _refuse_unknown(tree, name)
        return _Plain(tree, Accessors(tree, contents, file_type, name), name).file()
    except MeshError:
        raise
    except _NONSENSE as error:
        raise MeshError(f"{name}: unreadable gltf: {quoted(error)}") from error


def _refuse_unknown(tree: dict[str, Any], name: str) -> None:
    for extension in tree.get("extensionsRequired", ()):
        if extension not in _KNOWN and not str(extension).startswith(_OF_LOOKS):
            raise MeshError(
                f"{name}: it requires the extension {quoted(extension)}, which is not read: export"
                " it without"
            )
    version = str(tree.get("asset", {}).get("version", ""))
    if not version.startswith("2."):
        raise MeshError(f"{name}: it is glTF {quoted(version)}, not 2.x")


class _Plain:
    """A document that is being written, with one buffer."""

    def __init__(self, tree: dict[str, Any], accessors: Accessors, name: str) -> None:
        self._tree, self._read, self._name = tree, accessors, name
        self._parts: list[bytes] = []
        self._size = 0
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._mesh_of: dict[tuple[int, tuple[float, ...]], int | None] = {}
        self._corners = 0

    def file(self) -> bytes:
        """Return the bytes of the GLB file."""
        nodes = [self._node(node) for node in self._tree.get("nodes", ())]
        for node in list(nodes):
            self._place_instances(node, nodes)
        roots = self._roots(nodes)
        nodes.append({"matrix": _Z_UP, "children": roots})
        kept = ("asset", "materials")
        tree = {key: self._tree[key] for key in kept if key in self._tree}
        tree |= {
            "scene": 0,
            "scenes": [{"nodes": [len(nodes) - 1]}],
            "nodes": nodes,
            "meshes": self._meshes,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._size}],
        }
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        body = b"".join(self._parts)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def _roots(self, nodes: list[dict[str, Any]]) -> list[int]:
        """Return the nodes of the scene that is shown; without one, all that are roots."""
        scenes = self._tree.get("scenes") or []
        if scenes:
            shown = entry(self._tree, "scenes", self._tree.get("scene", 0)).get("nodes", ())
            for index in shown:
                entry(self._tree, "nodes", index)
            return list(shown)
        children = {child for node in nodes for child in node.get("children", ())}
        roots = [i for i in range(len(nodes)) if i not in children]
        if not nodes:
            for mesh in range(len(self._tree.get("meshes", ()))):
                place = self._mesh(mesh, ())
                if place is not None:
                    roots.append(len(nodes))
                    nodes.append({"mesh": place})
        return roots

    def _node(self, node: dict[str, Any]) -> dict[str, Any]:
        kept = ("children", "matrix", "translation", "rotation", "scale", "name")
        result = {key: node[key] for key in kept if key in node}
        _check_pose(result, QUATERNION_NORM_DEFECT)
        if "mesh" not in node:
            return result
        if "skin" in node:
            raise MeshError(
                f"{self._name}: a mesh is bent by a skin, which is not read: export it in its pose"
            )
        place = self._mesh(node["mesh"], tuple(node.get("weights", ())))
        if place is not None:
            result["mesh"] = place
        instances = node.get("extensions", {}).get(_INSTANCING)
        if instances is not None:
            result["instances"] = instances["attributes"]
        return result

    def _place_instances(self, node: dict[str, Any], nodes: list[dict[str, Any]]) -> None:
        """Put a node for each instance below one that places its mesh many times."""
        attributes = node.pop("instances", None)
        if attributes is None:
            return
        mesh, children = node.pop("mesh", None), list(node.get("children", ()))
        columns = {
            key.lower(): self._read.numbers(attributes[key])
            for key in ("TRANSLATION", "ROTATION", "SCALE")
            if key in attributes
        }
        counts = {len(values) for values in columns.values()}
        if len(counts) != 1:
            raise MeshError(f"{self._name}: instances have {sorted(counts)} poses")
        if len(nodes) + max(counts) > MAX_PLACES:
            raise MeshError(f"{self._name}: it places meshes more than {MAX_PLACES} times")
        for i in range(max(counts) if mesh is not None else 0):
            children.append(len(nodes))
            pose = {key: values[i].tolist() for key, values in columns.items()}
            _check_pose(pose, _PACKED)
            nodes.append({"mesh": mesh, **pose})
        node["children"] = children

    def _mesh(self, index: int, weights: tuple[float, ...]) -> int | None:
        """Return the index of a mesh with weights of morph targets; None for one of lines."""
        mesh = entry(self._tree, "meshes", index)
        weights = weights or tuple(mesh.get("weights", ()))
        key = (index, weights)
        if key not in self._mesh_of:
            where = f"{self._name}: mesh {index}"
            found = [self._primitive(p, weights, where) for p in mesh["primitives"]]
            primitives = [primitive for primitive in found if primitive is not None]
            self._mesh_of[key] = len(self._meshes) if primitives else None
            if primitives:
                self._meshes.append({"primitives": primitives})
        return self._mesh_of[key]

    def _primitive(
        self, primitive: dict[str, Any], weights: Sequence[float], where: str
    ) -> dict[str, Any] | None:
        mode, attributes = primitive.get("mode", _TRIANGLES), primitive.get("attributes", {})
        if mode in _LINES or "POSITION" not in attributes:
            return None
        if mode not in (_POINTS, _TRIANGLES, _STRIP, _FAN):
            raise MeshError(f"{where}: there is no mode {quoted(mode)} of primitives")
        packed = primitive.get("extensions", {}).get(DRACO)
        others: dict[str, NDArray[Any]] = {}
        if packed is not None:
            data = self._read.buffer_view(packed["bufferView"])
            points, corners = decoded_draco(data, where)
        else:
            points = self._read.numbers(attributes["POSITION"])
            corners = np.arange(len(points))
            if "indices" in primitive:
                corners = self._read.indices(primitive["indices"])
            others = dict(self._looks(attributes, len(points)))
        points = points + self._morphed(primitive.get("targets", ()), weights, points, where)
        self._check(points, corners, where)
        result: dict[str, Any] = {key: primitive[key] for key in ("material",) if key in primitive}
        # What is not finite is refused where all meshes are checked.
        with np.errstate(over="ignore"):
            positions = points.astype("<f4")
        result["attributes"] = {"POSITION": self._write(positions, "VEC3")}
        for key, values in others.items():
            kind = f"VEC{values.shape[1]}"
            result["attributes"][key] = self._write(values, kind, ints=values.dtype.kind == "u")
        if mode == _POINTS:
            return {**result, "mode": _POINTS}
        triangles = _triangles_of(mode, corners, where)
        result["indices"] = self._write(triangles.astype("<u4").reshape(-1, 1), "SCALAR")
        return {**result, "mode": _TRIANGLES}

    def _looks(self, attributes: dict[str, Any], count: int) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield texture coordinates as numbers, colours as they are written."""
        for key, index in attributes.items():
            if key.startswith("TEXCOORD_"):
                values: NDArray[Any] = self._read.numbers(index).astype("<f4")
            elif key == "COLOR_0":
                values = self._read.raw(index)
            else:
                continue
            if len(values) == count and values.shape[1] > 1:
                yield key, values

    def _morphed(
        self, targets: Any, weights: Sequence[float], points: NDArray[np.float64], where: str
    ) -> NDArray[np.float64]:
        """Return the points' displacements by morph targets."""
        offset = np.zeros_like(points)
        for target, weight in zip(targets, weights, strict=False):
            if weight and "POSITION" in target:
                moved = self._read.numbers(target["POSITION"])
                if moved.shape != points.shape:
                    raise MeshError(f"{where}: a morph target has {len(moved)} points")
                offset += float(weight) * moved
        return offset

    def _check(self, points: NDArray[np.float64], corners: NDArray[np.int64], where: str) -> None:
        if points.shape[1] != 3:
            raise MeshError(f"{where}: positions must have three numbers, not {points.shape[1]}")
        if len(corners) and int(corners.max()) >= len(points):
            raise MeshError(f"{where}: there is no vertex {int(corners.max())}")
        self._corners += len(points) + 3 * len(corners)
        if self._corners > 4 * MAX_CORNERS:
            raise MeshError(f"{self._name}: more than {MAX_CORNERS} vertices or triangles")

    def _write(self, values: NDArray[Any], kind: str, *, ints: bool = False) -> int:
        """Append numbers to the buffer; return their accessor."""
        data = np.ascontiguousarray(values).tobytes()
        data += b"\0" * (-len(data) % 4)
        component = {"<f4": 5126, "<u4": 5125, "|u1": 5121, "<u2": 5123}[values.dtype.str]
        self._views.append({"buffer": 0, "byteOffset": self._size, "byteLength": len(data)})
        width = values.shape[1] * values.dtype.itemsize
        if width % 4:
            self._views[-1]["byteStride"] = width
        self._size += len(data)
        self._parts.append(data)
        accessor = {
            "bufferView": len(self._views) - 1,
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        self._accessors.append({**accessor, "normalized": True} if ints else accessor)
        return len(self._accessors) - 1


def _check_pose(node: dict[str, Any], defect: float) -> None:
    """Raise ValueError for a node whose pose is not as the standard says.

    ``defect`` is by how much the length of its quaternion may be off.
    """
    parts = {"translation": 3, "rotation": 4, "scale": 3, "matrix": 16}
    numbers = {key: np.asarray(node[key], np.float64) for key in parts if key in node}
    for key, values in numbers.items():
        if values.shape != (parts[key],) or not np.isfinite(values).all():
            raise ValueError(f"a node has the {key} {node[key]!r}")
    if "rotation" in numbers and not abs(length(numbers["rotation"]) - 1.0) <= defect:
        raise ValueError(f"a node has the rotation {node['rotation']!r}, which is not of length 1")
    if "matrix" in numbers:
        last = numbers["matrix"][3::4]
        if not (np.abs(last - (0.0, 0.0, 0.0, 1.0)) <= _LAST_ROW).all():
            raise ValueError(f"the last row of a node's matrix is {last.tolist()}")
        if len(numbers) > 1:
            raise ValueError("a node has a matrix and another pose")


def _triangles_of(mode: int, corners: NDArray[np.int64], where: str) -> NDArray[np.int64]:
    """Return (m, 3) triangles of a list, a strip or a fan, in the standard's order."""
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise MeshError(f"{where}: {len(corners)} corners are no triangles")
        return corners.reshape(-1, 3)
    count = max(len(corners) - 2, 0)
    i = np.arange(count)
    if mode == _STRIP:
        rows = np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)
    else:
        rows = np.stack([i + 1, i + 2, np.zeros_like(i)], axis=1)
    return corners[rows]

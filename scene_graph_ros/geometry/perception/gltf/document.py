"""A camera's view as a glTF 2.0 document: bodies with materials, and the camera as a node.

The world's z axis is up; a root node turns it to glTF's, which is y. Binary data and pictures are
in the document, as data addresses.
"""

from __future__ import annotations

import base64
import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.perception.camera import RenderCameraCore
from scene_graph_ros.geometry.perception.exact.bodies import Bodies
from scene_graph_ros.geometry.perception.exact.cover import Cover
from scene_graph_ros.geometry.perception.picture_bodies import with_one_picture_each
from scene_graph_ros.geometry.perception.srgb import linear
from scene_graph_ros.geometry.perception.surfaces import Patch, patch_of_shape
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["gltf_document"]

_FLOAT, _WHOLE = 5126, 5125
"""glTF's numbers for float32 and uint32."""
_FAR = 4.0
"""Of the farthest depth: how far a half space reaches around the camera."""
_UP = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
"""The matrix, column by column, that turns z to y."""

FloatArray = NDArray[np.float64]


def gltf_document(
    bodies: Bodies, cover: Cover, core: RenderCameraCore, X_WS: FloatArray, *, by_label: bool
) -> bytes:
    """Return the document. ``by_label``: materials are labels, unlit, instead of colours.

    A label's red and green are its lower and its upper byte, and node extras have it as a number.
    """
    bodies, cover = with_one_picture_each(bodies, cover)
    writer = _Writer()
    nodes = [_camera_node(X_WS)]
    for row in range(len(bodies.kind)):
        if by_label or cover.alpha[row] > 0.0:
            patch, paint = _surface(bodies, cover, row, X_WS, core.clipping.far)
            if by_label:
                paint, material = None, _label_material(int(bodies.label[row]))
            else:
                material = writer.color_material(bodies, cover, row, paint is not None)
            mesh = writer.mesh(
                patch, paint, material, has_uv=not by_label and patch.uv is not None
            )
            nodes.append(
                {
                    "mesh": mesh,
                    "matrix": bodies.X_WG[row].T.ravel().tolist(),
                    "name": f"body {row}",
                    "extras": {"label": int(bodies.label[row])},
                }
            )
    return writer.document(nodes, _camera(core), by_label=by_label)


def _camera_node(X_WS: FloatArray) -> dict[str, Any]:
    """Return the camera's node: glTF's looks along -z, and y is up."""
    X_WC = X_WS @ np.diag([1.0, -1.0, -1.0, 1.0])
    return {"camera": 0, "matrix": X_WC.T.ravel().tolist(), "name": "camera"}


def _camera(core: RenderCameraCore) -> dict[str, Any]:
    lens = core.intrinsics
    return {
        "type": "perspective",
        "perspective": {
            "aspectRatio": lens.width * lens.fy / (lens.height * lens.fx),
            "yfov": float(2.0 * np.arctan(0.5 * lens.height / lens.fy)),
            "znear": core.clipping.near,
            "zfar": core.clipping.far,
        },
    }


def _surface(
    bodies: Bodies, cover: Cover, row: int, X_WS: FloatArray, far: float
) -> tuple[Patch, FloatArray | None]:
    """Return a body's triangles in G, and linear colours of corners where its file has some."""
    if bodies.kind[row] <= ShapeKind.HALF_SPACE:
        R_WG, p_WG = bodies.X_WG[row, :3, :3], bodies.X_WG[row, :3, 3]
        foot = R_WG.T @ (X_WS[:3, 3] - p_WG)
        patch = patch_of_shape(int(bodies.kind[row]), bodies.size[row], _FAR * far, foot)
        return (patch if cover.picture[row] >= 0 else patch._replace(uv=None)), None
    mesh = bodies.mesh[row]
    first, last = bodies.triangle_start[mesh], bodies.triangle_start[mesh + 1]
    start, stop = bodies.vertex_start[mesh], bodies.vertex_start[mesh + 1]
    triangles, vertices = bodies.triangles[first:last], bodies.vertices[start:stop]
    own_corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    if bodies.is_painted[row]:
        palette = np.concatenate([bodies.palette, bodies.diffuse[row : row + 1]])
        paint = linear(palette[np.repeat(bodies.paint[first:last], 3)])
        return Patch(vertices[triangles].reshape(-1, 3), own_corners, None, None), paint
    if cover.picture[row] >= 0:
        at = cover.first[row]
        uv = cover.corners[at : at + len(triangles)].reshape(-1, 2)
        return Patch(vertices[triangles].reshape(-1, 3), own_corners, None, uv), None
    return Patch(vertices, triangles.astype(np.int64), None, None), None


def _label_material(label: int) -> dict[str, Any]:
    color = [(label & 0xFF) / 255.0, (label >> 8) / 255.0, 0.0]
    return {
        "pbrMetallicRoughness": {"baseColorFactor": [*linear(color).tolist(), 1.0]},
        "extensions": {"KHR_materials_unlit": {}},
        "doubleSided": True,
    }


class _Writer:
    """The parts of a document that refer to each other by number."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._materials: list[dict[str, Any]] = []
        self._images: list[dict[str, Any]] = []
        self._textures: dict[int, int] = {}

    def _array(self, values: NDArray[Any], kind: str) -> int:
        """Keep an array; return its accessor's number."""
        is_float = values.dtype == np.float32
        self._views.append(
            {"buffer": 0, "byteOffset": len(self._data), "byteLength": values.nbytes}
        )
        self._data += values.tobytes()
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _FLOAT if is_float else _WHOLE,
            "count": len(values),
            "type": kind,
        }
        if kind == "VEC3" and len(values):
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def mesh(
        self, patch: Patch, paint: FloatArray | None, material: dict[str, Any], *, has_uv: bool
    ) -> int:
        """Keep triangles with a material; return the mesh's number."""
        attributes = {"POSITION": self._array(patch.vertices.astype(np.float32), "VEC3")}
        if patch.normals is not None:
            attributes["NORMAL"] = self._array(patch.normals.astype(np.float32), "VEC3")
        if paint is not None:
            attributes["COLOR_0"] = self._array(paint.astype(np.float32), "VEC3")
        if has_uv:
            assert patch.uv is not None  # so the caller says
            # glTF counts rows of pictures from above.
            uv = np.column_stack([patch.uv[:, 0], 1.0 - patch.uv[:, 1]])
            attributes["TEXCOORD_0"] = self._array(uv.astype(np.float32), "VEC2")
        indices = self._array(patch.triangles.astype(np.uint32).ravel(), "SCALAR")
        self._materials.append(material)
        primitive = {
            "attributes": attributes,
            "indices": indices,
            "material": len(self._materials) - 1,
        }
        self._meshes.append({"primitives": [primitive]})
        return len(self._meshes) - 1

    def color_material(
        self, bodies: Bodies, cover: Cover, row: int, is_painted: bool
    ) -> dict[str, Any]:
        """Return a matt material of a body's colour and picture."""
        color = [1.0, 1.0, 1.0] if is_painted else linear(bodies.diffuse[row]).tolist()
        matt: dict[str, Any] = {
            "baseColorFactor": [*color, float(cover.alpha[row])],
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0,
        }
        if cover.picture[row] >= 0:
            texture = self._texture(cover, int(cover.picture[row]))
            repeats = cover.repeats[row]
            # v is turned round: 1 - k v is 1 - k + k (1 - v).
            transform = {"scale": repeats.tolist(), "offset": [0.0, float(1.0 - repeats[1])]}
            matt["baseColorTexture"] = {
                "index": texture,
                "extensions": {"KHR_texture_transform": transform},
            }
        mode = "BLEND" if cover.is_transparent[row] else "OPAQUE"
        return {"pbrMetallicRoughness": matt, "alphaMode": mode, "doubleSided": True}

    def _texture(self, cover: Cover, picture: int) -> int:
        """Keep a picture as PNG, each once; return its texture's number."""
        if picture not in self._textures:
            from PIL import Image  # it has read the picture

            width, height = cover.size[picture]
            start = cover.start[picture]
            texels = cover.texels[start : start + width * height].reshape(height, width, 4)
            file = io.BytesIO()
            Image.fromarray(np.ascontiguousarray(texels)).save(file, "PNG")
            self._images.append({"uri": _address("image/png", file.getvalue())})
            self._textures[picture] = len(self._images) - 1
        return self._textures[picture]

    def document(
        self, nodes: list[dict[str, Any]], camera: dict[str, Any], *, by_label: bool
    ) -> bytes:
        """Return the whole document, a root node above ``nodes``."""
        count = len(nodes)
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "scene_graph_ros"},
            "scene": 0,
            "scenes": [{"nodes": [count]}],
            "nodes": [*nodes, {"children": list(range(count)), "matrix": _UP, "name": "world"}],
            "cameras": [camera],
        }
        if self._meshes:
            tree |= {
                "meshes": self._meshes,
                "materials": self._materials,
                "accessors": self._accessors,
                "bufferViews": self._views,
                "buffers": [
                    {
                        "byteLength": len(self._data),
                        "uri": _address("application/octet-stream", bytes(self._data)),
                    }
                ],
            }
        if self._images:
            tree["images"] = self._images
            tree["textures"] = [{"source": k} for k in range(len(self._images))]
            tree["extensionsUsed"] = ["KHR_texture_transform"]
        if by_label and self._meshes:
            tree["extensionsUsed"] = ["KHR_materials_unlit"]
        return json.dumps(tree).encode()


def _address(kind: str, data: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"

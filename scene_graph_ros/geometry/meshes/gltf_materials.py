"""Materials of glTF without their images, which nobody looks at: as trimesh is to see them."""

from __future__ import annotations

import json
import struct
from typing import Any

__all__ = ["without_images"]

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")


def without_images(contents: bytes, file_type: str) -> bytes:
    """Return a glTF or GLB file's contents without textures and images.

    A material keeps its base colour, white where it says none, as glTF has it; one whose colour is
    a texture has none. The file has passed ``check_promises``.
    """
    if file_type == "gltf":
        return json.dumps(_plain(json.loads(contents))).encode()
    magic, version, _ = _HEADER.unpack_from(contents)
    length, kind = _CHUNK.unpack_from(contents, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    text = json.dumps(_plain(json.loads(contents[start : start + length]))).encode()
    text += b" " * (-len(text) % 4)
    chunks = _CHUNK.pack(len(text), kind) + text + contents[start + length :]
    return _HEADER.pack(magic, version, _HEADER.size + len(chunks)) + chunks


def _plain(tree: Any) -> Any:
    if not isinstance(tree, dict):
        return tree
    materials = tree.get("materials", [])
    kept = {key: value for key, value in tree.items() if key not in ("images", "textures")}
    if isinstance(materials, list):
        kept["materials"] = [_plain_material(material) for material in materials]
    return kept


def _plain_material(material: Any) -> dict[str, Any]:
    told = material if isinstance(material, dict) else {}
    color = told.get("pbrMetallicRoughness", {})
    if not isinstance(color, dict) or "baseColorTexture" in color:
        return {}
    return {"pbrMetallicRoughness": {"baseColorFactor": color.get("baseColorFactor", [1.0] * 4)}}

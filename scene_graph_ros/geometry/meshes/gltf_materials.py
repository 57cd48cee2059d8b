"""Materials of glTF: without their images, as trimesh is to see them, and their pictures."""

from __future__ import annotations

import math
from typing import Any

from scene_graph_ros.geometry.meshes.file_pictures import AS_IT_IS, FilePicture, Placement
from scene_graph_ros.geometry.meshes.gltf_file import (
    binary_part,
    data_of,
    document_of,
    with_document,
)
from scene_graph_ros.geometry.spatial.elementary import sine_cosine

__all__ = ["gltf_pictures", "without_images"]

_TRANSFORM = "KHR_texture_transform"


def without_images(contents: bytes, file_type: str) -> bytes:
    """Return a glTF or GLB file's contents without textures and images.

    A material keeps its base colour, white where it says none, as glTF has it. One with a picture
    is named by its number, as ``gltf_pictures`` numbers them, and its triangles keep the texture
    coordinates that it names. The file has passed ``check_promises``.
    """
    return with_document(contents, file_type, _plain(document_of(contents, file_type)))


def _plain(tree: Any) -> Any:
    if not isinstance(tree, dict):
        return tree
    materials = tree.get("materials", [])
    kept = {key: value for key, value in tree.items() if key not in ("images", "textures")}
    if isinstance(materials, list):
        kept["materials"] = [_plain_material(k, material) for k, material in enumerate(materials)]
        kept["meshes"] = [_with_coordinates(mesh, materials) for mesh in tree.get("meshes", ())]
    return kept


def _plain_material(number: int, material: Any) -> dict[str, Any]:
    color = _color_of(material)
    result: dict[str, Any] = {
        "pbrMetallicRoughness": {"baseColorFactor": color.get("baseColorFactor", [1.0] * 4)}
    }
    if "baseColorTexture" in color:
        result["name"] = str(number)
    return result


def _color_of(material: Any) -> dict[str, Any]:
    told = material if isinstance(material, dict) else {}
    color = told.get("pbrMetallicRoughness", {})
    return color if isinstance(color, dict) else {}


def _with_coordinates(mesh: Any, materials: list[Any]) -> Any:
    """Return a mesh whose first texture coordinates are those that its materials name."""
    primitives = []
    for primitive in mesh["primitives"]:
        number, attributes = primitive.get("material"), primitive.get("attributes", {})
        told = materials[number] if isinstance(number, int) and number < len(materials) else {}
        which = _coordinates_of(_color_of(told).get("baseColorTexture"))
        if which != "TEXCOORD_0":
            attributes = {key: value for key, value in attributes.items() if key != "TEXCOORD_0"}
            if which in attributes:
                attributes["TEXCOORD_0"] = attributes[which]
        primitives.append({**primitive, "attributes": attributes})
    return {**mesh, "primitives": primitives}


def _coordinates_of(texture: Any) -> str:
    told = texture if isinstance(texture, dict) else {}
    transform = _transform_of(told)
    return f"TEXCOORD_{transform.get('texCoord', told.get('texCoord', 0))}"


def _transform_of(texture: dict[str, Any]) -> dict[str, Any]:
    extensions = texture.get("extensions")
    found = extensions.get(_TRANSFORM) if isinstance(extensions, dict) else None
    return found if isinstance(found, dict) else {}


def gltf_pictures(contents: bytes, file_type: str) -> dict[str, FilePicture]:
    """Return the pictures of the base colours of materials by the materials' numbers.

    Raises AttributeError, LookupError, TypeError or ValueError for references that lead nowhere
    and for placements that are no numbers.
    """
    tree, inside = document_of(contents, file_type), binary_part(contents, file_type)
    found = {}
    for number, material in enumerate(tree.get("materials", ())):
        texture = _color_of(material).get("baseColorTexture")
        if texture is not None:
            source = tree["textures"][texture["index"]]["source"]
            address, data = _image(tree, source, inside)
            found[str(number)] = FilePicture(address, data, _placement(_transform_of(texture)))
    return found


def _image(tree: Any, number: int, inside: bytes) -> tuple[str, bytes | None]:
    """Return an image's address, and its data where that is in the document."""
    image, name = tree["images"][number], f"image {number}"
    if "bufferView" not in image:
        data = data_of(image["uri"])
        return (image["uri"], None) if data is None else (name, data)
    view = tree["bufferViews"][image["bufferView"]]
    buffer = tree["buffers"][view["buffer"]]
    whole = data_of(buffer["uri"]) if "uri" in buffer else inside
    assert whole is not None  # as buffers beside a file are in its document by now
    start = int(view.get("byteOffset", 0))
    return name, whole[start : start + int(view["byteLength"])]


def _placement(transform: dict[str, Any]) -> Placement:
    """Return the placement of a picture by KHR_texture_transform.

    glTF counts v from above, w = 1 - v: there, scaled coordinates are turned counter-clockwise as
    one sees it, by [[c, s], [-s, c]], and moved. Written in v, upwards, that is the matrix below.
    """
    if not transform:
        return AS_IT_IS
    x, y = (float(number) for number in transform.get("offset", (0.0, 0.0)))
    along, down = (float(number) for number in transform.get("scale", (1.0, 1.0)))
    angle = float(transform.get("rotation", 0.0))
    s, c = sine_cosine(angle)
    if not all(math.isfinite(number) for number in (x, y, along, down, angle)):
        raise ValueError(f"{_TRANSFORM} has numbers that are not finite")
    # u' = c a u + s d w + x, w' = -s a u + c d w + y, with w = 1 - v and v' = 1 - w'.
    return (c * along, -s * down, s * down + x), (s * along, c * down, 1.0 - c * down - y)

"""Colours and pictures of the triangles of COLLADA files: of materials, else of the corners."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.dae_document import Document, floats_of
from scene_graph_ros.geometry.meshes.dae_geometry import Body, Input

__all__ = ["Material", "colors_of", "coordinates_of", "material_of"]

FloatArray = NDArray[np.float64]

_SHADERS = ("blinn", "constant", "lambert", "phong")
_WHITE = (1.0, 1.0, 1.0)


class Material(NamedTuple):
    """The look of a body, as far as it is read."""

    color: tuple[float, ...]
    """Red, green and blue, 0 to 1; white with a picture."""
    address: str | None = None
    """The picture's file as the mesh's file writes it."""
    number: str | None = None
    """Which of a body's texture coordinates are the picture's; None: the first."""


def material_of(document: Document, instance: Any, symbol: str | None) -> Material | None:
    """Return the material that an instance of a geometry binds to a symbol, None for none.

    Raises AttributeError, LookupError or ValueError for references that lead nowhere.
    """
    bound = [
        one
        for one in instance.findall("bind_material/technique_common/instance_material")
        if symbol is not None and one.get("symbol") == symbol
    ]
    if not bound:
        return None
    material = document.target(bound[0].get("target"), "material")
    effect = document.target(material.find("instance_effect").get("url"), "effect")
    shaders = [one for kind in _SHADERS for one in effect.iter(kind)]
    diffuse = shaders[0].find("diffuse") if shaders else None
    if diffuse is None:
        return Material(_WHITE)
    params = {one.get("sid"): one for one in effect.iter("newparam")}
    texture = diffuse.find("texture")
    if texture is not None:
        address = _address(document, params, texture.get("texture"))
        return Material(_WHITE, address, _number(bound[0], texture.get("texcoord")))
    told = diffuse.find("color")
    if told is None:
        told = params[diffuse.find("param").get("ref")][0]
    return Material(_color(told))


def _color(element: Any) -> tuple[float, ...]:
    color = floats_of(element)[:3]
    if len(color) < 3 or not np.isfinite(color).all():
        raise ValueError(f"{element.text!r} is no colour")
    return tuple(np.clip(color, 0.0, 1.0).tolist())


def _address(document: Document, params: dict[str | None, Any], key: str | None) -> str:
    """Return the address of a picture that is named by a sampler, or by the image's own id."""
    sampler = params[key].find("sampler2D") if key in params else None
    if sampler is not None:
        image = sampler.find("instance_image")
        if image is not None:
            key = image.get("url").removeprefix("#")
        else:
            key = params[sampler.find("source").text].find("surface/init_from").text
    init = document.target(f"#{key}", "image").find("init_from")
    nested = init.find("ref")
    return str((init if nested is None else nested).text)


def _number(bound: Any, symbol: str | None) -> str | None:
    """Return the number of the texture coordinates that a symbol is bound to, if it is."""
    for one in bound.findall("bind_vertex_input"):
        if one.get("semantic") == symbol and one.get("input_semantic") == "TEXCOORD":
            return str(one.get("input_set", "0"))
    return None


def colors_of(body: Body) -> FloatArray:
    """Return colours (m, 3), 0 to 1, of triangles by the mean of their corners'; NaN for none."""
    told = next((one for one in body.inputs if one.semantic == "COLOR"), None)
    if told is None:
        return np.full((len(body.cut), 3), np.nan)
    return np.clip(_at_corners(body, told, "RGB").mean(axis=1), 0.0, 1.0)


def coordinates_of(body: Body, number: str | None) -> FloatArray:
    """Return texture coordinates (m, 3, 2) of the corners of triangles, NaN for none.

    ``number`` is that of the inputs which is meant, None for the first.
    """
    inputs = [one for one in body.inputs if one.semantic == "TEXCOORD"]
    if not inputs:
        return np.full((len(body.cut), 3, 2), np.nan)
    chosen = next((one for one in inputs if one.number == number), inputs[0])
    return _at_corners(body, chosen, "ST")


def _at_corners(body: Body, told: Input, names: str) -> FloatArray:
    """Return the numbers (m, 3, k) of an input at the corners of triangles."""
    values, index = body.document.source(told.source, names), body.rows[body.cut, told.offset]
    if index.min(initial=0) < 0:
        raise IndexError(f"{told.semantic} refers to row {index.min()}")
    return values[index]

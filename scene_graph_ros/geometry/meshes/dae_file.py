"""Read COLLADA files: the bodies of the scene that is shown, each where its nodes place it.

Numbers keep all their digits. What the scene shows is read whole or refused by its name: a mesh
that is bent by a skin or a morph, what is in another file, what is no mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import math
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.color_warnings import warn_of_color
from scene_graph_ros.geometry.meshes.dae_document import Document, floats_of
from scene_graph_ros.geometry.meshes.dae_geometry import bodies_of, Body
from scene_graph_ros.geometry.meshes.dae_materials import (
    colors_of,
    coordinates_of,
    Material,
    material_of,
)
from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.file_pictures import FilePicture, FilePictures
from scene_graph_ros.geometry.meshes.promises import MAX_CORNERS
from scene_graph_ros.geometry.meshes.solids.mesh_report import merged, Repair
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.geometry.spatial.sums import determinant, length, moved, product

__all__ = ["DaeMesh", "dae_coordinates", "parse_dae"]

FloatArray = NDArray[np.float64]

_NONSENSE = (
    ArithmeticError,
    AttributeError,
    ElementTree.ParseError,
    LookupError,
    TypeError,
    ValueError,
)

_LAST_ROW = 1e-6
"""How far the last row of a matrix may be from (0, 0, 0, 1), in a file of few digits."""

_TRANSFORMS = {"matrix": 16, "rotate": 4, "scale": 3, "translate": 3}
"""How many numbers each has."""


class DaeMesh(NamedTuple):
    """All bodies, one behind another."""

    vertices: FloatArray
    """(n, 3) metres."""
    triangles: NDArray[np.int64]
    """(m, 3)."""
    colors: FloatArray | None
    """(m, 3), 0 to 1, NaN for triangles without; None where there are none."""
    pictures: FilePictures | None


class _Placed(NamedTuple):
    """A body where a node places it."""

    body: Body
    """Its triangles run counter-clockwise seen from outside also where the node mirrors it."""
    X: FloatArray
    """(4, 4): its pose, with any scale."""
    instance: Any
    """The element that places it, and binds its materials."""


def parse_dae(contents: bytes, name: str, repairs: list[Repair]) -> DaeMesh:
    """Return the mesh of a file that has passed ``check_promises``; the unit is applied.

    ``repairs`` gets the repairs. Warns with MeshColorWarning of looks that make no sense.

    Raises:
        MeshError: the file is no COLLADA file, or shows what can't be read.

    """
    document, metres, placed = _read(contents, name, repairs)
    vertices, triangles, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    # What is not finite is refused where all meshes are checked.
    with np.errstate(all="ignore"):
        for body, X, _ in placed:
            corners = body.rows[body.cut, body.offset]
            used, corners = used_indices(corners, len(body.points))
            vertices.append(moved(body.points[used], X) * metres)
            triangles.append(corners + count)
            count += len(used)
    try:
        colors, pictures = _looks(document, placed)
    except _NONSENSE as error:
        warn_of_color(f"{name}: shown without its colours, which are unreadable: {quoted(error)}")
        colors, pictures = None, None
    return DaeMesh(np.concatenate(vertices), np.concatenate(triangles), colors, pictures)


def dae_coordinates(contents: bytes, name: str) -> FloatArray:
    """Return (m, 3, 2) texture coordinates of the corners of ``parse_dae``'s triangles, or NaN.

    Raises MeshError as ``parse_dae``, and for coordinates that are not there.
    """
    document, _, placed = _read(contents, name, [])
    found = [np.zeros((0, 3, 2))]
    try:
        for body, _, instance in placed:
            material = material_of(document, instance, body.material)
            number = None if material is None else material.number
            found.append(coordinates_of(body, number))
    except _NONSENSE as error:
        raise MeshError(f"{name}: unreadable texture coordinates: {quoted(error)}") from error
    return np.concatenate(found)


def _read(
    contents: bytes, name: str, repairs: list[Repair]
) -> tuple[Document, float, list[_Placed]]:
    """Return the document, the unit in metres, and all bodies where they are placed."""
    try:
        document = Document(contents)
        return document, _metres(document), _placed_bodies(document, name, repairs)
    except MeshError:
        raise
    except _NONSENSE as error:
        raise MeshError(f"{name}: unreadable dae: {quoted(error)}") from error


def _metres(document: Document) -> float:
    unit = document.root.find("asset/unit")
    result = 1.0 if unit is None else float(unit.get("meter", 1.0))
    if not 0.0 < result < math.inf:
        raise ValueError(f"its unit is {result} m")
    return result


def _placed_bodies(document: Document, name: str, repairs: list[Repair]) -> list[_Placed]:
    """Return all bodies of the scene; counted before they are copied."""
    shown = document.root.find("scene/instance_visual_scene")
    if shown is None:
        raise ValueError("it shows no scene")
    scene = document.target(shown.get("url"), "visual_scene")
    bodies: dict[str | None, tuple[list[Body], list[Repair]]] = {}
    poses: dict[Any, FloatArray] = {}
    placed: list[_Placed] = []
    count, told = 0, list[Repair]()
    for instance, chain in _instances(scene, (), document, name):
        address = instance.get("url")
        if address not in bodies:
            geometry, own = document.target(address, "geometry"), list[Repair]()
            bodies[address] = bodies_of(geometry, document, name, own), own
        X = np.eye(4)
        for node in chain:
            if node not in poses:
                poses[node] = _pose(node)
            X = product(X, poses[node])
        found, own = bodies[address]
        for body in found:
            count += max(len(body.points), len(body.cut))
            if count > MAX_CORNERS:
                raise MeshError(f"{name}: more than {MAX_CORNERS} vertices or triangles")
            if determinant(X[:3, :3]) < 0.0:
                body = body._replace(cut=body.cut[:, ::-1])
            placed.append(_Placed(body, X, instance))
        told += [_moved_repair(repair, X, _metres(document)) for repair in own]
    repairs += merged(told)
    return placed


def _moved_repair(repair: Repair, X: FloatArray, metres: float) -> Repair:
    x, y, z = (moved(np.array([repair.point]), X)[0] * metres).tolist()
    return replace(repair, point=(x, y, z))


def _instances(
    parent: Any, chain: tuple[Any, ...], document: Document, name: str
) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """Yield the instances of geometries below a node, and the nodes that each is in."""
    for child in parent:
        if child.tag == "node":
            yield from _instances(child, (*chain, child), document, name)
        elif child.tag == "instance_node":
            node = document.target(child.get("url"), "node")
            yield from _instances(node, (*chain, node), document, name)
        elif child.tag == "instance_geometry":
            yield child, chain
        elif child.tag == "instance_controller":
            raise MeshError(
                f"{name}: a mesh is bent by the controller {quoted(child.get('url'))}, which is"
                " not read: export it in its pose"
            )


def _pose(node: Any) -> FloatArray:
    """Return (4, 4): a node's transforms, one after another as it has them."""
    X = np.eye(4)
    for child in node:
        if child.tag in ("lookat", "skew"):
            raise ValueError(f"a node has a {child.tag}, which is not read: export matrices")
        if child.tag not in _TRANSFORMS:
            continue
        numbers = floats_of(child)
        if len(numbers) != _TRANSFORMS[child.tag]:
            raise ValueError(f"{child.tag} has {len(numbers)} numbers")
        own = np.eye(4)
        if child.tag == "matrix":
            own = numbers.reshape(4, 4)
            if not (np.abs(own[3] - (0.0, 0.0, 0.0, 1.0)) <= _LAST_ROW).all():
                raise ValueError(f"the last row of a matrix is {own[3].tolist()}")
        elif child.tag == "translate":
            own[:3, 3] = numbers
        elif child.tag == "scale":
            own[:3, :3] = np.diag(numbers)
        else:
            own[:3, :3] = _rotation(numbers[:3], float(numbers[3]))
        X = product(X, own)
    return X


def _rotation(axis: FloatArray, degrees: float) -> FloatArray:
    """Return the rotation (3, 3) about an axis of any length; quarter turns are exact."""
    quarters = round(degrees / 90.0)
    s, c = sine_cosine(math.radians(degrees - 90.0 * quarters))
    for _ in range(quarters % 4):
        s, c = c, -s
    size = length(axis)
    if not size > 0.0:
        if degrees == 0.0:
            return np.eye(3)
        raise ValueError("rotate has an axis without a direction")
    x, y, z = axis / size
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    along = np.array([[x * x, x * y, x * z], [x * y, y * y, y * z], [x * z, y * z, z * z]])
    return c * np.eye(3) + s * across + (1.0 - c) * along


def _looks(
    document: Document, placed: list[_Placed]
) -> tuple[FloatArray | None, FilePictures | None]:
    """Return the colours and the pictures of all triangles."""
    colors, rows = [np.zeros((0, 3))], [np.zeros(0, np.int32)]
    numbers: dict[FilePicture, int] = {}
    for body, _, instance in placed:
        material: Material | None = material_of(document, instance, body.material)
        row = -1
        if material is None:
            colors.append(colors_of(body))
        else:
            colors.append(np.tile(material.color, (len(body.cut), 1)))
            if material.address is not None:
                row = numbers.setdefault(FilePicture(material.address), len(numbers))
        rows.append(np.full(len(body.cut), row, np.int32))
    found = np.concatenate(colors)
    pictures = FilePictures(tuple(numbers), np.concatenate(rows)) if numbers else None
    return (None if np.isnan(found).all() else found), pictures

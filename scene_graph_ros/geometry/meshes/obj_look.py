"""The MTL materials of an OBJ file's triangles, read once for colours and pictures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.files import FileMark, package_folder
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.color_warnings import warn_of_color
from scene_graph_ros.geometry.meshes.io import FilesRead, read_file, read_file_marked
from scene_graph_ros.geometry.meshes.obj_colors import MtlMaterial, obj_materials, parse_mtl
from scene_graph_ros.geometry.meshes.sources import load_surface
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["ObjLook", "obj_look"]

_CAPACITY = 4096


class ObjLook(NamedTuple):
    """The materials of an OBJ file's triangles."""

    materials: list[MtlMaterial]
    row: NDArray[np.int32]
    """(m,) into ``materials``, in the order of ``load_surface``; -1 for none."""
    libraries: FilesRead
    """The MTL files that a material of these is from."""


_looks: BuildCache[ObjLook | None] = BuildCache(_CAPACITY)


def obj_look(shape: MeshShape) -> ObjLook | None:
    """Return the materials of an OBJ file's triangles, None where it names none.

    One from memory names no files. Warns with MeshColorWarning, once per file, where an MTL file
    is missing or wrong. Raises MeshError as ``load_surface`` does.
    """
    path = shape.path
    if path is None:
        return None
    return _looks.get(shape.source_key, lambda: _read(path, len(load_surface(shape)[1])))


def _library(path: Path, library: str) -> tuple[bytes, FilesRead]:
    """Read a library of a mesh file, from the file's package or folder: none of another place.

    Raises MeshError.
    """
    folder, place = package_folder(path), os.path.normpath(path.parent.absolute() / library)
    if not Path(place).is_relative_to(folder):
        raise MeshError(f"it lies outside {folder}, and libraries of elsewhere are not read")
    return read_file_marked(place)


def _read(path: Path, count: int) -> ObjLook | None:
    """Return the materials of ``count`` triangles."""
    contents = read_file(path)
    if b"usemtl" not in contents:
        return None
    uses = obj_materials(contents)
    if len(uses.row) != count:
        warn_of_color(
            f"mesh file {str(path)!r} has changed since it was read: shown without its colours"
        )
        return None
    known: dict[str, MtlMaterial] = {}
    origins: dict[str, tuple[Path, FileMark]] = {}
    for library in uses.libraries:
        name = f"{str(path)!r} names the materials {library!r}"
        try:
            contents, files = _library(path, library)
            materials = parse_mtl(contents, name)
        except MeshError as error:
            warn_of_color(f"{name}, shown without their colours: {error}")
            continue
        origins |= dict.fromkeys(materials, files[0])
        folder = str(Path(library).parent)
        known |= {key: _beside(material, folder) for key, material in materials.items()}
    told = {name: m for name, m in known.items() if m != MtlMaterial()}
    missing = sorted(set(uses.materials) - told.keys())
    if missing and uses.libraries:
        warn_of_color(
            f"mesh file {str(path)!r}: no colour (Kd) of material {', '.join(missing[:5])}"
        )
    materials_used = [told.get(name, MtlMaterial()) for name in uses.materials]
    libraries = dict.fromkeys(origins[name] for name in uses.materials if name in origins)
    return ObjLook(materials_used, uses.row, tuple(libraries))


def _beside(material: MtlMaterial, folder: str) -> MtlMaterial:
    """Return a material whose picture is looked for where its MTL file is."""
    if material.picture is None:
        return material
    return material._replace(picture=material.picture._replace(folder=folder))

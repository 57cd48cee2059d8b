"""The files that clients of Foxglove's protocol may be sent: those that a scene's meshes are of.

A client asks by an address. It is looked up among those of the scene and never followed, so that
no request leads to another file of the disk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import functools
from pathlib import Path
import posixpath
from urllib.parse import unquote
import warnings

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.files import read_limited
from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.gltf_file import GLTF_TYPES
from scene_graph_ros.geometry.meshes.io import buffer_files
from scene_graph_ros.geometry.meshes.obj_look import obj_look
from scene_graph_ros.geometry.meshes.triangle_pictures import triangle_pictures
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["MAX_ASSET_BYTES", "AssetError", "SceneAssets"]

MAX_ASSET_BYTES = 64 * 2**20
"""Of a file that a client is sent."""


class AssetError(LookupError):
    """A client asks for what it can't be sent."""


class SceneAssets:
    """The files of one version of a scene, by the addresses that viewers find them at."""

    def __init__(
        self, inspector: SceneGraphInspector, addressing: Callable[[], Callable[[Path], str]]
    ) -> None:
        """``addressing`` returns what returns a file's address, as markers have it.

        It is called when the first file is asked for.
        """
        self._inspector, self._addressing = inspector, addressing

    def read(self, address: str) -> bytes:
        """Return a file. Raises AssetError for one that is not the scene's, or can't be read."""
        path = self._paths.get(_normal(address))
        if path is None:
            raise AssetError(f"no mesh of the scene is of {quoted(address)}, or names it")
        try:
            return read_limited(path, MAX_ASSET_BYTES)
        except OSError as error:
            raise AssetError(f"{address}: {error.strerror}") from error

    @functools.cached_property
    def _paths(self) -> dict[str, Path]:
        inspector, address_of = self._inspector, self._addressing()
        shapes = {inspector.get_shape(each) for each in inspector.get_all_geometry_ids()}
        return {
            _normal(address): path
            for shape in shapes
            if isinstance(shape, MeshShape) and shape.path is not None
            for path in (shape.path, *_named_by(shape))
            for address in (address_of(path), path.as_uri())
        }


def _named_by(shape: MeshShape) -> Iterator[Path]:
    """Yield the files of materials, pictures and buffers that a mesh's file names."""
    with contextlib.suppress(MeshError), warnings.catch_warnings():
        # Who draws it says what is missing.
        warnings.simplefilter("ignore", MeshColorWarning)
        look = obj_look(shape) if shape.file_type == "obj" else None
        if look is not None:
            yield from look.libraries
        if shape.path is not None and shape.file_type in GLTF_TYPES:
            yield from buffer_files(shape.path)
        found = triangle_pictures(shape)
        if found is not None:
            yield from (Path(file.place) for file in found.pictures if file.contents is None)


def _normal(address: str) -> str:
    """Return an address in one of the ways in which it can be written."""
    scheme, separator, place = address.partition("://")
    return f"{scheme}{separator}{posixpath.normpath(unquote(place))}"

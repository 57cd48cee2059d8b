"""The files that clients of Foxglove's protocol may be sent: those that a scene's meshes are of.

A client asks by an address. It is looked up among those of the scene and never followed, so that
no request leads to another file of the disk. A file is sent as long as it is the one that was read
as a part of the scene: a file that took its place since, be it by a link, is not.
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
from scene_graph_ros.geometry.files import FileMark, read_part
from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.obj_look import obj_look
from scene_graph_ros.geometry.meshes.sources import files_read
from scene_graph_ros.geometry.meshes.textures import known_texture
from scene_graph_ros.geometry.meshes.triangle_pictures import triangle_pictures
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["FRAGMENT", "MAX_ASSET_BYTES", "Asset", "AssetError", "SceneAssets"]

MAX_ASSET_BYTES = 64 * 2**20
"""Of a file that a client is sent."""


FRAGMENT = 1 << 18
"""Bytes that are read at once: no more of a file waits for a client."""

_PACKAGE = "package.xml"
"""The file in a package's folder."""


class AssetError(LookupError):
    """A client asks for a file that it can't be sent."""


class Asset:
    """A file for one client, of which one fragment at a time is in memory."""

    def __init__(self, address: str, mark: FileMark) -> None:
        """Read its beginning.

        Raises AssetError where it can't be read, or is not the file that was marked.
        """
        if mark.size > MAX_ASSET_BYTES:
            raise AssetError(f"{address}: has {mark.size} bytes, the limit is {MAX_ASSET_BYTES}")
        self._address, self._mark = address, mark
        self._first = self._read(0)

    def fragments(self) -> Iterator[bytes]:
        """Yield its bytes. Raises AssetError where it changes or goes meanwhile."""
        yield self._first
        for start in range(FRAGMENT, self._mark.size, FRAGMENT):
            yield self._read(start)

    def _read(self, start: int) -> bytes:
        try:
            return read_part(self._mark, start, FRAGMENT)
        except OSError as error:
            raise AssetError(f"{self._address}: {error.strerror}") from error


class SceneAssets:
    """The files of one version of a scene, by the addresses that viewers find them at."""

    def __init__(
        self, inspector: SceneGraphInspector, addressing: Callable[[], Callable[[Path], str]]
    ) -> None:
        """``addressing`` returns the function from a file to its address in markers.

        It is called when the first file is asked for.
        """
        self._inspector, self._addressing = inspector, addressing

    def find(self, address: str) -> Asset:
        """Return a file. Raises AssetError for one that is not the scene's, or can't be read."""
        mark = self._marks.get(_normal(address))
        if mark is None:
            raise AssetError(
                f"no mesh of the scene is of {quoted(address)}, or uses it from its own folder or"
                " package"
            )
        return Asset(address, mark)

    @functools.cached_property
    def _marks(self) -> dict[str, FileMark]:
        inspector, address_of = self._inspector, self._addressing()
        shapes = {inspector.get_shape(each) for each in inspector.get_all_geometry_ids()}
        return {
            _normal(address): mark
            for shape in shapes
            if isinstance(shape, MeshShape) and shape.path is not None
            for path, mark in _files_of(shape)
            for address in (address_of(path), path.as_uri())
        }


def _files_of(shape: MeshShape) -> Iterator[tuple[Path, FileMark]]:
    """Yield the file of a mesh and those it uses that may be sent; none if it is no mesh."""
    with contextlib.suppress(MeshError), warnings.catch_warnings():
        # Who draws it says what is missing.
        warnings.simplefilter("ignore", MeshColorWarning)
        mesh, *others = files_read(shape)
        yield mesh
        for path, mark in (*others, *_look_of(shape)):
            if _may_be_sent(mark, mesh):
                yield path, mark


def _look_of(shape: MeshShape) -> Iterator[tuple[Path, FileMark]]:
    """Yield the files of materials and pictures that triangles of a mesh have."""
    look = obj_look(shape) if shape.file_type == "obj" else None
    if look is not None:
        yield from look.libraries
    found = triangle_pictures(shape)
    for picture in () if found is None else found.pictures:
        mark = None if picture.contents is not None else known_texture(picture.place).mark
        if mark is not None:
            yield Path(picture.place), mark


def _may_be_sent(file: FileMark, mesh: tuple[Path, FileMark]) -> bool:
    """Tell whether a file belongs to the mesh that names it, links and owners considered.

    It lies below the mesh's folder or package and is the same user's: else whoever writes a mesh
    could name any file that the node may read.
    """
    path, mark = mesh
    if file.owner != mark.owner:
        return False
    folders = (path.parent.resolve(), Path(mark.place).parent)
    packages = (
        above
        for folder in folders
        for above in (folder, *folder.parents)
        if (above / _PACKAGE).is_file()
    )
    return any(Path(file.place).is_relative_to(root) for root in (*folders, *packages))


def _normal(address: str) -> str:
    """Return an address in one of the ways in which it can be written."""
    scheme, separator, place = address.partition("://")
    return f"{scheme}{separator}{posixpath.normpath(unquote(place))}"

"""Find the files behind ``package://`` and ``file://`` addresses, without importing ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
import functools
import os
from pathlib import Path
import site
import stat
import sys
import urllib.parse

from scene_graph_ros.geometry.files import find_file, MAX_TEXT_BYTES, Reach, read_limited
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files.xml_tree import parse_xml

__all__ = [
    "ROBOT_ENDINGS",
    "SCENE_ENDINGS",
    "Packages",
    "UnknownPackageError",
    "find_package",
    "resolve_resource",
]

SCENE_ENDINGS = (".yaml", ".yml")
ROBOT_ENDINGS = (".urdf", ".srdf", ".xml")
"""Of the texts that a request may name."""

_INDEX = Path("share/ament_index/resource_index/packages")

_NEXT = 3
"""Folders above a file in which packages without a manifest may be."""

MAX_RESOURCE = 4096
"""Characters of an address: as many bytes as Linux takes for a path."""


class UnknownPackageError(SceneFileError):
    """A ``package://`` address whose package is found in none of the places searched."""


@dataclass(frozen=True)
class Packages:
    """Where packages are looked for, first match wins.

    1. ``package_map``: package name -> its share folder;
    2. ``package_dirs``: folders that are the package, or contain it;
    3. the ament index of each prefix in ``AMENT_PREFIX_PATH``;
    4. each folder of ``ROS_PACKAGE_PATH``, searched like ``package_dirs``;
    5. the folders above the file that names the package, as in a source checkout;
    6. the prefixes of this Python environment, where wheels put robot descriptions;
    7. without a manifest, of the folders above the file one that is called as the package, or one
       that is in the next ones of these.

    ``reach`` says which of the texts that are found may be read.
    """

    package_map: Mapping[str, str | Path] = field(default_factory=dict)
    package_dirs: tuple[str | Path, ...] = ()
    reach: Reach = field(default_factory=Reach)

    @staticmethod
    def of(
        package_map: Mapping[str, str | Path] | None = None,
        package_dirs: Iterable[str | Path] = (),
        reach: Reach | None = None,
    ) -> Packages:
        """Return the search rule for optional arguments as the loaders take them."""
        return Packages(dict(package_map or {}), tuple(package_dirs), reach or Reach())

    def folders(self) -> list[Path]:
        """Return the share folders of packages."""
        prefixes = [*_environment_paths("AMENT_PREFIX_PATH"), *_python_prefixes()]
        given = [*self.package_map.values(), *self.package_dirs]
        named = [*map(Path, given), *_environment_paths("ROS_PACKAGE_PATH")]
        return [*named, *(prefix / "share" for prefix in prefixes)]

    def find(self, name: str, *, near: Path | None = None) -> Path:
        """Return the share folder of package ``name``; ``near`` is a file that names it.

        Raises UnknownPackageError listing the places searched.
        """
        if name in self.package_map:
            mapped = Path(self.package_map[name])
            if _is(stat.S_ISDIR, mapped):
                return mapped
            raise UnknownPackageError(
                f"package {name!r} is mapped to {mapped}, which is no folder"
            )
        searched = []
        for label, folder in self._candidates(name, near):
            if label not in searched:
                searched.append(label)
            if folder is not None:
                return folder
        # A copy without its manifest, as wheels have them.
        for above in self._above(near):
            if above.name == name:
                return above
        for above in () if near is None else near.resolve().parents[:_NEXT]:
            beside = above / name
            is_near = name not in (".", "..") and self.reach.includes(beside)
            if is_near and _is(stat.S_ISDIR, beside):
                return beside
        places = ", ".join(searched) or "nowhere (AMENT_PREFIX_PATH is not set)"
        raise UnknownPackageError(f"package {name!r} not found; searched {places}")

    def _above(self, near: Path | None) -> list[Path]:
        """Return the folders above a file that may be looked at."""
        parents = () if near is None else near.resolve().parents
        return [folder for folder in parents if self.reach.includes(folder)]

    def _candidates(self, name: str, near: Path | None) -> Iterator[tuple[str, Path | None]]:
        for entry in self.package_dirs:
            yield f"package_dirs entry {entry}", _package_in(Path(entry), name)
        for prefix in _environment_paths("AMENT_PREFIX_PATH"):
            yield f"ament prefix {prefix}", _package_in_prefix(prefix, name)
        for folder in _environment_paths("ROS_PACKAGE_PATH"):
            yield f"ROS_PACKAGE_PATH entry {folder}", _package_in(folder, name)
        if near is not None:
            for folder in self._above(near):
                yield f"folders above {near.name}", folder if _is_package(folder, name) else None
        for prefix in _python_prefixes():
            yield f"Python prefix {prefix}", _package_in_prefix(prefix, name)


def _environment_paths(variable: str) -> list[Path]:
    return [Path(part) for part in os.environ.get(variable, "").split(os.pathsep) if part]


def _python_prefixes() -> list[Path]:
    """Return the prefixes below which installed wheels have a ``share`` folder."""
    wheels = [Path(folder) / "cmeel.prefix" for folder in site.getsitepackages()]
    folders = [Path(sys.prefix), *wheels]
    return [folder for folder in folders if _is(stat.S_ISDIR, folder)]


def _is(kind: Callable[[int], bool], path: Path) -> bool:
    """Tell whether a path is of a kind. Names come from anywhere: other texts are no paths."""
    try:
        return kind(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def _package_in_prefix(prefix: Path, name: str) -> Path | None:
    share = prefix / "share" / name
    if _is(bool, prefix / _INDEX / name) or _is(stat.S_ISREG, share / "package.xml"):
        return share if _is(stat.S_ISDIR, share) else None
    return None


def _package_in(folder: Path, name: str) -> Path | None:
    """Return ``folder`` if it is package ``name``, or the package in it or in its share."""
    if _is_package(folder, name):
        return folder
    child = folder / name
    if _is(stat.S_ISDIR, child):
        return child
    return _package_in_prefix(folder, name)


def _is_package(folder: Path, name: str) -> bool:
    manifest = folder / "package.xml"
    if not _is(stat.S_ISREG, manifest):
        return False
    return folder.name == name or _manifest_name(manifest) == name


@functools.lru_cache(maxsize=256)
def _manifest_name(manifest: Path) -> str | None:
    """Read a package's name; a broken manifest names no package."""
    try:
        text = read_limited(manifest, MAX_TEXT_BYTES)
        element = parse_xml(text, str(manifest)).child("name")
    except (OSError, SceneFileError):
        return None
    return element.text.strip() if element is not None else None


def find_package(
    name: str,
    *,
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> Path:
    """Return the share folder of the ROS package ``name``.

    Raises UnknownPackageError listing the places searched.
    """
    return Packages.of(package_map, package_dirs).find(name)


def resolve_resource(
    resource: str,
    *,
    base: Path | None = None,
    packages: Packages | None = None,
    endings: tuple[str, ...] = (),
) -> Path:
    """Return the existing file that ``resource`` means.

    ``resource`` is ``package://<package>/<path>``, ``file:///<path>``, an absolute path or one
    relative to the folder of ``base``, the file that contains it, or to the working folder. It has
    to be within the reach of ``packages``; with ``endings`` it is a text.
    Raises SceneFileError with the resource and the path tried.
    """
    packages = packages or Packages()
    path = _path_of(resource, base, packages)
    try:
        path = _spelled(path, "%" in resource, packages.reach, endings)
        find_file(path)
    except OSError as error:
        missing = isinstance(error, (FileNotFoundError, NotADirectoryError))
        reason = "no such file" if missing else error.strerror
        meaning = "" if str(path) == resource else f" means {path}"
        raise SceneFileError(f"{resource!r}{meaning}: {reason}") from error
    if _is_pointer(path):
        raise SceneFileError(
            f"{resource!r}: {path} is not the file, but what Git LFS has in its place: run"
            " 'git lfs pull' where it was cloned"
        )
    return path


def _spelled(path: Path, is_quoted: bool, reach: Reach, endings: tuple[str, ...]) -> Path:
    """Return the path, or its form without percent signs: the one that may be named and exists.

    Of a path that may not be named it is not looked at whether it exists. Raises OSError.
    """
    spellings = [path, Path(urllib.parse.unquote(str(path)))] if is_quoted else [path]
    allowed, refusals = [], []
    for each in spellings:
        try:
            allowed.append(reach.checked(each, endings))
        except OSError as refusal:
            refusals.append(refusal)
    if not allowed:
        raise refusals[0]
    return next((each for each in allowed if _is(bool, each)), allowed[-1])


_POINTER = b"version https://git-lfs.github.com/spec/"
_MOST_OF_POINTER = 1024
"""Bytes: larger files are what they are."""


def _is_pointer(path: Path) -> bool:
    """Tell whether a file only says where Git LFS has the file."""
    try:
        if path.stat().st_size > _MOST_OF_POINTER:
            return False
        return read_limited(path, _MOST_OF_POINTER).startswith(_POINTER)
    except OSError:
        return False


def _path_of(resource: str, base: Path | None, packages: Packages) -> Path:
    """Return the path that an address means, whether or not it is there."""
    if not resource.strip():
        raise SceneFileError(f"expected a path, package:// or file://, got {resource!r}")
    if len(resource) > MAX_RESOURCE:
        raise SceneFileError(
            f"an address has at most {MAX_RESOURCE} characters, got {len(resource)}:"
            f" {quoted(resource)}"
        )
    scheme, separator, rest = resource.partition("://")
    if resource.startswith("file:/") and not separator:
        scheme, separator, rest = "file", "://", resource.removeprefix("file:")
    if not separator:
        try:
            path = Path(resource).expanduser()
        except RuntimeError as error:
            raise SceneFileError(f"{resource!r}: {error}") from error
        return path if path.is_absolute() or base is None else base.parent / path
    if scheme == "package":
        # Some robot descriptions write a third slash, which other readers skip as well.
        package, _, inner = rest.lstrip("/").partition("/")
        if not package or not inner:
            raise SceneFileError(f"expected package://<package>/<path>, got {resource!r}")
        return packages.find(package, near=base) / inner
    if scheme != "file":
        raise SceneFileError(
            f"expected a path, package:// or file://, got the scheme {scheme!r} in {resource!r}"
        )
    host, slash, inner = rest.partition("/")
    if host not in ("", "localhost") or not slash:
        on = f": {host!r} would be another machine" if slash else ""
        raise SceneFileError(f"expected file:///<absolute path>, got {resource!r}{on}")
    return Path(urllib.parse.unquote(slash + inner))

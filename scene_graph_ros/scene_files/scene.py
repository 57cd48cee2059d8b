"""Read scene files: YAML checked against the schema, then against itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, Reach, read_limited
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files.checks import problems_of
from scene_graph_ros.scene_files.packages import Packages, resolve_resource, SCENE_ENDINGS
from scene_graph_ros.scene_files.scene_file import SceneFile
from scene_graph_ros.scene_files.schema import SceneSpec
from scene_graph_ros.scene_files.schema_errors import located_error
from scene_graph_ros.scene_files.yaml_document import parse_yaml

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.scene_files.loaded_scene import LoadedScene

__all__ = ["Scene", "load_scene", "load_scene_text"]


@one_line()
@dataclass(frozen=True)
class Scene(SceneFile):
    """A scene file that was read and checked; robots and meshes are read when it is applied."""

    def apply(self, scene_graph: SceneGraph, *, prefix: str = "") -> LoadedScene:
        """Register everything in the scene, or nothing.

        ``prefix`` goes before the names of sources and of anchored geometries, which share the
        world with those of other scenes; references in the file are meant without it. Raises
        SceneFileError, with the place in the scene file, for robots and meshes that cannot be
        read and for all objects that the scene graph refuses.
        """
        from scene_graph_ros.scene_files.apply_scene import apply_scene

        return apply_scene(self, scene_graph, prefix)


def load_scene(
    path: str | Path,
    *,
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
    reach: Reach | None = None,
) -> Scene:
    """Read a scene from a file, a ``package://`` or a ``file://`` address.

    ``reach`` says which scenes, URDF and SRDF may be read; by default all that the user may read.
    Raises SceneFileError; each of its ``problems`` names file, line, path in the file and value.
    """
    packages = Packages.of(package_map, package_dirs, reach)
    file = resolve_resource(str(path), packages=packages, endings=SCENE_ENDINGS)
    try:
        text = read_limited(file, MAX_TEXT_BYTES)
    except OSError as error:
        raise SceneFileError(f"{file}: cannot be read: {error.strerror}") from error
    return _scene(text, str(path), file, packages, is_quoted=packages.reach.is_anywhere)


def load_scene_text(
    text: str,
    *,
    label: str = "<text>",
    base: Path | None = None,
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
    reach: Reach | None = None,
) -> Scene:
    """Read a scene from YAML text, called ``label`` in messages; see ``load_scene``.

    Relative paths in it start from the folder of the file ``base``, else from the working folder.
    """
    return _scene(text, label, base, Packages.of(package_map, package_dirs, reach))


def _scene(
    text: str | bytes,
    label: str,
    base: Path | None,
    packages: Packages,
    *,
    is_quoted: bool = True,
) -> Scene:
    document = parse_yaml(text, label, is_quoted=is_quoted)
    if not isinstance(document.data, dict):
        raise document.error(f"a scene is a mapping, got {type(document.data).__name__}")
    if "version" not in document.data:
        # What is none is not gone through: its lines may be anything.
        raise document.error("missing; a scene is a mapping with version: 1", "version")
    try:
        spec = SceneSpec.model_validate(document.data)
    except ValidationError as error:
        raise located_error(error, document) from error
    problems = problems_of(spec, document)
    if problems:
        raise SceneFileError(problems)
    folder = Path.cwd() if base is None else base.parent
    mapped = {name: folder / path for name, path in spec.packages.items()}
    whole = replace(packages, package_map={**mapped, **packages.package_map})
    return Scene(spec, document, base, whole)

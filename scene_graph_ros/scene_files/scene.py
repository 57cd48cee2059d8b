"""Read scene files: YAML checked against the schema, then against itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, read_limited
from scene_graph_ros.geometry.model.names import canonical_name, InvalidNameError
from scene_graph_ros.located import SceneFileError, suggestion
from scene_graph_ros.scene_files.packages import Packages, resolve_resource
from scene_graph_ros.scene_files.schema import FrameSpec, SceneSpec
from scene_graph_ros.scene_files.schema_errors import located_error
from scene_graph_ros.scene_files.yaml_document import parse_yaml, YamlDocument

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.scene_files.loaded_scene import LoadedScene

__all__ = ["Scene", "load_scene", "load_scene_text"]


_MOST_PROBLEMS = 100
"""So many are listed at once. Each looks for a name that may have been meant, which takes time."""


@dataclass(frozen=True)
class Scene:
    """A scene file that was read and checked; robots and meshes are read when it is applied."""

    spec: SceneSpec
    document: YamlDocument
    base: Path | None
    """The file, if there is one: relative paths in it start from its folder."""
    packages: Packages

    def apply(self, scene_graph: SceneGraph, *, prefix: str = "") -> LoadedScene:
        """Register everything in the scene, or nothing.

        ``prefix`` goes before the names of sources and of anchored geometries, which share the
        world with those of other scenes; references in the file are meant without it. Raises
        SceneFileError, with the place in the scene file, for robots and meshes that cannot be
        read and for whatever the scene graph refuses.
        """
        from scene_graph_ros.scene_files.apply_scene import apply_scene

        return apply_scene(self, scene_graph, prefix)


def load_scene(
    path: str | Path,
    *,
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> Scene:
    """Read a scene from a file, a ``package://`` or a ``file://`` address.

    Raises SceneFileError; each of its ``problems`` names file, line, path in the file and value.
    """
    packages = Packages.of(package_map, package_dirs)
    file = resolve_resource(str(path), packages=packages)
    try:
        text = read_limited(file, MAX_TEXT_BYTES)
    except OSError as error:
        raise SceneFileError(f"{file}: cannot be read: {error.strerror}") from error
    return _scene(text, str(path), file, packages)


def load_scene_text(
    text: str,
    *,
    label: str = "<text>",
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> Scene:
    """Read a scene from YAML text, called ``label`` in messages; see ``load_scene``.

    Relative paths in it start from the working folder.
    """
    return _scene(text, label, None, Packages.of(package_map, package_dirs))


def _scene(text: str | bytes, label: str, base: Path | None, packages: Packages) -> Scene:
    document = parse_yaml(text, label)
    if not isinstance(document.data, dict):
        raise document.error(f"a scene is a mapping, got {type(document.data).__name__}")
    try:
        spec = SceneSpec.model_validate(document.data)
    except ValidationError as error:
        raise located_error(error, document) from error
    problems = _Checker(spec, document).problems()
    if problems:
        raise SceneFileError(problems)
    folder = Path.cwd() if base is None else base.parent
    mapped = {name: folder / path for name, path in spec.packages.items()}
    return Scene(
        spec, document, base, Packages({**mapped, **packages.package_map}, packages.package_dirs)
    )


class _Checker:
    """Checks that names are unique and mean something, as far as the file alone can tell."""

    def __init__(self, spec: SceneSpec, document: YamlDocument) -> None:
        self.spec = spec
        self.document = document
        self.found: list[str] = []
        self.robots = {robot.name for robot in spec.robots}
        self.sources = {source.name for source in spec.sources} | self.robots
        self.frames = {(frame.source, frame.name): frame for frame in spec.frames}
        self.rooted: set[tuple[str, str]] = set()

    def problems(self) -> list[str]:
        self._unique_sources()
        self._frames()
        self._geometries()
        self._cameras()
        self._filters()
        return self.found

    def report(self, message: str, *path: str | int) -> None:
        if len(self.found) >= _MOST_PROBLEMS:
            raise SceneFileError([*self.found, f"{self.document.file}: there is more wrong"])
        self.found.append(f"{self.document.location(*path)}: {message}")

    def _source(self, name: str, *path: str | int) -> bool:
        if name in self.sources:
            return True
        self.report(f"no source or robot {name!r}{suggestion(name, self.sources)}", *path)
        return False

    def _parent(self, source: str, name: str, *path: str | int) -> None:
        """Check a frame's name; a robot's frames are known only when its URDF is read."""
        if name == "world" or (source, name) in self.frames or source in self.robots:
            return
        known = ["world", *(frame for owner, frame in self.frames if owner == source)]
        self.report(f"source {source!r} has no frame {name!r}{suggestion(name, known)}", *path)

    def _unique_sources(self) -> None:
        places: dict[str, tuple[str | int, ...]] = {}
        for index, source in enumerate(self.spec.sources):
            self._unique(places, source.name, "sources", index, "name")
        for index, robot in enumerate(self.spec.robots):
            self._unique(places, robot.name, "robots", index, "name")

    def _unique(
        self, places: dict[str, tuple[str | int, ...]], name: str, *path: str | int
    ) -> None:
        if name in places:
            first = self.document.location(*places[name]).line
            self.report(f"the name {name!r} is taken by line {first}", *path)
        else:
            places[name] = path

    def _frames(self) -> None:
        places: dict[str, tuple[str | int, ...]] = {}
        for index, frame in enumerate(self.spec.frames):
            if frame.name == "world":
                self.report("the name 'world' means the world frame", "frames", index, "name")
                continue
            if not self._source(frame.source, "frames", index, "source"):
                continue
            self._unique(places, f"{frame.source}/{frame.name}", "frames", index, "name")
            self._parent(frame.source, frame.parent, "frames", index, "parent")
            self._no_loop(frame, index)

    def _no_loop(self, frame: FrameSpec, index: int) -> None:
        passed = {frame.name: None}
        current = self.frames.get((frame.source, frame.parent))
        while current is not None and current.name not in passed:
            if (frame.source, current.name) in self.rooted:
                current = None
                break
            passed[current.name] = None
            current = self.frames.get((frame.source, current.parent))
        if current is None:
            # So that no frame's ancestors are walked through twice.
            self.rooted.update((frame.source, name) for name in passed)
            return
        if current.name == frame.name:
            chain = " -> ".join([*passed, frame.name])
            self.report(f"a frame cannot be its own ancestor: {chain}", "frames", index, "parent")

    def _geometries(self) -> None:
        places: dict[str, tuple[str | int, ...]] = {}
        for index, geometry in enumerate(self.spec.geometries):
            if not self._source(geometry.source, "geometries", index, "source"):
                continue
            self._parent(geometry.source, geometry.frame, "geometries", index, "frame")
            if geometry.deformable is not None and geometry.frame != "world":
                self.report(
                    f"deformable geometry is in the world, not on a frame; got {geometry.frame!r}",
                    *("geometries", index, "frame"),
                )
            # The world is one frame for all sources, so names of anchored geometry are, too.
            owner = "" if geometry.frame == "world" else f"{geometry.source}/"
            path = f"{owner}{geometry.frame}/{geometry.name}"
            self._unique(places, path, "geometries", index, "name")

    def _cameras(self) -> None:
        places: dict[str, tuple[str | int, ...]] = {}
        for index, camera in enumerate(self.spec.cameras):
            try:
                canonical_name("camera", camera.name)
            except InvalidNameError as error:
                self.report(str(error), "cameras", index, "name")
            self._unique(places, camera.name, "cameras", index, "name")
            if self._source(camera.source, "cameras", index, "source"):
                self._parent(camera.source, camera.frame, "cameras", index, "frame")

    def _filters(self) -> None:
        for index, declared in enumerate(self.spec.collision_filters):
            sets: Sequence[tuple[tuple[str | int, ...], list[str]]]
            if declared.within is not None:
                sets = [(("within",), declared.within)]
            else:
                sets = [(("between", i), names) for i, names in enumerate(declared.between or [])]
            for where, members in sets:
                for position, member in enumerate(members):
                    place = ("collision_filters", index, *where, position)
                    self._source(member.partition("/")[0], *place)

"""Faults of a scene file, as far as it alone can tell: names that mean nothing, loops."""

from __future__ import annotations

from collections.abc import Sequence
import math

from scene_graph_ros.geometry.model.names import canonical_name, InvalidNameError
from scene_graph_ros.geometry.shapes.voxel_runs import MOST_IN_RUNS
from scene_graph_ros.located import SceneFileError, suggestion
from scene_graph_ros.scene_files.schema import FrameSpec, SceneSpec
from scene_graph_ros.scene_files.schema_shapes import VoxelGridSpec
from scene_graph_ros.scene_files.yaml_document import YamlDocument

__all__ = ["problems_of"]

_MOST_PROBLEMS = 100
"""So many are listed at once. Each looks for a name that may have been meant, which takes time."""


def problems_of(spec: SceneSpec, document: YamlDocument) -> list[str]:
    """Return a line for each name that is not unique or means nothing, with its place.

    Raises SceneFileError where there are too many to go on.
    """
    return _Checker(spec, document).problems()


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
        self._sensors()
        self._voxel_grids()
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

    def _sensors(self) -> None:
        """Check that sensors fill geometry that there is, and those that remember anchored one."""
        known = {s.name for s in self.spec.sources} | {r.name for r in self.spec.robots}
        kinds = {s.name: s.filled_type for s in self.spec.sources}
        for index, source in enumerate(self.spec.sources):
            sensor, key = source.sensor, "points" if source.points else "depth"
            if sensor is None:
                continue
            filled = source.name if sensor.fills is None else sensor.fills
            kind = kinds.get(filled, "point_cloud")
            own = [g for g in self.spec.geometries if g.source == filled]
            there = {g.name: g.frame for g in own if g.shape.type == kind}
            if filled not in known:
                hint = suggestion(filled, known)
                self.report(f"there is no source {filled!r}{hint}", "sources", index, key, "fills")
            if kind == "voxel_grid" and source.points is not None and not source.points.remember:
                self.report(
                    f"the voxel grid of {filled!r} holds what was seen: say remember: true",
                    *("sources", index, key),
                )
            name = sensor.geometry
            if name is not None and name not in there:
                hint = suggestion(name, there)
                self.report(
                    f"source {source.name!r} has no {kind} {name!r}{hint}",
                    *("sources", index, key, "geometry"),
                )
            for row, removed in enumerate(sensor.remove or ()):
                if removed not in known:
                    hint = suggestion(removed, known)
                    place = ("sources", index, key, "remove", row)
                    self.report(f"there is no source {removed!r}{hint}", *place)
            replaces = source.points is not None and not source.points.remember
            if replaces and sensor.fills is None:
                continue
            for each, frame in there.items():
                if each == (name or each) and frame != "world":
                    self.report(
                        f"the {kind} {each!r} is on frame {frame!r}, and images of depth, and"
                        " sensors that remember or fill another source's, fill what is anchored:"
                        " leave its frame out",
                        *("sources", index, key),
                    )

    def _voxel_grids(self) -> None:
        """Check that maps fill voxel grids that there are, and how many voxels these have."""
        total = sum(
            math.prod(g.shape.counts)
            for g in self.spec.geometries
            if isinstance(g.shape, VoxelGridSpec)
        )
        if total > MOST_IN_RUNS:
            self.report(
                f"its voxel grids have {total} voxels together, and those of a file may have"
                f" {MOST_IN_RUNS}",
                "geometries",
            )
        for index, source in enumerate(self.spec.sources):
            if source.voxels is None:
                continue
            own = [g for g in self.spec.geometries if g.source == source.name]
            grids = [g.name for g in own if g.shape.type == "voxel_grid"]
            name = source.voxels.geometry
            if name is not None and name not in grids:
                self.report(
                    f"source {source.name!r} has no voxel_grid {name!r}{suggestion(name, grids)}",
                    *("sources", index, "voxels", "geometry"),
                )

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
        for index, renderer in enumerate(self.spec.renderers):
            self._unique(places, renderer.name, "renderers", index, "name")
        places = {}
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

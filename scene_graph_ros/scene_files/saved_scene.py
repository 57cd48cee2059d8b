"""Write a scene graph as a scene file, which loads to the same world."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry import Context, Role, SceneGraph
from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.scene_files.saved_check import check_saved
from scene_graph_ros.scene_files.saved_values import (
    as_line,
    pose_to_spec,
    properties_to_spec,
    SavedFiles,
    SceneSaveError,
    shape_of_now,
    shape_to_spec,
    volume_mesh_bytes,
)

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.snapshot import Snapshot
    from scene_graph_ros.geometry.perception import CameraDescription

__all__ = ["save_scene"]

_ROLES = {
    "proximity": Role.PROXIMITY,
    "illustration": Role.ILLUSTRATION,
    "perception": Role.PERCEPTION,
}
_PLAIN_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def save_scene(
    scene_graph: SceneGraph,
    path: str | Path,
    *,
    context: Context | None = None,
    cameras: Iterable[CameraDescription] = (),
    name: str = "",
) -> None:
    """Write a scene file that loads to a world with the same names, order and answers, to the bit.

    ``load_scene(path).apply(scene_graph)`` makes it, ``set_initial_poses`` puts frames where they
    are in ``context``: without one, at the identity. ``cameras`` are of the scene, as
    ``LoadedScene.cameras`` has them. Robots become sources with frames: their joints are not
    part of a scene graph. Meshes are named by path; those in memory only are written in full, or
    into a folder beside, ``<path's stem>_files``. Filters that are in force become permanent.

    The file is read back and compared before anything is written.

    Raises SceneSaveError, and writes nothing, for scenes that no file can hold: a slash in a name,
    a frame below one of another source, deformed geometry, properties that are arrays, another
    accuracy than "exact". Raises OSError where nothing can be written.
    """
    file = Path(path).absolute()
    asked = scene_graph.create_default_context() if context is None else context
    saving = _Saving(asked.snapshot, SavedFiles(file))
    text = saving.text(list(cameras), name)
    check_saved(asked.snapshot, text, saving.files)
    saving.files.write()
    file.write_text(text, encoding="utf-8")


class _Saving:
    """The parts of a file, made of a snapshot."""

    def __init__(self, snapshot: Snapshot, files: SavedFiles) -> None:
        self.snapshot, self.state = snapshot, snapshot.state
        self.inspector, self.files = snapshot.inspector, files
        self.world = self.inspector.world_frame_id()

    def text(self, cameras: list[CameraDescription], name: str) -> str:
        self._check_answers()
        parts = {
            "sources": self._sources(),
            "frames": self._frames(),
            "geometries": self._geometries(),
            "renderers": self._renderers(),
            "cameras": [self._camera(each) for each in cameras],
            "collision_filters": self._filters(),
        }
        lines = ["version: 1", f"name: {as_line(name)}"]
        for key, entries in parts.items():
            if entries:
                lines += [f"{key}:", *(f"- {as_line(entry)}" for entry in entries)]
        return "\n".join(lines) + "\n"

    def _check_answers(self) -> None:
        for what, value, wanted in (
            ("accuracy", self.state.accuracy, Accuracy.EXACT),
            ("engine", self.state.engine, Engine.NATIVE),
        ):
            if value is not wanted:
                raise SceneSaveError(
                    f"the {what} of the scene graph is {value.value!r}, which a scene file can't"
                    f" say. Remedy: set_{what}({wanted.value!r}), and again on what is loaded"
                )

    def _sources(self) -> list[dict[str, Any]]:
        """Return all sources; one whose name is no topic's has a topic of its own."""
        found = []
        deforming = {
            self.inspector.get_owning_source_id(i)
            for i in self.inspector.get_all_deformable_geometry_ids()
        }
        clouds = self.inspector.get_all_cloud_ids()
        sensing = {self.inspector.get_owning_source_id(i) for i in clouds}
        for index, source in enumerate(self.inspector.get_all_source_ids()[1:]):
            entry: dict[str, Any] = {"name": self._checked(self.state.source_names[source])}
            if not _PLAIN_NAME.fullmatch(entry["name"]):
                if self.state.source_frames[source]:
                    entry["poses"] = {"topic": f"source_{index}/poses"}
                if source in deforming:
                    entry["configurations"] = {"topic": f"source_{index}/configurations"}
                if source in sensing:
                    entry["points"] = {"topic": f"source_{index}/points"}
            found.append(entry)
        return found

    @staticmethod
    def _checked(name: str) -> str:
        if "/" in name:
            raise SceneSaveError(
                f"the name {quoted(name)} has a slash in it, which names in scene files have not."
                " Remedy: rename_frame, rename_geometry"
            )
        return name

    def _frames(self) -> list[dict[str, Any]]:
        found = []
        for frame in self.inspector.get_all_frame_ids():
            if frame == self.world:
                continue
            record = self.state.frames[frame]
            parent = self.state.frames[record.parent_id]
            if parent.id != self.world and parent.source_id != record.source_id:
                raise SceneSaveError(
                    f"frame {self.inspector.get_path(frame)!r} is below"
                    f" {self.inspector.get_path(parent.id)!r}, of another source, which a scene"
                    " file can't say. Remedy: change_parent to the world, with its pose there"
                )
            if record.frame_group:
                raise SceneSaveError(
                    f"frame {self.inspector.get_path(frame)!r} has frame group"
                    f" {record.frame_group}, which a scene file can't say"
                )
            entry: dict[str, Any] = {
                "name": self._checked(record.name),
                "source": self.state.source_names[record.source_id],
            }
            if parent.id != self.world:
                entry["parent"] = parent.name
            entry["pose"] = pose_to_spec(self.snapshot.pose_in_parent(frame))
            found.append(entry)
        return found

    def _geometries(self) -> list[dict[str, Any]]:
        found = []
        for geometry_id, record in self.state.geometries.items():
            name = self._checked(record.name)
            entry: dict[str, Any] = {
                "name": name,
                "source": self.state.source_names[record.source_id],
            }
            frame = self.state.frames[record.frame_id]
            if frame.id != self.world:
                entry["frame"] = self._checked(frame.name)
                if frame.source_id != record.source_id:
                    raise SceneSaveError(
                        f"geometry {name!r} is on a frame of another source, which a scene file"
                        " can't say"
                    )
            entry["pose"] = pose_to_spec(record.X_FG)
            shape = shape_of_now(self.snapshot, geometry_id)
            entry["shape"] = shape_to_spec(shape, name, self.files)
            entry["roles"] = {
                word: properties_to_spec(_groups(record.properties[role]), f"geometry {name!r}")
                for word, role in _ROLES.items()
                if role in record.properties
            }
            if record.deformable is not None:
                entry["deformable"] = {"mesh": self._reference_mesh(geometry_id, name)}
            found.append(entry)
        return found

    def _reference_mesh(self, geometry_id: Any, name: str) -> str:
        deformable = self.state.geometries[geometry_id].deformable
        assert deformable is not None
        now = self.snapshot.configuration(geometry_id).q_WG
        if now.tobytes() != deformable.reference.q_WG.tobytes():
            raise SceneSaveError(
                f"geometry {name!r} is deformed, which a scene file can't say. Remedy: save"
                " without a context, and set_configurations on what is loaded"
            )
        return self.files.add(name, "vtk", volume_mesh_bytes(deformable.mesh))

    def _renderers(self) -> list[dict[str, Any]]:
        if not self.state.renderers:
            return []
        from scene_graph_ros.scene_files.renderer_texts import renderer_to_text
        from scene_graph_ros.scene_files.yaml_document import parse_yaml

        found = []
        for name, engine in self.state.renderers.items():
            kind, parameters = renderer_to_text(engine)
            if kind not in ("exact", "traced"):
                raise SceneSaveError(
                    f"renderer {name!r} is a {engine.type_name}, which is not saved. Remedy:"
                    " remove_renderer, and add_renderer on what is loaded"
                )
            if getattr(engine, "environment_map", None) is not None:
                raise SceneSaveError(
                    f"renderer {name!r} has an environment_map, whose pixels a scene file can't"
                    " hold. Remedy: remove_renderer, and add_renderer on what is loaded"
                )
            found.append({"name": name, "type": kind, **(parse_yaml(parameters, name).data or {})})
        return found

    def _camera(self, camera: CameraDescription) -> dict[str, Any]:
        if not np.array_equal(camera.camera.core.X_BS, np.eye(4)):
            raise SceneSaveError(
                f"camera {camera.name!r} has a sensor apart from it (X_BS), which a scene file"
                " can't say. Remedy: multiply X_PC by it"
            )
        lens = camera.camera.core.intrinsics
        clipping, depths = camera.camera.core.clipping, camera.camera.depth_range
        entry: dict[str, Any] = {"name": camera.name, "source": camera.source}
        if camera.frame != "world":
            entry["frame"] = camera.frame
        return entry | {
            "pose": pose_to_spec(camera.X_PC),
            "size": [lens.width, lens.height],
            "intrinsics": {"fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy},
            "clipping": [clipping.near, clipping.far],
            "depth_range": [depths.min_depth, depths.max_depth],
            "images": sorted(output.value for output in camera.outputs),
            "rate": camera.rate,
            "renderer": camera.camera.core.renderer_name,
        }

    def _filters(self) -> list[dict[str, Any]]:
        """Return each geometry with those after it that it is not checked against."""
        ids = list(self.state.geometries)
        names = [self.inspector.get_path(each) for each in ids]
        partners: dict[int, list[str]] = {}
        for i, j in self.state.filters.excluded_rows(ids).tolist():
            partners.setdefault(i, []).append(names[j])
        return [{"between": [[names[i]], others]} for i, others in partners.items()]


def _groups(properties: Any) -> dict[str, dict[str, Any]]:
    return {
        group: dict(properties.get_properties_in_group(group))
        for group in sorted(properties.get_group_names())
    }

"""Scene files into an edit of the world; files and packages are found with the node's rules."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, package_folder, Reach, read_limited
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.node.world.handles import Claim, Handle, new_token, token_of_file
from scene_graph_ros.node.world.robot_motion import RobotMotion
from scene_graph_ros.node.world.scene import Edit, SourceRecord
from scene_graph_ros.node.world.source_topics import TF
from scene_graph_ros.scene_files.packages import Packages, resolve_resource, SCENE_ENDINGS

if TYPE_CHECKING:
    from scene_graph_ros.scene_files.loaded_scene import LoadedScene

__all__ = ["SceneLoader", "folders_of", "loader_of"]


def folders_of(named: str, scene: Path | None, regions: str) -> tuple[Path, ...]:
    """Return the folders below which requests may name files, beside those of packages.

    ``named`` are some, separated by colons; with them come the package or the folder of the
    ``scene`` that the node starts with, and the folder for ``regions``.
    """
    folders = [Path(part) for part in (*named.split(":"), regions) if part]
    return tuple(folders if scene is None else [*folders, package_folder(scene)])


@dataclass(frozen=True)
class Described:
    """A robot as a text describes it, in an edit that may count."""

    loaded: LoadedScene
    description: Any
    edit: Edit

    @property
    def warnings(self) -> tuple[str, ...]:
        """Oddities of the text."""
        return self.loaded.warnings

    def count(self) -> None:
        """Take note that the edit counts."""
        self.description.applied(self.loaded)

    def poses(self) -> dict[int, list[float]]:
        """Return the poses of frames that depend on when the edit was made, row by row."""
        rehung = self.edit.rehung
        return {int(f): self.edit.initial_poses[f].ravel().tolist() for f in rehung}


class SceneLoader:
    """Loads scene files and resolves the addresses of meshes."""

    def __init__(
        self,
        package_paths: str,
        check_pose_type: Callable[[str], Any],
        effect_names: Collection[str],
        texts: Mapping[Path, str] | None = None,
        folders: tuple[Path, ...] | None = None,
    ) -> None:
        """``package_paths`` are folders separated by colons.

        ``effect_names`` are the effects that a scene may switch off; ``texts`` has the texts of
        files that are not to be read, by path: then no file with a token is read or made either.
        Requests name files below ``folders``, and those that packages share; None: anywhere.
        """
        self._texts = {} if texts is None else texts
        self._reads_tokens = texts is None
        self._folders = tuple(Path(part) for part in package_paths.split(":") if part)
        self._packages = Packages.of(package_dirs=self._folders)
        if folders is None:
            self._reach = Reach()
        else:
            self._reach = Reach((*self._packages.folders(), *folders))
        self._check_pose_type = check_pose_type
        self._effect_names = effect_names

    def resolve(self, resource: str) -> Path:
        """Return the file of a request behind a path, ``file://`` or ``package://`` address."""
        return resolve_resource(resource, packages=replace(self._packages, reach=self._reach))

    def requested_text(self, resource: str) -> tuple[str, str]:
        """Return as ``text`` does, if a request may name the file."""
        return self.text(resource, self._reach)

    def text(self, resource: str, reach: Reach | None = None) -> tuple[str, str]:
        """Return the path and the text of a YAML file, both empty where ``resource`` is."""
        if not resource:
            return "", ""
        packages = replace(self._packages, reach=reach or Reach())
        path = resolve_resource(resource, packages=packages, endings=SCENE_ENDINGS).absolute()
        try:
            return str(path), read_limited(path, MAX_TEXT_BYTES).decode(errors="replace")
        except OSError as error:
            raise SceneFileError(f"{path}: cannot be read: {error.strerror}") from error

    def load_request(self, edit: Edit, request: Any) -> list[SourceRecord]:
        """Add the scene that a LoadScene request names or contains; it switches no effect off.

        Nor does it have the node connect to a server: a client could have it ask anyone; or read
        and write files with tokens.
        """
        loaded = self._load(
            edit, request.resource, request.text, request.prefix, reach=self._reach
        )
        off = [name for name, switch in loaded.effects.items() if switch == "off"]
        if off:
            raise MessageError(
                f"effects: {', '.join(off)}: off for everybody can be said by the scene alone "
                "that the node starts with, its parameter 'scene'"
            )
        if loaded.servers:
            raise MessageError(
                f"renderers: {', '.join(loaded.servers)}: the node asks a render server only where"
                " the scene says so that it starts with, its parameter 'scene'"
            )
        for source in loaded.sources.values():
            if source.token_file is not None or source.is_claimable:
                key = "claim" if source.is_claimable else "token_file"
                raise MessageError(
                    f"source {quoted(source.name)}: {key} can be said by the scene alone that the"
                    " node starts with, its parameter 'scene'; who loads a scene gets its handles"
                )
        return [self._record(edit, source) for source in loaded.sources.values()]

    def load(self, edit: Edit, resource: str) -> list[SourceRecord]:
        """Add the scene that the node starts with, and return its sources.

        Raises SceneFileError; MessageError for effects and types of poses that there are not.
        """
        loaded = self._load(edit, resource)
        edit.effects_off.update(name for name, how in loaded.effects.items() if how == "off")
        return [
            self._record(edit, source, self._first_handle(source))
            for source in loaded.sources.values()
        ]

    def _first_handle(self, source: Any) -> Handle:
        """Return the handle of a source of the scene that the node starts with."""
        if source.token_file is not None and self._reads_tokens:
            return Handle(token_of_file(source.token_file, source.token_file_folder))
        return Handle(new_token(), Claim.OPEN if source.is_claimable else Claim.CLOSED)

    def describe(self, edit: Edit, name: str, text: str) -> Described:
        """Replace a robot of the scene by the one of a URDF's text.

        Its source stays, and so do positions of joints that it had before. Raises
        SceneFileError, and the scene graph's errors; UnknownIdError where it is gone.
        """
        # What attaches frames is imported by those who do.
        from scene_graph_ros.node.world.attaching import let_go_of

        old = edit.records.get(name)
        if old is None or old.description is None:
            raise UnknownIdError(f"no source {quoted(name)} waits for a description")
        if old.robot is not None:
            let_go_of(edit, old)
        handle = edit.handles[name]
        edit.remove_source(old)
        loaded = old.description.apply(edit.scene_graph, text)
        edit.add_cameras(loaded.cameras)
        (source,) = loaded.sources.values()
        record = self._record(edit, source, handle, old)
        assert record.motion is not None
        return Described(loaded, old.description, edit)

    def _load(
        self,
        edit: Edit,
        resource: str,
        text: str = "",
        prefix: str = "",
        reach: Reach | None = None,
    ) -> LoadedScene:
        # Reading files needs pydantic and the XML readers: only where a scene is loaded.
        from scene_graph_ros.scene_files import load_scene, load_scene_text

        path = Path(resource)
        if resource and path in self._texts:
            scene = load_scene_text(
                self._texts[path], label=resource, base=path, package_dirs=self._folders
            )
        elif resource:
            scene = load_scene(resource, package_dirs=self._folders, reach=reach)
        else:
            scene = load_scene_text(text, package_dirs=self._folders, reach=reach)
        loaded = scene.apply(edit.scene_graph, prefix=prefix)
        edit.add_cameras(loaded.cameras)
        for name in loaded.effects:
            if name not in self._effect_names:
                known = ", ".join(self._effect_names)
                raise MessageError(f"effects: {quoted(name)} is none of {known}")
        return loaded

    def _record(
        self,
        edit: Edit,
        source: Any,
        handle: Handle | None = None,
        old: SourceRecord | None = None,
    ) -> SourceRecord:
        """Put a source on record, with a handle or a new one; ``old`` is its former record."""
        if source.pose_type:
            self._check_pose_type(source.pose_type)
        robot, motion = source.robot, None
        if robot is not None:
            if robot.moving_base is not None:
                self._check_pose_type(robot.moving_base.type or TF)
            motion = RobotMotion(robot, has_moving_base=robot.has_moving_base)
            if old is not None and old.motion is not None:
                motion.take_over(old.motion)
        record = SourceRecord(
            source.source_id,
            source.name,
            source.pose_type,
            source.pose_topic,
            source.robot,
            source.configuration_topic,
            source.points_topic,
            source.cloud,
            source.interpolates if robot is None else _interpolates(robot),
            motion,
            source.description,
            source.sensor,
            source.voxels,
        )
        edit.records[record.name] = record
        edit.handles[record.name] = Handle(new_token()) if handle is None else handle
        edit.initial_poses.update(source.initial_poses)
        if source.robot is not None:
            edit.initial_poses.update(source.robot.frame_poses())
        return record


def _interpolates(robot: Any) -> bool:
    """Tell whether transforms that move a robot's base are composed at one time."""
    return robot.moving_base is None or robot.moving_base.interpolates


def loader_of(
    parameter: Callable[[str], Any],
    check_pose_type: Callable[[str], Any],
    effect_names: Collection[str],
) -> SceneLoader:
    """Return a node's loader, with the folders below which requests may name files.

    Raises SceneFileError where there is no such scene as the node starts with.
    """
    paths, scene = parameter("package_paths"), parameter("scene")
    path = SceneLoader(paths, check_pose_type, effect_names).resolve(scene) if scene else None
    folders = folders_of(parameter("resource_folders"), path, parameter("regions_folder"))
    return SceneLoader(paths, check_pose_type, effect_names, folders=folders)

"""A version of the scene, made ready while the one before it still counts. No rclpy here.

`Edit` is a change in the making, on a copy of the model; `Scene` is its result: the model with its
sources, frames and names. Both are made without the world's lock. Only the poses, which
go on meanwhile, are brought over with the lock held.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

import numpy as np

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import NameConflictError, OwnershipError, UnknownIdError
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.model.renderers import Renderer
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.node.runtime.names import DEFAULT_POSE_TYPE
from scene_graph_ros.node.world.deformables import deformables_by_source, SourceDeformables
from scene_graph_ros.node.world.fields import fields_by_source
from scene_graph_ros.node.world.grids import grids_by_source
from scene_graph_ros.node.world.handles import Handle
from scene_graph_ros.node.world.intake import SourceFrames
from scene_graph_ros.node.world.padded_sides import PaddedSide
from scene_graph_ros.node.world.scene_frames import bring_poses, frames_of
from scene_graph_ros.node.world.scene_robots import SceneRobots
from scene_graph_ros.node.world.scene_sensors import connect_sensors, sensed_by_source
from scene_graph_ros.node.world.source_topics import depth_settings, filled_source, fills_voxels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
    from scene_graph_ros.geometry.model.snapshot import Snapshot
    from scene_graph_ros.geometry.perception import CameraDescription
    from scene_graph_ros.node.world.pose_history import PoseHistory
    from scene_graph_ros.node.world.robot_motion import RobotMotion
    from scene_graph_ros.scene_files import sensor_settings as its

__all__ = ["Attachment", "Edit", "Scene", "SourceRecord", "records_of"]


@dataclass(frozen=True)
class SourceRecord:
    """A source beside the model: the origin of its poses.

    ``pose_type`` "" means that no poses are read. ``robot`` computes link poses for JointState,
    ``motion`` has when its joints were heard. ``interpolates``: TF is composed at one time.
    ``cloud`` names the geometry whose points it sends, "" for its only one.
    ``description`` is the origin of a robot's description, None where a file has it; ``sensor``
    has the settings of its images of depth or clouds, None where no file has some; so has
    ``voxels`` those of its maps.
    """

    id: Any
    name: str
    pose_type: str = DEFAULT_POSE_TYPE
    pose_topic: str = ""
    robot: Any = None
    configuration_topic: str = ""
    points_topic: str = ""
    cloud: str = ""
    interpolates: bool = True
    motion: RobotMotion | None = None
    description: Any = None
    sensor: its.SensorSettings | None = None
    voxels: its.VoxelSettings | None = None

    @property
    def depth(self) -> its.DepthSettings | None:
        """The settings of its images of depth, None where it sends none."""
        return depth_settings(self)

    @property
    def filled(self) -> str:
        """The name of the source whose cloud or voxel grid its sensor fills."""
        return filled_source(self)

    @property
    def fills_voxels(self) -> bool:
        """Whether its sensor fills its voxel grid in place of a cloud."""
        return fills_voxels(self)


@dataclass(frozen=True)
class Attachment:
    """A frame that a robot's link carries.

    ``parent`` is its former and later parent; ``pairs`` are filtered as long as it is
    carried.
    """

    link: str
    parent: FrameId
    pairs: tuple[tuple[GeometryId, GeometryId], ...]


@dataclass
class Edit:
    """A change of the model in the making, on a copy: it counts when it ends without error."""

    scene_graph: SceneGraph
    records: dict[str, SourceRecord]
    handles: dict[str, Handle] = field(default_factory=dict)
    """Of all sources, by name."""
    filter_owners: dict[int, str] = field(default_factory=dict)
    effects_off: set[str] = field(default_factory=set)
    initial_poses: dict[Any, np.ndarray] = field(default_factory=dict)
    cameras: dict[str, CameraDescription] = field(default_factory=dict)
    has_changes: bool = True
    names_before: SceneNames | None = None
    attachments: dict[FrameId, Attachment] = field(default_factory=dict)
    paddings: dict[tuple[PaddedSide, PaddedSide], float] = field(default_factory=dict)
    """Metres, of single pairs."""
    rehung: set[FrameId] = field(default_factory=set)
    """Frames whose poses are in another parent from now on: they begin at their initial ones."""
    moment: Snapshot | None = None
    """Where all is while the edit is made."""
    positions: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    """Configurations of the robots at that moment, by the names of their sources."""
    bases: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    """Poses ``(4, 4)`` of their root links."""
    brought_renderers: set[str] = field(default_factory=set)
    """Names of the renderers that requests brought along: they go with their last camera."""

    def names(self) -> SceneNames:
        """Return the names of the model as it is now: ask again after a change."""
        return SceneNames(self.scene_graph.model_inspector(), self.names_before)

    def deforming(self) -> frozenset[str]:
        """Return the names of the sources that have deformable geometry."""
        inspector = self.scene_graph.model_inspector()
        return self._owners(inspector.get_all_deformable_geometry_ids())

    def sensing(self) -> frozenset[str]:
        """Return the names of the sources whose clouds or voxel grids sensors fill."""
        own = self._owners(self.scene_graph.model_inspector().get_all_cloud_ids())
        filled = frozenset(name for name, each in self.records.items() if each.fills_voxels)
        return (own - filled) | (self._with_grids() & filled)

    def with_fields(self) -> frozenset[str]:
        """Return the names of the sources that have height fields."""
        return self._owners(self.scene_graph.model_inspector().get_all_height_field_ids())

    def with_grids(self) -> frozenset[str]:
        """Return the names of the sources that have voxel grids which maps fill."""
        own = self._with_grids()
        return frozenset(name for name in own if not self.records[name].fills_voxels)

    def _with_grids(self) -> frozenset[str]:
        return self._owners(self.scene_graph.model_inspector().get_all_voxel_grid_ids())

    def _owners(self, geometries: Iterable[GeometryId]) -> frozenset[str]:
        inspector = self.scene_graph.model_inspector()
        owners = {inspector.get_owning_source_id(geometry_id) for geometry_id in geometries}
        return frozenset(name for name, record in self.records.items() if record.id in owners)

    def owner(self, name: str, token: int) -> SourceRecord:
        """Return the source ``name`` after checking the token.

        Raises UnknownIdError where there is no such source, OwnershipError for a wrong token.
        """
        record = self.records.get(name)
        if record is None:
            raise UnknownIdError(f"no source is called {quoted(name)}")
        if self.handles[name].token != token:
            raise OwnershipError(f"the token does not belong to source {quoted(name)}")
        return record

    def add_cameras(self, cameras: Mapping[str, CameraDescription]) -> None:
        """Add cameras by name; raises NameConflictError for a name that is taken."""
        for name in cameras:
            if name in self.cameras:
                raise NameConflictError(f"there is a camera named {name!r} already")
        self.cameras.update(cameras)

    def remove_cameras(self, record: SourceRecord, names: Iterable[str]) -> None:
        """Remove cameras of a source.

        Raises UnknownIdError for one that is not there, OwnershipError for another source's.
        """
        wanted = dict.fromkeys(names)
        for name in wanted:
            camera = self.cameras.get(name)
            if camera is None:
                raise UnknownIdError(f"there is no camera {quoted(name)}")
            if camera.source != record.name:
                raise OwnershipError(
                    f"camera {quoted(name)} is of source {quoted(camera.source)}, not of"
                    f" {quoted(record.name)}"
                )
        for name in wanted:
            del self.cameras[name]
        self.drop_unused_renderers()

    def bring_renderer(self, name: str, engine: Renderer) -> None:
        """Add a renderer for cameras of a request, unless there is one of that name and kind.

        Raises NameConflictError where it is another, and the errors of ``add_renderer``.
        """
        if not self.scene_graph.has_renderer(name):
            self.scene_graph.add_renderer(name, engine)
            self.brought_renderers.add(name)
        elif self.scene_graph.renderer_parameter_yaml(name) != engine.parameter_yaml():
            raise NameConflictError(f"there is another renderer named {quoted(name)} already")

    def drop_unused_renderers(self) -> None:
        """Remove renderers that requests brought along and no camera has any more."""
        used = {each.camera.core.renderer_name for each in self.cameras.values()}
        for name in self.brought_renderers - used:
            self.scene_graph.remove_renderer(name)
        self.brought_renderers &= used

    def remove_source(self, record: SourceRecord) -> None:
        """Remove a source with all that it registered, and its cameras."""
        self.scene_graph.remove_source(record.id)
        del self.records[record.name], self.handles[record.name]
        for name in [n for n, each in self.cameras.items() if each.source == record.name]:
            del self.cameras[name]
        self.drop_unused_renderers()

    def add_source(self, name: str, *, token: int, **values: Any) -> SourceRecord:
        """Register a source in the model and on record; raises NameConflictError if taken.

        Raises InvalidNameError for a text that can't be a source's name.
        """
        # The core would choose a name where there is none.
        canonical = canonical_name("source", name)
        source_id = self.scene_graph.register_source(canonical)
        record = SourceRecord(source_id, canonical, **values)
        self.records[canonical], self.handles[canonical] = record, Handle(token)
        return record


class Scene:
    """The model between two edits; only its poses change.

    Frames of a source that an edit leaves as they are, are the same object before and after it.
    """

    def __init__(self, edit: Edit, before: Scene | None, *, world_frame: str) -> None:
        """Make the result of ``edit`` ready; `take_poses` before it is used."""
        self.scene_graph, self.records = edit.scene_graph, edit.records
        self.handles: Mapping[str, Handle] = edit.handles
        self.filter_owners, self.effects_off = edit.filter_owners, frozenset(edit.effects_off)
        self.cameras: Mapping[str, CameraDescription] = dict(edit.cameras)
        self._brought_renderers = frozenset(edit.brought_renderers)
        self._rehung = frozenset(edit.rehung)
        self.version: int = 0 if before is None else before.version + 1
        inspector = self.scene_graph.model_inspector()
        self.context: Context = self.scene_graph.create_default_context()
        there = set(inspector.get_all_frame_ids())
        self.attachments = {f: a for f, a in edit.attachments.items() if f in there}
        sides = {None, *there, *inspector.get_all_geometry_ids()}
        self.paddings = {p: value for p, value in edit.paddings.items() if sides.issuperset(p)}
        between_steps()
        self.names = SceneNames(self.context.snapshot.inspector, edit.names_before)
        between_steps()
        known = {} if before is None else before.frames
        self.frames: dict[str, SourceFrames] = {}
        for name, record in self.records.items():
            own = tuple(sorted(inspector.frames_for_source(record.id)))
            frames = frames_of(
                *(name, own, inspector, edit.initial_poses, known.get(name), world_frame),
                is_rehung=not edit.rehung.isdisjoint(own),
            )
            frames.attached = frozenset(f for f in frames.ids if f in self.attachments)
            self.frames[name] = frames
        self._owners: dict[str, str] = {}
        for name, frames in self.frames.items():
            self._owners.update(dict.fromkeys(frames.names, name))
        ids = {name: record.id for name, record in self.records.items()}
        self.deformables = deformables_by_source(inspector, ids)
        self.clouds = sensed_by_source(self.records, self.names, inspector, world_frame)
        self.fields = fields_by_source(inspector, ids)
        of_maps = {name: each for name, each in self.records.items() if not each.fills_voxels}
        self.grids = grids_by_source(inspector, of_maps, self.names)
        elements = {
            *inspector.get_all_cloud_ids(),
            *inspector.get_all_height_field_ids(),
            *inspector.get_all_voxel_grid_ids(),
        }
        self.has_elements = not elements.isdisjoint(
            inspector.get_all_geometry_ids(Role.PROXIMITY) if elements else ()
        )
        """Whether there are clouds, height fields or voxel grids to measure."""
        self.history: PoseHistory | None = connect_sensors(
            *(self.clouds, self.records, self.names, self.context.snapshot.inspector),
            *(self.cameras, self.frames, None if before is None else before.history),
        )
        """Where all was in the last seconds, of a scene that sensors fill."""
        robots = {n: record.robot for n, record in self.records.items() if record.robot}
        self.robots = SceneRobots(robots, self.scene_graph, self.context, self.paddings)

    def note_poses(self, source: str | None = None) -> None:
        """Remember where all is now, or what is one source's, where a scene has clouds."""
        if self.history is None:
            return
        if source is not None:
            motions = {source: self.records[source].motion}
            self.history.note_some({source: self.frames[source]}, motions)
            return
        motions = {name: record.motion for name, record in self.records.items()}
        self.history.note(self.frames, motions)

    def begin_edit(
        self,
        moment: Snapshot,
        positions: Mapping[str, NDArray[np.float64]],
        bases: Mapping[str, NDArray[np.float64]],
    ) -> Edit:
        """Return a change that has changed nothing yet, of this scene at a moment; see `Edit`."""
        return Edit(
            self.scene_graph.clone(),
            dict(self.records),
            dict(self.handles),
            dict(self.filter_owners),
            set(self.effects_off),
            cameras=dict(self.cameras),
            names_before=self.names,
            attachments=dict(self.attachments),
            paddings=dict(self.paddings),
            moment=moment,
            positions=positions,
            bases=bases,
            brought_renderers=set(self._brought_renderers),
        )

    def take_poses(self, before: Scene | None) -> None:
        """Put all frames, vertices and points where they are in the scene before, by now."""
        for name, frames in self.frames.items():
            old = None if before is None else before.frames.get(name)
            if old is not None and old is not frames:
                bring_poses(old, frames, self._rehung)
                motion = self.records[name].motion
                if motion is not None:
                    motion.write(motion.kinematics.link_poses()[1], (), frames)
            if frames.names:
                self.context.set_frame_poses(self.records[name].id, frames.X_PF)
        for name, deformables in self.deformables.items():
            if before is not None and name in before.deformables:
                deformables.take_over(before.deformables[name])
            self.deform(name)
        for kind in ("clouds", "fields", "grids"):
            known: Mapping[str, Any] = {} if before is None else getattr(before, kind)
            for name, sensed in getattr(self, kind).items():
                if before is not None and name in known:
                    sensed.take_over(known[name], before.context, self.context)

    def begin(self) -> None:
        """Tell the frames, which the scene before may share, whose all others are from now on."""
        for frames in self.frames.values():
            frames.foreign = self._owners
        self.note_poses()

    def set_accuracy(self, accuracy: str) -> bool:
        """Answer at this tier; tell whether that is another than before."""
        if self.scene_graph.accuracy == accuracy:
            return False
        self.scene_graph.set_accuracy(accuracy)
        self.scene_graph.set_accuracy(accuracy, context=self.context)
        return True

    def deform(self, source: str) -> None:
        """Bring configurations of a source that are new into the context."""
        deformables: SourceDeformables = self.deformables[source]
        fresh = {g: deformables.positions[g] for g in deformables.fresh}
        self.context.set_configurations(self.records[source].id, fresh)
        deformables.fresh.clear()

    def sense(self, source: str) -> None:
        """Bring points, heights and voxels of a source that are new into the context."""
        for kind in (self.clouds, self.fields, self.grids):
            if source in kind:
                kind[source].bring(self.context)


def records_of(scene_graph: SceneGraph) -> dict[str, SourceRecord]:
    """Return the sources of a scene graph by name, without the world's own."""
    inspector = scene_graph.model_inspector()
    records = {}
    own = inspector.get_owning_source_id(inspector.world_frame_id())
    for source_id in inspector.get_all_source_ids():
        if source_id != own:
            name = inspector.get_name(source_id)
            records[name] = SourceRecord(source_id, name)
    return records

"""The world: one writer, many readers.

`World` owns the scene graph and the poses of all sources. Poses change under its lock and end
with a new immutable `WorldSnapshot`; whoever answers or publishes reads a snapshot and holds no
lock. A change of the model is made on a copy, without the lock, and swapped in as a whole: a
refused change leaves no trace, and one that takes long holds up nobody. No rclpy here.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
import threading
from typing import Any, TYPE_CHECKING, TypeVar

import numpy as np

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.spatial.record_kernels import latest
from scene_graph_ros.geometry.steps import between_steps, calling_between_steps
from scene_graph_ros.node.runtime.precedence import Precedence
from scene_graph_ros.node.world.deformables import SourceDeformables
from scene_graph_ros.node.world.fields import SourceFields
from scene_graph_ros.node.world.grids import SourceGrids
from scene_graph_ros.node.world.half_spaces import check_half_spaces
from scene_graph_ros.node.world.handles import Handle, new_token
from scene_graph_ros.node.world.intake import SourceFrames, UNSTAMPED
from scene_graph_ros.node.world.scene import Edit, records_of, Scene, SourceRecord
from scene_graph_ros.node.world.scene_robots import SceneRobots
from scene_graph_ros.node.world.sensed import SensedGeometry
from scene_graph_ros.node.world.source_stamps import SeenImage, SourceStamps, STATIC
from scene_graph_ros.node.world.voxel_limits import check_voxels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scene_graph_ros.geometry.perception import CameraDescription

__all__ = ["World", "WorldSnapshot"]

T = TypeVar("T")


@dataclass(frozen=True)
class WorldSnapshot:
    """The world at one time. Nothing in it changes any more.

    ``records`` are its sources by name, ``deforming`` the names of those with deformable geometry,
    ``sensing`` of those with clouds or grids that sensors fill, ``with_fields`` of those with
    height fields, ``with_grids`` of those with grids that maps fill, ``cameras`` the cameras by
    name, also those whose frame is gone.
    ``stamp`` is the newest stamp among its poses, ``stamps`` has those of each source's frames;
    nanoseconds of the node's clock, STATIC for those that never get old. ``arrival`` is when the
    oldest message that this update applied arrived, nanoseconds of the steady clock; None where
    no message led to it.
    ``robots`` are those of its scene, ``positions`` of each the joints' positions, by name of the
    source, in the order of its ``kinematics.position_names``, ``bases`` where its root link is.
    """

    query: QueryObject
    names: SceneNames
    records: Mapping[str, SourceRecord]
    deforming: frozenset[str]
    scene_version: int
    sequence: int
    stamp: int
    stamps: Mapping[str, SourceStamps]
    robots: SceneRobots
    positions: Mapping[str, NDArray[np.float64]]
    bases: Mapping[str, NDArray[np.float64]]
    arrival: int | None = None
    cameras: Mapping[str, CameraDescription] = field(default_factory=dict)
    sensing: frozenset[str] = frozenset()
    with_fields: frozenset[str] = frozenset()
    with_grids: frozenset[str] = frozenset()
    has_elements: bool = False
    """Whether there are clouds, height fields or voxel grids to measure."""
    images: Mapping[str, SeenImage] = field(default_factory=dict)
    """The newest message of each sensor by source, of those that sent one."""
    _turns: dict[Hashable, threading.Lock] = field(default_factory=dict, repr=False)

    def ask(self, question: Callable[..., T], *arguments: Hashable) -> T:
        """Return the answer of a method of ``QueryObject`` about this snapshot.

        A thread that asks the same as another waits for its answer, which the query remembers: to
        compute it twice side by side would take longer for both.
        """
        with self._turns.setdefault((question, arguments), threading.Lock()):
            return question(self.query, *arguments)

    def source_stamp(self, source: str) -> int:
        """Return the stamp of a source in nanoseconds; UNSTAMPED where it was not heard.

        A robot is as old as the oldest joint that moves one of its links; the frames of other
        sources move each for itself, and the newest counts.
        """
        stamps = self.stamps.get(source)
        return UNSTAMPED if stamps is None else stamps.stamp

    def joint_stamp(self, path: str) -> int | None:
        """Return the stamp of a robot's joint, ``robot/joint``; None where there is none."""
        source, _, joint = path.partition("/")
        stamps = self.stamps.get(source)
        return stamps.joint_stamps.get(joint) if stamps is not None and joint else None

    def frame_stamp(self, path: str) -> int:
        """Return the stamp of a frame, ``source/frame``: of the oldest that it depends on.

        Raises UnknownIdError or NameConflictError for its name.
        """
        frame_id, inspector = self.names.frame_id(path), self.inspector
        world, stamp = inspector.world_frame_id(), STATIC
        while frame_id != world:
            owner = inspector.get_name(inspector.get_owning_source_id(frame_id))
            stamp = min(stamp, self.stamps[owner].by_frame.get(frame_id, UNSTAMPED))
            frame_id = inspector.get_parent_frame(frame_id)
        return stamp

    @property
    def inspector(self) -> Any:
        """Introspect the model of this snapshot."""
        return self.query.inspector()


def _allow(edit: Edit, before: WorldSnapshot) -> None:
    """Find nothing wrong with an edit."""


class World:
    """Owner of the model and of all poses."""

    def __init__(
        self,
        scene_graph: SceneGraph | None = None,
        *,
        world_frame: str = "world",
        check: Callable[[Edit, WorldSnapshot], None] = _allow,
        precedence: Precedence | None = None,
    ) -> None:
        """``check`` raises for an edit that must not be made of the world of the snapshot.

        While ``precedence`` is held, the world is updated: edits stand back between their steps.
        Raises UnsupportedPairError for two half spaces of ``scene_graph`` that would be checked.
        """
        self.world_frame = world_frame
        self._check = check
        self._precedence = Precedence() if precedence is None else precedence
        self.lock = threading.RLock()
        self._editing = threading.RLock()
        self._sequence = 0
        self._watchers: tuple[Callable[[], None], ...] = ()
        self._watchers_lock = threading.Lock()
        graph = SceneGraph() if scene_graph is None else scene_graph
        check_half_spaces(graph.model_inspector())
        records = records_of(graph)
        handles = {name: Handle(new_token()) for name in records}
        self._scene = Scene(Edit(graph, records, handles), None, world_frame=world_frame)
        self._scene.take_poses(None)
        self._scene.begin()
        self._publish(None)

    @property
    def snapshot(self) -> WorldSnapshot:
        """The newest snapshot; safe from any thread, without waiting."""
        return self._snapshot

    @property
    def records(self) -> Mapping[str, SourceRecord]:
        """All sources by name; a new mapping after each edit."""
        return self._scene.records

    @property
    def handles(self) -> Mapping[str, Handle]:
        """Whose sources are, by name; a new mapping after each edit."""
        return self._scene.handles

    @property
    def effects_off(self) -> frozenset[str]:
        """The effects that scene files switched off."""
        return self._scene.effects_off

    def watch(self, told: Callable[[], None]) -> None:
        """Call ``told`` when there is a new snapshot, in the thread that made it.

        It is called with ``lock`` held, so it must not wait.
        """
        with self._watchers_lock:
            self._watchers = (*self._watchers, told)

    def unwatch(self, told: Callable[[], None]) -> None:
        """Call it no more."""
        with self._watchers_lock:
            self._watchers = tuple(each for each in self._watchers if each != told)

    def frames(self, source: str) -> SourceFrames:
        """Return the frames and newest poses of a source; hold ``lock`` to change them."""
        return self._scene.frames[source]

    @property
    def deformables(self) -> Mapping[str, SourceDeformables]:
        """Deformable geometry by source, of those that have some; ``lock`` to change them."""
        return self._scene.deformables

    @property
    def clouds(self) -> Mapping[str, SensedGeometry]:
        """Clouds, and grids that sensors fill, by source; ``lock`` to change them."""
        return self._scene.clouds

    @property
    def fields(self) -> Mapping[str, SourceFields]:
        """Height fields by source, of those that have some; ``lock`` to change them."""
        return self._scene.fields

    @property
    def grids(self) -> Mapping[str, SourceGrids]:
        """Voxel grids by source, of those that have some; ``lock`` to change them."""
        return self._scene.grids

    def edit(
        self,
        change: Callable[[Edit], T],
        prepare: Callable[[WorldSnapshot], object] = lambda snapshot: None,
        done: Callable[[T], object] = lambda result: None,
    ) -> tuple[T, WorldSnapshot]:
        """Change the model as a whole or, where ``change`` raises, not at all.

        One edit is made after another, and beside them poses go on: ``change`` and ``prepare``
        may take long. ``prepare`` gets the scene as it is going to be, before it counts; ``done``
        gets the result of ``change`` when it does, before poses go on.
        Returns the result of ``change`` and the snapshot that has the change in it. Raises
        UnsupportedPairError for two half spaces that would be checked, TooLargeError for too many
        voxels, and errors of ``check``.
        """
        with self._editing, calling_between_steps(self._precedence.stand_back):
            before = self._scene
            between_steps()
            now = self._snapshot
            edit = before.begin_edit(now.query.snapshot, now.positions, now.bases)
            result = change(edit)
            if not edit.has_changes:
                return result, self._snapshot
            between_steps()
            check_half_spaces(edit.scene_graph.model_inspector())
            check_voxels(edit.scene_graph.model_inspector())
            between_steps()
            self._check(edit, self._snapshot)
            between_steps()
            scene = Scene(edit, before, world_frame=self.world_frame)
            between_steps()
            with self.lock:
                scene.take_poses(before)
                preview = self._snapshot_of(scene, None)
            prepare(preview)
            between_steps()
            with self.lock:
                scene.take_poses(before)
                scene.set_accuracy(before.scene_graph.accuracy)
                scene.begin()
                self._scene = scene
                self._publish(None)
                done(result)
                return result, self._snapshot

    def commit(
        self,
        moved: Iterable[str],
        arrival: int | None,
        deformed: Iterable[str] = (),
        sensed: Iterable[str] = (),
    ) -> WorldSnapshot:
        """Take the poses that were written into the frames of ``moved`` sources into a snapshot.

        Likewise the configurations of ``deformed`` sources, and points, heights and voxels of
        ``sensed`` ones, in frames where these are by then. To be called with ``lock`` held,
        after `Intake.accept`.
        """
        with self.lock:
            scene = self._scene
            for source in moved:
                scene.context.set_frame_poses(scene.records[source].id, scene.frames[source].X_PF)
            for source in deformed:
                scene.deform(source)
            for source in sensed:
                scene.sense(source)
            self._publish(arrival)
            return self._snapshot

    def note_poses(self, source: str | None = None) -> None:
        """Remember where all is by now, or what is one source's; hold ``lock``.

        That is for messages of an earlier time.
        """
        self._scene.note_poses(source)

    def set_accuracy(self, accuracy: str) -> None:
        """Answer from now on at this tier; snapshots that are out keep theirs."""
        with self.lock:
            if self._scene.set_accuracy(accuracy):
                self._publish(None)

    def forget_stamps(self, after: int = UNSTAMPED) -> None:
        """Forget when poses were stamped that say later than ``after`` (ns); the poses hold.

        For clocks that jump back: else earlier poses would be out of order.
        """
        with self.lock:
            for name, frames in self._scene.frames.items():
                frames.stamps[frames.stamps > after] = UNSTAMPED
                motion = self._scene.records[name].motion
                if motion is not None:
                    motion.forget(after)
                    motion.write_stamps(frames)
            for deformables in self._scene.deformables.values():
                late = [g for g, stamp in deformables.stamps.items() if stamp > after]
                for geometry_id in late:
                    del deformables.stamps[geometry_id]
            for clouds in self._scene.clouds.values():
                clouds.forget(after)
            for fields in self._scene.fields.values():
                fields.forget(after)
            for grids in self._scene.grids.values():
                grids.forget(after)
            if self._scene.history is not None:
                self._scene.history.clear()
                self._scene.note_poses()
            self._publish(None)

    def _publish(self, arrival: int | None) -> None:
        self._sequence += 1
        self._snapshot = self._snapshot_of(self._scene, arrival)
        for told in self._watchers:
            told()

    def _snapshot_of(self, scene: Scene, arrival: int | None) -> WorldSnapshot:
        stamps = {name: _stamps_of(scene, name, frames) for name, frames in scene.frames.items()}
        return WorldSnapshot(
            query=QueryObject(scene.context.snapshot).bake(),
            names=scene.names,
            records=scene.records,
            deforming=frozenset(scene.deformables),
            sensing=frozenset(scene.clouds),
            with_fields=frozenset(scene.fields),
            with_grids=frozenset(scene.grids),
            has_elements=scene.has_elements,
            scene_version=scene.version,
            sequence=self._sequence,
            stamp=max([0, *(each.newest for each in stamps.values())]),
            stamps=stamps,
            robots=scene.robots,
            positions={n: r.kinematics.configuration for n, r in scene.robots.robots.items()},
            bases={n: r.kinematics.X_PB for n, r in scene.robots.robots.items()},
            arrival=arrival,
            cameras=scene.cameras,
            images=_images_of(scene),
        )


def _images_of(scene: Scene) -> dict[str, SeenImage]:
    return {
        name: SeenImage(state.stamp, *state.newest)
        for clouds in scene.clouds.values()
        for name, state in clouds.sensors.items()
        if state.newest is not None
    }


def _stamps_of(scene: Scene, name: str, frames: SourceFrames) -> SourceStamps:
    """Return the stamps of a source now."""
    stamps, is_static = frames.stamps.copy(), frames.is_static.copy()
    motion = scene.records[name].motion
    heard = [int(latest(stamps))]
    if motion is not None:
        heard.append(int(latest(motion.stamps)))
    deformables = scene.deformables.get(name)
    if deformables is not None:
        heard.append(deformables.stamp())
    clouds, fields = scene.clouds.get(name), scene.fields.get(name)
    grids = scene.grids.get(name)
    if clouds is not None:
        heard.append(clouds.stamp())
    heard.extend(each.stamp for each in (fields, grids) if each is not None)
    newest = stamp = max(heard)
    if motion is not None and len(stamps):
        stamp = int(np.where(is_static, STATIC, stamps).min())
    elif len(stamps) and is_static.all() and deformables is clouds is fields is grids is None:
        stamp = STATIC
    joints = {} if motion is None else motion.joint_stamps(STATIC)
    return SourceStamps(frames.ids, stamps, is_static, newest, stamp, joints)

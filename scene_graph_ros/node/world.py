"""The world: one writer, many readers.

`World` owns the scene graph and the poses of all sources. Changes happen under its lock and end
with a new immutable `WorldSnapshot`; whoever answers or publishes reads a snapshot and holds no
lock. A change of the model is made on a copy and swapped in as a whole, so a refused change
leaves no trace. No rclpy here.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
import secrets
import threading
from typing import Any, TypeVar

import numpy as np

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import NameConflictError, OwnershipError, UnknownIdError
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.spatial.record_kernels import latest
from scene_graph_ros.node.deformables import deformables_by_source, SourceDeformables
from scene_graph_ros.node.intake import SourceFrames, UNSTAMPED
from scene_graph_ros.node.names import DEFAULT_POSE_TYPE

__all__ = ["Edit", "SourceRecord", "World", "WorldSnapshot", "new_token"]

T = TypeVar("T")


def new_token() -> int:
    """Return a random non-zero token of 64 bits."""
    return secrets.randbits(64) or 1


@dataclass(frozen=True)
class SourceRecord:
    """What the node knows about a source beside the model: who may change it, where poses come.

    ``pose_type`` "" means that no poses are read. ``robot`` computes link poses for JointState.
    """

    id: Any
    name: str
    token: int
    pose_type: str = DEFAULT_POSE_TYPE
    pose_topic: str = ""
    robot: Any = None
    configuration_topic: str = ""


@dataclass(frozen=True)
class WorldSnapshot:
    """The world at one time. Nothing in it changes any more.

    ``stamp`` is the newest stamp among its poses, ``source_stamps`` that of each source;
    nanoseconds of the node's clock. ``arrival`` is when the oldest message that this update
    applied arrived, nanoseconds of the steady clock; None where no message led to it.
    """

    query: QueryObject
    names: SceneNames
    scene_version: int
    sequence: int
    stamp: int
    source_stamps: Mapping[str, int]
    arrival: int | None = None
    _turns: dict[Hashable, threading.Lock] = field(default_factory=dict, repr=False)

    def ask(self, question: Callable[..., T], *arguments: Hashable) -> T:
        """Return what a method of ``QueryObject`` answers about this snapshot.

        Whoever asks the same while a thread is at it waits for its answer, which the query
        remembers: to compute it twice side by side would take longer for both.
        """
        with self._turns.setdefault((question, arguments), threading.Lock()):
            return question(self.query, *arguments)

    @property
    def inspector(self) -> Any:
        """Introspect the model of this snapshot."""
        return self.query.inspector()


@dataclass
class Edit:
    """A change of the model in the making, on a copy: it counts when it ends without error."""

    scene_graph: SceneGraph
    records: dict[str, SourceRecord]
    filter_owners: dict[int, str] = field(default_factory=dict)
    effects_off: set[str] = field(default_factory=set)
    initial_poses: dict[Any, np.ndarray] = field(default_factory=dict)
    has_changes: bool = True

    def owner(self, name: str, token: int) -> SourceRecord:
        """Return the source ``name`` after checking the token.

        Raises UnknownIdError where there is no such source, OwnershipError for a wrong token.
        """
        record = self.records.get(name)
        if record is None:
            raise UnknownIdError(f"no source is called '{name}'")
        if record.token != token:
            raise OwnershipError(f"the token does not belong to source '{name}'")
        return record

    def add_source(self, name: str, **values: Any) -> SourceRecord:
        """Register a source in the model and on record; raises NameConflictError if taken."""
        if not name.strip():
            raise NameConflictError("the name of a source must not be empty")
        source_id = self.scene_graph.register_source(name)
        canonical = self.scene_graph.model_inspector().get_name(source_id)
        record = SourceRecord(source_id, canonical, **values)
        self.records[canonical] = record
        return record


class World:
    """Owner of the model and of all poses."""

    def __init__(self, scene_graph: SceneGraph | None = None, *, world_frame: str = "world"):
        self.world_frame = world_frame
        self.lock = threading.RLock()
        self._scene_graph = SceneGraph() if scene_graph is None else scene_graph
        self._filter_owners: dict[int, str] = {}
        self.effects_off: frozenset[str] = frozenset()
        self._version = 0
        self._sequence = 0
        self._records = self._records_of(self._scene_graph)
        self._frames: dict[str, SourceFrames] = {}
        self._deformables: dict[str, SourceDeformables] = {}
        self._rebuild({})

    @property
    def snapshot(self) -> WorldSnapshot:
        """The newest snapshot; safe from any thread, without waiting."""
        return self._snapshot

    @property
    def records(self) -> Mapping[str, SourceRecord]:
        """All sources by name; a new mapping after each edit."""
        return self._records

    def frames(self, source: str) -> SourceFrames:
        """Return the frames and newest poses of a source; hold ``lock`` to change them."""
        return self._frames[source]

    @property
    def deformables(self) -> Mapping[str, SourceDeformables]:
        """Deformable geometry by source, of those that have some; ``lock`` to change them."""
        return self._deformables

    def edit(self, change: Callable[[Edit], T]) -> tuple[T, WorldSnapshot]:
        """Change the model as a whole or, where ``change`` raises, not at all.

        Returns what ``change`` returned and the snapshot that has the change in it.
        """
        with self.lock:
            edit = Edit(
                self._scene_graph.clone(),
                dict(self._records),
                dict(self._filter_owners),
                set(self.effects_off),
            )
            result = change(edit)
            if not edit.has_changes:
                return result, self._snapshot
            self._scene_graph, self._records = edit.scene_graph, edit.records
            self._filter_owners = edit.filter_owners
            self.effects_off = frozenset(edit.effects_off)
            self._version += 1
            self._rebuild(edit.initial_poses)
            return result, self._snapshot

    def commit(
        self, moved: Iterable[str], arrival: int | None, deformed: Iterable[str] = ()
    ) -> WorldSnapshot:
        """Take the poses that were written into the frames of ``moved`` sources into a snapshot.

        Likewise the configurations of ``deformed`` sources. To be called with ``lock`` held,
        after `Intake.accept`.
        """
        with self.lock:
            for source in moved:
                frames = self._frames[source]
                self._context.set_frame_poses(self._records[source].id, frames.X_PF)
            for source in deformed:
                self._deform(self._context, source)
            self._publish(arrival)
            return self._snapshot

    def _deform(self, context: Any, source: str) -> None:
        deformables = self._deformables[source]
        fresh = {g: deformables.positions[g] for g in deformables.fresh}
        context.set_configurations(self._records[source].id, fresh)
        deformables.fresh.clear()

    def set_accuracy(self, accuracy: str) -> None:
        """Answer from now on at this tier; snapshots that are out keep theirs."""
        with self.lock:
            if self._scene_graph.accuracy != accuracy:
                self._scene_graph.set_accuracy(accuracy)
                self._scene_graph.set_accuracy(accuracy, context=self._context)
                self._publish(None)

    def forget_stamps(self) -> None:
        """Forget when poses were stamped, after the clock jumped back; the poses hold."""
        with self.lock:
            for frames in self._frames.values():
                frames.stamps[:] = UNSTAMPED
            for deformables in self._deformables.values():
                deformables.stamps.clear()
            self._publish(None)

    def _records_of(self, scene_graph: SceneGraph) -> dict[str, SourceRecord]:
        inspector = scene_graph.model_inspector()
        records = {}
        own = inspector.get_owning_source_id(inspector.world_frame_id())
        for source_id in inspector.get_all_source_ids():
            if source_id != own:
                name = inspector.get_name(source_id)
                records[name] = SourceRecord(source_id, name, new_token())
        return records

    def _rebuild(self, initial_poses: Mapping[Any, np.ndarray]) -> None:
        """Make a context of the changed model, in which all frames are where they were."""
        inspector = self._scene_graph.model_inspector()
        old = self._frames
        owners = {}
        self._frames = {}
        for name, record in self._records.items():
            frames = self._frames_of(record, inspector, initial_poses, old.get(name))
            self._frames[name] = frames
            owners.update(dict.fromkeys(frames.names, name))
        context = self._scene_graph.create_default_context()
        for name, frames in self._frames.items():
            frames.foreign = owners
            if frames.names:
                context.set_frame_poses(self._records[name].id, frames.X_PF)
        ids = {name: record.id for name, record in self._records.items()}
        self._deformables = deformables_by_source(inspector, ids, self._deformables)
        for name in self._deformables:
            self._deform(context, name)
        self._context = context
        self._names = SceneNames(context.snapshot.inspector)
        self._publish(None)

    def _frames_of(
        self,
        record: SourceRecord,
        inspector: Any,
        initial_poses: Mapping[Any, np.ndarray],
        old: SourceFrames | None,
    ) -> SourceFrames:
        ids = sorted(inspector.frames_for_source(record.id))
        names = tuple(inspector.get_name(frame_id) for frame_id in ids)
        X_PF = np.tile(np.eye(4), (len(ids), 1, 1))
        stamps = np.full(len(ids), UNSTAMPED, dtype=np.int64)
        for row, frame_id in enumerate(ids):
            before = None if old is None else old.row_of_id.get(frame_id)
            if old is not None and before is not None:
                X_PF[row], stamps[row] = old.X_PF[before], old.stamps[before]
            elif frame_id in initial_poses:
                X_PF[row] = initial_poses[frame_id]
        return SourceFrames(
            record.name, tuple(ids), names, self._parents(ids, inspector), X_PF, stamps
        )

    def _parents(self, ids: list[Any], inspector: Any) -> tuple[str, ...]:
        world = inspector.world_frame_id()
        parents = [inspector.get_parent_frame(frame_id) for frame_id in ids]
        return tuple(self.world_frame if p == world else inspector.get_name(p) for p in parents)

    def _publish(self, arrival: int | None) -> None:
        stamps = {name: int(latest(frames.stamps)) for name, frames in self._frames.items()}
        for name, deformables in self._deformables.items():
            stamps[name] = max(stamps[name], deformables.stamp())
        self._sequence += 1
        self._snapshot = WorldSnapshot(
            query=QueryObject(self._context.snapshot).bake(),
            names=self._names,
            scene_version=self._version,
            sequence=self._sequence,
            stamp=max([0, *stamps.values()]),
            source_stamps=stamps,
            arrival=arrival,
        )

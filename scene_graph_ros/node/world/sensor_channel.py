"""Messages of a sensor, images of depth or clouds: when they count, and where it was then.

A message is of a time that is past: it waits until all joints and frames that matter were heard
for then, and makes points where they were. That takes milliseconds, so it is looked at beside the
updates, and a later one takes the result; those that fill one geometry are looked at in turn.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
import enum
from functools import partial
from typing import Any, Generic, Protocol, TYPE_CHECKING, TypeVar

from scene_graph_ros.geometry.errors import NameConflictError, SceneGraphError, UnknownIdError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import compose
from scene_graph_ros.node.world.bounded_channel import BoundedChannel
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.pose_history import NotYetError, PastError
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.sensed import NotFilledError, SensedGeometry
from scene_graph_ros.node.world.sensor_state import SensorFrame, SensorState
from scene_graph_ros.node.world.sensor_worker import AtOnce, Worker
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.scene_files.sensor_settings import AS_THEY_ARE

if TYPE_CHECKING:
    from concurrent.futures import Future

    import numpy as np
    from numpy.typing import NDArray

    from scene_graph_ros.geometry.model.ids import GeometryId
    from scene_graph_ros.node.world.sensor_state import Looked
    from scene_graph_ros.sensing import CloudView, DepthRules, DepthView, SelfFilter

__all__ = ["PATIENCE", "RefusedError", "SensorChannel"]

PATIENCE = 500_000_000
"""Nanoseconds after its stamp until which a message waits for poses and its lens."""

_TOLERANT = 0.9
"""Of the time between two messages: stamps jitter."""


class RefusedError(SceneGraphError):
    """A message with a fault of its own kind."""

    def __init__(self, fault: Fault, detail: str) -> None:
        super().__init__(detail)
        self.fault = fault


class Reading(Protocol):
    """A message that was read."""

    @property
    def frame_id(self) -> str:
        """The sensor's frame, "" where the message names none."""

    @property
    def stamp_ns(self) -> int:
        """When it was taken, 0 for an unknown time."""


R = TypeVar("R", bound=Reading)


class _Verdict(enum.Enum):
    """What became of a message."""

    BEGUN = enum.auto()
    WAITS = enum.auto()
    DROPPED = enum.auto()


@dataclass(eq=False, slots=True)
class _Read(Kept):
    """A message that was read, and waits."""

    reading: Any
    stamp: int


@dataclass(frozen=True, eq=False)
class _Look:
    """A message that is looked at; the geometry that it fills, and where that was then."""

    kept: _Read
    filled: SensedGeometry
    state: SensorState
    geometry: GeometryId
    X_WG: NDArray[np.float64]
    result: Future[Looked]


class SensorChannel(BoundedChannel[SensedGeometry], Generic[R]):
    """The messages of one source. Between two updates the newest counts whose poses are there."""

    queued = 4

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, most_points: int) -> None:
        """Keep ``most_points`` at most."""
        super().__init__(record, intake, kind)
        self._worker: Worker = AtOnce()
        self._look: _Look | None = None
        self._again: Kept | None = None
        self.has_news = False
        """Whether the last update began or ended a look at a message."""
        self._settings = record.sensor or AS_THEY_ARE
        self._most_points = most_points

    def look_in(self, worker: Worker) -> None:
        """Have messages looked at somewhere else than in the update."""
        self._worker = worker

    @abstractmethod
    def _read_message(self, data: bytes) -> R:
        """Read a message. Raises RefusedError, and MessageError."""

    @abstractmethod
    def _lack(self, reading: R, state: SensorState) -> tuple[Fault, str] | None:
        """Return the lack for which a message does not count yet. Raises RefusedError."""

    @abstractmethod
    def _view(
        self,
        reading: R,
        state: SensorState,
        X_WS: NDArray[np.float64],
        rules: DepthRules,
        own: SelfFilter,
    ) -> DepthView | CloudView:
        """Return a message as it is seen from a pose."""

    def _said(self, reading: R) -> dict[str, int]:
        """Return counts for diagnostics, beside that of the points."""
        return {}

    def _make_room(self) -> None:
        # The oldest is the one whose poses come first: were it dropped, none might ever count.
        self._kept.pop()

    def has_result(self) -> bool:
        """Tell whether the look at a message is over."""
        return self._look is not None and self._look.result.done()

    def apply(self, kept: list[Kept], target: SensedGeometry, limits: TimeLimits) -> int | None:
        """Apply the message that was looked at; return when it arrived, or None.

        Then the newest of a time that is known is looked at. Newer ones wait, older ones are
        superseded; all wait while a message for the same geometry is looked at.
        """
        self.has_news = False
        arrival, waiting = self._finish(target), list[Kept]()
        if self._look is None and self._again is not None:
            kept, self._again = [self._again, *kept], None
        if target.look is not None:
            waiting = kept
        else:
            for older, one in zip(range(len(kept) - 1, -1, -1), reversed(kept), strict=True):
                verdict, waits = self._try(one, target, limits)
                if waits is not None:
                    waiting.insert(0, waits)
                if verdict is _Verdict.BEGUN:
                    self.intake.statistics.superseded += older
                    self.has_news = True
                    break
        if self._worker.is_at_once and arrival is None:
            arrival = self._finish(target)
        with self._lock:
            self._kept.extendleft(reversed(waiting))
        return arrival

    def _finish(self, filled: SensedGeometry) -> int | None:
        """Take the result of a look, if it has come; return when its message arrived."""
        look = self._look
        if look is None or not look.result.done():
            return None
        self._look, self.has_news = None, True
        if filled is not look.filled:
            self._again = look.kept  # The scene is another: so may be what the message shows.
            return None
        if filled.look is not look:
            self.intake.statistics.superseded += 1
            return None
        filled.look = None
        try:
            looked = look.result.result()
        except SceneGraphError as error:
            self.intake.fault(Fault.MALFORMED, "", str(error))
            return None
        look.state.take(looked)
        filled.take(looked, look.geometry, look.X_WG)
        told = filled.told(looked, self._message)
        self._tell(told, look.kept.reading, looked)
        return look.kept.arrival

    def _tell(self, told: dict[str, int], reading: Any, looked: Looked) -> None:
        """Have diagnostics tell what a message brought."""
        let_go = getattr(looked.counts, "let_go", 0)
        if let_go:
            self.intake.fault(
                Fault.TOO_LARGE,
                "",
                f"more points were seen than max_points_per_cloud, {self._most_points}: the oldest"
                f" {let_go} are let go",
            )
        self.newest = {**told, **self._said(reading)}
        self.intake.count(len(looked.new.radii))

    def _apply_one(self, kept: Kept, target: SensedGeometry, limits: TimeLimits) -> int:
        return int(self._try(kept, target, limits)[0] is _Verdict.BEGUN)

    def _try(
        self, kept: Kept, filled: SensedGeometry, limits: TimeLimits
    ) -> tuple[_Verdict, Kept | None]:
        """Apply a message, or return it to wait."""
        name = ""
        try:
            if not isinstance(kept, _Read):
                reading = self._read_message(kept.data)
                # One without a stamp is of now, as other messages are.
                stamp = reading.stamp_ns or limits.now
                kept = _Read(b"", kept.arrival, kept.is_static, reading, stamp)
            name = kept.reading.frame_id
            used = limits.of_static() if kept.is_static else limits
            verdict = self._begin(kept, filled, used)
        except NotFilledError as error:
            self.intake.fault(Fault.UNKNOWN_GEOMETRY, "", str(error))
        except (UnknownIdError, NameConflictError) as error:
            self.intake.fault(Fault.UNKNOWN_FRAME, name, str(error))
        except RefusedError as error:
            self.intake.fault(error.fault, "", str(error))
        except SceneGraphError as error:
            self.intake.fault(Fault.MALFORMED, "", str(error))
        else:
            return verdict, kept if verdict is _Verdict.WAITS else None
        return _Verdict.DROPPED, None

    def _begin(self, kept: _Read, filled: SensedGeometry, limits: TimeLimits) -> _Verdict:
        """Begin to look at a message."""
        reading, stamp = kept.reading, kept.stamp
        geometry, state = filled.geometry(), filled.sensors[self.record.name]
        self._check_place(filled, geometry)
        late = limits.problem(stamp, stamp if state.stamp == UNSTAMPED else state.stamp)
        if late is not None:
            raise RefusedError(late[0], f"{self._a_message} {late[1]}")
        if state.stamp != UNSTAMPED and stamp < state.stamp + int(
            _TOLERANT * 1e9 / self._settings.rate
        ):
            self.intake.statistics.superseded += 1
            return _Verdict.DROPPED
        sensor = self._sensor_frame(reading.frame_id, filled, geometry, state)
        lack = self._lack(reading, state)
        if lack is not None:
            return self._wait(*lack, stamp, limits)
        frame = filled.inspector.get_frame_id(geometry)
        try:
            frames = (sensor.frame, frame, *state.filters[0].frames)
            X_WF = state.surroundings.place(frames, stamp)
        except NotYetError as error:
            why = f"{self._a_message} waits in vain: {error}"
            return self._wait(Fault.NO_POSES, why, stamp, limits)
        except PastError as error:
            why = f"{self._a_message} is too old to be placed: {error}"
            raise RefusedError(Fault.NO_POSES, why) from error
        X_WS = compose(X_WF[sensor.frame], sensor.X_FS)
        view = partial(self._view, reading, state, X_WS)
        depth_error = filled.error(geometry)
        result = self._worker.start(
            partial(state.look, view, X_WF, filled.seen(), stamp, depth_error, self._most_points)
        )
        X_WG = compose(X_WF[frame], filled.inspector.get_pose_in_frame(geometry))
        self._look = filled.look = _Look(kept, filled, state, geometry, X_WG, result)
        return _Verdict.BEGUN

    _message = "message"

    @property
    def _a_message(self) -> str:
        return f"a{'n' * (self._message[0] in 'aeiou')} {self._message}"

    def _check_place(self, filled: SensedGeometry, geometry: GeometryId) -> None:
        """Raise NotFilledError for geometry that moves where points have to stay in the world."""
        its = self._settings
        stays = its.remembers or its.fills
        if stays and not filled.inspector.is_anchored(geometry):
            raise NotFilledError(
                f"{filled.noun} {quoted(filled.inspector.get_name(geometry))} moves with a frame;"
                " images, and sensors that remember, fill one that is anchored"
            )

    def _sensor_frame(
        self, name: str, filled: SensedGeometry, geometry: GeometryId, state: SensorState
    ) -> SensorFrame:
        """Return the frame of the sensor. Raises UnknownIdError and NameConflictError."""
        its = self._settings
        if its.frame:
            return SensorFrame(filled.frame_named(its.frame), its.X_FS)
        if name in state.surroundings.cameras:
            return state.surroundings.cameras[name]
        if not name:
            raise UnknownIdError(
                f"{self._a_message} has no frame_id, so nobody knows where its sensor is: send it,"
                f" or name the frame in the scene file, sources: {self._key}: frame"
            )
        return SensorFrame(filled.frame(name, geometry), its.X_FS)

    _key = ""
    """The settings' name in scene files."""

    def _wait(self, fault: Fault, why: str, stamp: int, limits: TimeLimits) -> _Verdict:
        """Have a message wait. Raises RefusedError for one that did so long enough."""
        if limits.now <= 0 or limits.now - stamp <= PATIENCE:
            return _Verdict.WAITS
        raise RefusedError(fault, why)

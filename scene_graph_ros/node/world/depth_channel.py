"""Images of depth, and their lens: messages of them, validated and applied.

Imported where a source has the settings of such images. An image is of a time that is past: it
waits until all joints and frames that matter were heard for then, and makes points where they
were.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import enum

from sensor_msgs.msg import CameraInfo, Image

from msg_adapters.depth_images import depth_from_msg, DepthImage, lens_from_msg
from scene_graph_ros.geometry.errors import NameConflictError, SceneGraphError, UnknownIdError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.bounded_channel import BoundedChannel, NewestChannel
from scene_graph_ros.node.world.clouds import NoCloudError, SourceClouds
from scene_graph_ros.node.world.depth_state import DepthState, OpticalFrame
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.pose_history import NotYetError, PastError
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import CAMERA_INFO, DEPTH_IMAGES
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["PATIENCE", "DepthChannel", "InfoChannel"]

PATIENCE = 500_000_000
"""Nanoseconds after its stamp until which an image waits for poses and its lens."""

_TOLERANT = 0.9
"""Of the time between two images: stamps jitter."""

_BYTES_PER_PIXEL = 8
"""Of a message: rows may be padded."""


class _Verdict(enum.Enum):
    """What became of an image."""

    APPLIED = enum.auto()
    WAITS = enum.auto()
    DROPPED = enum.auto()


@dataclass(eq=False, slots=True)
class _Read(Kept):
    """An image that was read, and waits."""

    image: DepthImage


class DepthChannel(BoundedChannel[SourceClouds]):
    """The images of one source. Between two updates the newest counts whose poses are there."""

    noun = DEPTH_IMAGES
    queued = 4

    def __init__(
        self,
        record: SourceRecord,
        intake: Intake,
        most_points: int,
    ) -> None:
        """Keep ``most_points`` at most."""
        super().__init__(record, intake, Image)
        assert record.depth is not None
        self._settings = record.depth
        self._most_points = most_points

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {self._settings.image_topic: False}

    def _make_room(self) -> None:
        # The oldest is the one whose poses come first: were it dropped, none might ever count.
        self._kept.pop()

    def apply(self, kept: list[Kept], target: SourceClouds, limits: TimeLimits) -> int | None:
        """Apply the newest image of a time that is known; return when it arrived, or None.

        Newer ones wait, older ones are superseded.
        """
        waiting: list[Kept] = []
        arrival = None
        for older, one in zip(range(len(kept) - 1, -1, -1), reversed(kept), strict=True):
            verdict, waits = self._try(one, target, limits)
            if waits is not None:
                waiting.insert(0, waits)
            if verdict is _Verdict.APPLIED:
                self.intake.statistics.superseded += older
                arrival = one.arrival
                break
        with self._lock:
            self._kept.extendleft(reversed(waiting))
        return arrival

    def _apply_one(self, kept: Kept, target: SourceClouds, limits: TimeLimits) -> int:
        return int(self._try(kept, target, limits)[0] is _Verdict.APPLIED)

    def _try(
        self, kept: Kept, clouds: SourceClouds, limits: TimeLimits
    ) -> tuple[_Verdict, Kept | None]:
        """Apply an image, or return it to wait."""
        try:
            read = kept if isinstance(kept, _Read) else self._read_image(kept, limits.now)
            verdict = self._look(read.image, clouds, limits)
        except NoCloudError as error:
            self.intake.fault(Fault.UNKNOWN_GEOMETRY, "", str(error))
        except (UnknownIdError, NameConflictError) as error:
            self.intake.fault(Fault.UNKNOWN_FRAME, "", str(error))
        except SceneGraphError as error:
            self.intake.fault(Fault.MALFORMED, "", str(error))
        else:
            return verdict, read if verdict is _Verdict.WAITS else None
        return _Verdict.DROPPED, None

    def _read_image(self, kept: Kept, now: int) -> _Read:
        """Read an image; one without a stamp is of now, as other messages are."""
        most = self._most_points * self._settings.step**2
        message = self._read(kept.data, most_bytes(1) + _BYTES_PER_PIXEL * most)
        image = depth_from_msg(message, most)
        if image.stamp_ns == 0:
            image = image._replace(stamp_ns=now)
        return _Read(b"", kept.arrival, kept.is_static, image)

    def _look(self, image: DepthImage, clouds: SourceClouds, limits: TimeLimits) -> _Verdict:
        cloud, state = clouds.cloud(), clouds.images
        assert state is not None
        if not clouds.inspector.is_anchored(cloud):
            raise NoCloudError(
                f"cloud {quoted(clouds.inspector.get_name(cloud))} moves with a frame; images fill"
                " one that is anchored"
            )
        stamp = image.stamp_ns
        late = limits.problem(stamp, UNSTAMPED if state.stamp == UNSTAMPED else state.stamp)
        if late is not None:
            return self._drop(late[0], f"an image {late[1]}")
        if state.stamp != UNSTAMPED and stamp < state.stamp + int(
            _TOLERANT * 1e9 / self._settings.rate
        ):
            self.intake.statistics.superseded += 1
            return _Verdict.DROPPED
        optical = self._optical(image, clouds, state)
        if state.lens is None:
            topic = quoted(self._settings.info_topic)
            return self._wait(
                Fault.NO_CAMERA_INFO, stamp, limits, f"no lens came on {topic} for an image"
            )
        lens, size = state.lens.lens, image.depth.shape
        if size != (lens.height, lens.width):
            return self._drop(
                Fault.WRONG_LENGTH,
                f"an image has {size[1]} x {size[0]} pixels, its lens {lens.width} x"
                f" {lens.height}",
            )
        try:
            X_WF = state.surroundings.place((optical.frame, *state.filters[0].frames), stamp)
        except NotYetError as error:
            return self._wait(Fault.NO_POSES, stamp, limits, f"an image waits in vain: {error}")
        except PastError as error:
            return self._drop(Fault.NO_POSES, f"an image is too old to be placed: {error}")
        radius = clouds.inspector.get_shape(cloud).radius
        counts = state.look(image, optical, X_WF, radius, self._most_points)
        clouds.see(cloud, stamp)
        if counts.let_go:
            self.intake.fault(
                Fault.TOO_LARGE,
                "",
                f"more points were seen than max_points_per_cloud, {self._most_points}: the oldest"
                f" {counts.let_go} are let go",
            )
        self.newest = {
            "points": len(state.seen),
            "points of the newest image": counts.new,
            "points cleared by it": counts.cleared,
            "points seen again in it": counts.seen_again,
        }
        self.intake.count(counts.new)
        return _Verdict.APPLIED

    def _optical(self, image: DepthImage, clouds: SourceClouds, state: DepthState) -> OpticalFrame:
        """Return the frame of the camera. Raises UnknownIdError and NameConflictError."""
        its, name = self._settings, image.frame_id
        if its.frame:
            return OpticalFrame(clouds.frame_named(its.frame), its.X_FC)
        if name in state.surroundings.cameras:
            return state.surroundings.cameras[name]
        if not name:
            raise UnknownIdError(
                "an image has no frame_id, so nobody knows where its camera is: send it, or name"
                " the frame in the scene file, sources: depth: frame"
            )
        return OpticalFrame(clouds.frame_named(name), its.X_FC)

    def _wait(self, fault: Fault, stamp: int, limits: TimeLimits, why: str) -> _Verdict:
        """Have an image wait, unless it did so long enough."""
        if limits.now <= 0 or limits.now - stamp <= PATIENCE:
            return _Verdict.WAITS
        return self._drop(fault, why)

    def _drop(self, fault: Fault, detail: str) -> _Verdict:
        self.intake.fault(fault, "", detail)
        return _Verdict.DROPPED


class InfoChannel(NewestChannel[SourceClouds]):
    """The lens of one source's images."""

    noun = CAMERA_INFO

    def __init__(self, record: SourceRecord, intake: Intake) -> None:
        super().__init__(record, intake, CameraInfo)
        assert record.depth is not None
        self._settings = record.depth
        self._data = b""

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {self._settings.info_topic: False}

    def _apply_one(self, kept: Kept, target: SourceClouds, limits: TimeLimits) -> int:
        state = target.images
        assert state is not None
        message = self._read(kept.data, most_bytes(1))
        state.lens = lens_from_msg(message, rectified=self._settings.is_rectified)
        lens = state.lens.lens
        self.newest = {
            "lens (pixels)": f"{lens.width} x {lens.height}, fx {lens.fx:g}, fy {lens.fy:g},"
            f" cx {lens.cx:g}, cy {lens.cy:g}"
        }
        self.intake.count(1)
        return 1

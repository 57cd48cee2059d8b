"""The node's subscriptions: poses, configurations, points, images and descriptions of sources."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.node import Node

from scene_graph_ros.node.runtime.loop import OwnThreadGroup, Topic
from scene_graph_ros.node.world.configuration_inputs import ConfigurationInputs
from scene_graph_ros.node.world.description_channel import Describe, DescriptionInputs
from scene_graph_ros.node.world.height_inputs import HeightInputs
from scene_graph_ros.node.world.inputs import BASE_POSES, JOINT_POSES, PoseInputs, POSES
from scene_graph_ros.node.world.sensor_inputs import DepthInputs, InfoInputs, PointInputs
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.source_topics import CAMERA_INFO, DEPTH_IMAGES
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.voxel_inputs import VoxelInputs
from scene_graph_ros.node.world.world import World

__all__ = ["Collected", "Subscriptions"]


class Collected(NamedTuple):
    """The messages of one update, judged."""

    moved: set[str]
    """Names of the sources whose frames moved."""
    deformed: Any
    """The configurations that came, as `World.commit` takes them."""
    sensed: set[str]
    """Names of the sources whose clouds, fields or grids have other points, heights or voxels."""
    first: int | None
    """The steady time of the first arrival, ns; None without any."""


class Subscriptions:
    """The inputs of a world; messages stay bytes until `collect`."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        changed: Callable[[], None],
        describe: Describe,
        most_points: int,
        most_voxels: int,
        lack: Callable[[str], str],
    ) -> None:
        """``describe`` takes a source's name, the text of its robot, and a callback.

        A message of points has ``most_points`` at most, a map ``most_voxels``; ``lack`` says which
        kernels of a group are missing.
        """
        self._world = world
        self._poses = [
            PoseInputs(node, world, group, changed, noun)
            for noun in (POSES, BASE_POSES, JOINT_POSES)
        ]
        self._configurations = ConfigurationInputs(node, world, group, changed)
        of_views = most_points, lack
        self._points = PointInputs(node, world, group, changed, "points", *of_views)
        self._info = InfoInputs(node, world, group, changed, CAMERA_INFO)
        self._heights = HeightInputs(node, world, group, changed)
        self._voxels = VoxelInputs(node, world, group, changed, most_voxels, lack)
        self._images = DepthInputs(node, world, group, changed, DEPTH_IMAGES, *of_views)
        self.all: list[Inputs[Any]] = [
            *self._poses,
            self._configurations,
            self._points,
            self._info,
            self._images,
            self._heights,
            self._voxels,
            DescriptionInputs(node, world, group, changed, describe),
        ]

    def follow_scene(self) -> list[Topic]:
        """Subscribe to the topics of the sources that there are now; return all of them."""
        for inputs in self.all:
            inputs.refresh()
        return [reader for inputs in self.all for reader in inputs.readers]

    def look(self) -> None:
        """Take note of messages that arrived; nothing moves yet."""
        for inputs in self.all:
            inputs.look()

    def collect(self, limits: TimeLimits) -> Collected:
        """Judge all messages that wait, and put in place what counts of them."""
        collected = [inputs.collect(limits) for inputs in self._poses]
        deformed, arrived = self._configurations.collect(limits)
        moved = {name for names, _ in collected for name in names}
        arrivals, sensed = [arrived, *(arrival for _, arrival in collected)], set[str]()
        if self._world.snapshot.sensing:
            self._world.note_poses()
            points = self._points.collect(limits)
            self._info.collect(limits)  # moves nothing
            images = self._images.collect(limits)
            sensed = points[0] | images[0]
            arrivals += [points[1], images[1]]
        snapshot = self._world.snapshot
        for inputs, wanted in (
            (self._heights, snapshot.with_fields),
            (self._voxels, snapshot.with_grids),
        ):
            if wanted:
                changed, arrived = inputs.collect(limits)
                sensed |= changed
                arrivals.append(arrived)
        # Steady times are never 0.
        return Collected(moved, deformed, sensed, min(filter(None, arrivals), default=None))

    def forget(self, after: int) -> None:
        """Forget stamps later than that; the poses hold."""
        for inputs in self._poses:
            inputs.forget(after)

    def discard(self) -> None:
        """Drop messages that wait."""
        for inputs in self.all:
            inputs.discard()

    def close(self) -> None:
        """End all subscriptions."""
        for inputs in self.all:
            inputs.close()

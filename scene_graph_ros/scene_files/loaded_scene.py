"""A scene file's objects in a scene graph: ids by name, poses to start with, kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TYPE_CHECKING

from numpy.typing import ArrayLike

from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.robots.kinematics import Kinematics
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import JointType, Pose
from scene_graph_ros.robots.semantic_model import SemanticModel, VirtualJoint

if TYPE_CHECKING:
    from scene_graph_ros.geometry import Context
    from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
    from scene_graph_ros.geometry.perception import CameraDescription
    from scene_graph_ros.scene_files.sensor_settings import SensorSettings, VoxelSettings

__all__ = ["LoadedRobot", "LoadedScene", "LoadedSource", "MovingBase"]


@dataclass(frozen=True)
class MovingBase:
    """The mover of a robot's base: poses on a topic, or TF where ``type`` is empty.

    ``parent`` is the frame that stands where the world does, ``link`` the one that is placed in
    it, of the robot's root or fixed to that; ``prefix`` is before names of links in messages.
    """

    topic: str
    type: str
    parent: str
    link: str
    prefix: str = ""
    interpolates: bool = True


@one_line()
@dataclass(frozen=True, eq=False)
class LoadedRobot:
    """A registered robot."""

    model: RobotModel
    semantics: SemanticModel | None
    link_frames: dict[str, FrameId]
    """Frames by link, in the order of their registration."""
    X_WB: Pose
    positions: dict[str, float]
    """Joint positions to start with; the joints not named start at 0."""
    joint_states_topic: str
    moving_base: MovingBase | None = None
    """None for one that stands still, or that only its virtual joint moves."""
    joint_poses_topic: str = ""
    """Of MultiDOFJointState messages."""
    link_prefix: str = ""
    """Before the names of links in those of frames."""

    @cached_property
    def spare_frames(self) -> dict[str, GeometryFrame]:
        """Frames by link that are registered when something is attached to the link, or beside it.

        There is one for each group of links, joined by fixed joints, of which none has a frame.
        """
        tops = {self.model.root: self.model.root}
        for joint in self.model.joints.values():
            is_fixed = joint.type is JointType.FIXED
            tops[joint.child] = tops[joint.parent] if is_fixed else joint.child
        with_frames = {tops[link] for link in self.link_frames}
        without = dict.fromkeys(top for top in tops.values() if top not in with_frames)
        return {link: GeometryFrame(self.link_prefix + link) for link in without}

    @cached_property
    def carriers(self) -> dict[str, FrameId]:
        """Frames by link, in the order of ``kinematics.link_names``: the spare ones come last."""
        spare = {link: frame.id() for link, frame in self.spare_frames.items()}
        return {**self.link_frames, **spare}

    @property
    def virtual_joint(self) -> VirtualJoint | None:
        """The joint by which messages move the base, where nothing else does."""
        joints = () if self.semantics is None else self.semantics.virtual_joints
        if self.moving_base is not None:
            return None
        return next((joint for joint in joints if joint.type != "fixed"), None)

    @property
    def has_joint_poses(self) -> bool:
        """Whether poses of joints, not positions, move parts of the robot."""
        kinds = {joint.type for joint in self.model.joints.values()}
        posed = kinds & {JointType.PLANAR, JointType.FLOATING}
        return bool(posed) or self.virtual_joint is not None

    @property
    def has_moving_base(self) -> bool:
        """Whether messages move the root link."""
        return self.moving_base is not None or self.virtual_joint is not None

    @cached_property
    def kinematics(self) -> Kinematics:
        """Forward kinematics of the ``carriers``, in the world, at the start's positions."""
        result = Kinematics(self.model, links=tuple(self.carriers), X_PB=self.X_WB)
        if self.positions:
            result.update(tuple(self.positions), tuple(self.positions.values()))
        return result

    def frame_poses(
        self, joint_names: Sequence[str] = (), positions: ArrayLike = ()
    ) -> dict[FrameId, Pose]:
        """Move the named joints, rad or m, and return ``X_WL`` ``(4, 4)`` of each link's frame.

        Raises JointStateError, and moves nothing, for positions that are not usable.
        """
        _, X_WL = self.kinematics.link_poses(joint_names, positions)
        return dict(zip(self.link_frames.values(), X_WL[: len(self.link_frames)], strict=True))


@one_line()
@dataclass(eq=False)
class LoadedSource:
    """A registered source and where its poses come from."""

    source_id: SourceId
    name: str
    pose_type: str
    """A ROS message type, e.g. ``sensor_msgs/msg/JointState``; empty without moving frames."""
    pose_topic: str
    """Empty for the default topic of the type."""
    frames: dict[str, FrameId] = field(default_factory=dict)
    initial_poses: dict[FrameId, Pose] = field(default_factory=dict)
    """Poses in the parent of the frames that the scene file names; links are not among them."""
    robot: LoadedRobot | None = None
    configuration_topic: str = ""
    """Empty for the default topic."""
    points_topic: str = ""
    """Empty for the default topic."""
    cloud: str = ""
    """The name of the geometry whose points the source sends, empty for its only cloud."""
    sensor: SensorSettings | None = None
    """None for a source of whose sensor the file says nothing."""
    voxels: VoxelSettings | None = None
    """None for a source of whose maps the file says nothing."""
    interpolates: bool = True
    """Whether transforms of TF are composed at one time, or of the newest of each."""
    description: Any = None
    """The `RobotDescription` of a robot that a topic describes."""
    token_file: Path | None = None
    """Where the token of its handle is, or is to be made: below `token_file_folder`."""
    token_file_folder: Path = Path()
    is_claimable: bool = False
    """Whether the first who asks for the source gets its handle."""


@one_line()
@dataclass(frozen=True, eq=False)
class LoadedScene:
    """A scene in a scene graph."""

    name: str
    sources: dict[str, LoadedSource]
    geometries: dict[str, GeometryId]
    """Geometries of the file's ``geometries`` by ``source/frame/name`` as the file names them."""
    effects: dict[str, str]
    """"auto" or "off" by the name of an effect; effects not named are "auto"."""
    warnings: tuple[str, ...]
    cameras: dict[str, CameraDescription] = field(default_factory=dict)
    """By name, with the prefix that the scene was given."""
    servers: tuple[str, ...] = ()
    """The names of renderers that ask a server."""
    doubts: tuple[str, ...] = ()
    """What files should not say, though they can be used: a checker refuses it."""
    notes: tuple[str, ...] = ()
    """What follows from the files and is good to know, such as limits that were narrowed."""

    def set_initial_poses(self, context: Context) -> None:
        """Put every frame of the scene where the file says."""
        for source in self.sources.values():
            poses = dict(source.initial_poses)
            if source.robot is not None:
                poses.update(source.robot.frame_poses())
            if poses:
                context.set_frame_poses(source.source_id, poses)

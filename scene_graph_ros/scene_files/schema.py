"""The schema of scene files, version 1. Lengths are in metres, angles in radians."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator, PlainValidator, WithJsonSchema

from scene_graph_ros.geometry.model.render_label import RenderLabel
from scene_graph_ros.scene_files.schema_handles import HandleSpec
from scene_graph_ros.scene_files.schema_renderers import RendererSpec
from scene_graph_ros.scene_files.schema_sensors import DepthSpec, PointsSpec, VoxelsSpec
from scene_graph_ros.scene_files.schema_shapes import ShapeSpec
from scene_graph_ros.scene_files.schema_values import (
    Channel,
    Name,
    Number,
    PoseSpec,
    Positive,
    Reference,
    Spec,
    Text,
)

__all__ = [
    "CameraSpec",
    "ColorSpec",
    "DeformableSpec",
    "FilterSpec",
    "FrameSpec",
    "GeometrySpec",
    "LensSpec",
    "PoseSpec",
    "PoseType",
    "RobotSpec",
    "RolesSpec",
    "SceneSpec",
    "SourceSpec",
    "json_schema",
]

Label = Annotated[int, Field(strict=True, ge=0, le=RenderLabel.MAX_FREE)]
ColorSpec = Annotated[list[Channel], Field(min_length=3, max_length=4)]


def _property_value(value: Any) -> Any:
    """Accept one finite number, text or truth value, or a list of one of these kinds."""
    entries = value if isinstance(value, list) else [value]
    kinds = {"number" if type(entry) in (int, float) else type(entry) for entry in entries}
    if len(kinds) > 1 or not kinds <= {"number", str, bool}:
        raise ValueError(
            f"must be a number, text, true or false, or a list of one of these, got {value!r}"
        )
    if kinds == {"number"} and not all(math.isfinite(entry) for entry in entries):
        raise ValueError(f"must be finite, got {value!r}")
    return value


_SCALARS = ("number", "string", "boolean")
PropertyValue = Annotated[
    Any,
    PlainValidator(_property_value),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": list(_SCALARS)},
                *({"type": "array", "items": {"type": kind}} for kind in _SCALARS),
            ]
        }
    ),
]
Properties = dict[Text, dict[Text, PropertyValue]]

PoseType = Literal[
    "sensor_msgs/msg/MultiDOFJointState",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/TransformStamped",
    "tf2_msgs/msg/TFMessage",
]


Composition = Literal["interpolated", "newest"]
_COMPOSITION = (
    "At which time chains of transforms are composed: interpolated at the newest of which all of "
    "the chain is known, or of the newest of each."
)


class PosesSpec(Spec):
    """Where the poses of a source's frames come from."""

    type: PoseType = "sensor_msgs/msg/MultiDOFJointState"
    topic: Text | None = Field(None, description='Default: "<source>/poses", or "/tf".')
    composition: Composition = Field("interpolated", description=_COMPOSITION)


class ConfigurationsSpec(Spec):
    """Where the configurations of a source's deformable geometry come from."""

    topic: Text = Field(description='Default: "<source>/configurations".')


class SourceSpec(HandleSpec):
    """An owner of frames and geometry, which alone moves and changes them."""

    name: Name
    poses: PosesSpec | None = Field(
        None, description="Default for a source with frames: MultiDOFJointState messages."
    )
    configurations: ConfigurationsSpec | None = Field(
        None, description="Default for a source with deformable geometry: the topic's default."
    )
    points: PointsSpec | None = Field(
        None, description="Default for a source with a cloud: the topic's default."
    )
    depth: DepthSpec | None = Field(
        None,
        description="In place of points: images of depth, of which its cloud is made, or a grid "
        "of voxels.",
    )
    voxels: VoxelsSpec | None = Field(
        None, description="Default for a source with a voxel grid: flat maps, the topic's default."
    )

    @property
    def sensor(self) -> PointsSpec | DepthSpec | None:
        """What it says of its sensor."""
        return self.points or self.depth

    @property
    def filled_type(self) -> str:
        """The type of shape that sensors fill of it."""
        return "point_cloud" if self.sensor is None else self.sensor.into

    @model_validator(mode="after")
    def _one_sensor(self) -> SourceSpec:
        if self.points is not None and self.depth is not None:
            raise ValueError("give points or depth, not both: have a source for each sensor")
        if self.voxels is not None and self.filled_type == "voxel_grid":
            raise ValueError("maps fill its voxel grid, or its sensor does: give one of them")
        return self


class FrameSpec(Spec):
    """A frame that its source moves; the pose is where it is until the source says otherwise."""

    name: Name
    source: Name
    parent: Name = Field("world", description="A frame of the same source, or world.")
    pose: PoseSpec = PoseSpec()


class RolesSpec(Spec):
    """The roles of a geometry, each with its properties as group -> name -> value."""

    proximity: Properties | None = None
    illustration: Properties | None = None
    perception: Properties | None = None


class DeformableSpec(Spec):
    """Options of a deformable geometry: its shape is cut into tetrahedra, whose vertices move."""

    resolution_hint: Annotated[Number, Field(gt=0.0)] | None = Field(
        None,
        description="Wanted edge length, metres; curved shapes need one. A mesh of tetrahedra "
        "(.vtk, .vtu) is taken as it is.",
    )
    mesh: Text | None = Field(
        None, description="A file of tetrahedra (.vtk, .vtu), the shape being only a description."
    )

    @model_validator(mode="after")
    def _one_mesh(self) -> DeformableSpec:
        if self.mesh is not None and self.resolution_hint is not None:
            raise ValueError("give resolution_hint or mesh, not both")
        return self


class GeometrySpec(Spec):
    """A shape fixed to a frame, or anchored to the world."""

    name: Name
    source: Name
    frame: Name = Field("world", description="A frame of the same source, or world: anchored.")
    pose: PoseSpec = PoseSpec()
    shape: ShapeSpec
    color: ColorSpec | None = Field(None, description="Red, green, blue and opacity, 0 to 1.")
    label: Label | None = Field(
        None, description="The number in label images. It gives the perception role."
    )
    roles: RolesSpec = Field(
        RolesSpec(proximity={}, illustration={}),
        description="Default: proximity and illustration, and perception where the file has "
        "cameras; without properties.",
    )
    deformable: DeformableSpec | None = Field(
        None, description="Given, even if empty, the geometry is deformable and in the world."
    )


BaseType = Literal[
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
]


class BaseSpec(PoseSpec):
    """Where a robot's root link is in the world; with a topic or tf, until that says it."""

    topic: Text | None = Field(None, description="On which poses of the base come.")
    type: BaseType | None = Field(None, description="Of the topic; default: nav_msgs/msg/Odometry")
    parent: Text | None = Field(
        None,
        description="The frame that stands where the world does, in which the poses are given, "
        'beside the world; default with Odometry: "odom".',
    )
    link: Text | None = Field(
        None, description="The link that poses without a child frame are of; default: the root."
    )
    tf: Annotated[list[Text], Field(min_length=2, max_length=2)] | None = Field(
        None, description="A frame of TF that stands where the world does, and the base's."
    )
    composition: Composition = Field("interpolated", description=_COMPOSITION)

    @property
    def moves(self) -> bool:
        """Tell whether messages move the base."""
        return self.topic is not None or self.tf is not None

    @model_validator(mode="after")
    def _one_way(self) -> BaseSpec:
        if self.topic is not None and self.tf is not None:
            raise ValueError("give topic or tf, not both")
        for name in ("type", "parent", "link"):
            if getattr(self, name) is not None and self.topic is None:
                raise ValueError(f"{name} needs a topic")
        return self


class DescriptionSpec(Spec):
    """A topic of std_msgs/String messages with the text of a URDF, latched as a rule."""

    topic: Text


class RobotSpec(HandleSpec):
    """A robot: a source whose frames are the links of a URDF, moved by joint states."""

    name: Name = Field(description="Name of the robot's source.")
    urdf: Text | DescriptionSpec = Field(
        description="A path relative to this file, package:// or file://; or {topic: "
        "/robot_description}, whose newest text it is."
    )
    srdf: Text | None = Field(None, description="Its disabled collisions become filters.")
    joint_limits: Text | None = Field(
        None, description="A joint_limits.yaml as MoveIt's: the narrower limits hold."
    )
    prefix: str = Field("", description="Put before the names of links.")
    base: BaseSpec = Field(BaseSpec(), description="Pose of the root link in the world.")
    multi_dof_joint_states: Text = Field(
        "multi_dof_joint_states",
        description="Topic of MultiDOFJointState messages about planar and floating joints, and "
        "the SRDF's virtual joint where the base has no source of its own.",
    )
    joint_states: Text = Field("joint_states", description="Topic of JointState messages.")
    positions: dict[Text, Number] = Field({}, description="Joint positions until one arrives.")
    group_state: Text | None = Field(None, description="A posture of the SRDF to start in.")
    collision: bool = True
    visual: bool = True
    all_links: bool = Field(False, description="Make frames of links without geometry, too.")
    filter_adjacent: bool = Field(False, description="Never check links that a joint connects.")
    skip_unreadable: bool = Field(
        False, description="Leave out geometry that can't be read, each with a warning."
    )
    proximity: Properties = Field({}, description="Properties of all collision geometry.")
    label: Label | None = Field(
        None, description="The number in label images. It gives the perception role."
    )
    perception: Properties | None = Field(
        None,
        description="Properties of all visual geometry, which then has the perception role; "
        "default: without properties where the file has cameras, else no such role.",
    )

    @model_validator(mode="after")
    def _posture_needs_srdf(self) -> RobotSpec:
        if self.group_state is not None and self.srdf is None:
            raise ValueError("group_state needs an srdf")
        return self


class LensSpec(Spec):
    """The lens of a camera, in pixels; pixels' centres are at whole numbers."""

    fx: Positive
    fy: Positive
    cx: Number
    cy: Number


class CameraSpec(Spec):
    """A camera on a frame, which publishes images where somebody listens.

    Its own frame is the optical one: x to the right, y down and z ahead.
    """

    name: Text = Field(description="Part of topics: letters, digits and '_', no digit first.")
    source: Name = Field(description="Whose camera it is.")
    frame: Name = Field("world", description="A frame of the same source, or world.")
    pose: PoseSpec = Field(PoseSpec(), description="Of the optical frame in that frame.")
    size: Annotated[
        list[Annotated[int, Field(strict=True, ge=1)]], Field(min_length=2, max_length=2)
    ] = Field(description="Width and height in pixels.")
    fov_y: Annotated[Number, Field(gt=0.0, lt=math.pi)] | None = Field(
        None, description="Angle of view from the upper edge to the lower one, radians."
    )
    intrinsics: LensSpec | None = Field(None, description="In place of fov_y.")
    clipping: Annotated[list[Positive], Field(min_length=2, max_length=2)] = Field(
        [0.01, 100.0], description="Least and largest depth at which anything is seen, metres."
    )
    depth_range: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Depths that depth images tell apart, metres; default: the clipping."
    )
    images: Annotated[list[Literal["color", "depth", "label", "points"]], Field(min_length=1)] = (
        Field(["color", "depth", "label"], description="What it offers.")
    )
    rate: Annotated[Number, Field(ge=1e-3, le=1e3)] = Field(
        30.0, description="Most images of each kind per second."
    )
    renderer: Text = Field("exact", description="One of renderers, or exact.")

    @model_validator(mode="after")
    def _one_lens(self) -> CameraSpec:
        if (self.fov_y is None) == (self.intrinsics is None):
            raise ValueError("give fov_y or intrinsics, and only one of them")
        return self


class FilterSpec(Spec):
    """Pairs that are never checked, or are checked again. Later filters overrule earlier ones.

    Members are "source", "source/frame" or "source/frame/geometry"; the frame of anchored
    geometry is "world".
    """

    action: Literal["exclude", "allow"] = "exclude"
    within: Annotated[list[Reference], Field(min_length=1)] | None = None
    between: (
        Annotated[
            list[Annotated[list[Reference], Field(min_length=1)]],
            Field(min_length=2, max_length=2),
        ]
        | None
    ) = None

    @model_validator(mode="after")
    def _one_kind(self) -> FilterSpec:
        if (self.within is None) == (self.between is None):
            raise ValueError("give within or between, and only one of them")
        return self


class SceneSpec(Spec):
    """A scene: owners, poses, and pairs that are not checked."""

    version: Literal[1] = Field(description="Version of this format.")
    name: str = ""
    packages: dict[Text, Text] = Field(
        {}, description="Folders of packages, relative to this file, before any other search."
    )
    sources: list[SourceSpec] = Field([])
    robots: list[RobotSpec] = Field([])
    frames: list[FrameSpec] = Field([])
    geometries: list[GeometrySpec] = Field([])
    renderers: list[RendererSpec] = Field([])
    cameras: list[CameraSpec] = Field([])
    collision_filters: list[FilterSpec] = Field([])
    effects: dict[Text, Literal["auto", "off"]] = Field(
        {}, description="auto: computed when something asks for it; off: never."
    )


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of scene files, for editors that complete and check while typing."""
    schema = SceneSpec.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "scene_graph_ros scene"
    return schema

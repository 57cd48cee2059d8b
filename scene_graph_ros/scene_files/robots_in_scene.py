"""Robots of a scene file: URDF, SRDF and the posture to start in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from scene_graph_ros.geometry.model.perception_properties import read_perception_properties
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import SceneFileError, suggestion
from scene_graph_ros.robots.adjacency import adjacent_pairs
from scene_graph_ros.robots.registration import register_robot
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.semantic_model import SemanticModel
from scene_graph_ros.scene_files.application import Application
from scene_graph_ros.scene_files.instances import (
    find_picture,
    perception_from_spec,
    pose_from_spec,
    properties_from_spec,
)
from scene_graph_ros.scene_files.limits_file import narrowed_by_file
from scene_graph_ros.scene_files.loaded_scene import LoadedRobot, MovingBase
from scene_graph_ros.scene_files.packages import ROBOT_ENDINGS, SCENE_ENDINGS
from scene_graph_ros.scene_files.schema import RobotSpec
from scene_graph_ros.scene_files.srdf import load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.ids import FrameId

__all__ = ["add_robots"]

_JOINT_STATE = "sensor_msgs/msg/JointState"
_ODOMETRY = "nav_msgs/msg/Odometry"


def add_robots(to: Application) -> None:
    """Register all robots, each as a source."""
    for index, robot in enumerate(to.spec.robots):
        if to.takes(robot.name):
            _add_robot(to, robot, index)
        elif robot.name in to.pending and not to.only:
            with to.located("robots", index, "name"):
                source = to.add_source(robot.name, "", "")
            to.take_handle(source, robot, "robots", index)


def _add_robot(to: Application, spec: RobotSpec, index: int) -> None:
    model = _robot_model(to, spec, index)
    semantics = _semantics(to, spec, model, index)
    positions = _positions(to, spec, model, semantics, index)
    with to.located("robots", index, "base"):
        X_WB = pose_from_spec(spec.base, f"base of robot {spec.name!r}")
    with to.located("robots", index, "proximity"):
        proximity = properties_from_spec("proximity", spec.proximity, None)
    with to.located("robots", index, "perception"):
        perception = perception_from_spec(
            spec.perception, spec.label, is_seen=bool(to.spec.cameras)
        )
        if perception is not None:
            find_picture(perception, to.resolve)
            read_perception_properties(perception, spec.name)
    frames: dict[str, FrameId] = {}
    robot = LoadedRobot(
        model,
        semantics,
        frames,
        X_WB,
        positions,
        spec.joint_states,
        _moving_base(to, spec, model, index),
        spec.multi_dof_joint_states,
        spec.prefix,
    )
    with to.located("robots", index, "name"):
        source = to.add_source(spec.name, _JOINT_STATE, spec.joint_states, robot)
    to.take_handle(source, spec, "robots", index)
    with to.located("robots", index, "urdf"):
        frames.update(
            register_robot(
                model,
                to.scene_graph,
                source.source_id,
                prefix=spec.prefix,
                semantics=semantics,
                filter_adjacent=spec.filter_adjacent,
                collision=spec.collision,
                visual=spec.visual,
                all_links=spec.all_links,
                proximity=proximity,  # type: ignore[arg-type]
                perception=perception,
            )
        )
    if spec.filter_adjacent:
        to.notes.extend(_adjacent_notes(spec.name, model, frames))
    source.frames.update((spec.prefix + link, frame) for link, frame in frames.items())
    inspector = to.scene_graph.model_inspector()
    for frame_id in frames.values():
        for geometry_id in inspector.get_geometries(frame_id):
            to.note_body(
                inspector.get_shape(geometry_id),
                inspector.get_proximity_properties(geometry_id),
                inspector.get_name(geometry_id),
                *("robots", index, "proximity"),
            )


def _adjacent_notes(robot: str, model: RobotModel, frames: Mapping[str, FrameId]) -> Iterator[str]:
    """Yield a sentence for each pair of links that ``filter_adjacent`` leaves without checks."""
    for link_A, link_B in sorted(adjacent_pairs(model)):
        if link_A in frames and link_B in frames:
            yield f"robot {robot!r}: {link_A!r} and {link_B!r} are adjacent, and not checked"


def _moving_base(
    to: Application, spec: RobotSpec, model: RobotModel, index: int
) -> MovingBase | None:
    """Return the mover of the base, None where there is none."""
    base = spec.base
    if not base.moves:
        return None
    named = base.tf or (base.parent or "", base.link or "")
    parent, link = (name.removeprefix("/") for name in named)
    if base.tf is not None:
        link = link.removeprefix(spec.prefix)
    name = link or model.root
    if name not in model.fixed_to_root():
        problem = "joints move it" if name in model.links else "the robot has no such link"
        where = ("tf", 1) if base.tf is not None else ("link",)
        raise to.scene.document.error(
            f"{name!r} can't be the base, as {problem}: the root link is {model.root!r}"
            f"{suggestion(name, list(model.fixed_to_root()))}",
            *("robots", index, "base", *where),
        )
    kind = "" if base.topic is None else base.type or _ODOMETRY
    if kind == _ODOMETRY and not parent:
        parent = "odom"
    interpolates = base.composition == "interpolated"
    return MovingBase(base.topic or "", kind, parent, name, spec.prefix, interpolates)


def _robot_model(to: Application, spec: RobotSpec, index: int) -> RobotModel:
    packages = to.scene.packages
    with to.located("robots", index, "urdf"):
        model = load_urdf(
            _text_or_path(to, spec),
            package_map=packages.package_map,
            package_dirs=packages.package_dirs,
            skip_unreadable=spec.skip_unreadable,
            reach=packages.reach,
        )
    if spec.joint_limits is not None:
        with to.located("robots", index, "joint_limits"):
            limits = to.resolve(spec.joint_limits, SCENE_ENDINGS)
            model = narrowed_by_file(model, limits, spec.joint_limits)
    to.warnings.extend(model.warnings)
    to.doubts.extend(model.doubts)
    to.notes.extend(model.notes)
    return model


def _text_or_path(to: Application, spec: RobotSpec) -> str:
    """Return the path of a robot's URDF, or its text where a topic has it."""
    if isinstance(spec.urdf, str):
        return str(to.resolve(spec.urdf, ROBOT_ENDINGS))
    text = to.texts[spec.name]
    if not text.lstrip(" \t\r\n\0\ufeff").startswith("<"):
        raise SceneFileError(f"the description is no XML: {quoted(text)}")
    return text


def _semantics(
    to: Application, spec: RobotSpec, model: RobotModel, index: int
) -> SemanticModel | None:
    if spec.srdf is None:
        return None
    with to.located("robots", index, "srdf"):
        semantics = load_srdf(str(to.resolve(spec.srdf, ROBOT_ENDINGS)), model)
    to.warnings.extend(semantics.warnings)
    return semantics


def _positions(
    to: Application,
    spec: RobotSpec,
    model: RobotModel,
    semantics: SemanticModel | None,
    index: int,
) -> dict[str, float]:
    """Return the posture to start in: the group state's, overruled by single positions."""
    positions: dict[str, float] = {}
    if spec.group_state is not None and semantics is not None:
        with to.located("robots", index, "group_state"):
            positions.update(semantics.group_state(spec.group_state).positions)
    known = [joint.name for joint in model.positioned_joints()]
    for name, value in spec.positions.items():
        if name not in known:
            raise to.scene.document.error(
                f"robot {model.name!r} has no joint {name!r} with a position"
                f"{suggestion(name, known)}",
                *("robots", index, "positions", name),
            )
        positions[name] = value
    return positions

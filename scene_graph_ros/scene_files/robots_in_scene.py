"""Robots of a scene file: URDF, SRDF and the posture to start in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scene_graph_ros.geometry.model.perception_properties import read_perception_properties
from scene_graph_ros.located import suggestion
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
from scene_graph_ros.scene_files.loaded_scene import LoadedRobot
from scene_graph_ros.scene_files.packages import ROBOT_ENDINGS
from scene_graph_ros.scene_files.schema import RobotSpec
from scene_graph_ros.scene_files.srdf import load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.ids import FrameId

__all__ = ["add_robots"]

_JOINT_STATE = "sensor_msgs/msg/JointState"


def add_robots(to: Application) -> None:
    """Register all robots, each as a source."""
    for index, robot in enumerate(to.spec.robots):
        _add_robot(to, robot, index)


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
    robot = LoadedRobot(model, semantics, frames, X_WB, positions, spec.joint_states)
    with to.located("robots", index, "name"):
        source = to.add_source(spec.name, _JOINT_STATE, spec.joint_states, robot)
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


def _robot_model(to: Application, spec: RobotSpec, index: int) -> RobotModel:
    packages = to.scene.packages
    with to.located("robots", index, "urdf"):
        model = load_urdf(
            str(to.resolve(spec.urdf, ROBOT_ENDINGS)),
            package_map=packages.package_map,
            package_dirs=packages.package_dirs,
        )
    to.warnings.extend(model.warnings)
    return model


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

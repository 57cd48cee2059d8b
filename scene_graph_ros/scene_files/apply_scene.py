"""Register a checked scene file in a scene graph, all of it or nothing."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from scene_graph_ros.scene_files.application import Application
from scene_graph_ros.scene_files.filters_in_scene import apply_filters
from scene_graph_ros.scene_files.geometries_in_scene import add_frames, add_geometries
from scene_graph_ros.scene_files.instances import pose_from_spec
from scene_graph_ros.scene_files.loaded_scene import LoadedScene
from scene_graph_ros.scene_files.property_names import property_warnings
from scene_graph_ros.scene_files.robots_in_scene import add_robots
from scene_graph_ros.scene_files.scene_file import SceneFile
from scene_graph_ros.scene_files.sensor_specs import sensor_settings, voxel_settings

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph

__all__ = ["RobotDescription", "apply_scene"]

_MULTI_DOF = "sensor_msgs/msg/MultiDOFJointState"


def apply_scene(scene: SceneFile, scene_graph: SceneGraph, prefix: str) -> LoadedScene:
    """Register the scene, all of it; where that raises, nothing."""
    application = Application(scene, scene_graph, prefix)
    application.warnings.extend(property_warnings(scene))

    def register() -> LoadedScene:
        _add_sources(application)
        _add_parts(application)
        for name in application.pending:
            source = application.source(name)
            source.description = RobotDescription(
                application, name, _topic_of(application, name), prefix
            )
        return application.loaded()

    return scene_graph.all_or_nothing(register)


def _add_parts(to: Application) -> None:
    """Add all that is to be added now, of the sources that there are."""
    add_robots(to)
    add_frames(to)
    add_geometries(to)
    to.make_bodies()
    apply_filters(to)
    _add_cameras(to)


def _topic_of(to: Application, name: str) -> str:
    return next(r.urdf.topic for r in to.spec.robots if r.name == name)  # type: ignore[union-attr]


class RobotDescription:
    """A robot that is described later, and again: its part of the file, beside its URDF."""

    def __init__(self, first: Application, name: str, topic: str, prefix: str) -> None:
        self.topic = topic
        self._first, self._name, self._prefix = first, name, prefix

    def apply(self, scene_graph: SceneGraph, text: str) -> LoadedScene:
        """Register the robot as a URDF describes it, and the scene file's objects on it.

        Of the robot as it was described before nothing must be left in ``scene_graph``. Returns
        the added objects, with the robot's source; `applied` when it counts. Raises SceneFileError
        where something is refused; then the scene graph may have parts of it.
        """
        first = self._first
        to = Application(first.scene, scene_graph, self._prefix)
        to.sources.update(first.sources)
        to.geometries.update(
            (path, known)
            for path, known in first.geometries.items()
            if path.partition("/")[0] != self._name
        )
        del to.sources[self._prefix + self._name]
        to.texts[self._name], to.only = text, self._name
        to.pending = first.pending - {self._name}
        _add_parts(to)
        source = to.source(self._name)
        source.description = self
        return replace(to.loaded(), sources={source.name: source})

    def applied(self, loaded: LoadedScene) -> None:
        """Take note that the result of `apply` counts, so that others may refer to it."""
        self._first.sources.update(loaded.sources)
        self._first.pending -= {self._name}


def _add_sources(to: Application) -> None:
    for index, source in enumerate(to.spec.sources):
        moves = any(frame.source == source.name for frame in to.spec.frames)
        given = source.poses
        pose_type = given.type if given is not None else _MULTI_DOF if moves else ""
        topic = (given.topic or "") if given is not None else ""
        deforms, points, sensor = source.configurations, source.points, source.sensor
        interpolates = given is None or given.composition == "interpolated"
        with to.located("sources", index, "name"):
            added = to.add_source(
                source.name,
                pose_type,
                topic,
                configuration_topic=deforms.topic if deforms is not None else "",
                points_topic=(points.topic or "") if points is not None else "",
                cloud=(sensor.geometry or "") if sensor is not None else "",
                sensor=None if sensor is None else sensor_settings(sensor, to.prefix),
                voxels=None if source.voxels is None else voxel_settings(source.voxels),
                interpolates=interpolates,
            )
        to.take_handle(added, source, "sources", index)


def _add_cameras(to: Application) -> None:
    """Describe the cameras; their modules are imported only where there are some."""
    if not to.spec.cameras and not to.spec.renderers:
        return
    from scene_graph_ros.scene_files.cameras import camera_from_spec
    from scene_graph_ros.scene_files.renderers import added_renderers, check_renderer_of_camera

    with added_renderers(to):
        for index, spec in enumerate(to.spec.cameras):
            if not to.takes(spec.source):
                continue
            located = partial(to.located, "cameras", index)
            source = to.source(spec.source)
            to.frame_id(source, spec.frame, "cameras", index, "frame")
            check_renderer_of_camera(to, index)
            with located("pose"):
                X_PC = pose_from_spec(spec.pose, f"of camera {spec.name!r}")
            name = to.prefix + spec.name
            camera = camera_from_spec(spec, X_PC, name, source.name, located)
            to.cameras[camera.name] = camera

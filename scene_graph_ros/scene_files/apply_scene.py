"""Register a checked scene file in a scene graph, all of it or nothing."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from scene_graph_ros.scene_files.application import Application
from scene_graph_ros.scene_files.filters_in_scene import apply_filters
from scene_graph_ros.scene_files.geometries_in_scene import add_frames, add_geometries
from scene_graph_ros.scene_files.instances import pose_from_spec
from scene_graph_ros.scene_files.loaded_scene import LoadedScene
from scene_graph_ros.scene_files.robots_in_scene import add_robots
from scene_graph_ros.scene_files.scene_file import SceneFile

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph

__all__ = ["apply_scene"]

_MULTI_DOF = "sensor_msgs/msg/MultiDOFJointState"


def apply_scene(scene: SceneFile, scene_graph: SceneGraph, prefix: str) -> LoadedScene:
    """Register the scene; on an error, remove what was registered of it and raise."""
    application = Application(scene, scene_graph, prefix)
    try:
        _add_sources(application)
        add_robots(application)
        add_frames(application)
        add_geometries(application)
        application.make_bodies()
        apply_filters(application)
        _add_cameras(application)
    except BaseException:
        for source in application.sources.values():
            scene_graph.remove_source(source.source_id)
        raise
    return application.loaded()


def _add_sources(to: Application) -> None:
    for index, source in enumerate(to.spec.sources):
        moves = any(frame.source == source.name for frame in to.spec.frames)
        given = source.poses
        pose_type = given.type if given is not None else _MULTI_DOF if moves else ""
        topic = (given.topic or "") if given is not None else ""
        deforms = source.configurations
        interpolates = given is None or given.composition == "interpolated"
        with to.located("sources", index, "name"):
            to.add_source(
                source.name,
                pose_type,
                topic,
                configuration_topic=deforms.topic if deforms is not None else "",
                interpolates=interpolates,
            )


def _add_cameras(to: Application) -> None:
    """Describe the cameras; what they are made of is imported only where there are some."""
    if not to.spec.cameras and not to.spec.renderers:
        return
    from scene_graph_ros.scene_files.cameras import camera_from_spec
    from scene_graph_ros.scene_files.renderers import added_renderers, check_renderer_of_camera

    with added_renderers(to):
        for index, spec in enumerate(to.spec.cameras):
            located = partial(to.located, "cameras", index)
            source = to.source(spec.source)
            to.frame_id(source, spec.frame, "cameras", index, "frame")
            check_renderer_of_camera(to, index)
            with located("pose"):
                X_PC = pose_from_spec(spec.pose, f"of camera {spec.name!r}")
            name = to.prefix + spec.name
            camera = camera_from_spec(spec, X_PC, name, source.name, located)
            to.cameras[camera.name] = camera

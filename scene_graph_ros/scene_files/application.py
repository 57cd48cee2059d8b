"""A scene on its way into a scene graph: the objects so far, and the place in the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
from typing import TYPE_CHECKING

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.located import suggestion
from scene_graph_ros.scene_files.instances import hydroelastic_of
from scene_graph_ros.scene_files.loaded_scene import LoadedRobot, LoadedScene, LoadedSource
from scene_graph_ros.scene_files.packages import resolve_resource
from scene_graph_ros.scene_files.scene_file import SceneFile
from scene_graph_ros.scene_files.schema_handles import HandleSpec

if TYPE_CHECKING:
    from scene_graph_ros.geometry import ProximityProperties, SceneGraph, Shape
    from scene_graph_ros.geometry.model.hydroelastic_properties import HydroelasticProperties
    from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
    from scene_graph_ros.geometry.perception import CameraDescription
    from scene_graph_ros.scene_files.sensor_settings import SensorSettings, VoxelSettings

__all__ = ["Application"]


class Application:
    """The content of a scene file in a scene graph, filled step by step.

    Names in the file are without ``prefix``, which those of sources and anchored geometries get.
    """

    def __init__(self, scene: SceneFile, scene_graph: SceneGraph, prefix: str) -> None:
        self.scene, self.spec = scene, scene.spec
        self.scene_graph = scene_graph
        self.prefix = prefix
        self.sources: dict[str, LoadedSource] = {}
        self.geometries: dict[str, GeometryId] = {}
        self.cameras: dict[str, CameraDescription] = {}
        self.warnings: list[str] = []
        self.doubts: list[str] = []
        self.notes: list[str] = []
        self.texts: dict[str, str] = {}
        """URDFs by the name of the robot, of those that a topic describes."""
        self.pending = frozenset(
            robot.name for robot in self.spec.robots if not isinstance(robot.urdf, str)
        )
        """Robots that are not described yet: what belongs to them has to wait."""
        self.only = ""
        """The one source of which parts are added; empty: of all."""
        self._bodies: list[tuple[tuple[str | int, ...], Shape, HydroelasticProperties]] = []

    def loaded(self) -> LoadedScene:
        """Return the loaded scene."""
        return LoadedScene(
            name=self.spec.name,
            sources=self.sources,
            geometries=self.geometries,
            effects=dict(self.spec.effects),
            cameras=self.cameras,
            servers=tuple(r.name for r in self.spec.renderers if r.type == "gltf_client"),
            warnings=tuple(self.warnings),
            doubts=tuple(self.doubts),
            notes=tuple(self.notes),
        )

    def takes(self, *sources: str) -> bool:
        """Tell whether a part of the file that speaks of these sources is to be added now."""
        if self.only and self.only not in sources:
            return False
        return self.pending.isdisjoint(sources)

    @contextmanager
    def located(self, *path: str | int) -> Iterator[None]:
        """Put the place in the scene file before the message of any error inside."""
        try:
            yield
        except SceneGraphError as error:
            raise self.scene.document.error(str(error), *path) from error

    def add_source(
        self,
        name: str,
        pose_type: str,
        topic: str,
        robot: LoadedRobot | None = None,
        configuration_topic: str = "",
        *,
        points_topic: str = "",
        cloud: str = "",
        sensor: SensorSettings | None = None,
        voxels: VoxelSettings | None = None,
        interpolates: bool = True,
    ) -> LoadedSource:
        """Register a source and take note of it."""
        full_name = self.prefix + name
        source_id = self.scene_graph.register_source(full_name)
        source = LoadedSource(
            source_id,
            full_name,
            pose_type,
            topic,
            robot=robot,
            configuration_topic=configuration_topic,
            points_topic=points_topic,
            cloud=cloud,
            sensor=sensor,
            voxels=voxels,
            interpolates=interpolates,
        )
        self.sources[full_name] = source
        return source

    def take_handle(self, source: LoadedSource, spec: HandleSpec, *path: str | int) -> None:
        """Note how somebody gets a source's handle; raises SceneFileError, with the place."""
        source.is_claimable = spec.claim == "first"
        if spec.token_file is None:
            return
        base, place = self.scene.base, (*path, "token_file")
        if base is None:
            raise self.scene.document.error(
                "only a scene that is a file has files beside it", *place
            )
        folder = base.absolute().parent
        file = Path(os.path.normpath(folder / spec.token_file))
        if file.parent != folder and folder not in file.parent.parents:
            raise self.scene.document.error(
                f"must lie below the scene's folder {str(folder)!r}, got {spec.token_file!r}",
                *place,
            )
        source.token_file, source.token_file_folder = file, folder

    def source(self, name: str) -> LoadedSource:
        """Return the source that the file calls ``name``."""
        return self.sources[self.prefix + name]

    def frame_id(self, source: LoadedSource, name: str, *path: str | int) -> FrameId:
        """Return a source's frame; raises SceneFileError, with the place, where there is none."""
        if name == "world":
            return self.scene_graph.world_frame_id()
        if name not in source.frames:
            raise self.scene.document.error(
                f"source {source.name!r} has no frame {name!r}{suggestion(name, source.frames)}",
                *path,
            )
        return source.frames[name]

    def resolve(self, resource: str, endings: tuple[str, ...] = ()) -> Path:
        """Return the file that an address in the scene means, of a text with its ``endings``."""
        base, packages = self.scene.base, self.scene.packages
        return resolve_resource(resource, base=base, packages=packages, endings=endings)

    def note_body(
        self,
        shape: Shape,
        properties: ProximityProperties | None,
        name: str,
        *path: str | int,
    ) -> None:
        """Check the properties of a geometry, and note the body that it needs."""
        with self.located(*path):
            hydroelastic = hydroelastic_of(shape, properties, name)
        if hydroelastic is not None:
            self._bodies.append((path, shape, hydroelastic))

    def make_bodies(self) -> None:
        """Make bodies, which the core keeps, so that mistakes in shapes are found now.

        Without a compliant one there are no contact surfaces, and nothing is made.
        """
        if any(hydroelastic.is_compliant for _, _, hydroelastic in self._bodies):
            from scene_graph_ros.geometry.hydroelastic.bodies import body_of

            for path, shape, hydroelastic in self._bodies:
                with self.located(*path):
                    body_of(shape, hydroelastic)

"""Register a checked scene file in a scene graph, all of it or nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
)
from scene_graph_ros.geometry.errors import NameConflictError, SceneGraphError
from scene_graph_ros.geometry.model.perception_properties import read_perception_properties
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.located import suggestion
from scene_graph_ros.robots.registration import register_robot
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.semantic_model import SemanticModel
from scene_graph_ros.scene_files.instances import (
    find_embedded_mesh,
    hydroelastic_of,
    instance_from_spec,
    perception_from_spec,
    pose_from_spec,
    properties_from_spec,
)
from scene_graph_ros.scene_files.loaded_scene import LoadedRobot, LoadedScene, LoadedSource
from scene_graph_ros.scene_files.packages import resolve_resource
from scene_graph_ros.scene_files.schema import DeformableSpec, FrameSpec, RobotSpec
from scene_graph_ros.scene_files.srdf import load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf

if TYPE_CHECKING:
    from scene_graph_ros.geometry import ProximityProperties, SceneGraph, Shape
    from scene_graph_ros.geometry.model.hydroelastic_properties import HydroelasticProperties
    from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
    from scene_graph_ros.geometry.perception import CameraDescription
    from scene_graph_ros.scene_files.scene import Scene

__all__ = ["apply_scene"]

_MULTI_DOF = "sensor_msgs/msg/MultiDOFJointState"
_JOINT_STATE = "sensor_msgs/msg/JointState"


def apply_scene(scene: Scene, scene_graph: SceneGraph, prefix: str) -> LoadedScene:
    """Register the scene; on an error, remove what was registered of it and raise."""
    application = _Application(scene, scene_graph, prefix)
    try:
        return application.run()
    except BaseException:
        for source in application.sources.values():
            scene_graph.remove_source(source.source_id)
        raise


class _Application:
    def __init__(self, scene: Scene, scene_graph: SceneGraph, prefix: str) -> None:
        self.scene = scene
        self.spec = scene.spec
        self.scene_graph = scene_graph
        self.prefix = prefix
        self.sources: dict[str, LoadedSource] = {}
        self.geometries: dict[str, GeometryId] = {}
        self.cameras: dict[str, CameraDescription] = {}
        self.warnings: list[str] = []
        self.bodies: list[tuple[tuple[str | int, ...], Shape, HydroelasticProperties]] = []

    def run(self) -> LoadedScene:
        for index, source in enumerate(self.spec.sources):
            moves = any(frame.source == source.name for frame in self.spec.frames)
            given = source.poses
            pose_type = given.type if given is not None else _MULTI_DOF if moves else ""
            topic = (given.topic or "") if given is not None else ""
            deforms = source.configurations
            with self._located("sources", index, "name"):
                self._add_source(
                    source.name,
                    pose_type,
                    topic,
                    configuration_topic=deforms.topic if deforms is not None else "",
                )
        for index, robot in enumerate(self.spec.robots):
            self._add_robot(robot, index)
        self._add_frames()
        self._add_geometries()
        self._make_bodies()
        self._apply_filters()
        self._add_cameras()
        return LoadedScene(
            name=self.spec.name,
            sources=self.sources,
            geometries=self.geometries,
            effects=dict(self.spec.effects),
            cameras=self.cameras,
            warnings=tuple(self.warnings),
        )

    @contextmanager
    def _located(self, *path: str | int) -> Iterator[None]:
        """Put the place in the scene file before the message of whatever is refused inside."""
        try:
            yield
        except SceneGraphError as error:
            raise self.scene.document.error(str(error), *path) from error

    def _add_source(
        self,
        name: str,
        pose_type: str,
        topic: str,
        robot: LoadedRobot | None = None,
        configuration_topic: str = "",
    ) -> LoadedSource:
        full_name = self.prefix + name
        source_id = self.scene_graph.register_source(full_name)
        source = LoadedSource(
            source_id,
            full_name,
            pose_type,
            topic,
            robot=robot,
            configuration_topic=configuration_topic,
        )
        self.sources[full_name] = source
        return source

    def _source(self, name: str) -> LoadedSource:
        return self.sources[self.prefix + name]

    # Robots.

    def _add_robot(self, spec: RobotSpec, index: int) -> None:
        model = self._robot_model(spec, index)
        semantics = self._semantics(spec, model, index)
        positions = self._positions(spec, model, semantics, index)
        with self._located("robots", index, "base"):
            X_WB = pose_from_spec(spec.base, f"base of robot {spec.name!r}")
        with self._located("robots", index, "proximity"):
            proximity = properties_from_spec("proximity", spec.proximity, None)
        with self._located("robots", index, "perception"):
            perception = perception_from_spec(
                spec.perception, spec.label, is_seen=bool(self.spec.cameras)
            )
            if perception is not None:
                read_perception_properties(perception, spec.name)
        frames: dict[str, FrameId] = {}
        robot = LoadedRobot(model, semantics, frames, X_WB, positions, spec.joint_states)
        with self._located("robots", index, "name"):
            source = self._add_source(spec.name, _JOINT_STATE, spec.joint_states, robot)
        with self._located("robots", index, "urdf"):
            frames.update(
                register_robot(
                    model,
                    self.scene_graph,
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
        inspector = self.scene_graph.model_inspector()
        for frame_id in frames.values():
            for geometry_id in inspector.get_geometries(frame_id):
                self._note_body(
                    inspector.get_shape(geometry_id),
                    inspector.get_proximity_properties(geometry_id),
                    inspector.get_name(geometry_id),
                    *("robots", index, "proximity"),
                )

    # Contact surfaces.

    def _note_body(
        self,
        shape: Shape,
        properties: ProximityProperties | None,
        name: str,
        *path: str | int,
    ) -> None:
        """Check the properties of a geometry, and note the body that it needs."""
        with self._located(*path):
            hydroelastic = hydroelastic_of(shape, properties, name)
        if hydroelastic is not None:
            self.bodies.append((path, shape, hydroelastic))

    def _make_bodies(self) -> None:
        """Make bodies, which the core keeps, so that mistakes in shapes are found now.

        Without a compliant one there are no contact surfaces, and nothing is made.
        """
        if any(hydroelastic.is_compliant for _, _, hydroelastic in self.bodies):
            from scene_graph_ros.geometry.hydroelastic.bodies import body_of

            for path, shape, hydroelastic in self.bodies:
                with self._located(*path):
                    body_of(shape, hydroelastic)

    def _resolve(self, resource: str) -> str:
        base, packages = self.scene.base, self.scene.packages
        return str(resolve_resource(resource, base=base, packages=packages))

    def _robot_model(self, spec: RobotSpec, index: int) -> RobotModel:
        packages = self.scene.packages
        with self._located("robots", index, "urdf"):
            model = load_urdf(
                self._resolve(spec.urdf),
                package_map=packages.package_map,
                package_dirs=packages.package_dirs,
            )
        self.warnings.extend(model.warnings)
        return model

    def _semantics(self, spec: RobotSpec, model: RobotModel, index: int) -> SemanticModel | None:
        if spec.srdf is None:
            return None
        with self._located("robots", index, "srdf"):
            semantics = load_srdf(self._resolve(spec.srdf), model)
        self.warnings.extend(semantics.warnings)
        return semantics

    def _positions(
        self,
        spec: RobotSpec,
        model: RobotModel,
        semantics: SemanticModel | None,
        index: int,
    ) -> dict[str, float]:
        """Return the posture to start in: the group state's, overruled by single positions."""
        positions: dict[str, float] = {}
        if spec.group_state is not None and semantics is not None:
            with self._located("robots", index, "group_state"):
                positions.update(semantics.group_state(spec.group_state).positions)
        known = [joint.name for joint in model.positioned_joints()]
        for name, value in spec.positions.items():
            if name not in known:
                raise self.scene.document.error(
                    f"robot {model.name!r} has no joint {name!r} with a position"
                    f"{suggestion(name, known)}",
                    *("robots", index, "positions", name),
                )
            positions[name] = value
        return positions

    # Frames, geometries and filters.

    def _frame_id(self, source: LoadedSource, name: str, *path: str | int) -> FrameId:
        if name == "world":
            return self.scene_graph.world_frame_id()
        if name not in source.frames:
            raise self.scene.document.error(
                f"source {source.name!r} has no frame {name!r}{suggestion(name, source.frames)}",
                *path,
            )
        return source.frames[name]

    def _add_frames(self) -> None:
        names = {(frame.source, frame.name) for frame in self.spec.frames}
        waiting: dict[tuple[str, str], list[tuple[int, FrameSpec]]] = {}
        for index, frame in enumerate(self.spec.frames):
            parent = (frame.source, frame.parent)
            if parent in names and frame.parent not in self._source(frame.source).frames:
                waiting.setdefault(parent, []).append((index, frame))
                continue
            ready = [(index, frame)]
            while ready:
                at, one = ready.pop()
                self._add_frame(one, at)
                ready += reversed(waiting.pop((one.source, one.name), []))
        # The checker refused loops, so each frame's parent came.
        assert not waiting

    def _add_frame(self, frame: FrameSpec, index: int) -> None:
        between_steps()
        source = self._source(frame.source)
        parent = self._frame_id(source, frame.parent, "frames", index, "parent")
        with self._located("frames", index, "name"):
            frame_id = self.scene_graph.register_frame(
                source.source_id, GeometryFrame(frame.name), parent=parent
            )
        with self._located("frames", index, "pose"):
            source.initial_poses[frame_id] = pose_from_spec(frame.pose, f"of frame {frame.name!r}")
        source.frames[frame.name] = frame_id

    def _add_geometries(self) -> None:
        for index, spec in enumerate(self.spec.geometries):
            between_steps()
            source = self._source(spec.source)
            frame_id = self._frame_id(source, spec.frame, "geometries", index, "frame")
            with self._located("geometries", index, "pose"):
                X_FG = pose_from_spec(spec.pose, f"of geometry {spec.name!r}")
            with self._located("geometries", index, "shape"):
                instance = instance_from_spec(
                    spec, X_FG, self._resource, is_seen=bool(self.spec.cameras)
                )
            if spec.frame == "world":
                instance.set_name(self.prefix + spec.name)
            if spec.deformable is not None:
                geometry_id = self._add_deformable(spec.deformable, source, instance, index)
            else:
                geometry_id = self._add_rigid(source, frame_id, instance, index)
            self.geometries[f"{spec.source}/{spec.frame}/{spec.name}"] = geometry_id

    def _add_rigid(
        self, source: LoadedSource, frame_id: FrameId, instance: GeometryInstance, index: int
    ) -> GeometryId:
        place = ("geometries", index, "roles", "proximity", "hydroelastic")
        self._note_body(instance.shape(), instance.proximity_properties(), instance.name(), *place)
        with self._located("geometries", index, "name"):
            return self.scene_graph.register_geometry(source.source_id, frame_id, instance)

    def _add_deformable(
        self, spec: DeformableSpec, source: LoadedSource, instance: GeometryInstance, index: int
    ) -> GeometryId:
        for role in ("proximity", "illustration", "perception"):
            with self._located("geometries", index, "roles", role, "deformable"):
                find_embedded_mesh(instance, role, self._resource)
        world = self.scene_graph.model_inspector().world_frame_id()
        try:
            return self.scene_graph.register_deformable_geometry(
                source.source_id, world, instance, spec.resolution_hint
            )
        except SceneGraphError as error:
            is_name = isinstance(error, NameConflictError)
            place = "name" if is_name else "deformable"
            raise self.scene.document.error(str(error), "geometries", index, place) from error

    def _resource(self, resource: str) -> Path:
        return Path(self._resolve(resource))

    # Cameras.

    def _add_cameras(self) -> None:
        """Describe the cameras; what they are made of is imported only where there are some."""
        if not self.spec.cameras:
            return
        from scene_graph_ros.scene_files.cameras import add_renderer, camera_from_spec

        for index, spec in enumerate(self.spec.cameras):
            located = partial(self._located, "cameras", index)
            source = self._source(spec.source)
            self._frame_id(source, spec.frame, "cameras", index, "frame")
            with located("pose"):
                X_PC = pose_from_spec(spec.pose, f"of camera {spec.name!r}")
            name = self.prefix + spec.name
            camera = camera_from_spec(spec, X_PC, name, source.name, located)
            self.cameras[camera.name] = camera
        # After all that may fail: it stays where the rest is taken back.
        add_renderer(self.scene_graph)

    # Filters.

    def _apply_filters(self) -> None:
        manager = self.scene_graph.collision_filter_manager()
        for index, spec in enumerate(self.spec.collision_filters):
            declaration = CollisionFilterDeclaration()
            place: tuple[str | int, ...] = ("collision_filters", index)
            if spec.within is not None:
                members = self._members(spec.within, *place, "within")
                method = f"{spec.action}_within"
                getattr(declaration, method)(members)
            else:
                assert spec.between is not None
                sets = [
                    self._members(names, *place, "between", i)
                    for i, names in enumerate(spec.between)
                ]
                method = f"{spec.action}_between"
                getattr(declaration, method)(*sets)
            with self._located(*place):
                manager.apply(declaration)

    def _members(self, references: list[str], *path: str | int) -> GeometrySet:
        """Return the geometries that "source", "source/frame" or "source/frame/name" mean."""
        result = GeometrySet()
        for index, reference in enumerate(references):
            source_name, _, rest = reference.partition("/")
            source = self._source(source_name)
            frame_name, _, name = rest.partition("/")
            place = (*path, index)
            if not rest:
                result.add(source.frames.values(), self._anchored(source_name))
            elif name:
                result.add(self._geometry(source_name, frame_name, name, *place))
            elif frame_name == "world":
                result.add(self._anchored(source_name))
            else:
                result.add(self._frame_id(source, frame_name, *place))
        return result

    def _anchored(self, source: str) -> list[GeometryId]:
        start = f"{source}/world/"
        return [gid for path, gid in self.geometries.items() if path.startswith(start)]

    def _geometry(self, source: str, frame: str, name: str, *path: str | int) -> GeometryId:
        full = f"{source}/{frame}/{name}"
        if full in self.geometries:
            return self.geometries[full]
        frame_id = self._frame_id(self._source(source), frame, *path)
        inspector = self.scene_graph.model_inspector()
        for geometry_id in inspector.get_geometries(frame_id):
            if inspector.get_name(geometry_id) == name:
                return geometry_id
        raise self.scene.document.error(
            f"frame {frame!r} of source {source!r} has no geometry {name!r}", *path
        )

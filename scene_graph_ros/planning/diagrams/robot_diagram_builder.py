"""Robots and a scene around them, put together piece by piece."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import SourceId
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.located import suggestion
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.robots import register_robot
from scene_graph_ros.robots.tree_joint import KinematicTreeError
from scene_graph_ros.scene_files import load_scene, load_srdf, load_urdf, LoadedRobot, LoadedScene

__all__ = ["DiagramBuiltError", "RobotDiagramBuilder"]


class DiagramBuiltError(SceneGraphError, RuntimeError):
    """A builder was asked for something after it had built its diagram."""


class _Added(NamedTuple):
    """The parts that were added at once. They count while their sources are registered."""

    sources: frozenset[SourceId]
    robots: dict[str, LoadedRobot]
    scene: LoadedScene | None = None


@one_line("scene_graph")
class RobotDiagramBuilder:
    """Makes a `RobotDiagram` of robots, scene files, and geometry that is registered by hand.

    All but `is_diagram_built` raises DiagramBuiltError once it is built.
    """

    def __init__(self) -> None:
        """Begin with an empty scene graph."""
        self._scene_graph = SceneGraph()
        self._added: list[_Added] = []
        self._is_built = False

    def is_diagram_built(self) -> bool:
        """Tell whether `build` was called."""
        return self._is_built

    @property
    def scene_graph(self) -> SceneGraph:
        """Where all is registered, to register more."""
        self._require_open("scene_graph")
        return self._scene_graph

    def add_scene(self, path: str | Path, *, prefix: str = "") -> LoadedScene:
        """Read a scene file, with its robots; return the outcome.

        ``prefix`` goes before the names of its sources and anchored geometries. Raises
        SceneFileError naming file, line and key, and then has added nothing.
        """
        self._require_open("add_scene")
        read = load_scene(path)

        def add() -> LoadedScene:
            scene = read.apply(self._scene_graph, prefix=prefix)
            named = scene.sources.values()
            robots = {source.name: source.robot for source in named if source.robot is not None}
            sources = frozenset(source.source_id for source in named)
            self._added.append(_Added(sources, robots, scene))
            return scene

        return self._scene_graph.all_or_nothing(add)

    def add_robot(
        self,
        name: str,
        urdf: str | Path,
        srdf: str | Path | None = None,
        *,
        X_WB: ArrayLike | None = None,
        positions: Mapping[str, float] | None = None,
        filter_adjacent: bool = False,
        all_links: bool = False,
    ) -> LoadedRobot:
        """Read a robot as a source of this name, with its base at ``X_WB`` ``(4, 4)``.

        The pairs of links that the SRDF disables are filtered, and with ``filter_adjacent`` those
        of neighbours. ``all_links`` makes bodies of links without geometry, too, to which shapes
        may be added. ``positions`` are where joints start by name, 0 without. Raises
        SceneFileError, InvalidPoseError, KinematicTreeError for a joint that is not there,
        JointStateError for its position, and NameConflictError for a name that is taken; then it
        has added nothing.
        """
        self._require_open("add_robot")
        pose = np.eye(4) if X_WB is None else as_pose(X_WB, f"X_WB of robot {name!r}")
        model = load_urdf(urdf)
        semantics = None if srdf is None else load_srdf(srdf, model)
        known = [joint.name for joint in model.positioned_joints()]
        for joint in positions or {}:
            if joint not in known:
                raise KinematicTreeError(
                    f"positions: robot {name!r} has no joint {joint!r} with a position"
                    f"{suggestion(joint, known)}"
                )

        def add() -> LoadedRobot:
            source = self._scene_graph.register_source(name)
            frames = register_robot(
                model,
                self._scene_graph,
                source,
                semantics=semantics,
                filter_adjacent=filter_adjacent,
                all_links=all_links,
            )
            robot = LoadedRobot(model, semantics, frames, pose, dict(positions or {}), "")
            robot.frame_poses()
            self._added.append(_Added(frozenset([source]), {name: robot}))
            return robot

        return self._scene_graph.all_or_nothing(add)

    def build(self) -> RobotDiagram:
        """Return the robots and the scene, all where it starts.

        Where there are several robots, names begin with the robot's and a slash. Raises
        KinematicTreeError where there is none, and then more can be added.
        """
        self._require_open("build")
        is_there = self._scene_graph.source_is_registered
        added = [each for each in self._added if all(map(is_there, each.sources))]
        robots = {name: robot for each in added for name, robot in each.robots.items()}
        if not robots:
            raise KinematicTreeError("the diagram has no robot to plan for")
        context = self._scene_graph.create_default_context()
        for scene in (each.scene for each in added if each.scene is not None):
            scene.set_initial_poses(context)
        inspector = context.inspector()
        for robot in robots.values():
            poses = robot.frame_poses()
            if poses:
                context.set_frame_poses(inspector.get_owning_source_id(next(iter(poses))), poses)
        result = RobotDiagram.of_loaded(robots, self._scene_graph, context)
        self._is_built = True
        return result

    def _require_open(self, what: str) -> None:
        if self._is_built:
            raise DiagramBuiltError(f"{what}: the diagram is built, so nothing can be added to it")

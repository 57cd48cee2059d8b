"""Robots and the scene that they are in, as one model that planning asks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from scene_graph_ros.geometry import QueryObject, SceneGraph
from scene_graph_ros.geometry.model.memory import Memory
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import KinematicTreeError
from scene_graph_ros.scene_files import load_scene

if TYPE_CHECKING:
    from scene_graph_ros.geometry import Context
    from scene_graph_ros.geometry.model.ids import FrameId
    from scene_graph_ros.scene_files import LoadedScene
    from scene_graph_ros.scene_files.loaded_scene import LoadedRobot

__all__ = ["RobotDiagram", "load_robot_diagram"]


@one_line()
@dataclass(frozen=True, eq=False)
class RobotDiagram:
    """Robots in a scene graph.

    ``tree`` has the joints and links of all robots, in whose configurations q planning speaks;
    ``frames`` are its links' frames, where they have one. Where there are several robots, names
    begin with the robot's and a slash. All else in the scene is where ``context`` has it. In a
    notebook it shows itself, and ``query(q)`` another configuration.
    """

    scene_graph: SceneGraph
    context: Context
    tree: KinematicTree
    frames: Mapping[str, FrameId]

    def query(self, q: ArrayLike) -> QueryObject:
        """Return the query object of the scene with the robots at q ``(nq,)``; it also draws it.

        Raises KinematicTreeError for another shape and values that are not finite.
        """
        snapshot = self.context.snapshot
        links = tuple(self.frames)
        X_WF = dict(zip(self.frames.values(), self.tree.link_poses(q, links), strict=True))
        inspector, world = snapshot.inspector, snapshot.inspector.world_frame_id()
        poses = {}
        for frame, X in X_WF.items():
            parent = inspector.get_parent_frame(frame)
            if parent == world:
                poses[frame] = X
            else:
                X_WP = X_WF.get(parent)
                base = snapshot.pose_in_world(parent) if X_WP is None else X_WP
                poses[frame] = np.linalg.inv(base) @ X
        return QueryObject(snapshot.with_frame_poses(poses, memory=Memory()))

    def _repr_html_(self) -> str:
        return QueryObject(self.context.snapshot)._repr_html_()

    @classmethod
    def of_scene(cls, scene_graph: SceneGraph, scene: LoadedScene) -> RobotDiagram:
        """Return the robots of a scene file that was applied to a scene graph.

        All is where the file puts it. Raises KinematicTreeError where there is no robot.
        """
        robots = {s.name: s.robot for s in scene.sources.values() if s.robot is not None}
        if not robots:
            raise KinematicTreeError(f"scene {scene.name!r} has no robot to plan for")
        context = scene_graph.create_default_context()
        scene.set_initial_poses(context)
        return cls.of_loaded(robots, scene_graph, context, name=scene.name)

    @classmethod
    def of_loaded(
        cls,
        robots: Mapping[str, LoadedRobot],
        scene_graph: SceneGraph,
        context: Context,
        *,
        name: str = "scene",
    ) -> RobotDiagram:
        """Return robots by name; only of several do the names of joints begin with the robot's."""
        if len(robots) == 1:
            (robot,) = robots.values()
            tree = robot.model.kinematic_tree(robot.semantics).at(robot.X_WB)
            return cls(scene_graph, context, tree, MappingProxyType(dict(robot.link_frames)))
        return cls.of_robots(robots, scene_graph, context, name=name)

    @classmethod
    def of_robots(
        cls,
        robots: Mapping[str, LoadedRobot],
        scene_graph: SceneGraph,
        context: Context,
        *,
        name: str = "scene",
        bases: Mapping[str, ArrayLike] | None = None,
    ) -> RobotDiagram:
        """Return robots by name, as one; also where there is one, its names begin with its own.

        ``bases`` are poses ``(4, 4)`` of root links that are not where they began. Links
        whose frames are not in the context any more have none.
        """
        there = set(context.inspector().get_all_frame_ids())
        tree = KinematicTree(name, (), ("world",), (0,), np.eye(4)[np.newaxis])
        frames: dict[str, FrameId] = {}
        for prefix, robot in robots.items():
            own = robot.model.kinematic_tree(robot.semantics)
            X_WB = robot.X_WB if bases is None else bases.get(prefix, robot.X_WB)
            tree = tree.attached(own, "world", X_WB, prefix=f"{prefix}/")
            frames.update(
                {f"{prefix}/{link}": f for link, f in robot.carriers.items() if f in there}
            )
        return cls(scene_graph, context, tree, MappingProxyType(frames))


def load_robot_diagram(path: str | Path) -> RobotDiagram:
    """Read a scene file and return its robots, ready to plan for.

    Raises SceneFileError naming file, line and key, and KinematicTreeError where it has no robot.
    """
    scene_graph = SceneGraph()
    return RobotDiagram.of_scene(scene_graph, load_scene(path).apply(scene_graph))

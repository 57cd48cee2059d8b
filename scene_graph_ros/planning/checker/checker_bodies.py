"""The bodies that a collision checker speaks of: links of robots, and all other frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.planning.checker.robot_instances import RobotInstances
from scene_graph_ros.planning.errors import CollisionCheckerError
from scene_graph_ros.planning.pairs.checker_plan import carrier
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["AnyBody", "CheckerBodies", "CheckerBody"]


@one_line()
@dataclass(frozen=True)
class CheckerBody:
    """A frame of the scene with all geometries on it."""

    index: int
    name: str
    """A link's in the tree of robots, or world; else the frame's source, a slash, and its own."""
    model_instance_name: str
    """The source's."""
    body_name: str
    """The frame's."""
    frame_id: FrameId
    link: int
    """The link (row of the tree) that it is or that carries it; -1 where no joint moves it."""


AnyBody: TypeAlias = CheckerBody | FrameId | int | str
"""A body, its frame, its index, or its name."""


class CheckerBodies:
    """All bodies of a scene: links of robots and carried geometry come first."""

    def __init__(
        self,
        snapshot: Snapshot,
        tree: KinematicTree,
        frames: Mapping[str, FrameId],
        instances: RobotInstances,
    ) -> None:
        """``frames`` are those of the tree's links, by name."""
        inspector = snapshot.inspector
        self._without_frame = frozenset(tree.link_names) - frozenset(frames) - {"world"}
        links = {int(frame): tree.link_index(name) for name, frame in frames.items()}
        names = {int(inspector.world_frame_id()): "world"}
        names |= {int(frame): name for name, frame in frames.items()}
        found = []
        for frame in inspector.get_all_frame_ids():
            link, _ = carrier(inspector, frame, links)
            source, own = inspector.get_owning_source_name(frame), inspector.get_name(frame)
            name = names.get(int(frame), f"{source}/{own}")
            found.append((not instances.has(link), int(frame), name, source, own, frame, link))
        found.sort(key=lambda each: each[:2])
        self.all = tuple(
            CheckerBody(index, name, source, own, frame, link)
            for index, (_, _, name, source, own, frame, link) in enumerate(found)
        )
        self.num_robot_bodies = sum(instances.has(body.link) for body in self.all)

    @cached_property
    def index_of_frame(self) -> dict[FrameId, int]:
        """Each frame's body."""
        return {body.frame_id: body.index for body in self.all}

    @cached_property
    def _index_of_name(self) -> dict[str, int]:
        full = {f"{body.model_instance_name}/{body.body_name}": body.index for body in self.all}
        return full | {body.name: body.index for body in self.all}

    def __len__(self) -> int:
        return len(self.all)

    def find(self, body: AnyBody, field: str = "body") -> CheckerBody:
        """Return a body. Raises CollisionCheckerError naming the field where there is none."""
        index: Any = body
        if isinstance(body, CheckerBody):
            index = self.index_of_frame.get(body.frame_id)
        elif isinstance(body, FrameId):
            index = self.index_of_frame.get(body)
        elif isinstance(body, str):
            index = self._index_of_name.get(body)
            if body in self._without_frame:
                raise CollisionCheckerError(
                    f"{field}: link {quoted(body)} has no geometry, so no frame in the scene: load"
                    " its robot with all_links"
                )
            if index is None:
                near = suggestion(body, self._index_of_name)
                raise CollisionCheckerError(f"{field}: there is no body {quoted(body)}{near}")
        if index is None or isinstance(index, bool) or not isinstance(index, int):
            raise CollisionCheckerError(f"{field}: there is no body {quoted(body)}")
        if not 0 <= index < len(self.all):
            raise CollisionCheckerError(
                f"{field}: there is no body {index}; there are {len(self.all)}"
            )
        return self.all[index]

    def is_part_of_robot(self, index: int) -> bool:
        """Tell whether a body is a link of the checker's robots, or carried by one."""
        return index < self.num_robot_bodies

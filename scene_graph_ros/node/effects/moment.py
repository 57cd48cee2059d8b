"""The moment that the view in a browser shows: a snapshot and its contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.node.effects.answer_thread import Found
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.draggable import DraggableRobot
from scene_graph_ros.views.moment import Contacts, Trouble
from scene_graph_ros.views.sliders import Slider, SliderState

__all__ = ["SnapshotMoment"]


class SnapshotMoment(NamedTuple):
    """A snapshot, and the newest contact surfaces: where these are late, of an earlier one."""

    snapshot: WorldSnapshot
    found: Found | None
    pressure_scale: float
    look: Callable[[str, WorldSnapshot], bytes] | None = None
    """What a camera sees as a PNG file; None where there are no pictures."""
    sliders: tuple[Slider, ...] = ()
    """Joints that pages may move."""
    refused: Mapping[str, str] = {}
    """Why the joints of a robot can't be moved now."""
    slider_sequence: int = 0
    """Another number for each such mapping."""
    troubles: tuple[Trouble, ...] = ()
    draggable: tuple[DraggableRobot, ...] = ()
    """Robots whose links pages may drag."""
    """What diagnostics say that is not as it should be."""

    @property
    def query(self) -> QueryObject:
        """Answers about the snapshot."""
        return self.snapshot.query

    @property
    def inspector(self) -> Any:
        """Introspects its model."""
        return self.snapshot.inspector

    @property
    def scene_version(self) -> int:
        """That of the snapshot."""
        return self.snapshot.scene_version

    @property
    def sequence(self) -> int:
        """That of the snapshot."""
        return self.snapshot.sequence

    @property
    def stamp(self) -> int:
        """That of the snapshot."""
        return self.snapshot.stamp

    @property
    def contact_sequence(self) -> int:
        """That of the snapshot whose surfaces there are."""
        return -1 if self.found is None else self.found.snapshot.sequence

    @property
    def cameras(self) -> tuple[str, ...]:
        """Those of the snapshot whose pictures can be asked for."""
        return () if self.look is None else tuple(sorted(self.snapshot.cameras))

    def picture(self, camera: str) -> bytes:
        """Return a camera's image of the snapshot."""
        return b"" if self.look is None else self.look(camera, self.snapshot)

    def slider_state(self) -> SliderState:
        """Return the positions of the joints that may be moved."""
        where = {
            robot: dict(zip(record.kinematics.position_names, positions.tolist(), strict=True))
            for robot, record in self.snapshot.robots.robots.items()
            for positions in (self.snapshot.positions[robot],)
        }
        positions = tuple(where[slider.robot][slider.joint] for slider in self.sliders)
        return SliderState(positions, self.refused)

    def contacts(self) -> Contacts:
        """Return the contacts: surfaces and the points beside them are of the same snapshot."""
        if self.found is None:
            return Contacts(self.snapshot.ask(QueryObject.compute_point_pair_penetration))
        surfaces, points = self.found.answer
        return Contacts(points, surfaces, self.pressure_scale)

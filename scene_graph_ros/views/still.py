"""One moment of a scene without a node, to be drawn."""

from __future__ import annotations

from typing import Any, NamedTuple

from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.results import Penetrations
from scene_graph_ros.views.draggable import DraggableRobot
from scene_graph_ros.views.moment import Contacts, Trouble
from scene_graph_ros.views.sliders import Slider, SliderState

__all__ = ["StillMoment"]


class StillMoment(NamedTuple):
    """The world of a query object. It has no cameras, joints or stamps."""

    query: QueryObject
    """Of one snapshot."""
    points: Penetrations
    """What touches."""

    @property
    def inspector(self) -> Any:
        """Introspects the model."""
        return self.query.inspector()

    @property
    def scene_version(self) -> int:
        """That of the model."""
        return self.query.snapshot.model_version

    @property
    def sequence(self) -> int:
        """There is no other moment."""
        return 0

    @property
    def stamp(self) -> int:
        """No message moved anything."""
        return 0

    @property
    def contact_sequence(self) -> int:
        """There is one answer."""
        return 0

    @property
    def cameras(self) -> tuple[str, ...]:
        """None."""
        return ()

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """None."""
        return ()

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """None."""
        return ()

    @property
    def draggable(self) -> tuple[DraggableRobot, ...]:
        """None."""
        return ()

    @property
    def slider_sequence(self) -> int:
        """There is one state."""
        return 0

    def slider_state(self) -> SliderState:
        """Return that of no joint."""
        return SliderState((), {})

    def contacts(self) -> Contacts:
        """Return the contacts at points."""
        return Contacts(self.points)

    def picture(self, camera: str) -> bytes:
        """Return nothing: there are no cameras."""
        return b""

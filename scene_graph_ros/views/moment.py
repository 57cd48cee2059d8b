"""The world at one time, as views need it."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.views.draggable import DraggableRobot
from scene_graph_ros.views.sliders import Slider, SliderState

__all__ = ["Contacts", "Moment", "Trouble"]


class Trouble(NamedTuple):
    """Something that is not as it should be."""

    level: str
    """``warning``, ``error`` or ``stale``."""
    name: str
    text: str


class Contacts(NamedTuple):
    """Contacts, as tables of answers."""

    points: Any
    """Penetrations of the pairs without a surface."""
    surfaces: Any = None
    """Contact surfaces, None where nothing asks for them."""
    pressure_scale: float = 0.0
    """Pa. What they show in red."""


class Moment(Protocol):
    """The world at one time. Nothing in it changes any more."""

    @property
    def query(self) -> QueryObject:
        """Answers about a snapshot."""

    @property
    def inspector(self) -> Any:
        """Introspects the model of the snapshot."""

    @property
    def scene_version(self) -> int:
        """Another number for each model."""

    @property
    def sequence(self) -> int:
        """Another number for each moment."""

    @property
    def stamp(self) -> int:
        """Of the newest pose, in nanoseconds of the clock that stamps poses."""

    @property
    def contact_sequence(self) -> int:
        """Another number for each answer of ``contacts``, where that comes later than the rest."""

    @property
    def cameras(self) -> tuple[str, ...]:
        """Name the cameras whose pictures can be asked for: others with another scene version."""

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """Troubles, as diagnostics have them; none where all is well."""

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """The joints that may be moved: others with another scene version."""

    @property
    def draggable(self) -> tuple[DraggableRobot, ...]:
        """The robots whose links may be dragged: others with another scene version."""

    @property
    def slider_sequence(self) -> int:
        """Another number for each change of which of them can't be moved."""

    def slider_state(self) -> SliderState:
        """Return the positions of these joints."""

    def contacts(self) -> Contacts:
        """Return the contacts."""

    def picture(self, camera: str) -> bytes:
        """Return a camera's image as a PNG file, empty where it sees nothing."""

"""Lights of a scene that is traced."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.perception.checked_fields import checked_number, checked_vector
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["LightParameter"]

_TYPES = ("directional", "point", "spot")
_FRAMES = ("world", "camera")
_MAX_INTENSITY = 1e6
_MAX_PLACE = 1e9


@one_line()
@dataclass(frozen=True, slots=True)
class LightParameter:
    """A light. Of intensity 1, it lights a white surface that faces it to full white.

    A "point" light and a "spot" do so at a distance of 1 m, and fall off with the square of the
    distance. A spot lights points within ``cone_angle``, radians, of its ``direction``, the way
    that light takes, softer towards the edge. ``position`` (m) and ``direction`` are in ``frame``:
    the "world", or the "camera", whose axes are those of images: x right, y down, z ahead.

    Raises EngineError, naming field and value.
    """

    type: str = "directional"
    color: Rgba = field(default_factory=lambda: Rgba(1.0, 1.0, 1.0))
    intensity: float = 1.0
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    frame: str = "camera"
    cone_angle: float = 0.5

    def __post_init__(self) -> None:
        for name, known in (("type", _TYPES), ("frame", _FRAMES)):
            if getattr(self, name) not in known:
                raise EngineError(
                    f"LightParameter: {name} must be one of {', '.join(known)}, not"
                    f" {quoted(getattr(self, name))}"
                )
        values = {
            "color": Rgba.from_value(self.color),
            "intensity": checked_number(self, "intensity", 0.0, _MAX_INTENSITY),
            "position": checked_vector(self, "position", _MAX_PLACE),
            "direction": checked_vector(self, "direction", _MAX_PLACE, is_direction=True),
            "cone_angle": checked_number(self, "cone_angle", 1e-3, 0.5 * math.pi),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

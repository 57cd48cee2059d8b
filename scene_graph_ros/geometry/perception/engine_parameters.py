"""The common part of the renderers' parameters: default colours, and how they are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import json
from typing import Any

from scene_graph_ros.geometry.model.rgba import Rgba

__all__ = ["CLEAR_COLOR", "DIFFUSE", "parameters_as_yaml", "take_colors"]

DIFFUSE = Rgba(0.9, 0.7, 0.2)
"""The colour of geometries that have none."""
CLEAR_COLOR = Rgba(204 / 255, 229 / 255, 1.0)
"""The colour of pixels that see nothing."""


def take_colors(engine: object, names: Iterable[str]) -> None:
    """Make an Rgba of fields of a frozen dataclass. Raises PropertyError for other values."""
    for name in names:
        object.__setattr__(engine, name, Rgba.from_value(getattr(engine, name)))


def parameters_as_yaml(engine: object, values: Mapping[str, Any]) -> str:
    """Return parameters as YAML, a line each, below the type's name; colours as four numbers."""
    plain = {
        name: value.as_array().tolist() if isinstance(value, Rgba) else value
        for name, value in values.items()
    }
    lines = [f"  {name}: {json.dumps(value)}\n" for name, value in plain.items()]
    return f"{type(engine).__name__}:\n{''.join(lines)}"

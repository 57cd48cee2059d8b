"""One parameter of the node: its default, and the values that it takes."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Any

__all__ = ["GIVEN_BY_ROS", "Parameter", "Value"]

GIVEN_BY_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""Parameters that every node has, and what comes before those of its topics."""

Value = bool | int | float | str


@dataclass(frozen=True)
class Parameter:
    """One parameter; its type is that of its default."""

    name: str
    default: Value
    description: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    read_only: bool = False
    is_secret: bool = False
    """Whether nobody who asks is told its value."""

    def problem(self, value: Any) -> str | None:
        """Return the fault of ``value`` for this parameter alone, or None."""
        if not _has_type(value, self.default):
            wanted = _TYPE_NAMES[type(self.default)]
            told = f"a value of type {type(value).__name__}" if self.is_secret else repr(value)
            return f"{self.name} must be {wanted}, not {told}"
        if self.choices and value not in self.choices:
            return f"{self.name} must be one of {', '.join(self.choices)}, not {value!r}"
        if isinstance(value, (bool, str)):
            return None
        if isinstance(value, float) and not math.isfinite(value):
            return f"{self.name} must be finite, not {value!r}"
        if self.minimum is not None and value < self.minimum:
            return f"{self.name} must be at least {self.minimum}, not {value!r}"
        if self.maximum is not None and value > self.maximum:
            return f"{self.name} must be at most {self.maximum}, not {value!r}"
        return None


_TYPE_NAMES = {bool: "true or false", int: "an integer", float: "a number", str: "a string"}


def _has_type(value: Any, default: Value) -> bool:
    # A bool is an int to Python, but not to ROS. A whole number does where one is asked for.
    return type(value) is type(default) or (type(default) is float and type(value) is int)

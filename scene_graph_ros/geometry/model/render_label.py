"""The label of a camera's pixel: the kind of thing that it sees."""

from __future__ import annotations

import operator
from typing import Any, ClassVar

from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["RenderLabel"]

_NAMES = {32767: "UNSPECIFIED", 32766: "EMPTY", 32765: "DO_NOT_RENDER", 32764: "DONT_CARE"}


class RenderLabel(int):
    """A whole number from 0 to MAX_FREE that its user gives a meaning, or a reserved one.

    Label images are made of their values, as int16. Several geometries may share a label.
    """

    MAX_FREE: ClassVar[int] = 32763
    """The largest label with a meaning of the user's."""
    UNSPECIFIED: ClassVar[RenderLabel]
    """Not a label yet; no geometry can have it."""
    EMPTY: ClassVar[RenderLabel]
    """A pixel that sees nothing; no geometry can have it."""
    DO_NOT_RENDER: ClassVar[RenderLabel]
    """Of a geometry that label images leave out, as if it were not there."""
    DONT_CARE: ClassVar[RenderLabel]
    """Of a geometry that is there, but of no interest: the label of those that are given none."""

    def __new__(cls, value: Any) -> RenderLabel:
        """Raise PropertyError unless ``value`` is a whole number from 0 to 32767."""
        if isinstance(value, bool):
            raise PropertyValueError(f"a render label must be a whole number, not {quoted(value)}")
        try:
            number = operator.index(value)
        except TypeError as error:
            raise PropertyValueError(
                f"a render label must be a whole number, not {quoted(value)}"
            ) from error
        if not (0 <= number <= cls.MAX_FREE or number in _NAMES):
            raise PropertyValueError(
                f"a render label must be between 0 and {cls.MAX_FREE}, not {quoted(value)}"
            )
        return super().__new__(cls, number)

    def is_reserved(self) -> bool:
        """Tell whether the label has a meaning of its own, and none of the user's."""
        return int(self) > self.MAX_FREE

    def __repr__(self) -> str:
        return f"RenderLabel({_NAMES.get(int(self), int(self))})"


RenderLabel.UNSPECIFIED = RenderLabel(32767)
RenderLabel.EMPTY = RenderLabel(32766)
RenderLabel.DO_NOT_RENDER = RenderLabel(32765)
RenderLabel.DONT_CARE = RenderLabel(32764)

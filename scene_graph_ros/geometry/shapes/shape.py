"""The common part of all shapes, and the checks of their parameters."""

from __future__ import annotations

import abc
import dataclasses
import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tolerances import MAX_SHAPE_SIZE, MIN_SHAPE_SIZE

__all__ = ["PrimitiveShape", "Shape", "symmetric_bounds"]


class Shape:
    """A shape in its canonical frame G. Shapes are immutable; equal parameters mean equal shapes.

    Lengths are in metres.
    """

    __slots__ = ()
    kind: ClassVar[ShapeKind]

    @property
    def type_name(self) -> str:
        """The name of the shape's class, e.g. ``"Sphere"``."""
        return type(self).__name__


class PrimitiveShape(Shape, abc.ABC):
    """A shape that a few numbers describe completely: the fields of a frozen dataclass."""

    __slots__ = ()
    may_be_point: ClassVar[bool] = False
    """Whether a size may be 0, besides those from MIN_SHAPE_SIZE on."""

    def __post_init__(self) -> None:
        """Store every size as ``float``. Raises InvalidShapeError for one out of range."""
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            size = _checked_size(self, field.name, getattr(self, field.name))
            object.__setattr__(self, field.name, size)

    @abc.abstractmethod
    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lower and upper corner ``(3,)`` of the tight box around the shape in G."""

    @abc.abstractmethod
    def volume(self) -> float:
        """Return the volume in m^3; infinite for a half space."""


def _checked_size(shape: PrimitiveShape, field: str, value: Any) -> float:
    """Return a size parameter in metres as ``float``.

    Raises InvalidShapeError, naming shape, field and value, unless it is a finite number between
    MIN_SHAPE_SIZE and MAX_SHAPE_SIZE, or 0 where the shape may be a point.
    """
    label = f"{shape.type_name}: {field}"
    size = as_float(value)
    if size is None:
        raise InvalidShapeError(f"{label} must be a number, not {quoted(value)}")
    may_be_zero = shape.may_be_point
    if not math.isfinite(size) or size < 0.0 or (size == 0.0 and not may_be_zero):
        sign = "at least 0" if may_be_zero else "positive"
        raise InvalidShapeError(f"{label} must be {sign} and finite, not {quoted(value)}")
    if size != 0.0 and not MIN_SHAPE_SIZE <= size <= MAX_SHAPE_SIZE:
        point = "0 or " if may_be_zero else ""
        raise InvalidShapeError(
            f"{label} must be {point}between {MIN_SHAPE_SIZE:g} and {MAX_SHAPE_SIZE:g} m,"
            f" not {quoted(value)}"
        )
    return size


def symmetric_bounds(
    half_extents: tuple[float, float, float],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners ``-h`` and ``h`` of a box centred on the origin."""
    upper = np.array(half_extents)
    return -upper, upper

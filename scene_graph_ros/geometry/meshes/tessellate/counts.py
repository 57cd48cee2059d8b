"""From a resolution hint to numbers of elements, and the refusal of those that are too many."""

from __future__ import annotations

import math

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["MAX_ELEMENTS", "checked_count", "divisions", "required_hint"]

MAX_ELEMENTS = 2_000_000
"""Triangles or tetrahedra of one shape: a hundred times what a contact needs, and about 1 GB."""


def required_hint(shape: Shape, resolution_hint: float | None) -> float:
    """Return the wanted length of edges, in metres.

    Raises:
        PropertyError: it is missing for a curved shape, or not a positive finite number.

    """
    if resolution_hint is None:
        raise PropertyValueError(
            f"{shape!r} is curved: its mesh needs a resolution_hint, the length of its edges in"
            " metres"
        )
    if not (math.isfinite(resolution_hint) and resolution_hint > 0.0):
        raise PropertyValueError(
            f"the resolution_hint of {shape!r} must be positive and finite, not"
            f" {resolution_hint!r}"
        )
    return resolution_hint


def divisions(length: float, resolution_hint: float, *, at_least: int) -> int:
    """Return into how many parts a length is cut so that none is longer than the hint.

    The count may be huge, or so large that it is stopped at a float's largest integer: it is
    for ``checked_count`` to refuse it.
    """
    parts = min(length / resolution_hint, 1e18)
    return max(at_least, math.ceil(parts))


def checked_count(shape: Shape, resolution_hint: float, size: float, elements: int) -> None:
    """Refuse more than MAX_ELEMENTS.

    Args:
        shape: whose mesh it would be.
        resolution_hint: metres.
        size: metres, to be divided by the hint.
        elements: how many the mesh would have.

    Raises:
        MeshError: they are too many; names the shape, its size, the hint and the number.

    """
    if elements > MAX_ELEMENTS:
        raise MeshError(
            f"resolution_hint {resolution_hint:g} m of {shape!r}, {size:g} m in size, asks for"
            f" {elements:.3g} elements; more than {MAX_ELEMENTS} are refused: make it larger"
        )

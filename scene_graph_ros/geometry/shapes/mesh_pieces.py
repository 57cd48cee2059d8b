"""How a mesh is taken apart into convex pieces."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["BY_COACD", "BY_OBJECTS", "MeshPieces"]

BY_OBJECTS = "objects"
BY_COACD = "coacd"


class MeshPieces(NamedTuple):
    """A mesh means the union of the convex hulls of its pieces, which are one of these."""

    by: str
    """BY_OBJECTS: the objects of an OBJ file; BY_COACD: what CoACD splits the solid into."""
    threshold: float = 0.0
    """Of CoACD: how concave a piece may be, as a part of the mesh's size."""
    seed: int = 0
    """Of CoACD, which searches at random."""

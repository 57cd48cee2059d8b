"""The report on the triangles of a mesh, in numbers and in one sentence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["MeshReport", "PiecesReport", "Repair", "merged", "repair_at"]

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Repair:
    """One kind of fault that was put right."""

    kind: str
    """Such as ``"T vertices"``."""
    count: int
    """How many there were."""
    point: Point
    """Metres, in the frame of the mesh: where one of them is."""
    size: float | None = None
    """Metres: the extent of the largest one, or the width of the widest gap, where it is known."""

    def __str__(self) -> str:
        place = ", ".join(f"{x:.6g}" for x in self.point)
        size = "" if self.size is None else f"up to {self.size:.3g} m, "
        return f"{self.count} {self.kind} ({size}one at ({place}))"


def repair_at(
    kind: str, count: int, point: NDArray[np.float64], size: float | None = None
) -> Repair:
    """Return a repair at a point (3,)."""
    x, y, z = (float(c) for c in point)
    return Repair(kind, count, (x, y, z), size)


def merged(repairs: Iterable[Repair]) -> list[Repair]:
    """Return one repair for all of a kind, with the place of the first one of them."""
    found: dict[str, Repair] = {}
    for repair in repairs:
        one = found.get(repair.kind)
        if one is not None:
            sizes = [r.size for r in (one, repair) if r.size is not None]
            size = max(sizes, default=None)
            repair = replace(one, count=one.count + repair.count, size=size)
        found[repair.kind] = repair
    return list(found.values())


@dataclass(frozen=True)
class PiecesReport:
    """By how much the convex hulls of a mesh's pieces leave its solid, metres.

    The largest distance of a point is between the one that was found and its bound.
    """

    count: int
    """How many pieces there are."""
    outside_solid: float
    """How far a point of a hull is from the solid: what is in the way without being there."""
    outside_solid_bound: float
    outside_hulls: float
    """How far a point of the solid is from all hulls: what is there and in nobody's way."""
    outside_hulls_bound: float

    def __str__(self) -> str:
        return (
            f"{_count(self.count, 'convex piece')}, with points {self.outside_solid:.3g} m outside"
            f" of the solid (at most {self.outside_solid_bound:.3g}) and points of the solid"
            f" {self.outside_hulls:.3g} m outside of all hulls (at most"
            f" {self.outside_hulls_bound:.3g})"
        )


@dataclass(frozen=True)
class MeshReport:
    """The solid that the triangles of a mesh mean, and its repairs."""

    parts: int
    """Closed parts, cavities among them."""
    cavities: int
    """Closed parts that bound a hollow."""
    sheets: int
    """Parts with an open edge that was not repaired: they have no inside."""
    repairs: tuple[Repair, ...]
    """What was put right."""
    is_closed: bool
    """Whether the mesh means a solid as a whole: it has a closed part and no sheet."""
    reason: str
    """One sentence that says why it does not, or what is doubtful about the solid; else empty."""
    pieces: PiecesReport | None = None
    """Of a mesh that the proximity properties take apart; the others say what its file has."""

    def __str__(self) -> str:
        counts = [_count(self.parts - self.cavities, "closed part")]
        counts += [_count(self.cavities, "cavity", "cavities")] if self.cavities else []
        counts += [_count(self.sheets, "sheet")] if self.sheets else []
        text = ", ".join(counts)
        if self.repairs:
            text += "; repaired: " + ", ".join(map(str, self.repairs))
        if self.pieces:
            text += f"; {self.pieces}"
        return f"{text}: {self.reason}" if self.reason else text


def _count(number: int, noun: str, plural: str = "") -> str:
    return f"{number} {noun if number == 1 else plural or noun + 's'}"

"""What was made of the triangles of a mesh, in numbers and in one sentence."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["MeshReport", "Repair"]

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

    def __str__(self) -> str:
        place = ", ".join(f"{x:.6g}" for x in self.point)
        return f"{self.count} {self.kind} (one at ({place}))"


@dataclass(frozen=True)
class MeshReport:
    """What a mesh means, and what had to be put right for it."""

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

    def __str__(self) -> str:
        counts = [_count(self.parts - self.cavities, "closed part")]
        counts += [_count(self.cavities, "cavity", "cavities")] if self.cavities else []
        counts += [_count(self.sheets, "sheet")] if self.sheets else []
        text = ", ".join(counts)
        if self.repairs:
            text += "; repaired: " + ", ".join(map(str, self.repairs))
        return f"{text}: {self.reason}" if self.reason else text


def _count(number: int, noun: str, plural: str = "") -> str:
    return f"{number} {noun if number == 1 else plural or noun + 's'}"

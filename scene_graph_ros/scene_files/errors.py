"""Errors of scene files: each message starts with where in which file, and quotes the value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["JointStateError", "Location", "SceneFileError", "UnknownPackageError"]


@dataclass(frozen=True)
class Location:
    """A place in a file.

    ``file`` is the path as the user gave it, or a label such as ``<text>``; ``line`` counts from
    1, or is None where a whole file is meant; ``path`` names the element inside the file.
    """

    file: str
    line: int | None = None
    path: str = ""

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        return f"{place}: {self.path}" if self.path else place


class SceneFileError(SceneGraphError, ValueError):
    """A scene, URDF or SRDF file that cannot be used; ``problems`` has a line for each reason."""

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems: tuple[str, ...] = (
            (problems,) if isinstance(problems, str) else tuple(problems)
        )
        super().__init__("\n".join(self.problems))


class UnknownPackageError(SceneFileError):
    """A ``package://`` address whose package is found in none of the places searched."""


class JointStateError(SceneGraphError, ValueError):
    """Joint positions that are not finite, or do not match their names."""

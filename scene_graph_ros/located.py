"""Errors of files: messages start with the file and the place in it, and quote the value."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import difflib

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["Location", "SceneFileError", "suggestion"]

_LONGEST_LIST = 1000
"""Names. Among more of them a search for the nearest takes seconds."""


@one_line()
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


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" for the known name nearest to ``name``, or nothing."""
    names = list(known)
    if len(names) > _LONGEST_LIST or len(name) > _LONGEST_LIST:
        return ""
    near = difflib.get_close_matches(name, names, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""

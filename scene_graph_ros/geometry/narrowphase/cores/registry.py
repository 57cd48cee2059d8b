"""Which file answers for which kind of core, and how a question finds it.

A question is the head of a function whose first argument is a core, or a placed one. Its body
finds out the core's kind and calls the function of the same name in the file of that kind.
"""

from __future__ import annotations

from collections.abc import Callable
import inspect
from types import ModuleType
from typing import Any

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.narrowphase.cores import (
    box,
    cylinder,
    ellipsoid,
    hull,
    point,
    segment,
    triangle,
)
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    POINT,
    SEGMENT,
    TRIANGLE,
)

__all__ = ["FILES", "QUESTIONS", "asked"]

FILES: dict[int, ModuleType] = {
    BOX: box,
    HULL: hull,
    CYLINDER: cylinder,
    ELLIPSOID: ellipsoid,
    SEGMENT: segment,
    TRIANGLE: triangle,
    POINT: point,
}
"""The kinds in the order in which a core is compared with them: those asked most come first."""

QUESTIONS: list[str] = []
"""The names of all that was made a question."""


def asked(compiled: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that lets the core's own file answer a question, compiled as given.

    The question's first parameter is a ``core``, or a ``placed`` one.

    Raises NotImplementedError, naming kind and question, where a file has no answer.
    """

    def decorate(question: Callable[..., Any]) -> Any:
        name = question.__name__
        QUESTIONS.append(name)
        first = next(iter(inspect.signature(question).parameters))
        kind = "core[0]" if first == "core" else f"{first}.core[0]"
        answers = {kind: _answer(file, name) for kind, file in FILES.items()}
        return by_kind(compiled, [kind], answers)(question)

    return decorate


def _answer(file: ModuleType, name: str) -> Any:
    answer = getattr(file, name, None)
    if answer is None:
        kind = file.__name__.rpartition(".")[2]
        raise NotImplementedError(f"a core of the kind {kind!r} has no answer to {name!r}")
    return answer

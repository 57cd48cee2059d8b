"""Which file answers for which kind of core, and how a question finds it.

A question is the head of a function whose first argument is a core. ``asked`` writes its body: it
finds out the core's kind and calls the function of the same name in the file of that kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
import inspect
from types import ModuleType
from typing import Any

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

    What most kinds answer by one and the same function comes last, and is compiled once.

    Raises NotImplementedError, naming kind and question, where a file has no answer.
    """

    def decorate(question: Callable[..., Any]) -> Any:
        name = question.__name__
        QUESTIONS.append(name)
        answers = {kind: _answer(file, name) for kind, file in FILES.items()}
        common = Counter(map(id, reversed(answers.values()))).most_common(1)[0][0]
        arguments = ", ".join(inspect.signature(question).parameters)
        names: dict[str, Any] = {"__name__": question.__module__}
        lines = [f"def {name}({arguments}):"]
        last = ""
        for kind, answer in answers.items():
            called = f"return answer_{kind}({arguments})"
            names[f"answer_{kind}"] = answer
            if id(answer) == common:
                last = called
            else:
                lines.append(f"    if core[0] == {kind}: {called}")
        source = "\n".join([*lines, f"    {last}"])
        exec(compile(source, inspect.getfile(question), "exec"), names)  # noqa: S102 - written here
        return compiled(_like(names[name], question))

    return decorate


def _answer(file: ModuleType, name: str) -> Any:
    answer = getattr(file, name, None)
    if answer is None:
        kind = file.__name__.rpartition(".")[2]
        raise NotImplementedError(f"a core of the kind {kind!r} has no answer to {name!r}")
    return answer


def _like(written: Any, question: Callable[..., Any]) -> Any:
    """Give what was written the place and the description of the question."""
    written.__doc__ = question.__doc__
    written.__code__ = written.__code__.replace(co_firstlineno=question.__code__.co_firstlineno)
    return written

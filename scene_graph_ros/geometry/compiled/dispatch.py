"""Choice of a kernel by kind: the table is data, the chain of comparisons is written from it.

The compiler merges such a chain into its caller, and drops it where kinds are known. A function
that is looked up in a table when the code runs could not be merged.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
import inspect
from typing import Any

__all__ = ["by_kind"]


def by_kind(
    compiled: Callable[..., Any],
    kinds: Sequence[str],
    table: Mapping[Any, Any],
    *,
    otherwise: Any = None,
    given: Mapping[str, Any] | None = None,
) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that gives a function, of which only the head counts, its body.

    The body calls the table's function for the kinds of the arguments.

    Args:
        compiled: The decorator that compiles the function.
        kinds: An expression of the parameters for each part of the table's keys: ``"core[0]"``.
        table: Kernels by kind (an integer), or by a tuple of kinds where ``kinds`` are several.
            Each is handed the parameters, and the ``given`` ones, that it has by name.
        otherwise: The function for all other kinds. Without it the table must name all kinds:
            the kernel that most of them share comes last, without a comparison.
        given: Kernels of the parameters by name of their values, for kernels that take it.

    Raises TypeError where a kernel has a parameter that the function has not.

    """
    given = dict(given or {})

    def decorate(question: Callable[..., Any]) -> Any:
        parameters = list(inspect.signature(question).parameters)
        names: dict[str, Any] = dict(question.__globals__)
        lines = [f"def {question.__name__}({', '.join(parameters)}):"]
        lines += [f"    kind_{k} = {expression}" for k, expression in enumerate(kinds)]

        def call(name: str, kernel: Any) -> str:
            names[name] = kernel
            return f"{name}({', '.join(argument(kernel, taken) for taken in _taken(kernel))})"

        def argument(kernel: Any, taken: str) -> str:
            if taken in given:
                return call(f"given_{taken}", given[taken])
            if taken not in parameters:
                raise TypeError(f"{kernel!r} takes {taken!r}, which nobody gives it")
            return taken

        last = otherwise
        if last is None:
            shared = Counter(map(id, reversed(list(table.values())))).most_common(1)[0][0]
            last = next(kernel for kernel in table.values() if id(kernel) == shared)
        for number, (key, kernel) in enumerate(table.items()):
            if otherwise is None and kernel is last:
                continue
            keys = key if isinstance(key, tuple) else (key,)
            condition = " and ".join(f"kind_{k} == {int(part)}" for k, part in enumerate(keys))
            lines.append(f"    if {condition}: return {call(f'kernel_{number}', kernel)}")
        lines.append(f"    return {call('otherwise', last)}")
        exec(compile("\n".join(lines), inspect.getfile(question), "exec"), names)  # noqa: S102 - written here
        return compiled(_like(names[question.__name__], question))

    return decorate


def _taken(kernel: Any) -> list[str]:
    """Return the names of a kernel's parameters."""
    return list(inspect.signature(getattr(kernel, "py_func", kernel)).parameters)


def _like(written: Any, question: Callable[..., Any]) -> Any:
    """Give the written function the place and the docstring of the one it stands for."""
    written.__doc__ = question.__doc__
    written.__module__ = question.__module__
    written.__code__ = written.__code__.replace(co_firstlineno=question.__code__.co_firstlineno)
    return written

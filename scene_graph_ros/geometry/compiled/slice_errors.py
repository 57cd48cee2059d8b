"""Assignments to slices, compiled without the text of an error that no kernel means to raise.

Where an array does not fit a slice, numba's error tells both shapes. To write them it compiles
how integers become text: two seconds in each process that compiles, a tenth of a second and some
hundred kilobytes of code more in each kernel with such an assignment, and in all its callers. Of
our kernels the error says only what it is about, which numba provides for other targets, too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core.compiler_lock import global_compiler_lock
from numba.extending import overload
from numba.np import arrayobj

__all__ = ["with_short_slice_errors"]


def _refuse(source: Any, slice_: Any) -> None:
    """Raise what numba raises for shapes, without them."""


@overload(_refuse)
def _refuse_compiled(source: Any, slice_: Any) -> Any:
    def refuse(source: Any, slice_: Any) -> None:
        raise ValueError("cannot assign slice from input of different size")

    return refuse


def with_short_slice_errors(compile_for: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that compiles, with the short error; other functions keep numba's."""

    def compile_shortly(*arguments: Any) -> Any:
        with global_compiler_lock:  # nobody else compiles meanwhile
            numbas = arrayobj.raise_with_shape_context
            arrayobj.raise_with_shape_context = _refuse
            try:
                return compile_for(*arguments)
            finally:
                arrayobj.raise_with_shape_context = numbas

    return compile_shortly

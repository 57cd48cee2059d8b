"""Warnings of colours and pictures that a mesh's file promises and does not have."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
import warnings

__all__ = ["MeshColorWarning", "mesh_color_warnings_told", "warn_of_color"]


class MeshColorWarning(UserWarning):
    """Colours or pictures that a mesh's file promises can't be read: it is shown without them."""


def warn_of_color(text: str) -> None:
    """Warn of the colours that a mesh is shown without."""
    warnings.warn(MeshColorWarning(text), stacklevel=3)


@contextmanager
def mesh_color_warnings_told(tell: Callable[[str], object]) -> Iterator[None]:
    """Have each MeshColorWarning of the process told as a text instead of printed by Python."""
    show = warnings.showwarning

    def show_or_tell(
        message: Warning | str, category: type[Warning], *place: Any, **named: Any
    ) -> None:
        if issubclass(category, MeshColorWarning):
            tell(str(message))
        else:
            show(message, category, *place, **named)

    with warnings.catch_warnings():  # which puts back what is changed here
        warnings.simplefilter("always", MeshColorWarning)
        warnings.showwarning = show_or_tell
        yield

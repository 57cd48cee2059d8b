"""A function of arrays gives the same for every form of one, or refuses it in our words."""

from __future__ import annotations

from collections.abc import Callable, Collection
import contextlib
from typing import Any

from number_forms import equal_forms, no_numbers
import numpy as np
from plain_values import plain
import pytest

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["check_forms", "check_refusals"]

REFUSALS = SceneGraphError, ConvexSetError


def check_forms(
    call: Callable[..., Any],
    arrays: dict[str, Any],
    argument: str,
    forms: Collection[str] | None = None,
    numbers: Collection[str] = (),
) -> None:
    """Call a function with one of its arrays in all forms, or in those that are named.

    ``numbers`` names forms of what is no real number that the function takes.
    """
    expected = plain(call(**{name: np.array(values) for name, values in arrays.items()}))
    has_negative = np.min(arrays[argument]) < 0
    for form, value in equal_forms(arrays[argument]).items():
        if (forms is not None and form not in forms) or (form[0] == "u" and has_negative):
            continue
        try:
            found = plain(call(**(arrays | {argument: value})))
        except REFUSALS:
            assert form == "matrix", form
        else:
            assert found == expected, form
    check_refusals(call, arrays, argument, numbers)


def check_refusals(
    call: Callable[..., Any],
    arrays: dict[str, Any],
    argument: str,
    numbers: Collection[str] = (),
) -> None:
    """Call a function with what no form of one of its arrays is: it is refused in our words."""
    for form, value in no_numbers(arrays[argument]).items():
        if form in numbers:
            continue
        if form in ("zero size", "nothing"):
            with contextlib.suppress(*REFUSALS):
                call(**(arrays | {argument: value}))
        else:
            with pytest.raises(REFUSALS, match=r"."):
                call(**(arrays | {argument: value}))

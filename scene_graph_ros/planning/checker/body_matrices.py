"""Which bodies are checked against which, and how far apart they must stay: values, not state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.checker_bodies import CheckerBodies, CheckerBody
from scene_graph_ros.planning.errors import CollisionCheckerError, finite_number

__all__ = ["ALWAYS_FILTERED", "CHECKED", "FILTERED", "BodyMatrices"]

CHECKED, FILTERED, ALWAYS_FILTERED = 0, 1, -1


@dataclass(frozen=True, eq=False)
class BodyMatrices:
    """Paddings and filters of pairs of bodies, with a row for each of the r that robots move.

    Whole matrices are ``(n, n)``, symmetric; their other rows follow from these, as two bodies of
    the environment are never checked. A change makes another value.
    """

    bodies: CheckerBodies
    padding: NDArray[np.float64]
    """``(r, n)`` metres, symmetric, zero from a body to itself."""
    filtered: NDArray[np.int8]
    """``(r, n)``: CHECKED, FILTERED; ALWAYS_FILTERED from a body to itself."""

    @classmethod
    def of(cls, bodies: CheckerBodies, filtered: NDArray[np.bool_]) -> BodyMatrices:
        """Return matrices without padding, with filters ``(r, n)``."""
        matrix = np.where(filtered, np.int8(FILTERED), np.int8(CHECKED))
        np.fill_diagonal(matrix, ALWAYS_FILTERED)
        return cls(bodies, np.zeros(matrix.shape), matrix)

    # Paddings.

    def padding_matrix(self) -> NDArray[np.float64]:
        """Return ``(n, n)`` metres."""
        return self._whole(self.padding, 0.0)

    def with_padding_matrix(self, matrix: ArrayLike) -> BodyMatrices:
        """Return matrices with all paddings ``(n, n)`` set, metres."""
        padding = self._checked("collision_padding", matrix, np.float64, 0)
        return replace(self, padding=padding)

    def with_padding_between(self, a: int, b: int, value: Any) -> BodyMatrices:
        """Return matrices with one padding set."""
        padding = self.padding.copy()
        number = finite_number("padding", value)
        for row, column in self._entries(a, b):
            padding[row, column] = number
        return replace(self, padding=padding)

    def with_environment_padding(self, value: Any, body: int | None = None) -> BodyMatrices:
        """Return matrices with the padding of all robots' bodies, or of one, to all around."""
        number, padding = finite_number("padding", value), self.padding.copy()
        if body is not None:
            self._require_robot(self.bodies.all[body])
        rows = slice(None) if body is None else slice(body, body + 1)
        padding[rows, len(padding) :] = number
        return replace(self, padding=padding)

    def with_robot_padding(self, value: Any) -> BodyMatrices:
        """Return matrices with the padding between all bodies of robots."""
        number, padding = finite_number("padding", value), self.padding.copy()
        padding[:, : len(padding)] = number
        np.fill_diagonal(padding, 0.0)
        return replace(self, padding=padding)

    def largest_padding(self) -> float:
        """Return the largest padding (m) of two bodies, one of which is a robot's; 0: no pair."""
        values = self.padding[self.filtered != ALWAYS_FILTERED]
        return float(values.max()) if len(values) else 0.0

    def uniform_environment_padding(self) -> float | None:
        """Return the padding of all robots' bodies to all around; None where they differ."""
        return _uniform(self.padding[:, len(self.padding) :])

    def uniform_robot_padding(self) -> float | None:
        """Return the padding between all bodies of robots; None where they differ."""
        among = self.padding[:, : len(self.padding)]
        return _uniform(among[~np.eye(len(among), dtype=np.bool_)])

    # Filters.

    def filter_matrix(self) -> NDArray[np.int8]:
        """Return ``(n, n)``: CHECKED, FILTERED or ALWAYS_FILTERED."""
        return self._whole(self.filtered, ALWAYS_FILTERED)

    def with_filter_matrix(self, matrix: ArrayLike) -> BodyMatrices:
        """Return matrices with all filters ``(n, n)`` set: CHECKED or FILTERED."""
        field = "filter_matrix"
        filtered = self._checked(field, matrix, np.int8, ALWAYS_FILTERED)
        bad = (filtered != CHECKED) & (filtered != FILTERED)
        np.fill_diagonal(bad, False)
        if bad.any():
            a, b = np.argwhere(bad)[0]
            raise CollisionCheckerError(
                f"{field} of {self._pair(a, b)} must be 0 or 1, not {filtered[a, b]}"
            )
        return replace(self, filtered=filtered)

    def with_filter_between(self, a: int, b: int, is_filtered: Any) -> BodyMatrices:
        """Return matrices with two bodies filtered, or not."""
        if not isinstance(is_filtered, (bool, np.bool_)):
            raise CollisionCheckerError(
                f"filter_collision must be True or False, not {quoted(is_filtered)}"
            )
        filtered = self.filtered.copy()
        for row, column in self._entries(a, b):
            filtered[row, column] = FILTERED if is_filtered else CHECKED
        return replace(self, filtered=filtered)

    def with_all_filtered(self, body: int) -> BodyMatrices:
        """Return matrices with a robot's body filtered with all others."""
        self._require_robot(self.bodies.all[body])
        filtered = self.filtered.copy()
        filtered[body, :] = FILTERED
        filtered[:, body] = FILTERED
        filtered[body, body] = ALWAYS_FILTERED
        return replace(self, filtered=filtered)

    def is_filtered(self, a: int, b: int) -> bool:
        """Tell whether two bodies are not checked against each other."""
        row, column = min(a, b), max(a, b)
        return row >= len(self.filtered) or self.filtered[row, column] != CHECKED

    # Parts.

    def _whole(self, part: NDArray[Any], rest: Any) -> NDArray[Any]:
        robots, count = part.shape
        result = np.full((count, count), rest, dtype=part.dtype)
        result[:robots] = part
        result[:, :robots] = part.T
        return result

    def _entries(self, a: int, b: int) -> set[tuple[int, int]]:
        """Return the indices of a pair's entries, after checking that it can have some."""
        if a == b:
            name = self.bodies.all[a].name
            raise CollisionCheckerError(f"bodyA and bodyB are both {name!r}, which is no pair")
        robots = len(self.padding)
        if min(a, b) >= robots:
            raise CollisionCheckerError(
                f"{self._pair(a, b)} are both no part of a robot: they are never checked"
            )
        return {(row, column) for row, column in ((a, b), (b, a)) if row < robots}

    def _require_robot(self, body: CheckerBody) -> None:
        if not self.bodies.is_part_of_robot(body.index):
            raise CollisionCheckerError(f"body {body.name!r} is no part of a robot")

    def _pair(self, a: int, b: int) -> str:
        return f"{self.bodies.all[a].name!r} and {self.bodies.all[b].name!r}"

    def _checked(self, field: str, matrix: ArrayLike, dtype: Any, fixed: int) -> NDArray[Any]:
        """Return the robots' rows of a whole matrix, after checking its shape and values.

        ``fixed`` is the value on the diagonal and between bodies around robots.
        """
        count = len(self.bodies)
        given = real_array(matrix, f"{field} must be numbers", CollisionCheckerError)
        if given.shape != (count, count):
            raise CollisionCheckerError(
                f"{field} must have shape ({count}, {count}), not {given.shape}"
            )
        with np.errstate(invalid="ignore"):
            own = given.astype(dtype)
        wanted = np.full((count, count), np.nan)
        robots = len(self.padding)
        wanted[robots:, robots:] = fixed
        np.fill_diagonal(wanted, fixed)
        for is_bad, what in (
            (~np.isfinite(given), "must be finite"),
            (given != given.T, "must be the same in both orders"),
            (~np.isnan(wanted) & (given != wanted), f"must be {fixed}"),
            (given != own, "must be a whole number"),
        ):
            if is_bad.any():
                a, b = np.argwhere(is_bad)[0]
                raise CollisionCheckerError(
                    f"{field} of {self._pair(a, b)} {what}, not {given[a, b]:g}"
                    + (f" and {given[b, a]:g}" if given[a, b] != given[b, a] else "")
                )
        return own[:robots].copy()


def _uniform(values: NDArray[np.float64]) -> float | None:
    if not values.size:
        return 0.0
    first = float(values.flat[0])
    return first if (values == first).all() else None

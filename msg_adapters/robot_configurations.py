"""Configurations of robots, by names of positions, to arrays and back."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from msg_adapters.arrays import float64s_to_msg, int64s_to_msg, uint8s_to_msg, uint64s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.names import legend, SceneNames
from msg_adapters.poses import meant_name
from scene_graph_msgs.msg import ClearanceTable, CollisionTable, RobotConfigurations
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.located import suggestion

if TYPE_CHECKING:
    from scene_graph_ros.planning import ClearanceColumns

__all__ = [
    "AS_ONE",
    "Meaning",
    "RobotNames",
    "clearance_table_to_msg",
    "collision_table_to_msg",
    "configurations_from_msg",
    "configurations_to_msg",
    "count_rows",
    "padding_from_msg",
]


AS_ONE = 1e-3
"""rad or m: as far as encoders tell, joints of which one mimics the other are where both say."""

_MOST_LISTED = 12
"""Names that an error about an unknown one lists."""


class Meaning(NamedTuple):
    """Which entry a name means: that is at ``(value - offset) / multiplier``."""

    name: str
    """In full: of the position itself, or of a joint that mimics it."""
    row: int
    is_own: bool = True
    """Whether it is the position's own name."""
    multiplier: float = 1.0
    offset: float = 0.0


class RobotNames:
    """Parts of robots by ``<robot>/<name>``; ``<name>`` where only one of them has it.

    Leading slashes are passed over.
    """

    def __init__(
        self,
        noun: str,
        names: Sequence[str],
        robots: Iterable[str],
        followers: Mapping[str, Meaning] = MappingProxyType({}),
    ) -> None:
        """``names`` begin with one of the robots' and a slash; ``noun`` is their kind.

        ``followers`` are other names of theirs: joints that mimic others.
        """
        self.names = tuple(names)
        self._noun = noun
        self._meanings = {name: Meaning(name, row) for row, name in enumerate(self.names)}
        self._meanings.update(followers)
        self._bare: dict[str, list[str]] = defaultdict(list)
        # Names may have slashes in them: the longest robot's name is the robot.
        prefixes = sorted((f"{robot}/" for robot in robots), key=len, reverse=True)
        for name in self._meanings:
            prefix = next(p for p in prefixes if name.startswith(p))
            self._bare[name[len(prefix) :]].append(name)
        alone = {several[0]: bare for bare, several in self._bare.items() if len(several) == 1}
        self._short = [alone.get(name, name) for name in self.names]

    def short(self, row: int) -> str:
        """Return a name without its robot's where only one robot has it."""
        return self._short[row]

    def _known(self) -> str:
        """Return a list of all names for messages, empty where there are many."""
        if not self.names:
            return f"; no robot has a {self._noun} at all"
        if len(self.names) > _MOST_LISTED:
            return ""
        listed = ", ".join(self.short(row) for row in range(len(self.names)))
        return f" (there {'is' if len(self.names) == 1 else 'are'} {listed})"

    def row(self, name: str, field: str) -> int:
        """Return the row of the part that a name of a message's field means.

        Raises UnknownIdError for a name that no robot has, NameConflictError for one of several.
        """
        return self.meaning(name, field).row

    def meaning(self, name: str, field: str) -> Meaning:
        """Return the same, of joints that mimic others, too. Raises as `row`."""
        name = meant_name(name)
        if name in self._meanings:
            return self._meanings[name]
        found = self._bare.get(name, [])
        if not found:
            known = [*self._meanings, *self._bare]
            raise UnknownIdError(
                f"{field}: no robot has a {self._noun} {quoted(name)}{suggestion(name, known)}"
                f"{self._known()}"
            )
        if len(found) > 1:
            several = ", ".join(found[:5])
            raise NameConflictError(f"{field}: {quoted(name)} is ambiguous: {several}")
        return self._meanings[found[0]]


def count_rows(msg: RobotConfigurations) -> int:
    """Return the number of configurations of a message, if it is well-formed."""
    return len(msg.positions) // len(msg.names) if len(msg.names) else 1


def configurations_from_msg(
    msg: RobotConfigurations, names: RobotNames, present: NDArray[np.float64], field: str
) -> NDArray[np.float64]:
    """Return configurations ``(n, nq)``; positions without a name are those of ``present``.

    Without names it is the present one, ``(1, nq)``. A joint that mimics another says where that
    is. A position given twice counts where both agree, of joints that move as one within `AS_ONE`.
    Raises UnknownIdError or NameConflictError for a name, MessageError for lengths that don't fit,
    numbers that are not finite, or beyond all scenes, and contradictions, naming ``field``.
    """
    if not len(msg.names):
        if len(msg.positions):
            raise MessageError(f"{field} has {len(msg.positions)} positions, but no names")
        return present[np.newaxis].copy()
    meanings = [names.meaning(name, f"{field}.names") for name in msg.names]
    values = np.array(msg.positions, dtype=np.float64)
    if len(values) % len(meanings):
        raise MessageError(
            f"{field}.positions has {len(values)} numbers, which is no multiple of the"
            f" {len(meanings)} of names"
        )
    values = values.reshape(-1, len(meanings))
    bad = np.argwhere(~(np.abs(values) <= MAX_COORDINATE))
    if len(bad):
        row, column = bad[0]
        raise MessageError(
            f"{field}.positions: {quoted(meanings[column].name)} in row {row} must be a number up"
            f" to {MAX_COORDINATE:g}, not {values[row, column]}"
        )
    result = np.repeat(present[np.newaxis], len(values), axis=0)
    _fill(result, meanings, values)
    _check_agreement(result, meanings, values, msg.names, field)
    return result


def _fill(
    result: NDArray[np.float64], meanings: Sequence[Meaning], values: NDArray[np.float64]
) -> None:
    """Write values where they belong: a joint's own counts more than those of its followers."""
    said: dict[int, int] = {}
    for column, meaning in enumerate(meanings):
        known = said.get(meaning.row)
        is_better = known is None or (meaning.is_own and not meanings[known].is_own)
        if meaning.multiplier and is_better:
            said[meaning.row] = column
    for row, column in said.items():
        meaning = meanings[column]
        result[:, row] = (values[:, column] - meaning.offset) / meaning.multiplier


def _check_agreement(
    result: NDArray[np.float64],
    meanings: Sequence[Meaning],
    values: NDArray[np.float64],
    said: Sequence[str],
    field: str,
) -> None:
    """Raise MessageError where a value is another than configurations ``(n, nq)`` have."""
    for column, meaning in enumerate(meanings):
        expected = meaning.multiplier * result[:, meaning.row] + meaning.offset
        tolerance = 0.0 if meaning.is_own else AS_ONE
        is_other = np.abs(values[:, column] - expected) > tolerance
        if is_other.any():
            k = int(np.argmax(is_other))
            raise MessageError(
                f"{field}: {quoted(said[column])} is at {values[k, column]:.10g} in row {k} of"
                f" positions, where what else is said puts it at {expected[k]:.10g}"
            )


def configurations_to_msg(
    names: RobotNames, configurations: NDArray[np.float64], columns: ArrayLike | None = None
) -> RobotConfigurations:
    """Return some columns, or all, of configurations ``(n, nq)``."""
    chosen = np.arange(len(names.names)) if columns is None else np.asarray(columns, np.intp)
    return RobotConfigurations(
        names=[names.names[column] for column in chosen],
        positions=float64s_to_msg(configurations[:, chosen]),
    )


def padding_from_msg(value: float, field: str) -> float:
    """Return a padding in metres; raises MessageError for one beyond lengths of scenes."""
    if not abs(value) <= MAX_COORDINATE:
        raise MessageError(f"{field} must be a number up to {MAX_COORDINATE:g}, not {value}")
    return float(value)


def collision_table_to_msg(
    rows: ArrayLike,
    pairs: Sequence[tuple[Any, Any]],
    depths: ArrayLike,
    at: ArrayLike,
    names: SceneNames | None,
) -> CollisionTable:
    """Return pairs of geometry ids that stop rows; without ``names`` the legend stays empty."""
    ids = np.array([sorted((int(a), int(b))) for a, b in pairs], dtype=np.int64).reshape(-1, 2)
    return CollisionTable(
        row=uint64s_to_msg(rows),
        id_a=int64s_to_msg(ids[:, 0]),
        id_b=int64s_to_msg(ids[:, 1]),
        depth=float64s_to_msg(depths),
        at=float64s_to_msg(at),
        geometries=legend(names, ids),
    )


def clearance_table_to_msg(
    columns: ClearanceColumns, position_names: Sequence[str] | None, names: SceneNames | None
) -> ClearanceTable:
    """Return padded distances of pairs of geometries, and their derivatives.

    Without ``position_names`` nothing is told of positions; without ``names`` the legend stays
    empty.
    """
    jacobian = columns.jacobian.reshape(-1)
    return ClearanceTable(
        row=uint64s_to_msg(columns.configuration),
        id_a=int64s_to_msg(columns.id_A),
        id_b=int64s_to_msg(columns.id_B),
        kind=uint8s_to_msg(columns.collision_type),
        distance=float64s_to_msg(columns.distance),
        position_names=list(position_names or []),
        jacobian=float64s_to_msg([] if position_names is None else jacobian),
        geometries=legend(names, np.stack([columns.id_A, columns.id_B], axis=1)),
    )

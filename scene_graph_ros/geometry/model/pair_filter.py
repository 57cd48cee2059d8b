"""Which pairs of geometries were excluded by declarations, as a growing matrix of bits.

Only geometries that a declaration excluded from something have a slot (a row and a column), so a
large scene with few filters stays small. Pairs on one frame and pairs of anchored geometries are
not in here: they never collide, whatever was declared.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import FilterId, GeometryId

__all__ = ["Operation", "PairFilter", "Statement"]

Bits = NDArray[np.uint8]
_ROWS_AT_ONCE = 256


class Operation(enum.Enum):
    """What a statement does with its pairs."""

    EXCLUDE = "exclude"
    ALLOW = "allow"


class Statement(NamedTuple):
    """All pairs (a, b) with a in ``ids_A`` and b in ``ids_B``, in both orders."""

    operation: Operation
    ids_A: frozenset[GeometryId]
    ids_B: frozenset[GeometryId]


def _packed(slots: Iterable[int], capacity: int) -> Bits:
    flags = np.zeros(capacity, dtype=np.uint8)
    flags[list(slots)] = 1
    return np.packbits(flags, bitorder="little")


class PairFilter:
    """The persistent state of all pairs, and transient statements on top of it."""

    def __init__(self) -> None:
        self._slots: dict[GeometryId, int] = {}
        self._free: list[int] = []
        self._bits: Bits = np.zeros((0, 0), dtype=np.uint8)
        self._bits_are_shared = False
        self._transient: dict[FilterId, tuple[Statement, ...]] = {}
        self._effective: Bits | None = None

    def copy(self) -> PairFilter:
        """Return an independent filter; the bits are copied when one side changes them."""
        result = PairFilter()
        result._slots = dict(self._slots)
        result._free = list(self._free)
        result._bits = self._bits
        result._bits_are_shared = self._bits_are_shared = True
        result._transient = dict(self._transient)
        result._effective = self._effective
        return result

    def apply(self, statements: Iterable[Statement]) -> None:
        """Change the persistent state. There must be no transient statements."""
        assert not self._transient
        for statement in statements:
            self._reserve(statement)
            self._own_bits()
            self._write(self._bits, statement)
        self._effective = None

    def apply_transient(self, statements: Iterable[Statement]) -> FilterId:
        """Put statements on top of all earlier ones, to be removed by the returned id."""
        kept = tuple(statements)
        for statement in kept:
            self._reserve(statement)
        filter_id = FilterId.get_new_id()
        self._transient[filter_id] = kept
        self._effective = None
        return filter_id

    def remove(self, filter_id: FilterId) -> bool:
        """Undo a transient application; return whether it was active."""
        if filter_id not in self._transient:
            return False
        del self._transient[filter_id]
        self._effective = None
        return True

    def is_active(self, filter_id: FilterId) -> bool:
        """Tell whether a transient application is in force."""
        return filter_id in self._transient

    def has_transient_history(self) -> bool:
        """Tell whether there are transient statements."""
        return bool(self._transient)

    def forget(self, geometry_id: GeometryId) -> None:
        """Drop all that was declared about a geometry, which loses its role or is removed."""
        self._transient = {
            filter_id: tuple(_without(geometry_id, s) for s in statements)
            for filter_id, statements in self._transient.items()
        }
        self._effective = None
        slot = self._slots.pop(geometry_id, None)
        if slot is None:
            return
        self._own_bits()
        self._bits[slot] = 0
        self._bits[:, slot >> 3] &= np.uint8(0xFF ^ (1 << (slot & 7)))
        self._free.append(slot)

    def is_excluded(self, id_A: GeometryId, id_B: GeometryId) -> bool:
        """Tell whether the pair was excluded and not allowed again since."""
        a, b = self._slots.get(id_A), self._slots.get(id_B)
        if a is None or b is None:
            return False
        return bool(self._effective_bits()[a, b >> 3] >> (b & 7) & 1)

    def bit_matrix(self, ids: Collection[GeometryId]) -> Bits | None:
        """Return ``(n, ceil(n / 8))`` bits for the rows ``ids``, or None if nothing is excluded.

        Bit ``(matrix[i, j >> 3] >> (j & 7)) & 1`` is set where the pair (i, j) is excluded.
        """
        rows, slots = [], []
        for row, geometry_id in enumerate(ids):
            slot = self._slots.get(geometry_id)
            if slot is not None:
                rows.append(row)
                slots.append(slot)
        bits = self._effective_bits()
        if not slots or not bits.any():
            return None
        row_array, slot_array = np.array(rows), np.array(slots)
        matrix = np.zeros((len(ids), (len(ids) + 7) // 8), dtype=np.uint8)
        wide = np.zeros((_ROWS_AT_ONCE, len(ids)), dtype=np.uint8)
        for start in range(0, len(rows), _ROWS_AT_ONCE):
            part = slice(start, start + _ROWS_AT_ONCE)
            flags = np.unpackbits(bits[slot_array[part]], axis=1, bitorder="little")
            block = wide[: len(flags)]
            block[:, row_array] = flags[:, slot_array]
            matrix[row_array[part]] = np.packbits(block, axis=1, bitorder="little")
        return matrix

    def excluded_rows(self, ids: Collection[GeometryId]) -> NDArray[np.int64]:
        """Return ``(k, 2)`` the rows i < j in ``ids`` of all pairs that are excluded."""
        matrix = self.bit_matrix(ids)
        found = [np.empty((0, 2), dtype=np.int64)]
        for start in range(0, 0 if matrix is None else len(ids), _ROWS_AT_ONCE):
            assert matrix is not None
            block = matrix[start : start + _ROWS_AT_ONCE]
            rows = np.argwhere(np.unpackbits(block, axis=1, bitorder="little"))
            rows[:, 0] += start
            found.append(rows[rows[:, 0] < rows[:, 1]])
        return np.concatenate(found)

    def _effective_bits(self) -> Bits:
        if not self._transient:
            return self._bits
        effective = self._effective
        if effective is None:
            effective = self._bits.copy()
            for statements in self._transient.values():
                for statement in statements:
                    self._write(effective, statement)
            self._effective = effective
        return effective

    def _reserve(self, statement: Statement) -> None:
        """Give slots to the geometries of an excluding statement."""
        if statement.operation is Operation.ALLOW or not (statement.ids_A and statement.ids_B):
            return
        for geometry_id in sorted((statement.ids_A | statement.ids_B) - self._slots.keys()):
            self._slots[geometry_id] = self._free.pop() if self._free else len(self._slots)
        if len(self._slots) + len(self._free) > len(self._bits):
            self._grow(len(self._slots) + len(self._free))

    def _grow(self, needed: int) -> None:
        capacity = max(8, 1 << (needed - 1).bit_length())
        grown = np.zeros((capacity, capacity // 8), dtype=np.uint8)
        old = self._bits
        grown[: old.shape[0], : old.shape[1]] = old
        self._bits, self._bits_are_shared = grown, False

    def _own_bits(self) -> None:
        if self._bits_are_shared:
            self._bits, self._bits_are_shared = self._bits.copy(), False

    def _write(self, bits: Bits, statement: Statement) -> None:
        slots_A = [self._slots[i] for i in statement.ids_A if i in self._slots]
        slots_B = [self._slots[i] for i in statement.ids_B if i in self._slots]
        if not slots_A or not slots_B:
            return
        packed_A, packed_B = _packed(slots_A, len(bits)), _packed(slots_B, len(bits))
        if statement.operation is Operation.EXCLUDE:
            bits[slots_A] |= packed_B
            bits[slots_B] |= packed_A
        else:
            bits[slots_A] &= ~packed_B
            bits[slots_B] &= ~packed_A


def _without(geometry_id: GeometryId, statement: Statement) -> Statement:
    return statement._replace(
        ids_A=statement.ids_A - {geometry_id}, ids_B=statement.ids_B - {geometry_id}
    )

"""Which pairs of geometries were excluded by declarations, as a growing matrix of bits.

Only geometries that a declaration excluded from something have a slot (a row and a column), so a
large scene with few filters stays small. Pairs on one frame and pairs of anchored geometries are
not in here: they never collide, with any declarations.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
import enum
import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import FilterId, GeometryId
from scene_graph_ros.geometry.model.writes import Writes

__all__ = ["Operation", "PairFilter", "Statement"]

Bits = NDArray[np.uint8]
_ROWS_AT_ONCE = 256


class Operation(enum.Enum):
    """The operation of a statement on its pairs."""

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

    def apply(self, writes: Writes, statements: Iterable[Statement]) -> None:
        """Change the persistent state. There must be no transient statements."""
        assert not self._transient
        self._apply(writes, tuple(statements))

    def flatten(self, writes: Writes) -> None:
        """Make all transient statements, the oldest first, persistent."""
        ids = list(self._transient)
        kept = tuple(s for statements in self._transient.values() for s in statements)
        self._apply(writes, kept)
        for filter_id in ids:
            writes.drop(self._transient, filter_id)

    def _apply(self, writes: Writes, kept: tuple[Statement, ...]) -> None:
        slots, bits = self._reserve(writes, kept)
        rows = sorted(slots.values())
        if rows:
            # Beside the others, which stay as they are until all writes are done.
            changed = bits[rows]
            place = {row: k for k, row in enumerate(rows)}
            for statement in kept:
                _write(changed, place, slots, statement)
            writes.put((self._own_bits(writes, bits), rows, changed))
        writes.set(self, "_effective", None)

    def apply_transient(self, writes: Writes, statements: Iterable[Statement]) -> FilterId:
        """Put statements on top of all earlier ones, to be removed by the returned id."""
        kept = tuple(statements)
        _, bits = self._reserve(writes, kept)
        if bits is not self._bits:
            self._own_bits(writes, bits)
        filter_id = FilterId.get_new_id()
        writes.put((self._transient, filter_id, kept))
        writes.set(self, "_effective", None)
        return filter_id

    def remove(self, writes: Writes, filter_id: FilterId) -> bool:
        """Undo a transient application; return whether it was active."""
        if filter_id not in self._transient:
            return False
        writes.drop(self._transient, filter_id)
        writes.set(self, "_effective", None)
        return True

    def forget(self, writes: Writes, ids: Sequence[GeometryId]) -> None:
        """Drop all that was declared about geometries, which lose their role or are removed."""
        gone = frozenset(ids)
        for filter_id, statements in self._transient.items():
            if any(not gone.isdisjoint(s.ids_A | s.ids_B) for s in statements):
                writes.put(
                    (self._transient, filter_id, tuple(_without(gone, s) for s in statements))
                )
        slots = [self._slots[i] for i in ids if i in self._slots]
        if slots:
            writes.set(self, "_effective", None)
            bits, kept = self._own_bits(writes, self._bits), ~_packed(slots, len(self._bits))
            for column in sorted({slot >> 3 for slot in slots}):
                writes.put((bits, (slice(None), column), self._bits[:, column] & kept[column]))
            writes.put((bits, slots, 0))
            for geometry_id in ids:
                writes.drop(self._slots, geometry_id)
            writes.set(self, "_free", [*self._free, *slots])

    def is_active(self, filter_id: FilterId) -> bool:
        """Tell whether a transient application is in force."""
        return filter_id in self._transient

    def has_transient_history(self) -> bool:
        """Tell whether there are transient statements."""
        return bool(self._transient)

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
            every = range(len(effective))
            for statements in self._transient.values():
                for statement in statements:
                    _write(effective, every, self._slots, statement)
            self._effective = effective
        return effective

    def _reserve(
        self, writes: Writes, statements: Iterable[Statement]
    ) -> tuple[dict[GeometryId, int], Bits]:
        """Give slots to the geometries of excluding statements.

        Returns the slots of all geometries in the statements that have one, and bits that have
        room for them.
        """
        needed = {
            geometry_id
            for s in statements
            if s.operation is Operation.EXCLUDE and s.ids_A and s.ids_B
            for geometry_id in s.ids_A | s.ids_B
        }
        known = self._slots
        slots = {i: known[i] for s in statements for i in s.ids_A | s.ids_B if i in known}
        new = sorted(needed - slots.keys())
        if not new:
            return slots, self._bits
        free, count = list(self._free), len(self._slots) + len(self._free)
        numbers = itertools.count(count)
        given = {i: free.pop() if free else next(numbers) for i in new}
        for geometry_id, slot in given.items():
            writes.put((self._slots, geometry_id, slot))
        writes.set(self, "_free", free)
        return slots | given, _grown(self._bits, next(numbers))

    def _own_bits(self, writes: Writes, bits: Bits) -> Bits:
        """Return the bits that are written to: those given, unless others look at them."""
        if bits is self._bits and not self._bits_are_shared:
            return bits
        if bits is self._bits:
            bits = bits.copy()
        writes.set(self, "_bits", bits)
        writes.set(self, "_bits_are_shared", False)
        return bits


def _grown(bits: Bits, needed: int) -> Bits:
    """Return bits with room for so many slots: those given where they have it."""
    if needed <= len(bits):
        return bits
    capacity = max(8, 1 << (needed - 1).bit_length())
    grown = np.zeros((capacity, capacity // 8), dtype=np.uint8)
    grown[: bits.shape[0], : bits.shape[1]] = bits
    return grown


def _write(
    rows: Bits,
    row_of: Mapping[int, int] | range,
    slots: Mapping[GeometryId, int],
    statement: Statement,
) -> None:
    """Write a statement to the rows of bits of its slots."""
    slots_A = [slots[i] for i in statement.ids_A if i in slots]
    slots_B = [slots[i] for i in statement.ids_B if i in slots]
    if not slots_A or not slots_B:
        return
    rows_A, rows_B = ([row_of[slot] for slot in some] for some in (slots_A, slots_B))
    capacity = 8 * rows.shape[1]
    packed_A, packed_B = _packed(slots_A, capacity), _packed(slots_B, capacity)
    if statement.operation is Operation.EXCLUDE:
        rows[rows_A] |= packed_B
        rows[rows_B] |= packed_A
    else:
        rows[rows_A] &= ~packed_B
        rows[rows_B] &= ~packed_A


def _without(ids: frozenset[GeometryId], statement: Statement) -> Statement:
    return statement._replace(ids_A=statement.ids_A - ids, ids_B=statement.ids_B - ids)

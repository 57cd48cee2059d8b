"""Declaring which pairs of geometries are not to be checked for collision.

Never checked, with any declarations: geometries on the same frame, and two anchored geometries.
Every other pair of geometries with the proximity role is checked until a declaration excludes it.
"""

from __future__ import annotations

from collections.abc import Callable
import enum
from typing import Any, Concatenate, NamedTuple, ParamSpec, Protocol, TypeVar

from scene_graph_ros.geometry.errors import FilterHistoryError
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FilterId, GeometryId
from scene_graph_ros.geometry.model.pair_filter import Operation, PairFilter, Statement
from scene_graph_ros.geometry.model.writes import Writes
from scene_graph_ros.geometry.one_line import cut, one_line
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "CollisionFilterDeclaration",
    "CollisionFilterManager",
    "CollisionFilterScope",
]


Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class CollisionFilterScope(enum.Enum):
    """Which geometries of a GeometrySet a declaration means."""

    ALL = 0
    """All with the proximity role."""
    OMIT_DEFORMABLE = 1
    """Only rigid ones."""


class _Entry(NamedTuple):
    operation: Operation
    set_A: GeometrySet
    set_B: GeometrySet | None


class CollisionFilterDeclaration:
    """Statements about pairs, in order; a later one overrules an earlier one.

    The sets are copied now; which geometries the frames in them have is looked up when the
    declaration is applied. Geometry registered later, or without the proximity role by then, is
    not affected. The methods return the declaration, so calls can be chained.
    """

    __slots__ = ("_entries", "scope")

    def __init__(self, scope: CollisionFilterScope = CollisionFilterScope.ALL) -> None:
        if not isinstance(scope, CollisionFilterScope):
            raise TypeError(f"scope must be a CollisionFilterScope, not {quoted(scope)}")
        self.scope = scope
        self._entries: list[_Entry] = []

    def exclude_within(self, geometry_set: GeometrySet) -> CollisionFilterDeclaration:
        """Exclude all pairs within the set."""
        return self._add(Operation.EXCLUDE, geometry_set)

    def exclude_between(
        self, set_A: GeometrySet, set_B: GeometrySet
    ) -> CollisionFilterDeclaration:
        """Exclude all pairs with one geometry in each set, not those within a set."""
        return self._add(Operation.EXCLUDE, set_A, set_B)

    def allow_within(self, geometry_set: GeometrySet) -> CollisionFilterDeclaration:
        """Allow all pairs within the set again."""
        return self._add(Operation.ALLOW, geometry_set)

    def allow_between(self, set_A: GeometrySet, set_B: GeometrySet) -> CollisionFilterDeclaration:
        """Allow all pairs with one geometry in each set again."""
        return self._add(Operation.ALLOW, set_A, set_B)

    def _add(self, operation: Operation, *sets: GeometrySet) -> CollisionFilterDeclaration:
        given: Any
        for given in sets:
            if not isinstance(given, GeometrySet):
                raise TypeError(
                    f"{operation.value} takes a GeometrySet, such as GeometrySet(frame_id),"
                    f" not {quoted(given)}"
                )
        set_A, *others = (each.copy() for each in sets)
        self._entries.append(_Entry(operation, set_A, others[0] if others else None))
        return self

    def resolve(
        self,
        lookup: Callable[[GeometrySet, CollisionFilterScope], frozenset[GeometryId]],
    ) -> list[Statement]:
        """Return the statements with all sets replaced by the geometries that ``lookup`` finds."""
        statements = []
        for operation, set_A, set_B in self._entries:
            ids_A = lookup(set_A, self.scope)
            ids_B = ids_A if set_B is None else lookup(set_B, self.scope)
            statements.append(Statement(operation, ids_A, ids_B))
        return statements

    def __repr__(self) -> str:
        parts = [
            f"{op.value}_within({a!r})" if b is None else f"{op.value}_between({a!r}, {b!r})"
            for op, a, b in self._entries
        ]
        return cut(".".join(["CollisionFilterDeclaration()", *parts]))


def _check_declaration(declaration: Any) -> None:
    if not isinstance(declaration, CollisionFilterDeclaration):
        raise TypeError(f"a filter is a CollisionFilterDeclaration, not {quoted(declaration)}")


class _FilterOwner(Protocol):
    def change_filters(
        self,
        change: Callable[Concatenate[PairFilter, Writes, Arguments], Result],
        *arguments: Arguments.args,
        **named: Arguments.kwargs,
    ) -> Result: ...

    def filters(self) -> PairFilter: ...

    def resolve_set(
        self, geometry_set: GeometrySet, scope: CollisionFilterScope
    ) -> frozenset[GeometryId]: ...


@one_line()
class CollisionFilterManager:
    """Applies declarations to a model, or to the model of one context."""

    __slots__ = ("_owner",)

    def __init__(self, owner: _FilterOwner) -> None:
        self._owner = owner

    def apply(self, declaration: CollisionFilterDeclaration) -> None:
        """Apply a declaration for good.

        Raises UnknownIdError for ids that are not registered, and FilterHistoryError while
        transient declarations are in force.
        """
        _check_declaration(declaration)
        if self.has_transient_history():
            raise FilterHistoryError(
                f"cannot apply {declaration!r} for good while transient declarations are in"
                " force: remove them first"
            )
        statements = declaration.resolve(self._owner.resolve_set)
        self._owner.change_filters(PairFilter.apply, statements)

    def apply_transient(self, declaration: CollisionFilterDeclaration) -> FilterId:
        """Apply a declaration until it is removed; return the id to remove it by.

        Transient declarations may be removed in any order; the rest stays in force as if the
        removed one had never been applied. Raises UnknownIdError for ids that are not registered.
        """
        _check_declaration(declaration)
        statements = declaration.resolve(self._owner.resolve_set)
        return self._owner.change_filters(PairFilter.apply_transient, statements)

    def remove_declaration(self, filter_id: FilterId) -> bool:
        """Undo a transient declaration. Returns False if the id names none in force."""
        if not self.is_active(filter_id):
            return False
        return self._owner.change_filters(PairFilter.remove, filter_id)

    def flatten(self) -> None:
        """Make the outcome of all transient declarations persistent; their ids are then inactive.

        Pairs are filtered as before, and persistent declarations may be applied again.
        """
        self._owner.change_filters(PairFilter.flatten)

    def is_active(self, filter_id: FilterId) -> bool:
        """Tell whether a transient declaration is in force."""
        is_id = isinstance(filter_id, FilterId)
        return is_id and self._owner.filters().is_active(filter_id)

    def has_transient_history(self) -> bool:
        """Tell whether any transient declaration is in force."""
        return self._owner.filters().has_transient_history()

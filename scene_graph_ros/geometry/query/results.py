"""Result tables of queries.

A table is a sequence of records, made when one is looked at. Its columns are arrays of the same
names as the records' fields, read-only, so callers who want numbers copy nothing. Ids are
``GeometryId`` in records and integers in columns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Generic, overload, TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.paths import path_of
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.one_line import cut, one_line

__all__ = [
    "CandidatePair",
    "CandidatePairs",
    "LateColumns",
    "PenetrationAsPointPair",
    "Penetrations",
    "PointDistances",
    "ResultTable",
    "SignedDistancePair",
    "SignedDistancePairs",
    "SignedDistanceToPoint",
]

if TYPE_CHECKING:
    import pandas

    from scene_graph_ros.geometry.model.state import GeometryState

_OF_ELEMENTS = frozenset({"element", "element_A", "element_B"})
"""Columns that only tables of scenes with shapes of many elements have among ``columns``."""

FloatArray = NDArray[np.float64]
Record = TypeVar("Record")


@dataclass(frozen=True, slots=True, eq=False)
class CandidatePair:
    """Two geometries that may be in collision: their bounding boxes meet."""

    id_A: GeometryId
    id_B: GeometryId


@one_line()
@dataclass(frozen=True, slots=True, eq=False)
class PenetrationAsPointPair:
    """Two penetrating geometries: ``depth = (p_WCb - p_WCa) . nhat_BA_W > 0``."""

    id_A: GeometryId
    id_B: GeometryId
    p_WCa: FloatArray
    """(3,) metres: the point of A deepest inside B."""
    p_WCb: FloatArray
    """(3,) metres: the point of B deepest inside A."""
    nhat_BA_W: FloatArray
    """(3,) unit vector out of B into A: moving A by ``depth`` along it ends the penetration."""
    depth: float
    """Metres."""
    ddistance_dX_WA: FloatArray | None = None
    """(6,) or None; see ``SignedDistancePair``. The distance is ``-depth``."""
    ddistance_dX_WB: FloatArray | None = None
    """(6,) or None."""
    dp_WCa_dX_WA: FloatArray | None = None
    """(3, 6) or None; see ``SignedDistancePair``, also for the next four."""
    dp_WCa_dX_WB: FloatArray | None = None
    """(3, 6) or None."""
    dp_WCb_dX_WA: FloatArray | None = None
    """(3, 6) or None."""
    dp_WCb_dX_WB: FloatArray | None = None
    """(3, 6) or None."""
    is_witness_differentiable: bool | None = None
    """Or None."""
    gap: float | None = None
    """Metres, or None: the certificate; see ``SignedDistancePair``, also for the next."""
    decided_by: Mechanism | None = None
    """Or None."""
    element_A: int = -1
    """Which element of A decides, if A is a shape of many, such as a point of a cloud; else -1."""
    element_B: int = -1
    """The same of B."""


@one_line()
@dataclass(frozen=True, slots=True, eq=False)
class SignedDistancePair:
    """The signed distance of two geometries: ``p_WCa - p_WCb = distance * nhat_BA_W``."""

    id_A: GeometryId
    id_B: GeometryId
    p_ACa: FloatArray
    """(3,) metres: the witness point on A, in A's geometry frame."""
    p_BCb: FloatArray
    """(3,) metres: the witness point on B, in B's geometry frame."""
    distance: float
    """Metres; negative when penetrating."""
    nhat_BA_W: FloatArray
    """(3,) unit vector out of B into A: the direction of fastest increasing distance."""
    is_nhat_BA_W_unique: bool
    """False where the normal is a choice among several."""
    ddistance_dX_WA: FloatArray | None = None
    """(6,) or None: the rate of the distance is ``ddistance_dX_WA @ V_WA`` when A moves with the
    spatial velocity V_WA = (angular; of A's origin), rad/s and m/s, both expressed in W."""
    ddistance_dX_WB: FloatArray | None = None
    """(6,) or None: the same for B."""
    dp_WCa_dX_WA: FloatArray | None = None
    """(3, 6) or None: A's witness moves at ``dp_WCa_dX_WA @ V_WA`` in W when A moves."""
    dp_WCa_dX_WB: FloatArray | None = None
    """(3, 6) or None: the same when B moves."""
    dp_WCb_dX_WA: FloatArray | None = None
    """(3, 6) or None: B's witness, when A moves."""
    dp_WCb_dX_WB: FloatArray | None = None
    """(3, 6) or None: B's witness, when B moves."""
    is_witness_differentiable: bool | None = None
    """Or None. False where the witnesses are a choice among several, or at a kink of a surface:
    each then counts as fixed to its own shape."""
    gap: float | None = None
    """Metres, or None: the certificate. Moving A by ``-distance`` along the normal makes the
    shapes touch to within this; where they are apart, the distance is off by no more."""
    decided_by: Mechanism | None = None
    """Or None: what found the distance. It comes with the certificate; see the page
    ``docs/narrowphase.md`` for what each proves."""
    element_A: int = -1
    """Which element of A decides, if A is a shape of many, such as a point of a cloud; else -1."""
    element_B: int = -1
    """The same of B."""


@one_line()
@dataclass(frozen=True, slots=True, eq=False)
class SignedDistanceToPoint:
    """The signed distance of a point Q to a geometry G."""

    id_G: GeometryId
    p_GN: FloatArray
    """(3,) metres: the point of G's surface nearest to Q, in G."""
    distance: float
    """Metres; negative inside."""
    grad_W: FloatArray
    """(3,) unit vector: the gradient of the distance with respect to Q."""
    is_grad_W_unique: bool
    """False where the nearest point, and so the gradient, is a choice among several."""
    point: int = 0
    """Index of Q in a batch of points."""
    element: int = -1
    """Which element of G is nearest, if G is a shape of many, such as a point of a cloud; else -1.
    """


@one_line("length")
class LateColumns(Mapping[str, NDArray[Any]]):
    """Read-only columns, each made when it is first looked at."""

    __slots__ = ("_made", "_recipes", "_source", "length")

    def __init__(
        self, recipes: Mapping[str, Callable[[Any], NDArray[Any]]], source: Any, length: int
    ) -> None:
        """Take the makers of each column of ``source``, and the length of all."""
        self._recipes = recipes
        self._source = source
        self._made: dict[str, NDArray[Any]] = {}
        self.length = length

    def __getitem__(self, name: str) -> NDArray[Any]:
        column = self._made.get(name)
        if column is None:
            column = self._recipes[name](self._source)
            column.setflags(write=False)
            column = self._made.setdefault(name, column)  # whoever is first makes it for all
        return column

    def __iter__(self) -> Iterator[str]:
        return iter(self._recipes)

    def __len__(self) -> int:
        return len(self._recipes)


class ResultTable(Sequence[Record], Generic[Record]):
    """An immutable sequence of records over columns; a slice is a table on the same columns.

    ``print`` shows its rows with names, a notebook as a table, and ``to_pandas`` returns a
    DataFrame. A table that was pickled has ids in place of names.
    """

    record_type: ClassVar[type[Any]]
    _ids: ClassVar[tuple[str, ...]] = ("id_A", "id_B")
    __slots__ = ("_columns", "_length", "_state")

    def __init__(
        self, columns: Mapping[str, NDArray[Any]], state: GeometryState | None = None
    ) -> None:
        """Take at least one column, all of equal length; they are made read-only.

        ``state`` knows the names of the geometries.
        """
        self._state = state
        self._columns: Mapping[str, NDArray[Any]]
        if isinstance(columns, LateColumns):
            self._columns, self._length = columns, columns.length
            return
        for column in columns.values():
            column.setflags(write=False)
        self._columns = MappingProxyType(dict(columns))
        self._length = len(next(iter(columns.values())))

    @property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """The columns by name, read-only."""
        return self._columns

    def __getattr__(self, name: str) -> NDArray[Any]:
        """Return the column of this name."""
        try:
            return object.__getattribute__(self, "_columns")[name]
        except KeyError:
            if name in _OF_ELEMENTS and name in self.record_type.__dataclass_fields__:
                return np.full(len(self), -1)  # of a scene without shapes of many elements
            raise AttributeError(f"{type(self).__name__} has no column {name!r}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._columns]

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> Record: ...

    @overload
    def __getitem__(self, index: slice) -> ResultTable[Record]: ...

    def __getitem__(self, index: int | slice) -> Record | ResultTable[Record]:
        if isinstance(index, slice):
            columns = {name: column[index] for name, column in self._columns.items()}
            return type(self)(columns, self._state)
        row = range(self._length)[index]
        record: Record = self.record_type(**{k: self._field(k, row) for k in self._columns})
        return record

    def _field(self, name: str, row: int) -> Any:
        value = self._columns[name][row]
        if name in self._ids:
            return GeometryId(int(value))
        if name == "decided_by":
            return Mechanism(int(value))
        return value if isinstance(value, np.ndarray) else value.item()

    def __iter__(self) -> Iterator[Record]:
        return (self[row] for row in range(self._length))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self._columns),)

    def name_of(self, id_value: int) -> str:
        """Return the name of a geometry by the number in a column: ``source/frame/geometry``."""
        geometry_id = GeometryId(int(id_value))
        return repr(geometry_id) if self._state is None else path_of(self._state, geometry_id)

    def to_pandas(self, columns: Sequence[str] | None = None) -> pandas.DataFrame:
        """Return a ``pandas.DataFrame`` of some columns, or of all that the query was asked for.

        Names of geometries are columns of their own, such as ``name_A`` for ``id_A``; a vector
        ``p_WCa`` becomes ``p_WCa_x``, ``p_WCa_y`` and ``p_WCa_z``.

        Raises:
            QueryArgumentError: there is no such column.
            ImportError: pandas is not installed.

        """
        from scene_graph_ros.table_text import as_pandas, UnknownColumnError

        try:
            return as_pandas(self._columns, self._ids, self.name_of, columns)
        except UnknownColumnError as error:
            raise QueryArgumentError(str(error)) from None

    def __repr__(self) -> str:
        text = f"<{type(self).__name__}: {self._length} x ({', '.join(self._columns)})>"
        return cut(text)

    def __str__(self) -> str:
        from scene_graph_ros.table_text import as_text

        return as_text(type(self).__name__, self._columns, self._ids, self.name_of)

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(str(self))

    def _repr_html_(self) -> str:
        from scene_graph_ros.table_text import as_html

        return as_html(type(self).__name__, self._columns, self._ids, self.name_of)


class CandidatePairs(ResultTable[CandidatePair]):
    """Pairs that passed the culling, sorted by (id_A, id_B)."""

    __slots__ = ()
    record_type = CandidatePair


class Penetrations(ResultTable[PenetrationAsPointPair]):
    """Penetrating pairs, sorted by (id_A, id_B)."""

    __slots__ = ()
    record_type = PenetrationAsPointPair


class SignedDistancePairs(ResultTable[SignedDistancePair]):
    """Signed distances of pairs, sorted by (id_A, id_B)."""

    __slots__ = ()
    record_type = SignedDistancePair


class PointDistances(ResultTable[SignedDistanceToPoint]):
    """Signed distances of points, sorted by (point, id_G)."""

    __slots__ = ()
    _ids = ("id_G",)
    record_type = SignedDistanceToPoint

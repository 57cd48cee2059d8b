"""Affine expressions of vertices' points, and the costs and constraints that are made of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.term_kernels import KINDS, value
from scene_graph_ros.convex.questions.arguments import as_matrix, frozen
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float

__all__ = [
    "Affine",
    "Atom",
    "Constraint",
    "Cost",
    "as_cost",
    "checked_vector",
    "norm",
    "norm1",
    "norm_inf",
    "quad_form",
    "stacked",
    "sum_squares",
    "value_of",
]


_USUAL = 1e100
"""Of smaller numbers no more is asked, in a third of the time."""


class Affine:
    """``sum of matrix @ point of a vertex + constant``: a vector ``(k,)``, or a number.

    ``+ - * / @`` with arrays and numbers and indices make others; ``== <= >=`` make constraints.
    ``terms`` has for each vertex's number its matrix ``(k, n)``; ``constant`` is ``(k,)``.
    """

    __array_ufunc__ = None  # so that numpy leaves the operators to this class
    __hash__ = None  # type: ignore[assignment]

    def __init__(
        self, terms: dict[int, np.ndarray], constant: np.ndarray, is_number: bool = False
    ) -> None:
        self.terms = terms
        self.constant = constant
        self.is_number = is_number

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self.constant)

    def __getitem__(self, index: Any) -> Affine:
        """Return some entries, or one as a number."""
        rows = np.arange(len(self))[index]
        some = np.atleast_1d(rows)
        terms = {key: matrix[some] for key, matrix in self.terms.items()}
        return Affine(terms, self.constant[some], np.ndim(rows) == 0)

    def _map(self, matrix: np.ndarray, is_number: bool) -> Affine:
        terms = {key: matrix @ each for key, each in self.terms.items()}
        return Affine(terms, matrix @ self.constant, is_number)

    def _add(self, other: Any, sign: float) -> Affine:
        b = other if isinstance(other, Affine) else _constant(other)
        if len(self) != len(b) and 1 not in (len(self), len(b)):
            raise ConvexSetError(
                f"an expression of {len(self)} entries can't be added to one of {len(b)}"
            )
        size = max(len(self), len(b))
        terms = {key: _tall(matrix, size) for key, matrix in self.terms.items()}
        for key, matrix in b.terms.items():
            more = sign * _tall(matrix, size)
            terms[key] = terms[key] + more if key in terms else more
        constant = self.constant + sign * b.constant
        return Affine(terms, constant, self.is_number and b.is_number)

    def __add__(self, other: Any) -> Any:
        if isinstance(other, Cost):
            return NotImplemented
        return self._add(other, 1.0)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Affine:
        return self._add(other, -1.0)

    def __neg__(self) -> Affine:
        return -1.0 * self

    def __rsub__(self, other: Any) -> Affine:
        return (-1.0 * self)._add(other, 1.0)

    def __mul__(self, factor: Any) -> Affine:
        values = _constant(factor).constant
        if len(values) not in (1, len(self)):
            raise ConvexSetError(
                f"a factor must be a number or have {len(self)} entries, not {quoted(factor)}"
            )
        terms = {key: values[:, None] * matrix for key, matrix in self.terms.items()}
        return Affine(terms, values * self.constant, self.is_number)

    __rmul__ = __mul__

    def __truediv__(self, divisor: Any) -> Affine:
        return self * (1.0 / real_array(divisor, "a divisor must be numbers", ConvexSetError))

    def __rmatmul__(self, matrix: Any) -> Affine:
        is_number = np.ndim(matrix) == 1
        rows = as_matrix(np.atleast_2d(matrix), "the matrix before @", len(self))
        return self._map(rows, is_number)

    def __matmul__(self, vector: Any) -> Affine:
        if np.ndim(vector) != 1:
            raise ConvexSetError(f"what follows @ must be a vector, not {quoted(vector)}")
        return self.__rmatmul__(vector)

    def at(self, points: Mapping[int, np.ndarray]) -> np.ndarray:
        """Return the value ``(k,)`` at points ``(n,)`` of vertices, by their numbers."""
        value = self.constant
        for key, matrix in self.terms.items():
            value = value + matrix @ points[key]
        return value

    def sum(self) -> Affine:
        """Return the sum of the entries."""
        return self._map(np.ones((1, len(self))), True)

    def __eq__(self, other: Any) -> Constraint:  # type: ignore[override]
        return Constraint(self - other, is_equation=True)

    def __le__(self, other: Any) -> Constraint:
        return Constraint(self - other, is_equation=False)

    def __ge__(self, other: Any) -> Constraint:
        return Constraint(-1.0 * (self - other), is_equation=False)


def _tall(matrix: np.ndarray, size: int) -> np.ndarray:
    if len(matrix) == size:
        return matrix  # to broadcast takes ten times as long as to add
    return np.broadcast_to(matrix, (size, matrix.shape[1]))


def _constant(value: Any) -> Affine:
    if (type(value) is float or type(value) is int) and -_USUAL < value < _USUAL:
        return Affine({}, frozen(np.array([value])), True)
    is_vector = type(value) is np.ndarray and value.ndim == 1
    is_number = not is_vector and np.ndim(value) == 0
    column = value[:, None] if is_vector else np.reshape(np.atleast_1d(value), (-1, 1))
    return Affine({}, as_matrix(column, "a number in an expression")[:, 0], is_number)


@dataclass(frozen=True, eq=False)
class Constraint:
    """All entries of ``rows`` are 0, or at most 0; or together they are in a ``cone``.

    Of a symmetric matrix the rows are the upper triangle, column after column.
    """

    rows: Affine
    is_equation: bool
    cone: Cone | None = None

    def __bool__(self) -> bool:
        """Refuse to be a condition, as in ``a <= x <= b``, which says something else."""
        raise ConvexSetError("a constraint has no truth value; write a <= x and x <= b apart")


@dataclass(frozen=True, eq=False)
class Atom:
    """A convex function of an affine vector w.

    ``norm``, ``norm_inf`` and ``squares`` of all of it, ``quotient`` is ``|w[1:]|^2 / w[0]``, at
    ``w[0] >= 0``, and ``exponential`` is ``exp(w[0])``.
    """

    kind: str
    of: Affine


def value_of(kind: str, w: np.ndarray) -> float:
    """Return an atom of a kind at a vector ``(k,)``."""
    return float(value(KINDS[kind], np.ascontiguousarray(w, dtype=float), 0, len(w)))


@dataclass(frozen=True, eq=False)
class Cost:
    """A sum of convex functions and of one affine number."""

    atoms: tuple[Atom, ...]
    rest: Affine

    __array_ufunc__ = None

    def at(self, points: Mapping[int, np.ndarray]) -> float:
        """Return the cost at points ``(n,)`` of vertices, by their numbers."""
        atoms = sum(value_of(atom.kind, atom.of.at(points)) for atom in self.atoms)
        return atoms + float(self.rest.at(points)[0])

    def __add__(self, other: Any) -> Cost:
        if not isinstance(other, Cost):
            other = as_cost(other, "a cost")
        return Cost(self.atoms + other.atoms, self.rest + other.rest)

    __radd__ = __add__

    def __mul__(self, factor: Any) -> Cost:
        number = as_float(factor)
        if number is None or not 0.0 <= number < np.inf:
            raise ConvexSetError(
                f"the factor of a cost must be a finite number, at least 0, not {quoted(factor)}"
            )
        atoms = tuple(_times(a, number) for a in self.atoms) if number else ()
        return Cost(atoms, self.rest * number)

    __rmul__ = __mul__

    def __le__(self, other: Any) -> Constraint:
        """Return the constraint that one convex function is at most an affine number.

        Raises ConvexSetError where there are several, and where the right side is convex.
        """
        if len(self.atoms) != 1:
            raise ConvexSetError(
                f"a constraint takes one norm or sum of squares, not {len(self.atoms)}; write one"
                " constraint for each"
            )
        side = as_cost(other, "the right side of <=")
        if side.atoms:
            raise ConvexSetError("the right side of <= must be a number or affine, and has a norm")
        atom, bound = self.atoms[0], side.rest - self.rest
        if atom.kind == "norm_inf":
            return Constraint(stacked([atom.of - bound, -1.0 * atom.of - bound]), False)
        if atom.kind == "norm":
            return Constraint(stacked([bound, atom.of]), False, Cone.SECOND_ORDER)
        if atom.kind == "exponential":
            return Constraint(stacked([atom.of, _ONE, bound]), False, Cone.EXPONENTIAL)
        if atom.kind == "quotient":
            # |w|^2 <= s t as |(t - s, 2 w)| <= t + s.
            s, w = atom.of[0], atom.of[1:]
            rows = stacked([bound + s, bound - s, 2.0 * w])
            return Constraint(rows, False, Cone.SECOND_ORDER)
        # |w|^2 <= t as |(t - 1, 2 w)| <= t + 1.
        rows = stacked([bound + 1.0, bound - 1.0, 2.0 * atom.of])
        return Constraint(rows, False, Cone.SECOND_ORDER)


def _times(atom: Atom, number: float) -> Atom:
    """Return an atom times a number above 0."""
    if atom.kind == "exponential":
        return Atom(atom.kind, atom.of + float(np.log(number)))
    if atom.kind == "quotient":
        root = np.full(len(atom.of), np.sqrt(number))
        root[0] = 1.0
        return Atom(atom.kind, atom.of * root)
    return Atom(atom.kind, atom.of * (np.sqrt(number) if atom.kind == "squares" else number))


def stacked(parts: list[Affine]) -> Affine:
    """Return the entries of some expressions behind one another."""
    keys = {key: matrix.shape[1] for part in parts for key, matrix in part.terms.items()}
    terms = {
        key: np.concatenate([part.terms.get(key, np.zeros((len(part), width))) for part in parts])
        for key, width in keys.items()
    }
    return Affine(terms, np.concatenate([part.constant for part in parts]))


def as_cost(value: Any, label: str) -> Cost:
    """Return a number, an affine number or a cost as a cost. Raises ConvexSetError."""
    if isinstance(value, Cost):
        return value
    if isinstance(value, Affine):
        if len(value) != 1:
            raise ConvexSetError(f"{label} must be a number, not {len(value)} entries; use norm")
        return Cost((), value)
    number = as_float(value)
    if number is None or not abs(number) < np.inf:
        raise ConvexSetError(
            f"{label} must be an expression or a finite number, not {quoted(value)}"
        )
    return Cost((), _constant(number))


_NOTHING = Affine({}, np.zeros(1), True)
_ONE = Affine({}, np.ones(1), True)


def checked_vector(vector: Any, name: str) -> Affine:
    """Return an expression. Raises ConvexSetError, which names the function that takes it."""
    if not isinstance(vector, Affine):
        raise ConvexSetError(
            f"{name} takes an expression of edge.xu, edge.xv, not {quoted(vector)}"
        )
    return vector


def norm(vector: Affine) -> Cost:
    """Return the Euclidean length."""
    return Cost((Atom("norm", checked_vector(vector, "norm")),), _NOTHING)


def norm1(vector: Affine) -> Cost:
    """Return the sum of the magnitudes."""
    checked = checked_vector(vector, "norm1")
    return Cost(tuple(Atom("norm", checked[k : k + 1]) for k in range(len(checked))), _NOTHING)


def norm_inf(vector: Affine) -> Cost:
    """Return the largest magnitude."""
    return Cost((Atom("norm_inf", checked_vector(vector, "norm_inf")),), _NOTHING)


def sum_squares(vector: Affine) -> Cost:
    """Return the squared Euclidean length."""
    return Cost((Atom("squares", checked_vector(vector, "sum_squares")),), _NOTHING)


def quad_form(vector: Affine, Q: Any) -> Cost:
    """Return ``x . Q x``. Raises ConvexSetError unless Q is symmetric and never negative."""
    checked = checked_vector(vector, "quad_form")
    form = as_matrix(Q, "quad_form: Q", len(checked))
    values, axes = np.linalg.eigh(form) if form.shape == form.T.shape else (np.zeros(0), form)
    size = float(np.abs(values).max(initial=0.0))
    is_symmetric = form.shape[0] == form.shape[1] and (form == form.T).all()
    if not is_symmetric or values.min(initial=0.0) < -1e-12 * size:
        raise ConvexSetError(
            "quad_form: Q must be symmetric without negative eigenvalues, not"
            f" {quoted(form.tolist())}"
        )
    return sum_squares((np.sqrt(np.maximum(values, 0.0))[:, None] * axes.T) @ checked)

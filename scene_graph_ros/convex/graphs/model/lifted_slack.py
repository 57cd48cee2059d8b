"""Graphs whose slack variables are coordinates of points, as the solvers take them.

A vertex with slack variables becomes the product of its set and theirs. An edge with some leads
over a vertex of its own, the product of the set it leads to and its variables: that has one edge
in and one out, so each path and each flow of one graph is one of the other, at the same cost.
Vertices and edges of graphs have numbers from 0; the added ones are below. An affine cost with
slack variables becomes one more coordinate, which is at least the cost and at least 0: what the
cost is where constraints are broken counts no more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import itertools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import (
    Affine,
    as_cost,
    Constraint,
    Cost,
)
from scene_graph_ros.convex.graphs.expressions.functions import FunctionCost
from scene_graph_ros.convex.graphs.model.costly import Costly
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.slack_variables import box_of, SlackVariables
from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
from scene_graph_ros.convex.sets.convex_set import ConvexSet

__all__ = ["LiftedSlack", "has_slack", "lifted_cost"]


_ROUNDING = 1e-9
"""Relative: by how much a bound of a cost is widened, far more than floats are off by."""


def has_slack(parts: Sequence[Costly]) -> bool:
    """Tell whether some vertices or edges have slack variables."""
    return any(part._slack for part in parts)


class _Columns(NamedTuple):
    """Where the variables of one number in expressions are: first columns of a lifted vertex."""

    vertex: Vertex
    first: int


class LiftedSlack:
    """The lifted vertices and edges of a graph, made when they are first asked for."""

    def __init__(self) -> None:
        self._owners: dict[int, tuple[Vertex, Costly]] = {}
        """By the numbers of lifted vertices those whose points and slack variables they have."""
        self._vertices: dict[int, Vertex] = {}
        self._edges: dict[int, tuple[Edge, ...]] = {}

    def owner(self, lifted: Vertex) -> tuple[Vertex, Costly]:
        """Return the vertex whose points, and the part whose slack variables, another has."""
        return self._owners[lifted.id]

    def split(self, number: int, x: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Return the point ``(n,)``, and slack variables by number, of a lifted vertex."""
        of, part = self._owners[number]
        ends = np.cumsum([of.ambient_dimension, *(len(each) for each in part._slack)]).tolist()
        pairs = zip(part._slack, itertools.pairwise(ends), strict=True)
        return x[: ends[0]], {each.number: x[a:b] for each, (a, b) in pairs}

    def ends(self, number: int) -> tuple[Edge, Edge]:
        """Return the first and the last of the edges in place of that of a number."""
        edges = self._edges[number]
        return edges[0], edges[-1]

    def vertex(self, of: Vertex) -> Vertex:
        """Return the vertex that has the slack variables of another in its points."""
        if of.id not in self._vertices:
            self._owners[of.id] = of, of
            self._vertices[of.id] = made = of if not of._slack else _with_slack(of, of, of.id)
            if made is not of:
                at = {of.id: _Columns(made, 0), **_columns(of, of, made)}
                _take(made, of, at, (of.ambient_dimension,))
        return self._vertices[of.id]

    def edge(self, of: Edge) -> tuple[Edge, ...]:
        """Return the edge, or the two over its own vertex, in place of another."""
        if of.id not in self._edges:
            self._edges[of.id] = self._lift(of)
        return self._edges[of.id]

    def _lift(self, of: Edge) -> tuple[Edge, ...]:
        u, v = self.vertex(of.u), self.vertex(of.v)
        if u is of.u and v is of.v and not of._slack:
            return (of,)
        at = {of.u.id: _Columns(u, 0), of.v.id: _Columns(v, 0)}
        counts = of.u.ambient_dimension, of.v.ambient_dimension
        if not of._slack:
            whole = Edge(of.id, u, v, of.name, of._phi)
            _take(whole, of, at, counts)
            return (whole,)
        own = _with_slack(of.v, of, -2 - of.id)
        self._owners[own.id] = of.v, of
        into, out = Edge(of.id, u, own, of.name, of._phi), Edge(-2 - of.id, own, v, of.name)
        at |= {of.v.id: _Columns(own, 0), **_columns(of.v, of, own)}
        _take(into, of, at, counts)
        n = of.v.ambient_dimension
        out.add_constraint(own.x[:n] == v.x[:n])
        return into, out


def _with_slack(vertex: Vertex, of: Costly, number: int) -> Vertex:
    """Return a vertex whose points are those of another and the slack variables of a part.

    And a coordinate for each of its affine costs with slack variables.
    """
    sets = {v.id: v.set for v in ((of.u, of.v) if isinstance(of, Edge) else (vertex,))}
    sets |= {each.number: box_of([each]) for each in of._slack}
    most = [_most(cost.rest, sets) for cost, _ in of._costs if of._is_affine_with_slack(cost)]
    costs = [SlackVariables(-1, "", np.zeros(1), np.array([max(each, 0.0)])) for each in most]
    product = CartesianProduct([vertex.set, box_of([*of._slack, *costs])])
    return Vertex(number, product, f"{of.name} and its slack variables")


def _most(of: Affine, sets: Mapping[int, ConvexSet]) -> float:
    """Return an upper bound of an affine number over sets by numbers in expressions."""
    most = size = float(of.constant[0])
    for number, matrix in of.terms.items():
        reached = sets[number].support(matrix[0])
        most += reached.value + reached.gap
        size = max(size, abs(most))
    return most + _ROUNDING * size


def _columns(vertex: Vertex, of: Costly, lifted: Vertex) -> dict[int, _Columns]:
    """Return where slack variables are in the points of a lifted vertex."""
    at, first = {}, vertex.ambient_dimension
    for each in of._slack:
        at[each.number] = _Columns(lifted, first)
        first += len(each)
    return at


def _take(lifted: Costly, of: Costly, at: Mapping[int, _Columns], counts: Sequence[int]) -> None:
    """Have a lifted vertex or edge take the costs and constraints of another.

    ``counts`` are the dimensions of its own points, without slack variables.
    """
    for terms, made in (
        (of._costs, lifted._costs),
        (of._constraints, lifted._constraints),
    ):
        made += [(_lifted_term(term, at, counts, bool(of._slack)), used) for term, used in terms]
    affine = [k for k, (cost, _) in enumerate(of._costs) if of._is_affine_with_slack(cost)]
    for place, k in enumerate(affine, start=-len(affine)):
        cost, used = lifted._costs[k]
        coordinate = at[of._slack[0].number].vertex.x[place]
        lifted._constraints.append((coordinate >= cost.rest, used))
        lifted._costs[k] = (as_cost(coordinate, "the coordinate of a cost"), used)


def _lifted_term(
    term: Any, at: Mapping[int, _Columns], counts: Sequence[int] = (), has_own: bool = False
) -> Any:
    if isinstance(term, Cost):
        atoms = tuple(replace(atom, of=_lifted(atom.of, at)) for atom in term.atoms)
        return Cost(atoms, _lifted(term.rest, at))
    if isinstance(term, Constraint):
        return replace(term, rows=_lifted(term.rows, at))
    if isinstance(term, FunctionCost):
        return FunctionCost(_of_points(term.function, counts, has_own))
    return type(term)(_of_points(term.function, counts, has_own), term.lower, term.upper)


def lifted_cost(cost: Cost, vertex: Vertex, lifted: Vertex) -> Cost:
    """Return a cost of a vertex's points as one of those of a lifted vertex that begin so."""
    made: Cost = _lifted_term(cost, {vertex.id: _Columns(lifted, 0)})
    return made


def _lifted(affine: Affine, at: Mapping[int, _Columns]) -> Affine:
    terms: dict[int, np.ndarray] = {}
    for number, matrix in affine.terms.items():
        vertex, first = at[number]
        wide = terms.setdefault(vertex.id, np.zeros((len(matrix), vertex.ambient_dimension)))
        wide[:, first : first + matrix.shape[1]] += matrix
    return Affine(terms, affine.constant, affine.is_number)


def _of_points(
    function: Callable[..., Any], counts: Sequence[int], has_own: bool
) -> Callable[..., Any]:
    """Return a function of lifted points that gives another its points, and slack variables."""

    def of_points(*lifted: Any) -> Any:
        points = [x[:n] for x, n in zip(lifted, counts, strict=True)]
        return function(*points, *([lifted[-1][counts[-1] :]] if has_own else []))

    return of_points

"""The table of edges' terms, from the expressions that were given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import Affine, Constraint, Cost
from scene_graph_ros.convex.graphs.expressions.packed_terms import packed
from scene_graph_ros.convex.graphs.expressions.term_kernels import KINDS
from scene_graph_ros.convex.graphs.model.edge_terms import (
    EdgeTerms,
    Layout,
    Part,
    sizes_of_costs,
)
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet, reach_of
from scene_graph_ros.convex.graphs.relax.edge_table import EdgeTable

__all__ = ["EdgeSource", "table_of"]

_NEGATIVE = 1e-12
"""Relative to the terms of a cost: how far below 0 rounding may take its least value."""

_NONE = np.zeros(0)


class EdgeSource(NamedTuple):
    """The parts of an edge: its costs, its constraints, its two sets with their numbers."""

    costs: Sequence[Cost]
    constraints: Sequence[Constraint]
    u: tuple[int, PlacedSet]
    v: tuple[int, PlacedSet]
    label: str

    def in_order(self) -> _Ordered:
        """Return its expressions in the order of a layout's rows, and their kinds."""
        atoms = [atom for cost in self.costs for atom in cost.atoms]
        flat = [c for c in self.constraints if c.cone is None]
        equations = [c.rows for c in flat if c.is_equation]
        inequalities = [c.rows for c in flat if not c.is_equation]
        in_cones = [c for c in self.constraints if c.cone is not None]
        layout = Layout(
            tuple(atom.kind for atom in atoms),
            tuple(len(atom.of) for atom in atoms),
            sum(len(each) for each in equations),
            sum(len(each) for each in inequalities),
            tuple(c.cone for c in in_cones if c.cone is not None),
            tuple(len(c.rows) for c in in_cones),
        )
        before = tuple(atom.of for atom in atoms)
        after = (*equations, *inequalities, *(c.rows for c in in_cones))
        return _Ordered(layout, before, tuple(cost.rest for cost in self.costs), after)


class _Ordered(NamedTuple):
    """Expressions of atoms, of linear costs, which are added up, and of constraints."""

    layout: Layout
    atoms: tuple[Affine, ...]
    rests: tuple[Affine, ...]
    constraints: tuple[Affine, ...]


def table_of(sources: Sequence[EdgeSource]) -> EdgeTable:
    """Return the table of edges, in their order.

    Raises ConvexSetError, which names the edge, where a linear cost may be negative.
    """
    alike: dict[Any, list[tuple[int, _Ordered]]] = {}
    for k, source in enumerate(sources):
        parts = source.in_order()
        lengths = tuple(len(each) for each in parts.constraints)
        shapes = source.u[1].S.shape, source.v[1].S.shape
        key = (parts.layout, len(parts.rests), lengths, shapes)
        alike.setdefault(key, []).append((k, parts))
    made: dict[int, EdgeTerms] = {}
    for some in alike.values():
        numbers = [k for k, _ in some]
        terms = _terms([sources[k] for k in numbers], [parts for _, parts in some])
        made.update(zip(numbers, terms, strict=True))
    return EdgeTable([made[k] for k in range(len(sources))])


def _terms(sources: Sequence[EdgeSource], some: Sequence[_Ordered]) -> list[EdgeTerms]:
    """Return the terms of edges of one layout, whose sets have as many variables."""
    layout = some[0].layout
    ends = [
        ([number for number, _ in some_ends], [placed for _, placed in some_ends])
        for some_ends in ([s.u for s in sources], [s.v for s in sources])
    ]
    centers = [np.array([placed.center for placed in sets])[:, :, None] for _, sets in ends]

    def rows(which: str) -> list[np.ndarray]:
        """Return Mu, Mv, m and its size, of all rows of some expressions of each edge."""
        columns = [getattr(each, which) for each in some]
        constant = np.array([np.concatenate([_NONE, *(e.constant for e in of)]) for of in columns])
        found, size = [], np.abs(constant)
        for (numbers, _), center in zip(ends, centers, strict=True):
            M = np.zeros((*constant.shape, center.shape[1]))
            for at, of, number in zip(M, columns, numbers, strict=True):
                begin = 0
                for each in of:
                    end = begin + len(each.constant)
                    if number in each.terms:
                        at[begin:end] = each.terms[number]
                    begin = end
            constant = constant + (M @ center)[:, :, 0]
            size = size + (np.abs(M) @ np.abs(center))[:, :, 0]
            found.append(M)
        return [*found, constant, size]

    rest = [np.sum(each, axis=1, keepdims=True) for each in rows("rests")]
    blocks = [rows("atoms"), rest, rows("constraints")]
    Mu, Mv, m, size = (np.concatenate(each, axis=1) for each in zip(*blocks, strict=True))
    sets, halves = [], []
    for _, placed in ends:
        sets.append(placed)
        halves.append(np.array([each.half for each in placed]))
    _check_linear(sets, halves, rest, [source.label for source in sources])
    most = np.abs(m)
    for M, half in zip((Mu, Mv), halves, strict=True):
        most = most + (np.abs(M) @ half[:, :, None])[:, :, 0]
    over = [M @ np.array([each.S for each in of]) for M, of in zip((Mu, Mv), sets, strict=True)]
    head = [Mu.shape[2], Mv.shape[2], over[0].shape[2], over[1].shape[2], m.shape[1]]
    head += [len(layout.kinds), layout.equations, layout.inequalities, len(layout.cones)]
    sizes = [*layout.atoms, *layout.cones, *(int(cone) for cone in layout.cone_kinds)]
    arrays = [sizes_of_costs(layout, m, most), *over, Mu, Mv, m, size, most]
    found = packed(head, [*(KINDS[kind] for kind in layout.kinds), *sizes], arrays)
    return [
        EdgeTerms(u, v, layout, Part(Mu[k], Mv[k], m[k]), size[k], most[k], found[k])
        for k, (u, v) in enumerate(zip(*sets, strict=True))
    ]


def _check_linear(
    sets: Sequence[Sequence[PlacedSet]],
    halves: Sequence[np.ndarray],
    rest: Sequence[np.ndarray],
    labels: Sequence[str],
) -> None:
    """Raise ConvexSetError where a linear cost is negative at some points of the sets."""
    *slopes, m, size = (each[:, 0] for each in rest)
    low, terms = m.copy(), size.copy()
    for of, M, half in zip(sets, slopes, halves, strict=True):
        terms += np.sum(np.abs(M) * half, axis=1)
        some = np.flatnonzero(M.any(axis=1)).tolist()
        if len(some):
            low[some] -= reach_of([of[k] for k in some], -M[some], half[some])[0]
    bad = np.flatnonzero(low < -_NEGATIVE * terms)
    if len(bad):
        k = int(bad[0])
        raise ConvexSetError(
            f"{labels[k]}: the linear part of the cost is {low[k]:.6g} at some points of the sets;"
            " costs must be at least 0 on all of both sets"
        )

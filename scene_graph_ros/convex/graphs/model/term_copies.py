"""Costs and constraints of a vertex or an edge, made those of others, and counted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import Affine, Constraint, Cost

__all__ = ["count_appearances", "renumbered"]


def renumbered(term: Any, numbers: Mapping[int, int]) -> Any:
    """Return a cost or constraint with other numbers of vertices; those that are not named stay.

    Functions take points in the order of an edge's vertices, so they are the same.
    """
    if isinstance(term, Cost):
        atoms = tuple(replace(atom, of=_of(atom.of, numbers)) for atom in term.atoms)
        return Cost(atoms, _of(term.rest, numbers))
    if isinstance(term, Constraint):
        return replace(term, rows=_of(term.rows, numbers))
    return term


def _of(affine: Affine, numbers: Mapping[int, int]) -> Affine:
    terms = {numbers.get(number, number): matrix for number, matrix in affine.terms.items()}
    return Affine(terms, affine.constant, affine.is_number)


def count_appearances(term: Any, count: int) -> int:
    """Return the number of variables' appearances in a term; ``count`` of a function."""
    if isinstance(term, Cost):
        return sum(_nonzeros(each) for each in (term.rest, *(atom.of for atom in term.atoms)))
    if isinstance(term, Constraint):
        return _nonzeros(term.rows)
    return count


def _nonzeros(affine: Affine) -> int:
    return sum(int(np.count_nonzero(matrix)) for matrix in affine.terms.values())

"""Checks of proofs about linear rows, in fractions; they share nothing with what finds proofs."""

from fractions import Fraction
from itertools import combinations

__all__ = ["assert_shows", "exact_rows", "exact_vertices", "largest_at_vertices", "largest_of"]


def exact_rows(A, b):
    """Return rows and right sides of floats as lists of fractions."""
    return [[Fraction(float(v)) for v in row] for row in A], [Fraction(float(v)) for v in b]


def _sums(weights, A, n):
    return [
        sum((w * row[k] for w, row in zip(weights, A, strict=True)), Fraction(0)) for k in range(n)
    ]


def assert_shows(kind, vector, A, b, num_equalities, n):
    """Assert that a vector shows what its kind says of the rows, as `Proof` defines it."""
    A, b = exact_rows(A, b)
    values = [sum((a * v for a, v in zip(row, vector, strict=False)), Fraction(0)) for row in A]
    if kind == "point":
        assert len(vector) == n
        assert all(v == s for v, s in list(zip(values, b, strict=True))[:num_equalities])
        assert all(v <= s for v, s in zip(values, b, strict=True))
    elif kind == "recession":
        assert any(vector)
        assert all(v == 0 for v in values[:num_equalities])
        assert all(v <= 0 for v in values)
    elif kind == "farkas":
        assert len(vector) == len(b)
        assert all(w >= 0 for w in vector[num_equalities:])
        assert not any(_sums(vector, A, n))
        assert sum(w * s for w, s in zip(vector, b, strict=True)) < 0
    else:
        assert kind == "multipliers"
        assert all(w > 0 for w in vector[num_equalities:])
        assert not any(_sums(vector, A, n))
        assert _rank(A) == n


def _rank(rows):
    rows, rank = [list(row) for row in rows], 0
    for k in range(len(rows[0]) if rows else 0):
        pivot = next((i for i in range(rank, len(rows)) if rows[i][k] != 0), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for i in range(rank + 1, len(rows)):
            factor = rows[i][k] / rows[rank][k]
            rows[i] = [a - factor * p for a, p in zip(rows[i], rows[rank], strict=True)]
        rank += 1
    return rank


def _solve(rows, sides):
    """Return where n rows meet in one point, None where they don't (Cramer, n up to 3)."""
    n = len(rows)
    whole = _determinant(rows)
    if whole == 0:
        return None
    swapped = [
        [[s if j == k else row[j] for j in range(n)] for row, s in zip(rows, sides, strict=True)]
        for k in range(n)
    ]
    return [_determinant(m) / whole for m in swapped]


def _determinant(m):
    if not m:
        return Fraction(1)
    minors = [[row[:k] + row[k + 1 :] for row in m[1:]] for k in range(len(m))]
    return sum(
        ((-1) ** k * m[0][k] * _determinant(minor) for k, minor in enumerate(minors)), Fraction(0)
    )


def exact_vertices(A, b):
    """Return the vertices of a bounded polyhedron, as lists of fractions."""
    A, b = exact_rows(A, b)
    found = []
    for chosen in combinations(range(len(b)), len(A[0]) if A else 0):
        x = _solve([A[i] for i in chosen], [b[i] for i in chosen])
        if x is not None and all(_dot(row, x) <= s for row, s in zip(A, b, strict=True)):
            found.append(x)
    return found


def largest_at_vertices(A, b, c):
    """Return the largest ``c . x`` over all vertices of a bounded polyhedron, None if empty."""
    return largest_of(exact_vertices(A, b), c)


def largest_of(vertices, c):
    """Return the largest ``c . x`` of vertices in fractions, None if there are none."""
    c = [Fraction(float(v)) for v in c]
    return max((_dot(c, x) for x in vertices), default=None)


def _dot(a, x):
    return sum(u * v for u, v in zip(a, x, strict=True))

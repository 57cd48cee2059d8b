"""Small programs over cones whose rows take neighbours alone, by what proves their answers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scene_graph_ros.convex.solve.banded.banded_cones import IMPROVE, minimize_banded
from scene_graph_ros.convex.solve.banded.step_systems import BandedProgram
from scene_graph_ros.convex.solve.linear_algebra.banded_systems import factor_band, solve_band


def program(cost, equations, singles, cones, at=(), groups=()):
    """Return a program of rows ``(first, values, constant)``; ``at`` are equations' places.

    ``groups`` are rows in front, how many, and what each of these has of a variable of its own,
    which costs as much as the last of the costs, in turn.
    """
    rows = [*equations, *singles, *(row for cone in cones for row in cone)]
    lengths = np.array([len(values) for _, values, _ in rows], dtype=np.int64)
    values = np.zeros((len(rows), max(lengths)))
    for r, (_, some, _) in enumerate(rows):
        values[r, : len(some)] = some
    signs = np.ones(len(cost))
    signs[list(at)] = -1.0
    own, own_values = np.full(len(rows), -1), np.zeros(len(rows))
    for k, (first, some) in enumerate(groups):
        own[first : first + len(some)] = len(cost) - len(groups) + k
        own_values[first : first + len(some)] = some
    return BandedProgram(
        np.array(cost, dtype=float),
        signs,
        np.array([first for first, _, _ in rows], dtype=np.int64),
        lengths,
        values,
        np.array([constant for *_, constant in rows], dtype=float),
        own,
        own_values,
        np.array(at, dtype=np.int64),
        len(singles),
        np.array([len(cone) for cone in cones], dtype=np.int64),
        np.array([(first, len(some)) for first, some in groups], np.int64).reshape(-1, 2),
    )


def solved(p):
    """Return points and what is proven by weak duality: both ends of the optimum."""
    x, z, residual = minimize_banded(p, 1e-10, IMPROVE.address())
    assert residual <= 1e-9
    m = len(p.at)
    dense = np.zeros((len(p.first), len(p.cost)))
    for r, (first, length) in enumerate(zip(p.first, p.lengths, strict=True)):
        dense[r, first : first + length] = p.values[r, :length]
        if p.own[r] >= 0:
            dense[r, p.own[r]] = p.own_values[r]
    y = np.append(x[p.at], z)
    point = np.where(p.signs > 0.0, x, 0.0)
    rows = dense @ point + p.constant
    assert np.abs(rows[:m]).max(initial=0.0) < 1e-8
    single = slice(m, m + p.num)
    assert rows[single].min(initial=0.0) > -1e-8
    assert y[single].min(initial=0.0) >= 0.0
    first = m + p.num
    for size in p.sizes:
        for each in (rows, y):
            some = each[first : first + size]
            assert some[0] - np.linalg.norm(some[1:]) > -1e-8
        first += size
    variables = p.signs > 0.0
    assert np.abs(dense.T @ y - p.cost)[variables].max() < 1e-8
    return x, float(p.cost @ point), -float(y @ p.constant)


def test_the_way_around_a_corner():
    """From (0, 0) to (2, 0) above (1, 1): each half is as long as the root of 2."""
    # Places: t, y, t'; y is the height at 1, at least 1.
    cones = [
        [(0, [1.0, 0.0], 0.0), (0, [0.0, 0.0], 1.0), (0, [0.0, 1.0], 0.0)],
        [(1, [0.0, 1.0], 0.0), (1, [0.0, 0.0], 1.0), (1, [1.0, 0.0], 0.0)],
    ]
    x, cost, bound = solved(program([1.0, 0.0, 1.0], [], [(1, [1.0], -1.0)], cones))
    assert cost == pytest.approx(2.0 * math.sqrt(2.0), abs=1e-8)
    assert bound == pytest.approx(2.0 * math.sqrt(2.0), abs=1e-8)
    assert x[1] == pytest.approx(1.0, abs=1e-7)


def test_equations_have_their_multipliers_beside_them():
    """Least t with |(x, y)| <= t, x + y = 3: 3 / root of 2, and it grows by 1 / root of 2."""
    cone = [(0, [0.0, 0.0, 1.0], 0.0), (0, [1.0, 0.0, 0.0], 0.0), (0, [0.0, 1.0, 0.0], 0.0)]
    p = program([0.0, 0.0, 1.0, 0.0], [(0, [1.0, 1.0], -3.0)], [], [cone], at=[3])
    x, cost, bound = solved(p)
    assert cost == pytest.approx(3.0 / math.sqrt(2.0), abs=1e-8)
    assert bound == pytest.approx(cost, abs=1e-8)
    assert x[:2] == pytest.approx([1.5, 1.5], abs=1e-6)
    assert x[3] == pytest.approx(1.0 / math.sqrt(2.0), abs=1e-7)


def test_the_same_with_lengths_that_are_the_cones_own():
    """Two groups of a cone each; and by largest magnitudes, groups of single rows: 1 each."""
    ways = [(0, [0.0], 0.0), (0, [0.0], 1.0), (0, [1.0], 0.0)]
    groups = [(1, [1.0, 0.0, 0.0]), (4, [1.0, 0.0, 0.0])]
    wall = (0, [1.0], -1.0)
    x, cost, bound = solved(program([0.0, 1.0, 1.0], [], [wall], [ways, ways], (), groups))
    assert cost == pytest.approx(2.0 * math.sqrt(2.0), abs=1e-8)
    assert bound == pytest.approx(2.0 * math.sqrt(2.0), abs=1e-8)
    assert x == pytest.approx([1.0, math.sqrt(2.0), math.sqrt(2.0)], abs=1e-7)
    sides = [(0, [0.0], 1.0), (0, [0.0], -1.0), (0, [1.0], 0.0), (0, [-1.0], 0.0)]
    groups = [(1, [1.0] * 4), (5, [1.0] * 4)]
    _, cost, bound = solved(program([0.0, 1.0, 1.0], [], [wall, *sides, *sides], [], (), groups))
    assert cost == pytest.approx(2.0, abs=1e-8)
    assert bound == pytest.approx(2.0, abs=1e-8)


@pytest.mark.parametrize("seed", range(60))
def test_chains_of_all_sorts(seed):
    """Boxes, steps that cost their length, equations between neighbours: each is proven."""
    rng = np.random.default_rng(seed)
    count, n = int(rng.integers(2, 12)), int(rng.integers(1, 4))
    has_equation = rng.random(count) < 0.3
    firsts = np.arange(count + 1) * n + np.append(0, np.cumsum(has_equation))
    inside = rng.uniform(-0.6, 0.6, size=(count + 1, n))
    at, equations, cones = [], [], []
    singles = [
        (firsts[k], sign * np.eye(n)[i], 0.7)
        for k in range(count + 1)
        for i in range(n)
        for sign in (1.0, -1.0)
    ]
    for k in range(count):
        step = np.zeros((n, firsts[k + 1] + n - firsts[k]))
        step[:, :n], step[:, -n:] = -np.eye(n), np.eye(n)
        ways = zip(step, rng.normal(size=n), strict=True)
        cones.append([(firsts[k], 0.0 * step[0], 0.0), *((firsts[k], *way) for way in ways)])
        if has_equation[k]:
            at.append(firsts[k] + n)
            equations.append((firsts[k], step[0], float(inside[k, 0] - inside[k + 1, 0])))
    before = len(equations) + len(singles)
    groups = [(before + k * (n + 1), np.eye(n + 1)[0]) for k in range(count)]
    cost = np.append(np.zeros(firsts[-1] + n), rng.uniform(0.5, 2.0, size=count))
    _, value, bound = solved(program(cost, equations, singles, cones, at, groups))
    assert value - bound == pytest.approx(0.0, abs=1e-8 * (1.0 + value))


def test_what_can_not_be_is_not_solved():
    """X at least 1 and at most 0: the residual says that nothing was found."""
    p = program([1.0], [], [(0, [1.0], -1.0), (0, [-1.0], 0.0)], [])
    _, _, residual = minimize_banded(p, 1e-10, IMPROVE.address())
    assert residual > 1e-3


@pytest.mark.parametrize("seed", range(10))
def test_systems_with_bands(seed):
    """Against numpy's dense solver, with rows of equations among those of variables."""
    rng = np.random.default_rng(seed)
    n, width = int(rng.integers(1, 30)), int(rng.integers(1, 6))
    signs = np.where(rng.random(n) < 0.3, -1.0, 1.0)
    dense = np.zeros((n, n))
    for i in range(n):
        for j in range(max(0, i - width + 1), i):
            # Between a variable and an equation alone.
            if signs[i] != signs[j]:
                dense[i, j] = dense[j, i] = rng.normal()
        dense[i, i] = signs[i] * rng.uniform(0.5, 2.0)
    band = np.zeros((n, width))
    for i in range(n):
        for j in range(min(width, i + 1)):
            band[i, j] = dense[i, i - j]
    factors, b = np.zeros_like(band), rng.normal(size=n)
    factor_band(band, signs, factors)
    x = b.copy()
    solve_band(factors, x)
    assert x == pytest.approx(np.linalg.solve(dense, b), rel=1e-9, abs=1e-9)

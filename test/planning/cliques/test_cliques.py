"""Cliques and covers, against all subsets of small graphs and cliques that were put in."""

import itertools
import time

import numpy as np
import pytest
from scipy.sparse import csc_matrix

from scene_graph_ros.geometry.optimization import SolverError
from scene_graph_ros.planning import (
    CliqueError,
    MaxCliqueSolverBase,
    MaxCliqueSolverViaBranchAndBound,
    MaxCliqueSolverViaGreedy,
    MaxCliqueSolverViaMip,
    MinCliqueCoverSolverBase,
    MinCliqueCoverSolverViaGreedy,
)

GREEDY, EXACT = MaxCliqueSolverViaGreedy(), MaxCliqueSolverViaBranchAndBound()


def random_graph(n, density, seed):
    """Return a random symmetric matrix of bool."""
    upper = np.triu(np.random.default_rng(seed).random((n, n)) < density, 1)
    return upper | upper.T


def all_graphs(n):
    """Return all graphs of n vertices."""
    pairs = list(itertools.combinations(range(n), 2))
    for bits in range(2 ** len(pairs)):
        graph = np.zeros((n, n), dtype=bool)
        for k, (i, j) in enumerate(pairs):
            graph[i, j] = graph[j, i] = bits >> k & 1
        yield graph


def size_by_subsets(graph):
    """Return the size of a largest clique: no subset is larger."""
    n = len(graph)
    for size in range(n, 0, -1):
        for members in itertools.combinations(range(n), size):
            if all(graph[i, j] for i, j in itertools.combinations(members, 2)):
                return size
    return 0


def test_cliques_of_all_graphs_of_five_vertices():
    """Exact ones are as large as any subset, and all of them are cliques."""
    for graph in all_graphs(5):
        largest = size_by_subsets(graph)
        assert EXACT.solve_max_clique(graph).sum() == largest
        greedy = GREEDY.solve_max_clique(graph)
        assert 1 <= greedy.sum() <= largest


def test_cliques_of_a_thousand_graphs_of_six_to_ten_vertices():
    """Of all densities; the program of HiGHS on every twentieth."""
    for seed in range(1000):
        graph = random_graph(6 + seed % 5, 0.1 + 0.08 * (seed % 11), seed)
        largest = size_by_subsets(graph)
        assert EXACT.solve_max_clique(csc_matrix(graph)).sum() == largest
        if seed % 20 == 0:
            assert MaxCliqueSolverViaMip().solve_max_clique(graph).sum() == largest


@pytest.mark.parametrize("n", [61, 62, 63, 125])
def test_a_clique_that_was_put_in_is_found(n):
    """Of 16 vertices in a sparse graph, where bitsets end."""
    graph = random_graph(n, 0.2, n)
    members = np.random.default_rng(n).choice(n, 16, replace=False)
    graph[np.ix_(members, members)] = True
    found = EXACT.solve_max_clique(graph)
    assert set(np.flatnonzero(found)) >= set(members.tolist())


def test_both_exact_solvers_agree_and_greedy_is_no_better():
    """On 40 vertices."""
    for seed in range(3):
        graph = random_graph(40, 0.5, seed)
        size = EXACT.solve_max_clique(graph).sum()
        assert MaxCliqueSolverViaMip().solve_max_clique(graph).sum() == size
        assert GREEDY.solve_max_clique(graph).sum() <= size
        again = EXACT.solve_max_clique(graph)
        np.testing.assert_array_equal(again, EXACT.solve_max_clique(graph))


def test_greedy_takes_the_highest_degree_among_candidates():
    """A star of five leaves beside a clique of four: the star's centre has most neighbours."""
    graph = np.zeros((10, 10), dtype=bool)
    graph[0, 1:6] = graph[1:6, 0] = True
    graph[6:, 6:] = True
    assert np.flatnonzero(GREEDY.solve_max_clique(graph)).tolist() == [0, 1]
    assert np.flatnonzero(EXACT.solve_max_clique(graph)).tolist() == [6, 7, 8, 9]


def test_a_time_limit_ends_the_search():
    """300 vertices of density 0.9 would take hours."""
    graph = random_graph(300, 0.9, 0)
    begin = time.monotonic()
    with pytest.raises(SolverError, match=r"0.05 s did not show that a clique of \d+"):
        MaxCliqueSolverViaBranchAndBound(time_limit=0.05).solve_max_clique(graph)
    assert time.monotonic() - begin < 200.0


def test_a_guess_is_kept_and_used():
    """It must fit; a guess that is a clique bounds the answer, any other is no help."""
    graph = random_graph(20, 0.5, 1)
    exact = EXACT.solve_max_clique(graph)
    solver = MaxCliqueSolverViaMip(exact.astype(float), {"time_limit": 60.0})
    assert solver.solve_max_clique(graph).sum() == exact.sum()
    np.testing.assert_array_equal(solver.get_initial_guess(), exact)
    assert solver.get_solver_options() == {"time_limit": 60.0}
    solver.set_initial_guess(np.ones(20))
    assert solver.solve_max_clique(graph).sum() == exact.sum()
    with pytest.raises(CliqueError, match="initial_guess has 20 entries, adjacency_matrix has 10"):
        solver.solve_max_clique(graph[:10, :10])
    with pytest.raises(CliqueError, match="solver_options has 'speed'"):
        solver.set_solver_options({"speed": 1})
    with pytest.raises(CliqueError, match="initial_guess"):
        solver.set_initial_guess([np.nan])


def test_covers_are_of_cliques_and_partitions_disjoint():
    """All vertices are in one; of what may overlap each clique is as large as it can be."""
    for seed in range(20):
        graph = random_graph(30, 0.4, seed)
        solver = MinCliqueCoverSolverViaGreedy(EXACT)
        parts = solver.solve_min_clique_cover(csc_matrix(graph), partition=True)
        assert sorted(v for part in parts for v in part) == list(range(30))
        cover = solver.solve_min_clique_cover(graph)
        assert set().union(*cover) == set(range(30)) and len(cover) == len(parts)
        for clique in cover:
            assert not any(graph[v][list(clique)].all() for v in set(range(30)) - clique)


def test_a_cover_ends_below_the_smallest_size():
    """Cliques of 5, 3 and 1 vertices: two are at least 2 large."""
    graph = np.zeros((9, 9), dtype=bool)
    graph[:5, :5] = graph[5:8, 5:8] = True
    solver = MinCliqueCoverSolverViaGreedy(GREEDY, min_clique_size=2)
    assert solver.solve_min_clique_cover(graph, True) == [set(range(5)), {5, 6, 7}]
    solver.set_min_clique_size(4)
    assert solver.get_min_clique_size() == 4
    assert solver.solve_min_clique_cover(graph) == [set(range(5))]
    assert len(solver.solve_min_clique_cover(np.zeros((3, 3), dtype=bool))) == 0
    for bad in (0, 1.5, True):
        with pytest.raises(CliqueError, match="min_clique_size"):
            solver.set_min_clique_size(bad)


class First(MaxCliqueSolverBase):
    """Takes the first vertex alone, or what it was told to."""

    answer = None

    def _do_solve_max_clique(self, adjacency_matrix):
        assert adjacency_matrix.dtype == bool
        return np.arange(adjacency_matrix.shape[0]) == 0 if self.answer is None else self.answer


def test_solvers_of_ones_own_are_used_and_checked():
    """Its cliques cover; what is none is refused, with the class' name."""
    graph = random_graph(6, 0.5, 0)
    own = First()
    cover = MinCliqueCoverSolverViaGreedy(own).solve_min_clique_cover(graph, True)
    assert cover == [{k} for k in range(6)]
    own.answer = np.ones(6, dtype=bool)
    with pytest.raises(CliqueError, match=r"First returned \[0, 1, 2, 3, 4, 5\], which is no"):
        own.solve_max_clique(graph)
    own.answer = np.ones(3)
    with pytest.raises(CliqueError, match="First must return which of 6 vertices"):
        own.solve_max_clique(graph)

    class Twice(MinCliqueCoverSolverBase):
        """Says a vertex twice."""

        def _do_solve_min_clique_cover(self, adjacency_matrix, partition):
            return [[0], [0]]

    assert Twice().solve_min_clique_cover(graph) == [{0}, {0}]
    with pytest.raises(CliqueError, match="Twice returned 0 in two cliques"):
        Twice().solve_min_clique_cover(graph, partition=True)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3)[:2], "shape"),
        (np.array([[0, 1], [0, 0]]), r"symmetric; \[0, 1\] is True, \[1, 0\] is False"),
        (np.full((2, 2), 0.5), "0 and 1"),
        (np.full((2, 2), np.nan), "0 and 1"),
        (np.array([["a"]]), "0 and 1"),
        ("graph", "shape|0 and 1"),
    ],
)
@pytest.mark.parametrize("solver", [GREEDY, EXACT, MaxCliqueSolverViaMip()])
def test_what_is_no_graph_is_refused(solver, matrix, message):
    """By all solvers, naming what is wrong; a graph of no vertex has no clique."""
    with pytest.raises(CliqueError, match=message):
        solver.solve_max_clique(matrix)
    with pytest.raises(CliqueError, match=message):
        MinCliqueCoverSolverViaGreedy(solver).solve_min_clique_cover(matrix)
    assert solver.solve_max_clique(np.zeros((0, 0))).shape == (0,)

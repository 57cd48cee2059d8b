"""Graphs that are made while they are searched: only where needed, and with a gap that is true."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    ImplicitGraphOfConvexSets,
    norm,
    Point,
)


class Lattice(ImplicitGraphOfConvexSets):
    """An endless lattice of squares of width 0.8 about whole points, with walls between some."""

    def __init__(self, walls=frozenset()):
        super().__init__()
        self.walls = walls
        self.asked = []
        self.cells = {}
        self.start = self.gcs.add_vertex(Point([0.0, 0.0]), "start")
        self.places = {self.start.id: (0, 0)}

    def cell(self, place):
        """Return the vertex of a cell, which is made when it is first needed."""
        if place not in self.cells:
            at = np.array(place, dtype=float)
            self.cells[place] = self.gcs.add_vertex(Hyperrectangle(at - 0.4, at + 0.4), str(place))
            self.places[self.cells[place].id] = place
        return self.cells[place]

    def do_successors(self, v):
        """Lead to the four neighbours."""
        place = self.places[v.id]
        self.asked.append(place)
        found = []
        for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            there = (place[0] + step[0], place[1] + step[1])
            if (place, there) not in self.walls:
                edge = self.gcs.add_edge(v, self.cell(there))
                edge.add_cost(norm(edge.xv - edge.xu))
                found.append(edge)
        return found


def ahead(goal):
    """Return the straight way to the near side of a cell, which nothing is shorter than."""

    def heuristic(v):
        # To the corner of the cell's square that is nearest to where one comes from.
        return norm(v.x[0] - (goal[0] - 0.4))

    return heuristic


def test_a_path_is_found_in_an_endless_graph():
    """Straight through cells: the length to the near side of the last one, without a gap."""
    lattice = Lattice()
    goal = lattice.cell((4, 0))
    result = lattice.solve_shortest_path(lattice.start, goal, heuristic=ahead((4, 0)))
    assert result.is_success, result.reason
    assert result.cost == pytest.approx(3.6, rel=1e-6)
    assert 3.6 * (1.0 - 2e-6) <= result.lower_bound <= 3.6 + 1e-12
    assert result.gap == result.cost - result.lower_bound
    assert [lattice.places[v] for v in result.vertices] == [(k, 0) for k in range(5)]
    # Nothing was made far from the way.
    assert len(lattice.asked) == len(set(lattice.asked)) <= 20


def test_it_agrees_with_the_whole_graph():
    """Around a wall: against the search of the graph as far as it was made."""
    walls = {((k, j), (k + 1, j)) for k in (0,) for j in (-1, 0, 1)}
    walls |= {(b, a) for a, b in walls}
    lattice = Lattice(walls)
    goal = lattice.cell((2, 0))
    result = lattice.solve_shortest_path(
        lattice.start, goal, heuristic=ahead((2, 0)), max_paths_per_vertex=2
    )
    assert result.is_success, result.reason
    # The whole graph that was made is a part of the endless one.
    whole = lattice.gcs.solve_shortest_path(lattice.start, goal)
    assert result.lower_bound <= whole.cost * (1.0 + 1e-12)
    assert whole.lower_bound * (1.0 - 1e-12) <= result.cost <= whole.cost * 1.05


def test_what_is_pruned_counts_in_the_gap():
    """With one start of a path for each cell the bound is still below the best path."""
    exact, pruned = (
        lattice.solve_shortest_path(lattice.start, lattice.cell((2, 1)), max_paths_per_vertex=most)
        for lattice, most in ((Lattice(), None), (Lattice(), 1))
    )
    assert exact.is_success
    assert pruned.is_success
    # From the point to the corner (1.6, 0.6) through squares that it crosses.
    assert exact.cost >= math.hypot(1.6, 0.6) * (1.0 - 1e-9)
    assert exact.gap <= 2e-6 * exact.cost
    assert pruned.lower_bound <= exact.cost <= pruned.cost * (1.0 + 1e-9)
    assert pruned.num_search_programs <= exact.num_search_programs


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        ({"max_successor_calls": 3}, "max_successor_calls was reached"),
        ({"options": GraphOfConvexSetsOptions(max_search_programs=4)}, "max_search_programs"),
        ({"options": GraphOfConvexSetsOptions(termination_func=lambda: True)}, "termination_func"),
    ],
)
def test_a_search_that_is_cut_short_says_what_no_path_is_below(limits, reason):
    """A bound, but no path."""
    lattice = Lattice()
    result = lattice.solve_shortest_path(lattice.start, lattice.cell((9, 9)), **limits)
    assert not result.is_success
    assert reason in result.reason
    assert 0.0 <= result.lower_bound <= math.hypot(8.6, 8.6)


def test_targets_may_be_told_by_a_function():
    """The first cell with x = 3; and the source itself, which costs nothing."""
    lattice = Lattice()
    result = lattice.solve_shortest_path(
        lattice.start, lambda v: lattice.places[v.id][0] == 3, heuristic=ahead((3, 0))
    )
    assert result.cost == pytest.approx(2.6, rel=1e-6)
    stay = lattice.solve_shortest_path(lattice.start, lattice.start)
    assert (stay.is_success, stay.cost) == (True, 0.0)


class Chain(ImplicitGraphOfConvexSets):
    """Five points in a row, of which the last leads nowhere."""

    def __init__(self):
        super().__init__()
        self.points = [self.gcs.add_vertex(Point([float(k)])) for k in range(5)]
        self.calls = 0

    def do_successors(self, v):
        """Lead to the next one and back to the first."""
        self.calls += 1
        k = self.points.index(v)
        if k == 4:
            return []
        edges = [self.gcs.add_edge(v, self.points[k + 1])]
        return [*edges, self.gcs.add_edge(v, self.points[0])] if k else edges


def test_expansion_ends_where_nothing_is_new_or_at_its_limit():
    """Each vertex is asked once."""
    chain = Chain()
    assert not chain.expand_recursively(chain.points[0], 3)
    assert (chain.calls, chain.gcs.num_edges) == (3, 5)
    assert chain.expand_recursively(chain.points[0])
    assert (chain.calls, chain.gcs.num_edges) == (5, 7)
    assert chain.successors(chain.points[4]) == []
    assert chain.calls == 5


def test_no_way_is_an_answer():
    """All was looked at."""
    chain = Chain()
    other = chain.gcs.add_vertex(Point([9.0]))
    result = chain.solve_shortest_path(chain.points[0], other)
    assert not result.is_success
    assert result.lower_bound == np.inf
    assert "none leads there" in result.reason


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda c: c.successors(Chain().points[1]), "v must be a vertex of gcs"),
        (lambda c: c.expand_recursively(c.points[0], 0), "max_successor_calls must be a whole"),
        (lambda c: c.solve_shortest_path(c.points[0], Chain().points[1]), "target must be"),
        (
            lambda c: c.solve_shortest_path(c.points[0], c.points[4], max_paths_per_vertex=0.5),
            "max_paths_per_vertex must be a whole",
        ),
        (
            lambda c: c.solve_shortest_path(
                c.points[0], c.points[4], heuristic=lambda v: norm(c.points[4].x - v.x)
            ),
            "only its own vertex.x",
        ),
    ],
)
def test_what_is_refused_is_named(wrong, message):
    """With what was given."""
    with pytest.raises(ConvexSetError, match=message):
        wrong(Chain())


def test_successors_must_be_edges_of_the_graph():
    """From the vertex that was asked about."""

    class Wrong(Chain):
        def do_successors(self, v):
            return [self.gcs.add_edge(self.points[1], self.points[2])]

    wrong = Wrong()
    with pytest.raises(ConvexSetError, match="must return edges of gcs that lead from it"):
        wrong.successors(wrong.points[0])

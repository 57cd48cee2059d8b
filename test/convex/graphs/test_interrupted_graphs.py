"""A graph whose edit is interrupted is the one before it or the one after it."""

from functools import partial
from types import SimpleNamespace

from interrupting import instruction_count, interrupted_at, places
import numpy as np
from public_changes import uncalled_methods
import pytest

from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Point,
)


class Graph:
    """Four points in a diamond, with costs, and one edge that has to be on paths."""

    def __init__(self):
        self.graph = GraphOfConvexSets()
        spots = ((0, 0), (1, 1), (1, -1), (2, 0))
        self.v = [self.graph.add_vertex(Point(spot), f"v{k}") for k, spot in enumerate(spots)]
        pairs = ((0, 1), (0, 2), (1, 3), (2, 3))
        self.e = [self.graph.add_edge(self.v[a], self.v[b], f"e{a}{b}") for a, b in pairs]
        for k, edge in enumerate(self.e):
            edge.add_cost(1.0 + k)
        self.kept = self.e[0].add_constraint(self.e[0].xu <= 9.0)
        self.e[0].add_phi_constraint(False)
        self.e[3].add_phi_constraint(True)


def answers(world):
    """Return all that a graph says of itself, by names, and its shortest path."""
    graph = world.graph
    first, last = world.v[0], world.v[3]
    path = []
    if graph.is_valid(first) and graph.is_valid(last):
        result = graph.solve_shortest_path(first, last)
        path = [result.is_success, result.cost, len(result.path)]
    return (
        [
            (v.name, [e.name for e in v.incoming_edges], [e.name for e in v.outgoing_edges])
            for v in graph.vertices
        ],
        [
            (e.name, e.u.name, e.v.name, sorted(e.phi_constraints), e.has_functions)
            for e in graph.edges
        ],
        [len(part.get_costs()) for part in (*graph.vertices, *graph.edges)],
        [len(part.get_constraints()) for part in (*graph.vertices, *graph.edges)],
        [len(part.slack_variables) for part in (*graph.vertices, *graph.edges)],
        (graph.num_vertices, graph.num_edges),
        path,
    )


EDITS = {
    "add_vertex": lambda w: w.graph.add_vertex(Point((5, 5)), "new"),
    "add_edge": lambda w: w.graph.add_edge(w.v[0], w.v[3], "new"),
    "add_vertex_from_template": lambda w: w.graph.add_vertex_from_template(w.v[1]),
    "add_edge_from_template": lambda w: w.graph.add_edge_from_template(w.v[0], w.v[3], w.e[0]),
    "remove_vertex": lambda w: w.graph.remove_vertex(w.v[1]),
    "remove_edge": lambda w: w.graph.remove_edge(w.e[3]),
    "add_cost": lambda w: w.e[1].add_cost(10.0),
    "add_constraint": lambda w: w.e[2].add_constraint(w.e[2].xu == w.e[2].xu),
    "discard_constraint": lambda w: w.e[0].discard_constraint(w.kept),
    "add_cost of a vertex": lambda w: w.v[1].add_cost(3.0),
    "add_constraint of a vertex": lambda w: w.v[1].add_constraint(w.v[1].x == w.v[1].x),
    "add_phi_constraint": lambda w: w.e[2].add_phi_constraint(False),
    "clear_phi_constraints": lambda w: w.e[3].clear_phi_constraints(),
    "new_slack_variables": lambda w: w.e[1].new_slack_variables(2),
    "new_slack_variables of a vertex": lambda w: w.v[1].new_slack_variables(2),
    "clear_all_phi_constraints": lambda w: w.graph.clear_all_phi_constraints(),
}


def of_clone(graph):
    """Return a graph with its own vertices and edges."""
    return SimpleNamespace(graph=graph, v=graph.vertices, e=graph.edges)


RELAXED = GraphOfConvexSetsOptions(convex_relaxation=True)


def found(world, options=None):
    """Return the shortest path from the first point to the last."""
    return world.graph.solve_shortest_path(world.v[0], world.v[3], options)


ASKED = {
    "vertices": lambda w: [v.name for v in w.graph.vertices],
    "edges": lambda w: [e.name for e in w.graph.edges],
    "how many": lambda w: (w.graph.num_vertices, w.graph.num_edges),
    "whose": lambda w: w.graph.is_valid(w.v[0]),
    "search": lambda w: summary(w, found(w)),
    "relaxation": lambda w: summary(w, found(w, RELAXED)),
    "restriction": lambda w: summary(w, w.graph.solve_convex_restriction([w.e[1], w.e[3]])),
    "solution": lambda w: [
        e.name for e in w.graph.get_solution_path(w.v[0], w.v[3], found(w, RELAXED))
    ],
    "samples": lambda w: [
        [e.name for e in path]
        for path in w.graph.sample_paths(w.v[0], w.v[3], dict.fromkeys(w.graph.edges, 0.5))
    ],
    "clone": lambda w: answers(of_clone(w.graph.clone())),
    "drawing": lambda w: w.graph.get_graphviz_string(found(w)),
}


def summary(world, result):
    """Return all that parts of a graph say of a result."""
    parts = [*world.graph.vertices, *world.graph.edges]
    return (
        result.cost,
        result.is_success,
        [part.get_solution_cost(result) for part in parts],
        [np.array(v.get_solution(result)).tolist() for v in world.graph.vertices],
        [e.get_solution_phi(result) for e in world.graph.edges],
    )


@pytest.mark.search
@pytest.mark.parametrize("name", ASKED)
def test_an_interrupted_question_changes_no_answer(name):
    """Neither its own nor another's, whatever it remembered."""
    ask, before = ASKED[name], answers(Graph())
    answer, world = ask(Graph()), Graph()
    count = instruction_count(lambda: ask(world))
    for at in places(count, name, 5):
        world = Graph()
        interrupted_at(lambda world=world: ask(world), at)
        assert ask(world) == answer, at
        assert answers(world) == before, at


COSTLY = (
    *("cost_at", "get_constraints", "get_costs", "get_solution_cost", "has_functions", "id"),
    *("name", "num_changes", "transcriptions", "slack_variables", "last_number"),
    "get_solution_slack_variables",
)
QUESTIONS = {
    GraphOfConvexSets: (),
    Vertex: (
        *COSTLY,
        *("ambient_dimension", "get_solution", "incoming_edges", "is_bounded", "outgoing_edges"),
        *("placed", "set", "x"),
        "discard_constraint",  # of edges, above
    ),
    Edge: (
        *COSTLY,
        *("get_solution_phi", "get_solution_phi_xu", "get_solution_phi_xv"),
        *("has_phi_constraints", "keep_terms", "kept_terms", "phi_constraints", "u", "v"),
        *("xu", "xv"),
    ),
}


@pytest.mark.parametrize("kind", QUESTIONS)
def test_each_public_change_is_tried(kind):
    """A new public method has to be an edit above, or to be named among the questions."""
    actions = [partial(each, Graph()) for each in (*EDITS.values(), *ASKED.values())]
    assert uncalled_methods(kind, QUESTIONS[kind], actions) == set()


@pytest.mark.search
@pytest.mark.parametrize("name", EDITS)
def test_an_interrupted_edit_is_done_or_not(name):
    """All answers are those of one of the two graphs, and the edit can then be made."""
    edit, world = EDITS[name], Graph()
    before = answers(world)
    count = instruction_count(lambda: edit(world))
    after = answers(world)
    for at in places(count, name):
        world = Graph()
        answers(world)
        interrupted_at(lambda world=world: edit(world), at)
        found = answers(world)
        if found == before:
            edit(world)
            found = answers(world)
        assert found == after, at

"""Templates and clones: the same sets, costs and constraints of vertices and edges elsewhere."""

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    FunctionConstraint,
    GraphOfConvexSets,
    Hyperrectangle,
    norm,
    Point,
    Transcription,
)


def example():
    """Return a graph with all kinds of terms; its best path takes the box at (1, 0.5)."""
    graph = GraphOfConvexSets()
    start = graph.add_vertex(Point([0.0, 0.0]), "start")
    box = graph.add_vertex(Hyperrectangle([1.0, 0.0], [2.0, 1.0]), "box")
    goal = graph.add_vertex(Point([3.0, 0.0]), "goal")
    into, out = graph.add_edge(start, box, "into"), graph.add_edge(box, goal, "out")
    box.add_cost(0.25 + 0.0 * box.x[0])
    box.add_constraint(box.x[1] >= 0.5)
    for edge in (into, out):
        edge.add_cost(norm(edge.xv - edge.xu))
    into.add_constraint(norm(into.xv - into.xu) <= 4.0)
    return graph, (start, box, goal), (into, out)


def cost(graph, start, goal):
    """Return the cost of the shortest path."""
    result = graph.solve_shortest_path(start, goal)
    assert result.is_success
    return result.cost


def test_a_clone_answers_the_same_and_knows_results_of_the_other():
    """In the same order, with the same numbers, and changes of one are none of the other."""
    graph, (start, box, goal), (into, out) = example()
    out.add_phi_constraint(True)
    graph.remove_vertex(graph.add_vertex(Point([9.0, 9.0])))
    copy = graph.clone()
    assert [v.name for v in copy.vertices] == ["start", "box", "goal"]
    assert [e.id for e in copy.edges] == [into.id, out.id]
    assert copy.edges[1].phi_constraints == {True}
    ends = copy.vertices[0], copy.vertices[2]
    result = graph.solve_shortest_path(start, goal)
    assert cost(copy, *ends) == pytest.approx(result.cost, rel=1e-12)
    np.testing.assert_array_equal(copy.vertices[1].get_solution(result), box.get_solution(result))
    copy.edges[0].add_cost(1.0)
    copy.edges[1].clear_phi_constraints()
    assert cost(copy, *ends) == pytest.approx(result.cost + 1.0, rel=1e-9)
    assert graph.solve_shortest_path(start, goal).cost == result.cost
    assert out.has_phi_constraints
    added = copy.add_vertex(Point([0.0, 0.0]))
    assert added.id not in {each.id for each in (*graph.vertices, *graph.edges)}
    assert GraphOfConvexSets().clone().num_vertices == 0


def test_templates_bring_costs_and_constraints_along():
    """A second graph made of the first one's parts costs the same; functions come, too."""
    graph, vertices, (into, out) = example()
    into.add_constraint(
        FunctionConstraint(lambda xu, xv: xv[0] - xu[0], 0.0, 1.5), Transcription.RESTRICTION
    )
    other = GraphOfConvexSets()
    other.add_vertex(Point([5.0]))
    start, box, goal = (other.add_vertex_from_template(each) for each in vertices)
    first = other.add_edge_from_template(start, box, into)
    last = other.add_edge_from_template(box, goal, out)
    assert (first.name, last.name, box.name) == ("into", "out", "box")
    paths = (graph, [into, out]), (other, [first, last])
    found = [each.solve_convex_restriction(path) for each, path in paths]
    assert found[0].cost == pytest.approx(found[1].cost, rel=1e-12)
    # Twice 0.5 above the straight way, which is shortest in the middle of what is allowed.
    assert found[0].cost == pytest.approx(2.0 * np.hypot(1.5, 0.5) + 0.25, rel=1e-6)


def test_what_is_no_template_is_refused():
    """Other things, vertices of other graphs or dimensions, and an edge to where it begins."""
    graph, (start, box, _), (into, _) = example()
    other = GraphOfConvexSets()
    line = other.add_vertex(Point([0.0]))
    with pytest.raises(ConvexSetError, match="template must be a Vertex, not 3"):
        graph.add_vertex_from_template(3)
    with pytest.raises(ConvexSetError, match="template must be an Edge"):
        graph.add_edge_from_template(start, box, box)
    with pytest.raises(ConvexSetError, match="u must be a vertex of this graph"):
        graph.add_edge_from_template(line, box, into)
    small = graph.add_vertex(Point([1.0]))
    with pytest.raises(ConvexSetError, match="v has dimension 1, that of the template 2"):
        graph.add_edge_from_template(start, small, into)
    with pytest.raises(ConvexSetError, match="u and v are both 'box'"):
        graph.add_edge_from_template(box, box, into)

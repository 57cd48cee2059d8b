"""An optimization through regions whose edit is interrupted is the one before or after it."""

from functools import partial

from interrupting import instruction_count, interrupted_at, places
import numpy as np
from public_changes import uncalled_methods
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    Hyperrectangle,
    Point,
)
from scene_graph_ros.planning import (
    EdgesBetweenSubgraphs,
    GcsTrajectoryOptimization,
    Subgraph,
)

LEFT, RIGHT = Hyperrectangle([0.0, 0], [2, 1]), Hyperrectangle([1.0, 0], [3, 1])
BOUND = np.array([2.0, 1.0])


class World:
    """A start, two regions and a goal, with costs and rules for all that comes."""

    def __init__(self):
        self.gcs = GcsTrajectoryOptimization(2)
        self.start = self.gcs.add_regions([Point([0.2, 0.5])], 0, name="start")
        self.free = self.gcs.add_regions([LEFT, RIGHT], 3, name="free")
        self.goal = self.gcs.add_regions([Point([2.8, 0.5]), Point([2.5, 0.1])], 0, name="goal")
        self.between = self.gcs.add_edges(self.start, self.free)
        self.on = self.gcs.add_edges(self.free, self.goal)
        self.gcs.add_time_cost()
        self.gcs.add_velocity_bounds(-BOUND, BOUND)


def terms(parts):
    """Return how many costs and constraints each part has, by names."""
    return [(each.name, len(each.get_costs()), len(each.get_constraints())) for each in parts]


def state_of(joined):
    """Return all that edges, and the regions of a subgraph, say of themselves."""
    common = (
        joined.name,
        terms(joined.edges),
        [joined.offset_of(edge).tolist() for edge in joined.edges],
        joined.continuity_order,
        joined.continuous_derivatives,
        repr(joined.meeting_bounds),
        joined.has_nonlinear_bounds,
    )
    if isinstance(joined, Subgraph):
        bounds = repr((joined.velocity_bounds, joined.derivative_bounds))
        return (*common, terms(joined.vertices), bounds)
    return common


def answers(world, *, path=True):
    """Return all of that, what the graph has, and the best way from start to goal."""
    gcs = world.gcs
    graph, subgraphs = gcs.graph_of_convex_sets, gcs.get_subgraphs()
    found = [
        terms(graph.vertices),
        terms(graph.edges),
        [
            ([e.name for e in v.incoming_edges], [e.name for e in v.outgoing_edges])
            for v in graph.vertices
        ],
        [state_of(each) for each in (*subgraphs, *gcs.get_edges_between_subgraphs())],
    ]
    if path and world.goal in subgraphs and not gcs._has_nonlinear_terms():
        trajectory, result = gcs.solve_path(world.start, world.goal)
        found.append((round(result.cost, 6), trajectory is None))
    return found


def x(subgraph):
    """Return the first coordinate of the first control point of a subgraph's regions."""
    return subgraph.vertex_control_points()[0][[0]]


def across(edges):
    """Return the same of where the two segments of edges meet."""
    before, after = edges.edge_constituent_vertex_control_points()
    return before[-1][[0]], after[0][[0]]


OF_ALL = {
    "add_regions": lambda w: w.gcs.add_regions([LEFT, RIGHT], 2, name="new"),
    "add_edges": lambda w: w.gcs.add_edges(w.start, w.goal, edges_between_regions=[(0, 0)]),
    "remove_subgraph": lambda w: w.gcs.remove_subgraph(w.goal),
    "add_time_cost": lambda w: w.gcs.add_time_cost(2.0),
    "add_path_length_cost": lambda w: w.gcs.add_path_length_cost(0.5),
    "add_path_energy_cost": lambda w: w.gcs.add_path_energy_cost(0.5),
    "add_velocity_bounds": lambda w: w.gcs.add_velocity_bounds(-0.5 * BOUND, BOUND),
    "add_path_continuity": lambda w: w.gcs.add_path_continuity_constraints(1),
    "add_continuity": lambda w: w.gcs.add_continuity_constraints(1),
    "add_derivative_bounds": lambda w: w.gcs.add_nonlinear_derivative_bounds(-BOUND, BOUND, 2),
}
OF_SUBGRAPH = {
    "time cost": lambda w: w.free.add_time_cost(3.0),
    "length cost": lambda w: w.free.add_path_length_cost(),
    "energy cost": lambda w: w.free.add_path_energy_cost(),
    "velocity bounds": lambda w: w.free.add_velocity_bounds(-0.5 * BOUND, BOUND),
    "derivative bounds": lambda w: w.free.add_nonlinear_derivative_bounds(-BOUND, BOUND, 2),
    "vertex cost": lambda w: w.free.add_vertex_cost(x(w.free)),
    "vertex constraint": lambda w: w.free.add_vertex_constraint(x(w.free) >= 0.1),
    "path continuity": lambda w: w.free.add_path_continuity_constraints(2),
    "continuity": lambda w: w.free.add_continuity_constraints(1),
    "edge cost": lambda w: w.free.add_edge_cost(across(w.free)[0]),
    "edge constraint": lambda w: w.free.add_edge_constraint(across(w.free)[1] <= 2.5),
}
OF_EDGES = {
    "velocity bounds between": lambda w: w.between.add_velocity_bounds(-0.5 * BOUND, BOUND),
    "derivative bounds between": lambda w: w.between.add_nonlinear_derivative_bounds(
        -BOUND, BOUND, 2
    ),
    "zero derivatives": lambda w: w.on.add_zero_derivative_constraints(1),
    "edge cost between": lambda w: w.on.add_edge_cost(across(w.on)[0]),
    "edge constraint between": lambda w: w.on.add_edge_constraint(across(w.on)[0] >= 0.1),
}
EDITS = OF_ALL | OF_SUBGRAPH | OF_EDGES

QUESTIONS = {
    GcsTrajectoryOptimization: (
        *("normalize_segment_times", "unwrap_to_continuous_trajectory"),  # of curves alone
    ),
    Subgraph: (
        *("continuity_order", "continuous_derivatives", "derivative_bounds", "durations"),
        *("edges",),
        *("edge_constituent_vertex_control_points", "edge_constituent_vertex_durations"),
        *("meeting_bounds", "most_continuity", "name", "offset_of", "order", "regions", "size"),
        *("variables", "velocity_bounds", "vertex_control_points", "vertex_duration", "vertices"),
    ),
    EdgesBetweenSubgraphs: (
        *("add_path_continuity_constraints", "add_continuity_constraints"),  # of both, above
        *("continuity_order", "continuous_derivatives", "edges", "from_subgraph", "to_subgraph"),
        *("edge_constituent_vertex_control_points", "edge_constituent_vertex_durations"),
        *("meeting_bounds", "most_continuity", "name", "offset_of"),
    ),
}


@pytest.mark.parametrize("kind", QUESTIONS)
def test_each_public_change_is_tried(kind):
    """A new public method has to be an edit above, or to be named among the questions."""
    actions = [partial(each, World()) for each in (*EDITS.values(), *ASKED.values())]
    assert uncalled_methods(kind, QUESTIONS[kind], actions) == set()


@pytest.mark.search
@pytest.mark.parametrize("name", EDITS)
def test_an_interrupted_edit_is_done_or_not(name):
    """All answers are those of one of the two, and the edit can then be made."""
    edit, world = EDITS[name], World()
    before, best = answers(world, path=False), answers(World())
    count = instruction_count(lambda: edit(world))
    after = answers(world, path=False)
    assert after != before
    for at in places(count, name):
        world = World()
        interrupted_at(lambda world=world: edit(world), at)
        found = answers(world, path=False)
        if found == before:
            edit(world)
            found = answers(world, path=False)
        assert found == after, at
    world = World()
    interrupted_at(lambda: edit(world), count // 2)
    assert answers(world) == best


def summary(solved):
    """Return what a solution says."""
    trajectory, result = solved
    return round(result.cost, 6), trajectory.end_time, result.is_success


def regions_on_the_way(world):
    """Return the vertices of one path."""
    return [world.start.vertices[0], *world.free.vertices, world.goal.vertices[0]]


ASKED = {
    "clone": lambda w: w.gcs.clone().estimate_complexity(),
    "path": lambda w: summary(w.gcs.solve_path(w.start, w.goal)),
    "restriction": lambda w: summary(w.gcs.solve_convex_restriction(regions_on_the_way(w))),
    "drawing": lambda w: w.gcs.get_graphviz_string(),
    "subgraphs": lambda w: [each.name for each in w.gcs.get_subgraphs()],
    "edges between": lambda w: [each.name for each in w.gcs.get_edges_between_subgraphs()],
    "graph": lambda w: (w.gcs.graph_of_convex_sets.num_edges, w.gcs.estimate_complexity()),
    "positions": lambda w: (w.gcs.num_positions, w.gcs.continuous_revolute_joints),
}


@pytest.mark.search
@pytest.mark.parametrize("name", ASKED)
def test_an_interrupted_question_leaves_nothing_behind(name):
    """A path to any of two goals is looked for with a vertex more, which goes again."""
    ask, world = ASKED[name], World()
    before = answers(world)
    answer, count = ask(world), instruction_count(lambda: ask(world))
    for at in places(count, name, 5):
        interrupted_at(lambda: ask(world), at)
        assert answers(world, path=False) == before[:-1], at
    assert ask(world) == answer
    assert answers(world) == before


def test_a_refusal_leaves_nothing_behind():
    """Neither of the regions before one that is refused, nor of a cost."""
    world = World()
    before = answers(world)
    with pytest.raises(ConvexSetError, match="unbounded"):
        world.gcs.add_regions([LEFT, HPolyhedron([[1.0, 0]], [1.0])], 2)
    with pytest.raises(ConvexSetError, match="use_in_transcription"):
        world.free.add_vertex_cost(x(world.free), "never")
    assert answers(world) == before

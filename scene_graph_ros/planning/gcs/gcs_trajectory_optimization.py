"""The best trajectory through convex regions, with a lower bound of the cost."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import copy
import dataclasses
import itertools
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.graph import GraphOfConvexSets
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.options import (
    GcsGraphvizOptions,
    GraphOfConvexSetsOptions,
)
from scene_graph_ros.convex.graphs.model.term_copies import count_appearances
from scene_graph_ros.convex.graphs.model.whole_edits import Undo
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.convex.questions.arguments import as_nonnegative, as_whole
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.pairwise_intersections import as_joints
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.gcs.all_subgraphs import AllSubgraphs
from scene_graph_ros.planning.gcs.edges_between_subgraphs import EdgesBetweenSubgraphs
from scene_graph_ros.planning.gcs.found_trajectory import found_trajectory
from scene_graph_ros.planning.gcs.joined_edges import JoinedEdges
from scene_graph_ros.planning.gcs.region_pairs import (
    as_pairs,
    GivenPairs,
    Meeting,
    meetings_between,
    meetings_inside,
)
from scene_graph_ros.planning.gcs.result import GcsTrajectoryResult
from scene_graph_ros.planning.gcs.segment_variables import SegmentVariables
from scene_graph_ros.planning.gcs.stops import (
    best_with_stops,
    bound_of_given,
    restricted,
    Tie,
    ties_undone,
)
from scene_graph_ros.planning.gcs.subgraph import Subgraph
from scene_graph_ros.planning.gcs.termination import in_time
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory
from scene_graph_ros.trajectories.unwrapping import (
    normalize_segment_times,
    unwrap_to_continuous_trajectory,
)

__all__ = ["GcsTrajectoryOptimization"]

Solved = tuple[CompositeTrajectory | None, GcsTrajectoryResult]


@one_line("num_positions")
class GcsTrajectoryOptimization(AllSubgraphs):
    """Regions, ways between them, costs and bounds: a Bézier curve in each region on the way.

    Each segment is q(t) = r((t - t_i) / h_i), its control points r_0, r_1, ... are in its region,
    and its duration h_i is between two limits (Marcucci, Petersen, von Wrangel and Tedrake,
    "Motion planning around obstacles with convex optimization", Science Robotics 8, 2023). Joints
    that turn without an end are ``continuous_revolute_joints``: regions then meet also after whole
    turns, and must be narrower than pi along these joints.

    Raises ConvexSetError for joints that there are not.
    """

    def __init__(self, num_positions: int, continuous_revolute_joints: Sequence[int] = ()) -> None:
        label = "GcsTrajectoryOptimization"
        super().__init__(as_whole(num_positions, f"{label}: num_positions", 1))
        self._joints = as_joints(continuous_revolute_joints, self._num_positions, label)
        self._graph = GraphOfConvexSets()

    @property
    def num_positions(self) -> int:
        """The number n of positions."""
        return self._num_positions

    @property
    def continuous_revolute_joints(self) -> list[int]:
        """The joints that turn without an end."""
        return list(self._joints)

    @property
    def graph_of_convex_sets(self) -> GraphOfConvexSets:
        """The graph that is solved, to look into."""
        self._settle()
        return self._graph

    def clone(self) -> GcsTrajectoryOptimization:
        """Return another problem with the same subgraphs, edges, costs and constraints.

        In the order of `get_subgraphs` and `get_edges_between_subgraphs`; regions are shared.
        """
        self._settle()
        kept = [region for each in self._subgraphs for region in each.regions]
        return copy.deepcopy(self, {id(region): region for region in kept})

    def estimate_complexity(self) -> int:
        """Return the number of variables' appearances in all costs and constraints.

        Sets' own rows are not counted: for about how large the program is, and whether it grew.
        """
        graph = self.graph_of_convex_sets
        sizes = [(each, each.ambient_dimension) for each in graph.vertices]
        both = [(e, e.u.ambient_dimension + e.v.ambient_dimension) for e in graph.edges]
        return sum(
            count_appearances(term, size)
            for each, size in (*sizes, *both)
            for term in (*each.get_costs(), *each.get_constraints())
        )

    def get_subgraphs(self) -> list[Subgraph]:
        """Return all subgraphs, in the order in which they were added."""
        self._settle()
        return list(self._subgraphs)

    def get_edges_between_subgraphs(self) -> list[EdgesBetweenSubgraphs]:
        """Return all edges between subgraphs, in the order in which they were added."""
        self._settle()
        return list(self._between)

    # What there is.

    def add_regions(
        self,
        regions: Sequence[ConvexSet],
        order: int,
        h_min: float | None = None,
        h_max: float | None = None,
        name: str = "",
        *,
        edges_between_regions: Sequence[tuple[int, int]] | None = None,
        edge_offsets: Sequence[Any] | None = None,
    ) -> Subgraph:
        """Add bounded regions, through each of which leads a Bézier curve of an order.

        It takes from ``h_min`` to ``h_max`` seconds, 1e-6 and 20 by default. Of order 0 it is a
        point, at which the trajectory waits for so long; without both it takes no time. Edges
        lead both ways between regions that meet, which is decided exactly, or along the pairs
        ``edges_between_regions``, whose first region is moved by its ``edge_offsets`` ``(n,)``: by
        default by the whole turns after which it meets the second, or by none. Raises
        ConvexSetError, which names the region.
        """
        label = (
            f"GcsTrajectoryOptimization.add_regions: {name or f'subgraph {len(self._subgraphs)}'}"
        )
        count = as_whole(order, f"{label}: order", 0)
        takes_time = count > 0 or h_min is not None or h_max is not None
        low, high = (
            as_nonnegative(default if value is None else value, f"{label}: {what}")
            for what, value, default in (("h_min", h_min, 1e-6), ("h_max", h_max, 20.0))
        )
        if low > high:
            raise ConvexSetError(f"{label}: h_min = {low} must not be above h_max = {high}")
        if not len(regions):
            raise ConvexSetError(f"{label}: regions must be one set or more, not empty")
        for k, region in enumerate(regions):
            self._check_region(region, f"{label}: regions[{k}]")
        given = self._given_pairs(
            edges_between_regions, edge_offsets, (len(regions), len(regions)), label
        )
        called = name or f"subgraph {len(self._subgraphs)}"
        variables = SegmentVariables(count, self._num_positions, takes_time)

        def add() -> Subgraph:
            subgraph = Subgraph(
                self._graph, self._whole_edits, regions, variables, (low, high), called
            )
            meetings = meetings_inside(subgraph, self._joints, given)
            self._connect(subgraph, subgraph, subgraph, meetings)
            self._subgraphs.append(subgraph)
            self._apply_rules(subgraph)
            return subgraph

        return self._whole_edits.make(self._undos, add)

    def _check_region(self, region: Any, label: str) -> None:
        if not isinstance(region, ConvexSet):
            raise ConvexSetError(f"{label} must be a ConvexSet, not {quoted(region)}")
        if region.ambient_dimension != self._num_positions:
            raise ConvexSetError(
                f"{label} has {region.ambient_dimension} dimensions, not as many as there are"
                f" positions, {self._num_positions}"
            )

    def add_edges(
        self,
        from_subgraph: Subgraph,
        to_subgraph: Subgraph,
        subspace: ConvexSet | None = None,
        *,
        edges_between_regions: Sequence[tuple[int, int]] | None = None,
        edge_offsets: Sequence[Any] | None = None,
    ) -> EdgesBetweenSubgraphs:
        """Let ways lead from the regions of one subgraph to those of another that they meet.

        With a ``subspace``, a Point, Hyperrectangle or HPolyhedron, both segments meet in it, and
        only regions that meet there are joined, also after whole turns of it. Pairs and offsets
        may be given as in `add_regions`. Raises ConvexSetError.
        """
        label = "GcsTrajectoryOptimization.add_edges"
        self._check_subgraph(from_subgraph, f"{label}: from_subgraph")
        self._check_subgraph(to_subgraph, f"{label}: to_subgraph")
        if from_subgraph is to_subgraph:
            raise ConvexSetError(f"{label}: to_subgraph must be another one than from_subgraph")
        if subspace is not None:
            self._check_region(subspace, f"{label}: subspace")
        between = EdgesBetweenSubgraphs(
            self._graph, self._whole_edits, from_subgraph, to_subgraph, subspace
        )
        sizes = (from_subgraph.size, to_subgraph.size)
        given = self._given_pairs(edges_between_regions, edge_offsets, sizes, label)
        meetings = meetings_between(from_subgraph, to_subgraph, self._joints, subspace, given)

        def add() -> EdgesBetweenSubgraphs:
            self._connect(between, from_subgraph, to_subgraph, meetings)
            self._between.append(between)
            self._apply_rules(between)
            return between

        return self._whole_edits.make(self._undos, add)

    def _undos(self) -> Iterable[Undo]:
        yield self._graph._additions_undone()
        yield from super()._undos()

    def _given_pairs(
        self, pairs: Any, offsets: Any, sizes: tuple[int, int], label: str
    ) -> GivenPairs | None:
        """Return the pairs and offsets that are given, if any. Raises ConvexSetError."""
        if pairs is not None:
            return as_pairs(pairs, offsets, sizes, self._num_positions, label)
        if offsets is not None:
            raise ConvexSetError(f"{label}: edge_offsets need edges_between_regions")
        return None

    def _connect(
        self, edges: JoinedEdges, first: Subgraph, second: Subgraph, meetings: list[Meeting]
    ) -> None:
        starts, ends = first.vertices, second.vertices
        for i, j, offset, turn in meetings:
            edges._join(starts[i], ends[j], offset, turn)

    def remove_subgraph(self, subgraph: Subgraph) -> None:
        """Remove a subgraph, with all edges to and from it. Raises ConvexSetError."""
        self._check_subgraph(subgraph, "GcsTrajectoryOptimization.remove_subgraph: subgraph")
        writes = self._graph._removal(subgraph.vertices)
        writes.set(self, "_subgraphs", [each for each in self._subgraphs if each is not subgraph])
        others = [
            each
            for each in self._between
            if subgraph not in (each.from_subgraph, each.to_subgraph)
        ]
        writes.set(self, "_between", others)
        self._graph._remove(writes)

    def _settle(self) -> None:
        """Finish or undo an edit that was interrupted."""
        self._graph._edges.now()
        self._whole_edits.settle()

    def _check_subgraph(self, subgraph: Any, label: str) -> None:
        self._settle()
        # Each has a vertex, and all of them go with it.
        if not (isinstance(subgraph, Subgraph) and self._graph.is_valid(subgraph._vertices[0])):
            raise ConvexSetError(
                f"{label} must be a subgraph of this object, not {quoted(subgraph)}"
            )

    # What is found.

    def solve_path(
        self,
        source: Subgraph,
        target: Subgraph,
        options: GraphOfConvexSetsOptions | None = None,
        *,
        timeout: float | None = None,
        watch: Callable[[], object] | None = None,
    ) -> Solved:
        """Return the best trajectory from any region of one subgraph to any of another.

        By default the relaxation is solved and the best of five paths that it suggests returned;
        with ``convex_relaxation=False`` paths are searched until the gap is closed. The trajectory
        is None where there is none, and the result's ``reason`` says why; it is None, too, where
        no region of a path takes time. After ``timeout`` (s) the best by then is returned, if any,
        and ``is_stopped`` says so; ``watch`` is called now and then and may raise.

        Raises ConvexSetError for other subgraphs and for costs that may be negative, SolverError
        where the solver failed, or where its answer breaks a constraint.
        """
        label = "GcsTrajectoryOptimization.solve_path"
        self._check_subgraph(source, f"{label}: source")
        self._check_subgraph(target, f"{label}: target")
        chosen = in_time(options, timeout, watch) or GraphOfConvexSetsOptions()
        if chosen.convex_relaxation is False and self._has_nonlinear_terms():
            raise ConvexSetError(
                f"{label}: options.convex_relaxation must not be False where derivatives of q(t)"
                " are to go on or are bounded: a search knows convex constraints only"
            )
        if chosen.convex_relaxation is None:
            chosen = dataclasses.replace(chosen, convex_relaxation=True)

        def find() -> Solved:
            begin, end = self._one_vertex(source, True), self._one_vertex(target, False)
            return self._solved(self._graph.solve_shortest_path(begin, end, chosen), chosen)

        undos = [ties_undone(self._ties()), self._graph._additions_undone()]
        return self._whole_edits.try_out(lambda: undos, find)

    def _one_vertex(self, subgraph: Subgraph, is_source: bool) -> Vertex:
        """Return the only vertex of a subgraph, or a new one next to all of them."""
        if subgraph.size == 1:
            return subgraph.vertices[0]
        single = self._graph.add_vertex(Point(), f"any of {subgraph.name}")
        for vertex in subgraph.vertices:
            ends = (single, vertex) if is_source else (vertex, single)
            self._graph.add_edge(*ends)
        return single

    def solve_convex_restriction(
        self,
        active_vertices: Sequence[Vertex],
        options: GraphOfConvexSetsOptions | None = None,
        *,
        timeout: float | None = None,
        watch: Callable[[], object] | None = None,
    ) -> Solved:
        """Return the best trajectory through given regions in order, two or more.

        Raises ConvexSetError for vertices between which there is no edge, or more than one.
        """
        label = "GcsTrajectoryOptimization.solve_convex_restriction: active_vertices"
        chosen = in_time(options, timeout, watch)
        self._settle()
        if len(active_vertices) < 2:
            raise ConvexSetError(f"{label} must be two or more, not {len(active_vertices)}")
        edges: list[Edge] = []
        given: Sequence[Any] = active_vertices
        for k, (u, v) in enumerate(itertools.pairwise(given)):
            for each in (u, v):
                if not isinstance(each, Vertex) or not self._graph.is_valid(each):
                    raise ConvexSetError(f"{label} must be of this graph, not {quoted(each)}")
            between = [edge for edge in u.outgoing_edges if edge.v is v]
            if len(between) != 1:
                raise ConvexSetError(
                    f"{label}[{k}], {u.name!r}, must have one edge to the next, {v.name!r}, not"
                    f" {len(between)}"
                )
            edges.append(between[0])

        def find() -> Solved:
            found = self._graph.solve_convex_restriction(edges, chosen)
            on_way = [tie for tie in self._ties() if tie.edge in edges]
            found = bound_of_given(found, on_way, edges, restricted(chosen))
            return self._solved(found, chosen)

        return self._whole_edits.try_out(lambda: [ties_undone(self._ties())], find)

    def _solved(
        self, found: GraphOfConvexSetsResult, options: GraphOfConvexSetsOptions | None
    ) -> Solved:
        """Return the trajectory of a path, with stops where they make it cost less."""
        ties = {tie.edge.id: tie for tie in self._ties()}
        if ties:
            edges = {edge.id: edge for edge in self._graph.edges}
            found = best_with_stops(found, ties, edges, restricted(options))
        joined = (*self._subgraphs, *self._between)
        leaving = [edge for edge in self._graph.edges if edge.id in found.path]
        return found_trajectory(found, self._subgraphs, joined, leaving)

    def _ties(self) -> list[Tie]:
        return [tie for each in (*self._subgraphs, *self._between) for tie in each.ties()]

    def get_graphviz_string(
        self,
        result: GcsTrajectoryResult | None = None,
        options: GcsGraphvizOptions | None = None,
    ) -> str:
        """Return the graph in the DOT language, with a result's numbers where one is given."""
        return self.graph_of_convex_sets.get_graphviz_string(
            None if result is None else result.graph_result, options
        )

    normalize_segment_times = staticmethod(normalize_segment_times)
    unwrap_to_continuous_trajectory = staticmethod(unwrap_to_continuous_trajectory)

"""Regions of one mode: segments of one order, their costs and their bounds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import itertools
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import norm, sum_squares
from scene_graph_ros.convex.graphs.expressions.transcription import ALL_TRANSCRIPTIONS
from scene_graph_ros.convex.graphs.graph import GraphOfConvexSets
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.whole_edits import whole_edit, WholeEdits
from scene_graph_ros.convex.questions.arguments import as_nonnegative, as_whole
from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.pairwise_intersections import own_box
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.gcs.arguments import as_bounds, as_weights
from scene_graph_ros.planning.gcs.joined_edges import JoinedEdges, Used
from scene_graph_ros.planning.gcs.nonlinear_terms import bound_derivative
from scene_graph_ros.planning.gcs.placeholders import (
    control_points,
    duration,
    new_placeholder,
    placed_constraint,
    placed_cost,
)
from scene_graph_ros.planning.gcs.segment_variables import SegmentVariables

__all__ = ["Subgraph"]


@one_line("name", "order", "size")
class Subgraph(JoinedEdges):
    """Regions, each a vertex whose point is a Bézier curve in it; made by `add_regions`.

    All control points are in the region, so the curve is at all times.
    """

    def __init__(
        self,
        graph: GraphOfConvexSets,
        whole_edits: WholeEdits,
        regions: Sequence[ConvexSet],
        variables: SegmentVariables,
        durations: tuple[float, float],
        name: str,
    ) -> None:
        super().__init__(graph, whole_edits, variables, variables, name)
        self._regions, self._variables = tuple(regions), variables
        self._here = new_placeholder()
        self._durations = durations
        self._velocity_bounds: list[tuple[np.ndarray, np.ndarray]] = []
        self._derivative_bounds: list[tuple[int, np.ndarray, np.ndarray]] = []
        self._vertices: list[Vertex] = []
        for k, region in enumerate(regions):
            points = _points_and_duration(region, variables, durations)
            if not points.is_bounded():
                raise ConvexSetError(
                    f"add_regions: set of '{name}[{k}]', {quoted(region)}, is unbounded;"
                    " intersect it with a box"
                )
            self._vertices.append(graph.add_vertex(points, f"{name}[{k}]"))

    def _parts(self) -> Iterable[Vertex | Edge]:
        return (*self._vertices, *self._edges)

    @property
    def order(self) -> int:
        """The order of the Bézier curves."""
        return self._variables.order

    @property
    def size(self) -> int:
        """The number of regions."""
        return len(self._regions)

    @property
    def regions(self) -> tuple[ConvexSet, ...]:
        """The regions."""
        return self._regions

    @property
    def vertices(self) -> list[Vertex]:
        """The vertices, in the order of the regions."""
        return list(self._vertices)

    @property
    def variables(self) -> SegmentVariables:
        """The coordinates of its vertices."""
        return self._variables

    @property
    def durations(self) -> tuple[float, float]:
        """The least and the greatest duration of a segment, s."""
        return self._durations

    @property
    def velocity_bounds(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The bounds ``(n,)`` and ``(n,)`` that velocities have to keep."""
        return list(self._velocity_bounds)

    @whole_edit
    def add_time_cost(self, weight: float = 1.0) -> None:
        """Add ``weight`` times the duration of each segment.

        Raises ConvexSetError where segments take no time.
        """
        label = f"{self._name}: add_time_cost"
        number = as_nonnegative(weight, f"{label}: weight")
        for vertex in self._vertices:
            vertex.add_cost(number * duration(self._variables, vertex.id, label))

    @whole_edit
    def add_path_length_cost(self, weight: Any = 1.0) -> None:
        """Add the sum of ``norm(weight @ (r_(i+1) - r_i))``, a bound of the length from above.

        ``weight`` is a number or ``(n, n)``. Raises ConvexSetError for order 0.
        """
        W = as_weights(
            weight, self._variables.num_positions, f"{self._name}: add_path_length_cost"
        )
        for vertex in self._vertices:
            for way in self._ways(vertex, "add_path_length_cost"):
                vertex.add_cost(norm(W @ way))

    @whole_edit
    def add_path_energy_cost(self, weight: Any = 1.0) -> None:
        """Add the sum of ``|weight @ (r_(i+1) - r_i)|^2``, which spreads control points evenly.

        ``weight`` is ``(n, n)``, or a number w for w times the identity. Raises ConvexSetError for
        order 0.
        """
        W = as_weights(
            weight, self._variables.num_positions, f"{self._name}: add_path_energy_cost"
        )
        for vertex in self._vertices:
            for way in self._ways(vertex, "add_path_energy_cost"):
                vertex.add_cost(sum_squares(W @ way))

    @whole_edit
    def add_velocity_bounds(self, lb: Any, ub: Any) -> None:
        """Ask for ``lb <= dq/dt <= ub`` ``(n,)`` at all times: of the derivative's control points.

        An infinite bound is none. Raises ConvexSetError for order 0.
        """
        label = f"{self._name}: add_velocity_bounds"
        low, high = as_bounds(lb, ub, self._variables.num_positions, label)
        sides = [
            (np.flatnonzero(keep), sign, (sign * bound[keep])[:, None])
            for keep, bound, sign in ((high < np.inf, high, 1.0), (low > -np.inf, low, -1.0))
            if keep.any()
        ]
        for vertex in self._vertices:
            h = duration(self._variables, vertex.id, label)
            limits = [limit @ h for _, _, limit in sides]
            for way in self._ways(vertex, "add_velocity_bounds"):
                for (rows, sign, _), limit in zip(sides, limits, strict=True):
                    vertex.add_constraint(self.order * sign * way[rows] <= limit)
        self._velocity_bounds.append((low, high))

    @whole_edit
    def add_nonlinear_derivative_bounds(self, lb: Any, ub: Any, derivative_order: int) -> None:
        """Ask for ``lb <= q^(N)(t) <= ub`` ``(n,)`` at all times, N being 2 or above.

        By the derivative's control points. Durations make it no convex constraint: paths keep it
        near the points that the relaxation leads to, which has bounds with durations of 1. The
        result has no lower bound then. An infinite bound is none. Raises ConvexSetError for an
        order below 2 (see `add_velocity_bounds`), or above that of the segments.
        """
        label = f"{self._name}: add_nonlinear_derivative_bounds"
        low, high = as_bounds(lb, ub, self._variables.num_positions, label)
        order = as_whole(derivative_order, f"{label}: derivative_order", 2)
        if order > self.order:
            raise ConvexSetError(
                f"{label}: derivative_order must not be above that of the segments, {self.order},"
                f" not {order}"
            )
        for vertex in self._vertices:
            place = self._variables, range(self.order - order + 1), vertex.id
            bound_derivative(vertex, place, low, high, order)
        self._derivative_bounds.append((order, low, high))
        self.has_nonlinear_bounds = True

    @property
    def derivative_bounds(self) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Orders and the bounds ``(n,)`` and ``(n,)`` that higher derivatives have to keep."""
        return list(self._derivative_bounds)

    def _ways(self, vertex: Vertex, question: str) -> list[Any]:
        """Return the ways ``(n,)`` between neighbouring control points."""
        if not self.order:
            raise ConvexSetError(
                f"{self._name}: {question}: regions of order 0 are stood in, not moved through"
            )
        points = control_points(self._variables, vertex.id)
        return [b - a for a, b in itertools.pairwise(points)]

    # What a user adds.

    def vertex_control_points(self) -> tuple[Any, ...]:
        """Return the control points ``(n,)``, which stand for those of each region.

        In `add_vertex_cost` and `add_vertex_constraint`.
        """
        return control_points(self._variables, self._here)

    def vertex_duration(self) -> Any:
        """Return the duration of a segment in the same way.

        Raises ConvexSetError where segments take no time.
        """
        return duration(self._variables, self._here, f"{self._name}: vertex_duration")

    @whole_edit
    def add_vertex_cost(self, cost: Any, use_in_transcription: Used = ALL_TRANSCRIPTIONS) -> None:
        """Add a cost to each region, of `vertex_control_points` and `vertex_duration`.

        ``use_in_transcription`` says in which programs it counts, as for vertices of all graphs.
        """
        label = f"{self._name}: add_vertex_cost: cost"
        for vertex in self._vertices:
            vertex.add_cost(
                placed_cost(cost, {self._here: vertex.id}, label), use_in_transcription
            )

    @whole_edit
    def add_vertex_constraint(
        self, constraint: Any, use_in_transcription: Used = ALL_TRANSCRIPTIONS
    ) -> None:
        """Add a convex constraint to each region, of the same expressions."""
        label = f"{self._name}: add_vertex_constraint: constraint"
        for vertex in self._vertices:
            placed = placed_constraint(constraint, {self._here: vertex.id}, label)
            vertex.add_constraint(placed, use_in_transcription)


def _points_and_duration(
    region: ConvexSet, variables: SegmentVariables, durations: tuple[float, float]
) -> ConvexSet:
    """Return the set of all segments whose control points are in a region."""
    if not variables.has_duration:
        return region
    count = variables.order + 1
    low, high = ([each] for each in durations)
    box = own_box(region)
    if box is not None:
        corners = (
            np.append(np.tile(at, count), h) for at, h in zip(box, (low, high), strict=True)
        )
        return Hyperrectangle(*corners)
    return CartesianProduct([*[region] * count, Hyperrectangle(low, high)])

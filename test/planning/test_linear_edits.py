"""To register one more thing takes as many instructions, however many there are."""

from interrupting import instruction_count
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.optimization import GraphOfConvexSets, Hyperrectangle, Point
from scene_graph_ros.planning import GcsTrajectoryOptimization


class Scene:
    """A chain of frames, each with a ball, in a model of its own."""

    def __init__(self):
        self.graph = SceneGraph()
        self.source = self.graph.register_source("s")
        self.count, self.frames, self.parts = 0, [], []

    def grow(self):
        """Register a frame and a geometry more."""
        k = self.count = self.count + 1
        parent = self.frames[-1] if self.frames else None
        frame = GeometryFrame(f"f{k}")
        self.frames.append(self.graph.register_frame(self.source, frame, parent=parent))
        ball = GeometryInstance(np.eye(4), Sphere(1.0), f"g{k}")
        ball.set_proximity_properties(ProximityProperties())
        self.parts.append(self.graph.register_geometry(self.source, self.frames[-1], ball))

    def shrink(self):
        """Remove the first geometry, and rename the next."""
        self.graph.remove_geometry(self.source, self.parts.pop(0))
        self.graph.rename_geometry(self.source, self.parts[0], f"renamed{len(self.parts)}")


class Graph:
    """A chain of points, with costs."""

    def __init__(self):
        self.graph, self.parts = GraphOfConvexSets(), []

    def grow(self):
        """Add a vertex and an edge more, with a cost and a constraint each."""
        self.parts.append(self.graph.add_vertex(Point([len(self.parts), 0.0])))
        if len(self.parts) > 1:
            edge = self.graph.add_edge(*self.parts[-2:])
            edge.add_cost(1.0)
            edge.add_constraint(edge.xu <= edge.xv)

    def shrink(self):
        """Remove the first vertex, and an edge."""
        self.graph.remove_vertex(self.parts.pop(0))
        self.graph.remove_edge(self.graph.add_edge(self.parts[0], self.parts[2]))


class Regions:
    """A chain of subgraphs, with rules for all that come."""

    def __init__(self):
        self.gcs, self.parts = GcsTrajectoryOptimization(2), []
        self.gcs.add_time_cost()
        self.gcs.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])

    def grow(self):
        """Add a subgraph and the edges from the one before."""
        k = len(self.parts)
        box = Hyperrectangle([k, 0.0], [k + 1.5, 1.0])
        self.parts.append(self.gcs.add_regions([box], 3, name=f"s{k}"))
        if k:
            self.gcs.add_edges(*self.parts[-2:])

    def shrink(self):
        """Add to one subgraph alone, and to one's edges."""
        self.parts[0].add_path_length_cost()
        self.gcs.get_edges_between_subgraphs()[0].add_zero_derivative_constraints(1)


@pytest.mark.parametrize("kind", [Scene, Graph, Regions])
def test_an_edit_takes_as_long_in_a_large_world(kind):
    """Sixfold what there is, and no edit takes more instructions than before."""

    def counts(size):
        while len(world.parts) < size:
            world.grow()
        world.shrink()  # which imports what it needs
        return [instruction_count(world.grow), instruction_count(world.shrink)]

    world = kind()
    small, large = counts(20), counts(120)
    assert large == small

"""Convex sets, and what can be proven of them: empty, bounded, disjoint, contained.

Points are rows. What decides returns a bool, and with ``certificate=True`` a `Decision` whose
certificate shows the answer, checked in rational arithmetic by its ``verify()``.
``docs/convex_sets.md`` says which set when.
"""

from scene_graph_ros.geometry.optimization.certificates import Certificate, Decision
from scene_graph_ros.geometry.optimization.errors import (
    ConvexSetError,
    SampleError,
    SolverError,
)
from scene_graph_ros.geometry.optimization.graphs.cone_expressions import (
    exp,
    exponential_cone,
    positive_semidefinite,
    quad_over_lin,
    rotated_second_order_cone,
    second_order_cone,
)
from scene_graph_ros.geometry.optimization.graphs.edge import Edge, Vertex
from scene_graph_ros.geometry.optimization.graphs.expressions import (
    norm,
    norm1,
    norm_inf,
    quad_form,
    sum_squares,
)
from scene_graph_ros.geometry.optimization.graphs.functions import FunctionConstraint
from scene_graph_ros.geometry.optimization.graphs.graph import GraphOfConvexSets
from scene_graph_ros.geometry.optimization.graphs.implicit import ImplicitGraphOfConvexSets
from scene_graph_ros.geometry.optimization.graphs.options import (
    GcsGraphvizOptions,
    GraphOfConvexSetsOptions,
)
from scene_graph_ros.geometry.optimization.graphs.result import GraphOfConvexSetsResult, PathBound
from scene_graph_ros.geometry.optimization.graphs.transcription import Transcription
from scene_graph_ros.geometry.optimization.iris.iris import iris, IrisRegion, Separation
from scene_graph_ros.geometry.optimization.iris.options import IrisOptions
from scene_graph_ros.geometry.optimization.iris.region_cuts import (
    find_region_cuts,
    RegionCut,
    RegionTest,
)
from scene_graph_ros.geometry.optimization.iris.regions_yaml import (
    load_iris_regions_yaml_file,
    save_iris_regions_yaml_file,
)
from scene_graph_ros.geometry.optimization.iris.scene_obstacles import (
    make_iris_obstacles,
    scene_obstacles,
    SceneObstacle,
)
from scene_graph_ros.geometry.optimization.sets.affine_ball import AffineBall
from scene_graph_ros.geometry.optimization.sets.affine_subspace import AffineSubspace
from scene_graph_ros.geometry.optimization.sets.answers import Projection, Support
from scene_graph_ros.geometry.optimization.sets.cartesian_product import CartesianProduct
from scene_graph_ros.geometry.optimization.sets.conic_program import (
    Cone,
    ConicConstraint,
    ConicProgram,
    ConicSolution,
)
from scene_graph_ros.geometry.optimization.sets.convex_hull import ConvexHull
from scene_graph_ros.geometry.optimization.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.optimization.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.optimization.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.geometry.optimization.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.geometry.optimization.sets.intersection import Intersection
from scene_graph_ros.geometry.optimization.sets.membership import Membership
from scene_graph_ros.geometry.optimization.sets.minkowski_sum import MinkowskiSum
from scene_graph_ros.geometry.optimization.sets.pairwise_intersections import (
    check_if_satisfies_convexity_radius,
    compute_pairwise_intersections,
)
from scene_graph_ros.geometry.optimization.sets.partition import partition_convex_set
from scene_graph_ros.geometry.optimization.sets.point import Point
from scene_graph_ros.geometry.optimization.sets.redundancy import Reduction
from scene_graph_ros.geometry.optimization.sets.sampled_volume import SampledVolume
from scene_graph_ros.geometry.optimization.sets.sampling import UniformSamples
from scene_graph_ros.geometry.optimization.sets.spectrahedron import Spectrahedron
from scene_graph_ros.geometry.optimization.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.optimization.sets.volume_interval import VolumeInterval

__all__ = [
    "AffineBall",
    "AffineSubspace",
    "CartesianProduct",
    "Certificate",
    "Cone",
    "ConicConstraint",
    "ConicProgram",
    "ConicSolution",
    "ConvexHull",
    "ConvexSet",
    "ConvexSetError",
    "Decision",
    "Edge",
    "FunctionConstraint",
    "GcsGraphvizOptions",
    "GraphOfConvexSets",
    "GraphOfConvexSetsOptions",
    "GraphOfConvexSetsResult",
    "HPolyhedron",
    "Hyperellipsoid",
    "Hyperrectangle",
    "ImplicitGraphOfConvexSets",
    "Intersection",
    "IrisOptions",
    "IrisRegion",
    "Membership",
    "MinkowskiSum",
    "PathBound",
    "Point",
    "Projection",
    "Reduction",
    "RegionCut",
    "RegionTest",
    "SampleError",
    "SampledVolume",
    "SceneObstacle",
    "Separation",
    "SolverError",
    "Spectrahedron",
    "Support",
    "Transcription",
    "UniformSamples",
    "VPolytope",
    "Vertex",
    "VolumeInterval",
    "check_if_satisfies_convexity_radius",
    "compute_pairwise_intersections",
    "exp",
    "exponential_cone",
    "find_region_cuts",
    "iris",
    "load_iris_regions_yaml_file",
    "make_iris_obstacles",
    "norm",
    "norm1",
    "norm_inf",
    "partition_convex_set",
    "positive_semidefinite",
    "quad_form",
    "quad_over_lin",
    "rotated_second_order_cone",
    "save_iris_regions_yaml_file",
    "scene_obstacles",
    "second_order_cone",
    "sum_squares",
]

"""Convex sets, and proofs about them: empty, bounded, disjoint, contained.

Points are rows. A decision returns a bool, and with ``certificate=True`` a `Decision` whose
certificate shows the answer, checked in rational arithmetic by its ``verify()``.
``docs/convex_sets.md`` says which set when.

The names below are imported when they are first used, from `scene_graph_ros.convex`.
"""

from typing import TYPE_CHECKING

from scene_graph_ros.lazy_names import lazy_names

if TYPE_CHECKING:
    from scene_graph_ros.convex.errors import (
        ConvexSetError,
        SampleError,
        SolverError,
    )
    from scene_graph_ros.convex.graphs.expressions.cone_expressions import (
        exp,
        exponential_cone,
        positive_semidefinite,
        quad_over_lin,
        rotated_second_order_cone,
        second_order_cone,
    )
    from scene_graph_ros.convex.graphs.expressions.expressions import (
        norm,
        norm1,
        norm_inf,
        quad_form,
        sum_squares,
    )
    from scene_graph_ros.convex.graphs.expressions.functions import FunctionConstraint
    from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
    from scene_graph_ros.convex.graphs.graph import GraphOfConvexSets
    from scene_graph_ros.convex.graphs.implicit import ImplicitGraphOfConvexSets
    from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
    from scene_graph_ros.convex.graphs.model.options import (
        GcsGraphvizOptions,
        GraphOfConvexSetsOptions,
    )
    from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult, PathBound
    from scene_graph_ros.convex.iris.iris import iris, IrisRegion, Separation
    from scene_graph_ros.convex.iris.options import IrisOptions
    from scene_graph_ros.convex.iris.region_cuts import (
        find_region_cuts,
        RegionCut,
        RegionTest,
    )
    from scene_graph_ros.convex.iris.regions_yaml import (
        load_iris_regions_yaml_file,
        save_iris_regions_yaml_file,
    )
    from scene_graph_ros.convex.iris.scene_obstacles import (
        make_iris_obstacles,
        scene_obstacles,
        SceneObstacle,
    )
    from scene_graph_ros.convex.questions.answers import Projection, Support
    from scene_graph_ros.convex.questions.certificates import Certificate, Decision
    from scene_graph_ros.convex.questions.conic_program import (
        Cone,
        ConicConstraint,
        ConicProgram,
        ConicSolution,
    )
    from scene_graph_ros.convex.questions.membership import Membership
    from scene_graph_ros.convex.questions.redundancy import Reduction
    from scene_graph_ros.convex.sets.affine_ball import AffineBall
    from scene_graph_ros.convex.sets.affine_subspace import AffineSubspace
    from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
    from scene_graph_ros.convex.sets.convex_hull import ConvexHull
    from scene_graph_ros.convex.sets.convex_set import ConvexSet
    from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
    from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
    from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
    from scene_graph_ros.convex.sets.intersection import Intersection
    from scene_graph_ros.convex.sets.minkowski_sum import MinkowskiSum
    from scene_graph_ros.convex.sets.pairwise_intersections import (
        check_if_satisfies_convexity_radius,
        compute_pairwise_intersections,
    )
    from scene_graph_ros.convex.sets.partition import partition_convex_set
    from scene_graph_ros.convex.sets.point import Point
    from scene_graph_ros.convex.sets.spectrahedron import Spectrahedron
    from scene_graph_ros.convex.sets.v_polytope import VPolytope
    from scene_graph_ros.convex.typed_yaml import yaml_dump_typed, yaml_load_typed
    from scene_graph_ros.convex.volumes.sampled_volume import SampledVolume
    from scene_graph_ros.convex.volumes.sampling import UniformSamples
    from scene_graph_ros.convex.volumes.volume_interval import VolumeInterval

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
    "yaml_dump_typed",
    "yaml_load_typed",
]

__getattr__, __dir__ = lazy_names(__name__)

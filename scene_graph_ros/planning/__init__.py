"""Planning for robots: which configurations and edges are free, proven. Nothing here imports ROS.

The names below are imported when they are first used.
"""

from typing import TYPE_CHECKING

from scene_graph_ros.lazy_names import lazy_names

if TYPE_CHECKING:
    from scene_graph_ros.planning.certified.cspace_free_box import CspaceFreeBox
    from scene_graph_ros.planning.certified.cspace_free_polytope import CspaceFreePolytope
    from scene_graph_ros.planning.certified.distance_certificate import DistanceCertificate
    from scene_graph_ros.planning.certified.distance_search import certify_by_distances
    from scene_graph_ros.planning.certified.errors import CertificateError
    from scene_graph_ros.planning.certified.pair_certificate import PairCertificate
    from scene_graph_ros.planning.certified.polytope_certificate import (
        PairFailure,
        PolytopeCertificate,
    )
    from scene_graph_ros.planning.certified.rational_kinematics import RationalForwardKinematics
    from scene_graph_ros.planning.certified.search_options import (
        BilinearAlternationOptions,
        BinarySearchOptions,
        EllipsoidMarginCost,
    )
    from scene_graph_ros.planning.checker.added_shapes import (
        BodyShapeDescription,
        make_body_shape_description,
    )
    from scene_graph_ros.planning.checker.checker_bodies import CheckerBody
    from scene_graph_ros.planning.checker.checker_contexts import CollisionCheckerContext
    from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
    from scene_graph_ros.planning.checker.collision_avoidance import (
        compute_collision_avoidance_displacement,
    )
    from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
    from scene_graph_ros.planning.checker.collision_checker_params import CollisionCheckerParams
    from scene_graph_ros.planning.checker.distance_and_interpolation import (
        DistanceAndInterpolationProvider,
        LinearDistanceAndInterpolationProvider,
    )
    from scene_graph_ros.planning.checker.homogeneous_filters import HeterogeneousFiltersError
    from scene_graph_ros.planning.checker.robot_clearance import (
        ClearanceColumns,
        RobotClearance,
        RobotCollisionType,
    )
    from scene_graph_ros.planning.checker.unimplemented_checker import (
        UnimplementedCollisionChecker,
    )
    from scene_graph_ros.planning.cliques.adjacency import CliqueError
    from scene_graph_ros.planning.cliques.clique_cover import (
        MinCliqueCoverSolverBase,
        MinCliqueCoverSolverViaGreedy,
    )
    from scene_graph_ros.planning.cliques.max_clique import (
        MaxCliqueSolverBase,
        MaxCliqueSolverViaBranchAndBound,
        MaxCliqueSolverViaGreedy,
        MaxCliqueSolverViaMip,
    )
    from scene_graph_ros.planning.cliques.visibility_graph import visibility_graph
    from scene_graph_ros.planning.constraints.held_constraints import (
        ConstraintMeasure,
        ConstraintStatus,
        measure_constraints,
    )
    from scene_graph_ros.planning.constraints.link_constraints import (
        AngleBetweenVectorsConstraint,
        LinkConstraint,
        OrientationConstraint,
        PositionConstraint,
    )
    from scene_graph_ros.planning.diagrams.dof_mask import DofMask
    from scene_graph_ros.planning.diagrams.robot_diagram import load_robot_diagram, RobotDiagram
    from scene_graph_ros.planning.diagrams.robot_diagram_builder import (
        DiagramBuiltError,
        RobotDiagramBuilder,
    )
    from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure, EdgeStatus
    from scene_graph_ros.planning.errors import CollisionCheckerError, PlanningError
    from scene_graph_ros.planning.gcs.edges_between_subgraphs import EdgesBetweenSubgraphs
    from scene_graph_ros.planning.gcs.gcs_trajectory_optimization import GcsTrajectoryOptimization
    from scene_graph_ros.planning.gcs.plan_through_regions import (
        plan_through_regions,
        RegionPlan,
    )
    from scene_graph_ros.planning.gcs.result import GcsTrajectoryResult
    from scene_graph_ros.planning.gcs.subgraph import Subgraph
    from scene_graph_ros.planning.ik.many_poses import (
        inverse_kinematics_of_poses,
        PosesReached,
    )
    from scene_graph_ros.planning.ik.pose_solver import (
        inverse_kinematics,
        InverseKinematics,
        InverseKinematicsFailure,
    )
    from scene_graph_ros.planning.ik.pose_target import (
        InverseKinematicsError,
        PoseTarget,
    )
    from scene_graph_ros.planning.motion.trajectory_planner import plan_trajectory
    from scene_graph_ros.planning.optimal_control.collocation_constraint import (
        add_direct_collocation_constraint,
        DirectCollocationConstraint,
    )
    from scene_graph_ros.planning.optimal_control.direct_collocation import DirectCollocation
    from scene_graph_ros.planning.optimal_control.direct_transcription import DirectTranscription
    from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
    from scene_graph_ros.planning.optimal_control.errors import (
        DynamicsError,
        MissingCasadiError,
        TrajectoryOptimizationError,
    )
    from scene_graph_ros.planning.optimal_control.kinematic_curve import BsplineBasis
    from scene_graph_ros.planning.optimal_control.kinematic_result import (
        KinematicTrajectoryResult,
    )
    from scene_graph_ros.planning.optimal_control.kinematic_trajectory_optimization import (
        KinematicTrajectoryOptimization,
    )
    from scene_graph_ros.planning.optimal_control.multiple_shooting import MultipleShooting
    from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
    from scene_graph_ros.planning.optimal_control.program_result import (
        ConstraintViolation,
        ProgramResult,
        SolveStatus,
    )
    from scene_graph_ros.planning.optimal_control.shooting_result import (
        TrajectoryOptimizationResult,
    )
    from scene_graph_ros.planning.optimal_control.solver_options import SolverOptions
    from scene_graph_ros.planning.paths.ompl_bridge.ompl_library import MissingOmplError
    from scene_graph_ros.planning.paths.ompl_bridge.ompl_planner import OmplPlanner
    from scene_graph_ros.planning.paths.ompl_bridge.ompl_space import OmplSpace
    from scene_graph_ros.planning.paths.path_planner import plan_path
    from scene_graph_ros.planning.paths.planned_path import Plan, PlanProgress, PlanStage
    from scene_graph_ros.planning.paths.roadmaps.roadmap import Roadmap
    from scene_graph_ros.planning.paths.roadmaps.roadmap_building import build_roadmap
    from scene_graph_ros.planning.paths.search.position_space import (
        get_continuous_revolute_joint_indices,
    )
    from scene_graph_ros.planning.plan_failure import PlanFailure
    from scene_graph_ros.planning.regions.around_seeds import (
        region_around,
        regions_along,
        regions_around,
    )
    from scene_graph_ros.planning.regions.clique_cover import (
        iris_in_configuration_space_from_clique_cover,
        RegionCover,
    )
    from scene_graph_ros.planning.regions.cover_options import IrisFromCliqueCoverOptions
    from scene_graph_ros.planning.regions.errors import RegionError, RegionNotFoundError
    from scene_graph_ros.planning.regions.iris_np import iris_in_configuration_space
    from scene_graph_ros.planning.regions.iris_zo import iris_zo
    from scene_graph_ros.planning.regions.iris_zo_options import IrisZoOptions
    from scene_graph_ros.planning.regions.np_options import IrisNpOptions
    from scene_graph_ros.planning.regions.region_record import ConfigurationRegion
    from scene_graph_ros.planning.straight.straight_plan import StraightFailure, StraightPlan
    from scene_graph_ros.planning.straight.straight_planner import plan_straight
    from scene_graph_ros.planning.timing.curve_timing import time_curve
    from scene_graph_ros.planning.timing.path_timing import prove_trajectory, time_path
    from scene_graph_ros.planning.timing.thinning import thin_trajectory
    from scene_graph_ros.planning.timing.timing_problem import TimedPath, TimingFailure
    from scene_graph_ros.planning.velocities.errors import SafeVelocityError
    from scene_graph_ros.planning.velocities.safe_step import DistantPair, SafeStep
    from scene_graph_ros.planning.velocities.safe_velocity import SafeVelocity
    from scene_graph_ros.planning.walking.zmp_planner import ZmpPlanner, ZmpPlannerError
    from scene_graph_ros.trajectories.retimers.retimer_libraries import MissingRetimerError
    from scene_graph_ros.trajectories.retimers.ruckig_retimer import RuckigRetimer
    from scene_graph_ros.trajectories.retimers.toppra_retimer import ToppraRetimer

__all__ = [
    "AngleBetweenVectorsConstraint",
    "BilinearAlternationOptions",
    "BinarySearchOptions",
    "BodyShapeDescription",
    "BsplineBasis",
    "CertificateError",
    "CheckerBody",
    "ClearanceColumns",
    "CliqueError",
    "CollisionChecker",
    "CollisionCheckerContext",
    "CollisionCheckerError",
    "CollisionCheckerParams",
    "ConfigurationRegion",
    "ConstraintMeasure",
    "ConstraintStatus",
    "ConstraintViolation",
    "CspaceFreeBox",
    "CspaceFreePolytope",
    "DiagramBuiltError",
    "DirectCollocation",
    "DirectCollocationConstraint",
    "DirectTranscription",
    "DistanceAndInterpolationProvider",
    "DistanceCertificate",
    "DistantPair",
    "DofMask",
    "Dynamics",
    "DynamicsError",
    "EdgeMeasure",
    "EdgeStatus",
    "EdgesBetweenSubgraphs",
    "EllipsoidMarginCost",
    "GcsTrajectoryOptimization",
    "GcsTrajectoryResult",
    "HeterogeneousFiltersError",
    "InverseKinematics",
    "InverseKinematicsError",
    "InverseKinematicsFailure",
    "IrisFromCliqueCoverOptions",
    "IrisNpOptions",
    "IrisZoOptions",
    "KinematicTrajectoryOptimization",
    "KinematicTrajectoryResult",
    "LinearDistanceAndInterpolationProvider",
    "LinkConstraint",
    "MaxCliqueSolverBase",
    "MaxCliqueSolverViaBranchAndBound",
    "MaxCliqueSolverViaGreedy",
    "MaxCliqueSolverViaMip",
    "MinCliqueCoverSolverBase",
    "MinCliqueCoverSolverViaGreedy",
    "MissingCasadiError",
    "MissingOmplError",
    "MissingRetimerError",
    "MultipleShooting",
    "NonlinearProgram",
    "OmplPlanner",
    "OmplSpace",
    "OrientationConstraint",
    "PairCertificate",
    "PairFailure",
    "Plan",
    "PlanFailure",
    "PlanProgress",
    "PlanStage",
    "PlanningError",
    "PolytopeCertificate",
    "PoseTarget",
    "PosesReached",
    "PositionConstraint",
    "ProgramResult",
    "RationalForwardKinematics",
    "RegionCover",
    "RegionError",
    "RegionNotFoundError",
    "RegionPlan",
    "Roadmap",
    "RobotClearance",
    "RobotCollisionType",
    "RobotDiagram",
    "RobotDiagramBuilder",
    "RuckigRetimer",
    "SafeStep",
    "SafeVelocity",
    "SafeVelocityError",
    "SceneGraphCollisionChecker",
    "SolveStatus",
    "SolverOptions",
    "StraightFailure",
    "StraightPlan",
    "Subgraph",
    "TimedPath",
    "TimingFailure",
    "ToppraRetimer",
    "TrajectoryOptimizationError",
    "TrajectoryOptimizationResult",
    "UnimplementedCollisionChecker",
    "ZmpPlanner",
    "ZmpPlannerError",
    "add_direct_collocation_constraint",
    "build_roadmap",
    "certify_by_distances",
    "compute_collision_avoidance_displacement",
    "get_continuous_revolute_joint_indices",
    "inverse_kinematics",
    "inverse_kinematics_of_poses",
    "iris_in_configuration_space",
    "iris_in_configuration_space_from_clique_cover",
    "iris_zo",
    "load_robot_diagram",
    "make_body_shape_description",
    "measure_constraints",
    "plan_path",
    "plan_straight",
    "plan_through_regions",
    "plan_trajectory",
    "prove_trajectory",
    "region_around",
    "regions_along",
    "regions_around",
    "thin_trajectory",
    "time_curve",
    "time_path",
    "visibility_graph",
]

__getattr__, __dir__ = lazy_names(__name__)

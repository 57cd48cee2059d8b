"""The node's parameters as data: readable, and checkable, without rclpy.

A set of values is accepted or refused as a whole; `validate` of `parameter_checks` says why.
``main`` and the node declare exactly this table, ``config/scene_graph.yaml`` and the launch file
are tested against it.
"""

from __future__ import annotations

from scene_graph_ros.geometry.accuracy import Accuracy
from scene_graph_ros.node.runtime.browser_parameters import BROWSER_PARAMETERS
from scene_graph_ros.node.runtime.jog_parameters import JOG_PARAMETERS
from scene_graph_ros.node.runtime.parameter import Parameter, Value

__all__ = ["PARAMETERS", "defaults"]

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "scene",
        "",
        "Scene file to load at start: a path, file:// or package:// address; empty: none.",
        read_only=True,
    ),
    Parameter(
        "package_paths",
        "",
        "Folders, separated by colons, searched first for the packages of package:// addresses.",
        read_only=True,
    ),
    Parameter(
        "resource_folders",
        "",
        "Folders, separated by colons, below which requests may name scenes, regions, robots,"
        " meshes and pictures, beside packages' share folders, the start scene's package or"
        " folder, and regions_folder.",
        read_only=True,
    ),
    Parameter(
        "world_frame",
        "world",
        "Name of the world frame in all outgoing headers.",
        read_only=True,
    ),
    Parameter(
        "autostart",
        True,
        "Configure and activate at start; false leaves it to a lifecycle manager.",
        read_only=True,
    ),
    Parameter(
        "executor",
        "multi_threaded",
        "Executor of the node's process.",
        choices=("multi_threaded", "single_threaded"),
        read_only=True,
    ),
    Parameter(
        "executor_threads",
        3,
        "Threads of the multi-threaded executor.",
        minimum=2,
        maximum=64,
        read_only=True,
    ),
    Parameter(
        "service_threads",
        3,
        "Requests that are answered at the same time, beside the executor.",
        minimum=1,
        maximum=64,
        read_only=True,
    ),
    Parameter(
        "shutdown_timeout",
        1.5,
        "Seconds. How long after SIGINT or SIGTERM the process ends whatever its threads do; up "
        "to four times as long where others keep the processors from it.",
        minimum=0.1,
        maximum=600.0,
        read_only=True,
    ),
    Parameter(
        "query_threads",
        1,
        "Threads that share the configurations, or the points, that one request asks about.",
        minimum=1,
        maximum=64,
    ),
    Parameter(
        "allow_editing",
        True,
        "Whether services may change the scene: register, remove, filter, load.",
    ),
    Parameter(
        "accuracy",
        Accuracy.EXACT.value,
        "How exact distances and depths of pairs are: errors below 1e-3, 1e-6 or 1e-12 of the "
        "pair's larger shape.",
        choices=tuple(tier.value for tier in Accuracy),
    ),
    Parameter(
        "max_update_rate",
        1000.0,
        "Hz. The world is updated when poses arrive, but no more often than this.",
        minimum=0.1,
        maximum=10000.0,
    ),
    Parameter(
        "min_update_rate",
        10.0,
        "Hz. Contacts are published at least this often while no poses arrive.",
        minimum=0.01,
        maximum=1000.0,
    ),
    Parameter(
        "marker_rate",
        30.0,
        "Hz. Markers are published at most this often.",
        minimum=0.01,
        maximum=1000.0,
    ),
    Parameter(
        "diagnostics_rate",
        1.0,
        "Hz. How often /diagnostics is published.",
        minimum=0.1,
        maximum=100.0,
    ),
    Parameter(
        "max_pose_age",
        5.0,
        "Seconds. A pose message stamped longer ago is stale and ignored; 0 accepts any age.",
        minimum=0.0,
        maximum=1e6,
    ),
    Parameter(
        "max_pose_lead",
        1.0,
        "Seconds. A pose message stamped further in the future is ignored.",
        minimum=0.0,
        maximum=1e6,
    ),
    Parameter(
        "max_points_per_cloud",
        1_000_000,
        "Points that one message of a source's cloud may have, at 64 bytes each; a larger one is"
        " not read.",
        minimum=1,
        maximum=100_000_000,
        read_only=True,
    ),
    Parameter(
        "max_voxels_per_map",
        1 << 24,
        "Cells of a flat map, or voxels that an octree spans within its grid, at 8 bytes each; a"
        " message of more is not read.",
        minimum=1,
        maximum=1 << 28,
        read_only=True,
    ),
    Parameter(
        "max_points_per_request",
        1_000_000,
        "Points times configurations that one request may ask about; more is TOO_LARGE.",
        minimum=1,
        maximum=100_000_000,
    ),
    Parameter(
        "max_rows_per_response",
        1_000_000,
        "Rows that one answer may have; more is TOO_LARGE.",
        minimum=1,
        maximum=100_000_000,
    ),
    Parameter(
        "max_faces_per_response",
        200_000,
        "Faces of contact surfaces that one answer may have; more is TOO_LARGE.",
        minimum=1,
        maximum=100_000_000,
    ),
    Parameter(
        "max_pairs_per_request",
        100_000,
        "Named pairs times configurations that one request may ask about; more is TOO_LARGE.",
        minimum=1,
        maximum=10_000_000,
    ),
    Parameter(
        "max_pixels_per_request",
        4_000_000,
        "Pixels times configurations that one request may have rendered; more is TOO_LARGE.",
        minimum=1,
        maximum=100_000_000,
    ),
    Parameter(
        "max_configurations_per_request",
        10_000,
        "What-if configurations that one request may ask about; more is TOO_LARGE.",
        minimum=1,
        maximum=1_000_000,
    ),
    Parameter(
        "max_robot_configurations_per_request",
        100_000,
        "Configurations of robots, times what-if ones, that one request may have checked; more is "
        "TOO_LARGE.",
        minimum=1,
        maximum=10_000_000,
    ),
    Parameter(
        "max_edges_per_request",
        10_000,
        "Edges between configurations of robots, times what-if ones, that one request may have "
        "checked; more is TOO_LARGE.",
        minimum=1,
        maximum=1_000_000,
    ),
    Parameter(
        "max_planning_time",
        60.0,
        "Seconds. How long one path is looked for at most.",
        minimum=0.01,
        maximum=86400.0,
    ),
    Parameter(
        "plan_from_unreported",
        False,
        "Whether a plan may begin where nobody has reported that joints are, or long ago; else"
        " such a goal is STALE.",
    ),
    Parameter(
        "start_tolerance",
        1e-3,
        "Radians or metres. How far beyond its limits a position may be where a path begins; the "
        "path's first edge moves it back.",
        minimum=0.0,
        maximum=1.0,
    ),
    Parameter(
        "retimer",
        "time_optimal",
        "What finds how fast a planned path is gone along: ours, TOPP-RA, or Ruckig, which stops "
        "at corners and goes along no curves; what they find is checked and proven alike.",
        choices=("time_optimal", "toppra", "ruckig"),
    ),
    Parameter(
        "max_trajectory_points",
        1000,
        "Points that a planned trajectory may have. One of more is thinned, and proven once more.",
        minimum=2,
        maximum=1000000,
    ),
    Parameter(
        "thinning_deviation",
        1e-3,
        "Radians or metres. How far a thinned trajectory may be from the one with all points; "
        "where max_trajectory_points are too few for that, a goal is NOT_TIMED.",
        minimum=1e-9,
        maximum=1.0,
    ),
    Parameter(
        "max_waiting_plans",
        8,
        "Goals of plan_path that may wait, beside the one that is worked on; more are TOO_LARGE.",
        minimum=0,
        maximum=1000,
    ),
    Parameter(
        "max_regions",
        1000,
        "Regions that are kept; more are TOO_LARGE.",
        minimum=0,
        maximum=100_000,
    ),
    Parameter(
        "max_faces_per_region",
        1000,
        "Faces that a region of a request or a file may have; more is TOO_LARGE.",
        minimum=4,
        maximum=100_000,
    ),
    Parameter(
        "max_waiting_requests",
        1000,
        "Requests that may wait for a thread, and again as many for poses; more are TOO_LARGE.",
        minimum=1,
        maximum=100_000,
    ),
    Parameter(
        "max_wait",
        5.0,
        "Seconds. Longest wait of a query for poses of its minimal stamp.",
        minimum=0.0,
        maximum=60.0,
    ),
    *BROWSER_PARAMETERS,
    Parameter(
        "record",
        "",
        "Folder to record to, which must not be there yet; empty: none.",
        read_only=True,
    ),
    Parameter(
        "record_max_bytes",
        4_000_000_000,
        "Size at which a recording ends.",
        minimum=1_000_000,
        maximum=1_000_000_000_000_000,
        read_only=True,
    ),
    Parameter(
        "regions_folder",
        "",
        "Folder that save_regions may write files to; empty: none.",
        read_only=True,
    ),
    *JOG_PARAMETERS,
    Parameter(
        "contact_point_size",
        0.02,
        "Metres. Diameter of the spheres that show contact points.",
        minimum=1e-6,
        maximum=1e3,
    ),
    Parameter(
        "contact_normal_length",
        0.1,
        "Metres. Length of the arrows that show contact normals.",
        minimum=1e-6,
        maximum=1e3,
    ),
    Parameter(
        "pressure_scale",
        1e5,
        "Pascal. Pressure that contact surfaces show in red, as any above it; none is blue.",
        minimum=1e-6,
        maximum=1e15,
    ),
)


def defaults() -> dict[str, Value]:
    """Return the default of each parameter by name."""
    return {parameter.name: parameter.default for parameter in PARAMETERS}

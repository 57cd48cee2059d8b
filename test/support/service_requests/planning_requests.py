"""Good requests about motions of robots."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Vector3
from scene_requests import pose

from scene_graph_msgs.msg import (
    LinkConstraint,
    MotionLimits,
    PoseGoal,
    QueryOptions,
    RegionTrajectoryOptions,
    RobotConfigurations,
)
from service_requests.small_world import OWNER, WHAT_IF

__all__ = ["REQUESTS"]

REQUESTS: dict[str, dict[str, Any]] = {
    "AttachFrame": {
        "source": OWNER,
        "frame": "hand",
        "link": "slide/ball",
        "touch_links": ["ball"],
        "with_pose": True,
        "pose": pose(x=0.5),
    },
    "CheckClearance": {
        "configurations": RobotConfigurations(names=["rail"], positions=[0.0, 1.0]),
        "influence_distance": 2.0,
        "with_jacobians": True,
    },
    "CheckConfigurations": {
        "configurations": RobotConfigurations(names=["rail"], positions=[0.0, 1.0]),
        "environment_padding": 0.01,
        "with_collisions": True,
    },
    "CheckEdges": {
        "ends": RobotConfigurations(names=["slide/rail"], positions=[0.0, 1.0]),
        "options": QueryOptions(what_if=WHAT_IF),
        "with_measures": True,
    },
    "DetachFrame": {"source": OWNER, "frame": "cup"},
    "PlanPath": {
        "goals": RobotConfigurations(names=["rail"], positions=[3.0]),
        "with_trajectory": True,
        "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_acceleration=2.0),
    },
    "PlanPath to a pose": {
        "pose_goals": [
            PoseGoal(link="ball", tool=pose(x=0.1), pose=pose(x=99.0, z=2.0)),
            PoseGoal(
                link="slide/ball",
                tool=pose(x=0.1),
                pose=pose(x=2.0, z=2.0),
                position_tolerance=1e-6,
            ),
        ],
        "with_trajectory": True,
        "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_acceleration=2.0),
    },
    "PlanPath that holds constraints": {
        "goals": RobotConfigurations(names=["rail"], positions=[3.0]),
        "with_trajectory": True,
        "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_acceleration=2.0),
        "constraints": [
            LinkConstraint(
                link="ball",
                vector_in_frame=Vector3(z=1.0),
                vector_in_link=Vector3(z=2.0),
                angle_upper=0.1,
            ),
            LinkConstraint(type=LinkConstraint.ORIENTATION, link="ball", theta_bound=0.1),
            LinkConstraint(
                type=LinkConstraint.POSITION,
                link="slide/ball",
                point=Point(x=0.1),
                box=pose(x=1.0),
                lower=Vector3(x=-1e3, y=-1e3, z=-1e3),
                upper=Vector3(x=1e3, y=1e3, z=1e3),
            ),
        ],
    },
    "PlanPath through regions": {
        "goals": RobotConfigurations(names=["rail"], positions=[-1.5]),
        "planner": "regions",
        "regions": RegionTrajectoryOptions(text="left: {A: [[1], [-1]], b: [0, 5]}", order=2),
        "with_trajectory": True,
        "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_acceleration=2.0),
    },
    "PlanPath through regions that grow": {
        "goals": RobotConfigurations(names=["rail"], positions=[-1.5]),
        "planner": "regions",
        "regions": RegionTrajectoryOptions(
            seeds=RobotConfigurations(names=["rail"], positions=[-1.0]),
            num_particles=50,
            epsilon=0.2,
            growth_padding=0.0,
        ),
        "with_trajectory": True,
        "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_acceleration=2.0),
    },
    "SetPadding": {
        "source": OWNER,
        "frames_a": ["cup", "cup"],
        "frames_b": ["base", "world"],
        "paddings": [0.02, -0.01],
    },
}
"""Fields by the type of the request, and what else is particular."""

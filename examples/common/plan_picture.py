"""Draw a robot on its way along a path: ghosts, and the line of its hand by its clearance."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from common.picture import Camera, trace
from msg_adapters.markers import SceneMarkers
from msg_adapters.scene import marker_items, SceneNames
from scene_graph_ros.geometry import Role
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.planning.paths.path_points import points_on

CAMERA = Camera(
    eye=(-1.25, -1.1, 1.75), target=(0.02, 0.5, 0.77), field_of_view=38.0, width=900, height=700
)
HAND, REACH = "panda_hand", 0.1
"""The link whose way is drawn, and how far (m) the tip of a hand is from its origin."""
FAR = 0.1
"""Metres: a clearance that is green."""
GHOSTS = 2
GHOST = 0.3
"""How many there are, and how opaque."""
DOTS = 600
DOT = 3.0
"""How many make the line, and their radius in pixels."""


def _place(robots: RobotDiagram, q: np.ndarray) -> None:
    """Put the robot where q puts its links."""
    inspector = robots.context.snapshot.inspector
    names = {int(frame): name for name, frame in robots.frames.items()}
    source = inspector.get_owning_source_id(next(iter(robots.frames.values())))
    order = sorted(inspector.frames_for_source(source))
    X_WL = robots.tree.link_poses(q, [names[int(frame)] for frame in order])
    robots.context.set_frame_poses(source, X_WL)


def _things(robots: RobotDiagram, *, is_robot: bool) -> list[Marker]:
    """Return markers of what is to be seen of the robots, or of all else, where it is."""
    snapshot = robots.context.snapshot
    inspector = snapshot.inspector
    frames = {int(frame) for frame in robots.frames.values()}
    ids = [
        geometry
        for geometry in inspector.get_all_geometry_ids(Role.ILLUSTRATION)
        if (int(inspector.get_frame_id(geometry)) in frames) == is_robot
    ]
    markers = SceneMarkers(frame_id="world")
    markers.set_items(marker_items(inspector, SceneNames(inspector), Role.ILLUSTRATION, ids))
    X_WG = np.array([snapshot.pose_in_world(geometry) for geometry in ids])
    return copy.deepcopy(markers.full(X_WG, 0).markers)


def _draw_way(
    image: Image.Image,
    checker: SceneGraphCollisionChecker,
    path: np.ndarray,
    camera: Camera,
) -> None:
    """Draw where the hand goes, coloured by what the robot is away from all else; hide nothing."""
    draw = ImageDraw.Draw(image)
    for q in points_on(checker.model.tree, path, DOTS):
        distances = checker.calc_robot_clearance(q, FAR).distances
        part = float(np.clip(distances.min(initial=FAR) / FAR, 0.0, 1.0))
        X_WH = checker.model.tree.link_poses(q, [HAND])[0]
        x, y = camera.project(X_WH[:3, 3] + REACH * X_WH[:3, 2])
        color = (int(230 * (1.0 - part)), int(190 * part), 25)
        draw.ellipse([x - DOT, y - DOT, x + DOT, y + DOT], fill=color)


def trace_robot(
    checker: SceneGraphCollisionChecker, shown: np.ndarray, camera: Camera, samples: int = 24
) -> Image.Image:
    """Return a picture of the robot at configurations ``(k, nq)``, all but the ends as ghosts."""
    robots = checker.model
    markers = _things(robots, is_robot=False)
    _place(robots, shown[0])
    seen = _things(robots, is_robot=True)
    markers.extend(seen)
    for number, q in enumerate(shown[1:], start=1):
        _place(robots, q)
        for before, marker in zip(seen, _things(robots, is_robot=True), strict=True):
            if marker.pose == before.pose:
                continue
            if number < len(shown) - 1:
                marker.mesh_use_embedded_materials = False
                marker.color = ColorRGBA(r=0.45, g=0.6, b=0.85, a=GHOST)
            markers.append(marker)
    return trace(markers, camera, samples=samples).convert("RGB")


def draw_plan(
    output: Path,
    checker: SceneGraphCollisionChecker,
    path: np.ndarray,
    camera: Camera = CAMERA,
) -> None:
    """Write the picture of a path ``(n, nq)`` to ``output`` (PNG)."""
    shown = points_on(checker.model.tree, path, GHOSTS + 2)
    image = trace_robot(checker, shown, camera)
    _draw_way(image, checker, path, camera)
    image.save(output)

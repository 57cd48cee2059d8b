"""Markers of a planned path: robots along it, and the curve of the tool.

The tool is the last link that the last of the moving joints carries.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.markers import SceneMarkers
from msg_adapters.poses import header_to_msg
from msg_adapters.scene import marker_items
from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.node.effects.markers import package_shares
from scene_graph_ros.node.effects.plan_proof import PathInWorld, PathProof
from scene_graph_ros.node.effects.plan_way import FAR, PlanWay, way_of
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.planning.paths.path_points import points_on

__all__ = ["PlanMarkers"]

_GHOSTS = 4
"""Robots that are shown on a path, at its ends and between them."""

_GHOST, _STOPPED = Rgba(0.45, 0.6, 0.85, 0.3), Rgba(0.9, 0.1, 0.1, 0.6)

_LINE, _LETTERS = 0.008, 0.04
"""Metres: how thick the line is, and how high the words are."""

_ABOVE = 0.015
"""Metres: how far the line of speed is above that of clearance."""

_RED, _GREEN = (0.9, 0.0, 0.1), (0.0, 0.75, 0.1)
"""Of a proven clearance of nothing, and of ten centimetres."""

_BLUE, _ORANGE = (0.1, 0.3, 0.9), (0.95, 0.45, 0.05)
"""Of rest, and of the tool's highest speed on its way."""


class PlanMarkers:
    """Makes the markers of one path after another."""

    def __init__(self, frame_id: str) -> None:
        self._frame_id = frame_id
        self._has_words = False

    @made_once
    def _ghosts(self) -> SceneMarkers:
        return SceneMarkers(frame_id=self._frame_id, package_shares=package_shares())

    def of(self, world: PathInWorld, proof: PathProof) -> MarkerArray:
        """Return the markers of a path: deletions of the one before first."""
        stamp, stop = world.snapshot.stamp, proof.stop
        shown = points_on(world.robots.tree, world.configurations, _GHOSTS)
        looks = [(f"plan/{number}", q, _GHOST) for number, q in enumerate(shown)]
        if stop is not None:
            looks.append(("plan/stop", stop.configuration, _STOPPED))
        items: list[Any] = []
        poses = []
        for group, q, color in looks:
            ids, X_WG = _robots_at(world, q)
            inspector, names = world.snapshot.inspector, world.snapshot.names
            made = marker_items(inspector, names, _role(world), ids, mesh_hulls=True)
            items += [i._replace(group=f"{group}/{i.group}", rgba=color) for i in made]
            poses.append(X_WG)
        self._ghosts.set_items(items)
        markers = self._ghosts.deletions(stamp).markers
        markers += self._ghosts.full(np.concatenate(poses), stamp).markers
        markers += self._ways(world)
        markers += self._words(world, proof)
        return MarkerArray(markers=markers)

    def none(self, stamp_ns: int) -> MarkerArray:
        """Return deletions of all markers that were shown."""
        self._ghosts.set_items([])
        markers = self._ghosts.deletions(stamp_ns).markers
        header = header_to_msg(stamp_ns, self._frame_id)
        self._has_words = False
        markers += [Marker(header=header, ns=ns, action=Marker.DELETE) for ns in _OTHERS]
        return MarkerArray(markers=markers)

    def _ways(self, world: PathInWorld) -> list[Marker]:
        """Return the tool's curve, coloured by proven clearance, and above it by speed."""
        way = way_of(world)
        points = world.robots.tree.link_poses(way.configurations, [_tool(world)])[:, 0, :3, 3]
        lines = [self._line(world, "plan/way", points, way.proven / FAR, (_RED, _GREEN))]
        speeds = _speeds(way, points)
        if speeds is not None:
            above = points + np.array([0.0, 0.0, _ABOVE])
            parts = speeds / (speeds.max() or 1.0)
            lines.append(self._line(world, "plan/speed", above, parts, (_BLUE, _ORANGE)))
        else:
            header = header_to_msg(world.snapshot.stamp, self._frame_id)
            lines.append(Marker(header=header, ns="plan/speed", action=Marker.DELETE))
        return lines

    def _line(
        self,
        world: PathInWorld,
        ns: str,
        points: NDArray[np.float64],
        parts: NDArray[np.float64],
        colors: Any,
    ) -> Marker:
        """Return a line through points ``(m + 1, 3)``, coloured by parts ``(m,)`` from 0 to 1."""
        marker = self._marker(world, ns, Marker.LINE_STRIP)
        marker.scale.x = _LINE
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]
        # Each point has the lesser of the pieces that it ends.
        at = np.minimum(np.append(parts, np.inf), np.append(np.inf, parts)).clip(0.0, 1.0)
        low, high = np.array(colors)
        for red, green, blue in (low + at[:, np.newaxis] * (high - low)).tolist():
            marker.colors.append(ColorRGBA(r=red, g=green, b=blue, a=1.0))
        return marker

    def _words(self, world: PathInWorld, proof: PathProof) -> list[Marker]:
        """Return why the path does not hold, where the tool is then; or take that back."""
        if proof.stop is None:
            had_words, self._has_words = self._has_words, False
            header = header_to_msg(world.snapshot.stamp, self._frame_id)
            gone = Marker(header=header, ns="plan/words", action=Marker.DELETE)
            return [gone] if had_words else []
        self._has_words = True
        X_WL = world.robots.tree.link_poses(proof.stop.configuration, [_tool(world)])[0]
        marker = self._marker(world, "plan/words", Marker.TEXT_VIEW_FACING)
        marker.text, marker.scale.z = proof.reason, _LETTERS
        marker.color = ColorRGBA(r=0.9, g=0.1, b=0.1, a=1.0)
        x, y, z = X_WL[:3, 3].tolist()
        marker.pose.position = Point(x=x, y=y, z=z)
        return [marker]

    def _marker(self, world: PathInWorld, ns: str, kind: int) -> Marker:
        header = header_to_msg(world.snapshot.stamp, self._frame_id)
        marker = Marker(header=header, ns=ns, type=kind, action=Marker.ADD)
        marker.pose.orientation.w = 1.0
        return marker


_OTHERS = ("plan/way", "plan/speed", "plan/words")


def _speeds(way: PlanWay, points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the mean speed of the tool on each piece ``(m,)``, m/s; None without times."""
    if way.times is None:
        return None
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(moved / np.diff(way.times))


def _role(world: PathInWorld) -> Role:
    """Return the role in which the robots are shown: illustration, else proximity."""
    inspector, carried = world.snapshot.inspector, world.carried
    seen = inspector.get_all_geometry_ids(Role.ILLUSTRATION)
    is_seen = any(inspector.get_frame_id(each) in carried for each in seen)
    return Role.ILLUSTRATION if is_seen else Role.PROXIMITY


def _robots_at(world: PathInWorld, q: NDArray[np.float64]) -> tuple[list[Any], NDArray[Any]]:
    """Return the geometries that robots carry, and where those are at q."""
    inspector, robots = world.snapshot.inspector, world.robots
    X_WL = robots.tree.link_poses(q)
    ids, poses = [], []
    for geometry in inspector.get_all_geometry_ids(_role(world)):
        found = world.carried.get(inspector.get_frame_id(geometry))
        if found is None or inspector.is_deformable(geometry):
            continue
        link, X_LF = found
        ids.append(geometry)
        poses.append(X_WL[link] @ X_LF @ inspector.get_pose_in_frame(geometry))
    return ids, np.array(poses).reshape(-1, 4, 4)


def _tool(world: PathInWorld) -> str:
    """Return the link whose way is drawn."""
    tree, moving = world.robots.tree, {world.path.position_names[i] for i in world.path.moving}
    depths = [0]
    for joint in tree.joints:
        names = (joint.name, joint.mimics)
        moves = any(name and _is_of(name, moving) for name in names)
        depths.append(depths[joint.parent] + moves)
    own = [0, *(depths[j] > depths[joint.parent] for j, joint in enumerate(tree.joints, 1))]
    count = max(d if o else 0 for d, o in zip(depths, own, strict=True))
    links = [
        link
        for link, j in zip(tree.link_names, tree.joint_of_link, strict=True)
        if depths[j] == count and (own[j] or not count)
    ]
    return links[-1]


def _is_of(joint: str, positions: set[str]) -> bool:
    return any(name == joint or name.startswith(f"{joint}.") for name in positions)

"""What is to be seen of a planned path: robots on their way, and the way of the tool.

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
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.planning.path_points import points_on

__all__ = ["PlanMarkers"]

_GHOSTS = 4
"""Robots that are shown on a path, at its ends and between them."""

_GHOST, _STOPPED = Rgba(0.45, 0.6, 0.85, 0.3), Rgba(0.9, 0.1, 0.1, 0.6)

_POINTS = 50
"""Points of the tool's way, of each of which the clearance is measured."""

_FAR = 0.1
"""Metres: a clearance that is green; none is red."""

_LINE, _LETTERS = 0.008, 0.04
"""Metres: how thick the line is, and how high the words are."""


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
        markers.append(self._way(world))
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

    def _way(self, world: PathInWorld) -> Marker:
        """Return the tool's way, coloured by what the robots keep from all else."""
        tree, checker = world.robots.tree, world.checker
        q = points_on(tree, world.configurations, _POINTS)
        X_WL = tree.link_poses(q, [_tool(world)])[:, 0]
        marker = self._marker(world, "plan/way", Marker.LINE_STRIP)
        marker.scale.x = _LINE
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in X_WL[:, :3, 3].tolist()]
        for each in q:
            distances = checker.calc_robot_clearance(each, _FAR).distances
            part = float(np.clip(distances.min(initial=_FAR) / _FAR, 0.0, 1.0))
            marker.colors.append(ColorRGBA(r=0.9 * (1.0 - part), g=0.75 * part, b=0.1, a=1.0))
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


_OTHERS = ("plan/way", "plan/words")


def _role(world: PathInWorld) -> Role:
    """Return the role in which the robots are shown: what people see, else what collides."""
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

"""Frames that links of robots carry: attached and detached as requests ask. No rclpy."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg, pose_to_msg
from msg_adapters.robot_configurations import RobotNames
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterDeclaration
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.node.world.scene import Attachment, Edit, SourceRecord
from scene_graph_ros.robots.robot_parts import JointType
from scene_graph_ros.robots.tree_of_model import tree_of_model

if TYPE_CHECKING:
    from scene_graph_ros.robots.robot_model import RobotModel
    from scene_graph_ros.scene_files.loaded_scene import LoadedRobot

__all__ = ["attach_frame", "detach_frame", "let_go_of"]


def attach_frame(request: Any, response: Any, edit: Edit) -> None:
    """Answer AttachFrame: the frame hangs on the link's, and pairs with it may touch."""
    record = edit.owner(request.source.name, request.source.token)
    frame = _frame(request, edit)
    known = edit.attachments.get(frame)
    if known is not None:
        raise NameConflictError(
            f"frame {quoted(request.frame)} is attached to {quoted(known.link)} already: detach it"
        )
    links = _Links(edit)
    path, link, X_CL, X_WC = links.carrier(request.link, "link")
    touching = [links.frame(name, "touch_links") for name in request.touch_links]
    own = [links.frame(request.link, "link"), *touching]
    if record.robot is not None:
        raise MessageError(f"frame: {quoted(request.frame)} is a robot's own, which joints move")
    if request.with_pose:
        X_LF = pose_from_msg(request.pose, "pose")
    else:
        X_LF = compose(inverse(compose(X_WC, X_CL)), links.moment.pose_in_world(frame))
    inspector = edit.scene_graph.model_inspector()
    parent = inspector.get_parent_frame(frame)
    pairs = _open_pairs(edit, frame, [each for each in own if each is not None])
    edit.scene_graph.change_parent(record.id, frame, link)
    _filter(edit, pairs, is_filtered=True)
    _put(edit, frame, compose(X_CL, X_LF))
    edit.attachments[frame] = Attachment(path, parent, pairs)
    response.pose = pose_to_msg(X_LF)


def detach_frame(request: Any, response: Any, edit: Edit) -> None:
    """Answer DetachFrame: the frame hangs on its former parent, and stays where it is."""
    record = edit.owner(request.source.name, request.source.token)
    frame = _frame(request, edit)
    if frame not in edit.attachments:
        raise UnknownIdError(f"frame: {quoted(request.frame)} is not attached to a link")
    response.pose = pose_to_msg(_detach(edit, record, frame))


def let_go_of(edit: Edit, robot: SourceRecord) -> None:
    """Detach all that a robot's links carry, which stays where it is: the robot goes."""
    inspector = edit.scene_graph.model_inspector()
    own = set(robot.robot.carriers.values())
    sources = {record.id: record for record in edit.records.values()}
    for frame in [f for f in edit.attachments if inspector.get_parent_frame(f) in own]:
        _detach(edit, sources[inspector.get_owning_source_id(frame)], frame)


def _detach(edit: Edit, record: SourceRecord, frame: FrameId) -> Any:
    """Hang a frame on its former parent; return its pose, X_WF, which stays."""
    known = edit.attachments.pop(frame)
    inspector, moment = edit.scene_graph.model_inspector(), edit.moment
    assert moment is not None
    frames, geometries = inspector.get_all_frame_ids(), set(inspector.get_all_geometry_ids())
    parent = known.parent if known.parent in frames else inspector.world_frame_id()
    X_WF = moment.pose_in_world(frame)
    edit.scene_graph.change_parent(record.id, frame, parent)
    there = tuple(pair for pair in known.pairs if geometries.issuperset(pair))
    _filter(edit, there, is_filtered=False)
    _put(edit, frame, compose(inverse(moment.pose_in_world(parent)), X_WF))
    return X_WF


class _Carrier(NamedTuple):
    """The frame C, at ``X_WC``, that goes with a link: its path, and where it is in C."""

    path: str
    frame: FrameId
    X_CL: NDArray[np.float64]
    X_WC: NDArray[np.float64]


class _Links:
    """Links of all robots, by name: with frames of their own where they have geometry."""

    def __init__(self, edit: Edit) -> None:
        assert edit.moment is not None
        self._edit, self.moment = edit, edit.moment
        self._there = set(edit.scene_graph.model_inspector().get_all_frame_ids())
        robots = {n: r.robot for n, r in edit.records.items() if r.robot is not None}
        self._links = [(robot, link) for robot in robots.values() for link in robot.model.links]
        paths = tuple(f"{n}/{link}" for n, robot in robots.items() for link in robot.model.links)
        self._names = RobotNames("link", paths, robots)

    def frame(self, name: str, field: str) -> FrameId | None:
        """Return a link's own frame, if it has one; raises UnknownIdError, NameConflictError."""
        return self._frame_of(*self._links[self._names.row(name, field)])

    def carrier(self, name: str, field: str) -> _Carrier:
        """Return the frame that goes with a link.

        It is its own or, where it has none, that of the nearest link that fixed joints join to
        it; where none of these has one, one of them gets it. Raises UnknownIdError,
        NameConflictError, and MessageError where the frames of all were removed.
        """
        row = self._names.row(name, field)
        path, (robot, link) = self._names.names[row], self._links[row]
        reached = {link: np.eye(4)}
        queue = [link]
        for each in queue:
            frame = self._frame_of(robot, each)
            if frame is not None:
                X_WC = self.moment.pose_in_world(frame)
                return _Carrier(path, frame, inverse(reached[each]), X_WC)
            for other, X in _welded(robot.model, each):
                if other not in reached:
                    reached[other] = compose(reached[each], X)
                    queue.append(other)
        spare = next((each for each in reached if each in robot.spare_frames), None)
        if spare is None:
            raise MessageError(
                f"{field}: the frames of {quoted(name)} and of the links that are fixed to it were"
                " removed from the scene"
            )
        frame, X_WC = self._register(robot, spare)
        return _Carrier(path, frame, inverse(reached[spare]), X_WC)

    def _register(self, robot: LoadedRobot, link: str) -> tuple[FrameId, NDArray[np.float64]]:
        """Register a link's spare frame where the link is, X_WC; joints move it from now on."""
        (owner,) = (record for record in self._edit.records.values() if record.robot is robot)
        frame = self._edit.scene_graph.register_frame(owner.id, robot.spare_frames[link])
        tree = tree_of_model(robot.model, follows=False).at(self._edit.bases[owner.name])
        (X_WC,) = tree.link_poses(self._edit.positions[owner.name], [link])
        self._edit.initial_poses[frame] = X_WC
        return frame, X_WC

    def _frame_of(self, robot: LoadedRobot, link: str) -> FrameId | None:
        frame = robot.carriers.get(link)
        return frame if frame in self._there else None


def _welded(model: RobotModel, link: str) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Yield the links that a fixed joint joins to this one, and where in it they are."""
    for joint in model.joints.values():
        if joint.type is JointType.FIXED and joint.parent == link:
            yield joint.child, joint.X_PC
        elif joint.type is JointType.FIXED and joint.child == link:
            yield joint.parent, inverse(joint.X_PC)


def _frame(request: Any, edit: Edit) -> FrameId:
    return edit.names().frame_id(request.frame, request.source.name)


def _open_pairs(
    edit: Edit, frame: FrameId, links: Iterable[FrameId]
) -> tuple[tuple[GeometryId, GeometryId], ...]:
    """Return the pairs of geometries on or below a frame with links' that are checked as yet."""
    inspector = edit.scene_graph.model_inspector()
    below = [frame]
    for each in below:
        below.extend(inspector.get_child_frames(each))
    own = [g for f in below for g in inspector.get_geometries(f, Role.PROXIMITY)]
    others = [g for f in dict.fromkeys(links) for g in inspector.get_geometries(f, Role.PROXIMITY)]
    filtered = inspector.collision_filtered
    return tuple((a, b) for a in own for b in others if not filtered(a, b))


def _filter(
    edit: Edit, pairs: Iterable[tuple[GeometryId, GeometryId]], *, is_filtered: bool
) -> None:
    """Filter pairs, or have them checked. Raises FilterHistoryError beside transient filters."""
    declaration = CollisionFilterDeclaration()
    others: dict[GeometryId, list[GeometryId]] = {}
    for own, other in pairs:
        others.setdefault(own, []).append(other)
    state = declaration.exclude_between if is_filtered else declaration.allow_between
    for own, several in others.items():
        state(GeometrySet([own]), GeometrySet(several))
    if others:
        edit.scene_graph.collision_filter_manager().apply(declaration)


def _put(edit: Edit, frame: FrameId, X_PF: Any) -> None:
    """Have a frame begin at a pose in its new parent."""
    edit.initial_poses[frame] = np.asarray(X_PF)
    edit.rehung.add(frame)

"""Requests that change the scene: pure functions of a request and an edit, without rclpy.

Each handler changes the copy of the model that an `Edit` holds and fills its response; where it
raises, the copy is thrown away and nothing has changed.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from dataclasses import dataclass
from typing import Any

from msg_adapters.errors import MessageError
from msg_adapters.properties import (
    properties_from_msg,
    resolve_files,
    role_from_msg,
)
from msg_adapters.scene import filter_from_msg, frame_from_msg, instance_from_msg
from scene_graph_msgs.msg import SourceHandle
from scene_graph_ros.geometry.errors import (
    NameConflictError,
    OwnershipError,
    RoleError,
    UnknownIdError,
)
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterDeclaration
from scene_graph_ros.geometry.model.ids import FilterId
from scene_graph_ros.geometry.model.names import InvalidNameError
from scene_graph_ros.geometry.model.roles import RoleAssign
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.runtime.names import DEFAULT_POSE_TYPE
from scene_graph_ros.node.world.handles import Claim, new_token
from scene_graph_ros.node.world.scene import Edit, SourceRecord

__all__ = ["EDITS", "Tools"]


@dataclass(frozen=True)
class Tools:
    """The node as handlers see it: files, message types and scene files."""

    resolve: Callable[[str], Any]
    check_pose_type: Callable[[str], Any]
    load_scene: Callable[[Edit, Any], list[SourceRecord]]
    scene_text: Callable[[str], tuple[str, str]]


Handler = Callable[[Any, Any, Edit, Tools], None]


def _owner(request: Any, edit: Edit) -> SourceRecord:
    return edit.owner(request.source.name, request.source.token)


def register_source(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RegisterSource; the same name with its own token gets the source back."""
    pose_type = request.pose_type or DEFAULT_POSE_TYPE
    tools.check_pose_type(pose_type)
    record = edit.records.get(request.name.strip())
    if record is not None:
        _hand_out(request, record, edit)
    else:
        if pose_type == "sensor_msgs/msg/JointState":
            raise MessageError(
                "pose_type sensor_msgs/msg/JointState needs a robot: load it with a scene file"
            )
        token = request.token or new_token()
        record = edit.add_source(request.name, token=token, pose_type=pose_type)
    response.source = _handle(record.name, edit)


def _hand_out(request: Any, record: SourceRecord, edit: Edit) -> None:
    """Hand out the handle of a source that is there, by its token or to the first."""
    handle = edit.handles[record.name]
    is_known = request.token != 0 and request.token == handle.token
    if not is_known and handle.claim is not Claim.OPEN:
        raise NameConflictError(_taken(request.name, handle.claim))
    if request.pose_type and record.pose_type != request.pose_type:
        raise MessageError(
            f"source {quoted(request.name)} sends {record.pose_type or 'no poses'}, not"
            f" {request.pose_type}"
        )
    edit.has_changes = not is_known
    if not is_known:
        edit.handles[record.name] = handle.taken(request.token)


def _taken(name: str, claim: Claim) -> str:
    """Say why nobody gets a handle, and how somebody could."""
    text = f"a source called {quoted(name)} exists already"
    if claim is Claim.TAKEN:
        return f"{text}, and was claimed: who did so has its handle"
    return f"{text}; its token gives it back"


def _handle(name: str, edit: Edit) -> SourceHandle:
    return SourceHandle(name=name, token=edit.handles[name].token)


def remove_source(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RemoveSource."""
    record = _owner(request, edit)
    edit.remove_source(record)


def register_frame(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RegisterFrame: later frames may be children of earlier ones."""
    record = _owner(request, edit)
    inspector = edit.scene_graph.model_inspector()
    world = inspector.get_name(inspector.world_frame_id())
    for description in request.frames:
        frame, X_PF = frame_from_msg(description)
        if frame.name() in ("world", world):
            raise InvalidNameError(f"the name {frame.name()!r} means the world frame")
        parent = None
        if description.parent not in ("", "world", world):
            parent = inspector.get_frame_id_by_name(record.id, description.parent)
        frame_id = edit.scene_graph.register_frame(record.id, frame, parent=parent)
        edit.initial_poses[frame_id] = X_PF
        response.frame_ids.append(int(frame_id))


def remove_frame(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RemoveFrame; a frame that went with its parent is no error."""
    record = _owner(request, edit)
    names = edit.names()
    frames = [names.frame_id(name, record.name) for name in request.frames]
    for frame_id in frames:
        if frame_id in edit.scene_graph.model_inspector().frames_for_source(record.id):
            edit.scene_graph.remove_frame(record.id, frame_id)


def register_geometry(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RegisterGeometry."""
    record = _owner(request, edit)
    names = edit.names()
    parent: Any = names.frame_id(request.frame, record.name)
    reference = request.parent_geometry
    if reference.id or reference.name:
        frame_id, parent = parent, names.geometry_id(reference)
        if edit.scene_graph.model_inspector().get_frame_id(parent) != frame_id:
            raise UnknownIdError(
                f"parent_geometry {quoted(names.geometry_path(parent))} is not on frame "
                f"{quoted(request.frame)}"
            )
    for description in request.geometries:
        between_steps()
        instance = instance_from_msg(description, tools.resolve)
        geometry_id = edit.scene_graph.register_geometry(record.id, parent, instance)
        response.geometry_ids.append(int(geometry_id))


def register_anchored_geometry(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RegisterAnchoredGeometry."""
    record = _owner(request, edit)
    for description in request.geometries:
        between_steps()
        instance = instance_from_msg(description, tools.resolve)
        geometry_id = edit.scene_graph.register_anchored_geometry(record.id, instance)
        response.geometry_ids.append(int(geometry_id))


def register_deformable_geometry(
    request: Any, response: Any, edit: Edit, tools: Tools
) -> None:  # fmt: skip
    """Answer RegisterDeformableGeometry."""
    from msg_adapters.deformables import deformable_from_msg, volume_mesh_to_msg

    record = _owner(request, edit)
    if not request.geometries:
        # The answer names the topic of the source's deformable geometry: there may be none.
        raise MessageError("geometries is empty: name at least one to register")
    world = edit.scene_graph.model_inspector().world_frame_id()
    for description in request.geometries:
        between_steps()
        instance, resolution_hint, reference_mesh = deformable_from_msg(description, tools.resolve)
        geometry_id = edit.scene_graph.register_deformable_geometry(
            record.id, world, instance, resolution_hint, reference_mesh=reference_mesh
        )
        mesh = edit.scene_graph.model_inspector().get_reference_mesh(geometry_id)
        response.geometry_ids.append(int(geometry_id))
        response.reference_meshes.append(volume_mesh_to_msg(mesh))


def remove_geometry(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RemoveGeometry; a geometry that went with its parent is no error."""
    record = _owner(request, edit)
    names = edit.names()
    for geometry_id in [names.geometry_id(reference) for reference in request.geometries]:
        between_steps()
        # All were there, so one that is not went with its parent.
        with contextlib.suppress(UnknownIdError):
            edit.scene_graph.remove_geometry(record.id, geometry_id)


def assign_role(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer AssignRole."""
    record = _owner(request, edit)
    names = edit.names()
    try:
        assign = RoleAssign(request.assign)
    except ValueError as error:
        raise RoleError(f"assign must be NEW or REPLACE, not {request.assign}") from error
    properties = properties_from_msg(request.role)
    resolve_files(properties, tools.resolve)
    for reference in request.geometries:
        geometry_id = names.geometry_id(reference)
        edit.scene_graph.assign_role(record.id, geometry_id, properties, assign)


def remove_role(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RemoveRole."""
    record = _owner(request, edit)
    names = edit.names()
    role = role_from_msg(request.role)
    targets: list[Any] = [names.frame_id(name, record.name) for name in request.frames]
    targets += [names.geometry_id(reference) for reference in request.geometries]
    for target in targets:
        response.removed += int(edit.scene_graph.remove_role(record.id, target, role))


def apply_filter(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer ApplyCollisionFilter: each pair must involve geometry of the source."""
    record = _owner(request, edit)
    names = edit.names()
    for statement in request.statements:
        _require_concern(statement, record, names, edit)
    declaration: CollisionFilterDeclaration = filter_from_msg(request.statements, names)
    manager = edit.scene_graph.collision_filter_manager()
    if request.is_transient:
        filter_id = manager.apply_transient(declaration)
        edit.filter_owners[int(filter_id)] = record.name
        response.filter_id = int(filter_id)
    else:
        manager.apply(declaration)


def _require_concern(statement: Any, record: SourceRecord, names: Any, edit: Edit) -> None:
    """Raise OwnershipError where no set of the statement is the source's own throughout."""
    inspector = edit.scene_graph.model_inspector()
    sets = [statement.a]
    if statement.operation in (statement.EXCLUDE_BETWEEN, statement.ALLOW_BETWEEN):
        sets.append(statement.b)
    for given in sets:
        items: list[Any] = [names.geometry_id(reference) for reference in given.geometries]
        items += [names.frame_id(frame) for frame in given.frames]
        if items and all(inspector.belongs_to_source(item, record.id) for item in items):
            return
    raise OwnershipError(
        f"source {quoted(record.name)} may filter pairs of its own geometry only: one set of each "
        "statement must be its own"
    )


def remove_filter(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RemoveCollisionFilter."""
    record = _owner(request, edit)
    owner = edit.filter_owners.get(request.filter_id)
    if owner is None:
        response.removed = False
        return
    if owner != record.name:
        raise OwnershipError(
            f"filter {request.filter_id} was declared by source {quoted(owner)}, "
            f"not by {quoted(record.name)}"
        )
    manager = edit.scene_graph.collision_filter_manager()
    response.removed = bool(manager.remove_declaration(FilterId(request.filter_id)))
    del edit.filter_owners[request.filter_id]


def register_camera(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RegisterCamera; modules of cameras are imported with the first of them."""
    from msg_adapters.cameras import scene_camera_from_msg
    from scene_graph_ros.geometry.perception.default_renderer import (
        add_default_renderer,
        DEFAULT_RENDERER,
    )

    record = _owner(request, edit)
    names = edit.names()
    if request.renderers:
        # What reads their parameters is imported with the first of them.
        from msg_adapters.renderers import renderer_from_msg

        for k, renderer in enumerate(request.renderers):
            edit.bring_renderer(renderer.name, renderer_from_msg(renderer, f"renderers[{k}]"))
    known = {DEFAULT_RENDERER, *edit.scene_graph.registered_renderer_names()}
    for description in request.cameras:
        camera = scene_camera_from_msg(description, record.name, DEFAULT_RENDERER)
        renderer_name = camera.camera.core.renderer_name
        if renderer_name not in known:
            hint = suggestion(renderer_name, known)
            raise UnknownIdError(
                f"camera {quoted(camera.name)}: there is no renderer {quoted(renderer_name)}{hint}"
            )
        if camera.frame != "world":
            names.frame_id(camera.frame, record.name)
        edit.add_cameras({camera.name: camera})
    add_default_renderer(edit.scene_graph)
    edit.drop_unused_renderers()


def remove_camera(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer RemoveCamera."""
    edit.remove_cameras(_owner(request, edit), request.cameras)


def attach_frame(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer AttachFrame; modules of robots are imported with the first of them."""
    from scene_graph_ros.node.world import attaching

    attaching.attach_frame(request, response, edit)


def detach_frame(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer DetachFrame."""
    from scene_graph_ros.node.world import attaching

    attaching.detach_frame(request, response, edit)


def set_padding(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer SetPadding."""
    from scene_graph_ros.node.world import paddings

    paddings.set_padding(request, response, edit)


def load_scene(request: Any, response: Any, edit: Edit, tools: Tools) -> None:
    """Answer LoadScene."""
    if bool(request.resource) == bool(request.text):
        raise MessageError("give either resource or text")
    for record in tools.load_scene(edit, request):
        response.sources.append(_handle(record.name, edit))


EDITS: dict[str, Handler] = {
    "ApplyCollisionFilter": apply_filter,
    "AssignRole": assign_role,
    "AttachFrame": attach_frame,
    "DetachFrame": detach_frame,
    "LoadScene": load_scene,
    "RegisterAnchoredGeometry": register_anchored_geometry,
    "RegisterCamera": register_camera,
    "RegisterDeformableGeometry": register_deformable_geometry,
    "RegisterFrame": register_frame,
    "RegisterGeometry": register_geometry,
    "RegisterSource": register_source,
    "RemoveCamera": remove_camera,
    "RemoveCollisionFilter": remove_filter,
    "RemoveFrame": remove_frame,
    "RemoveGeometry": remove_geometry,
    "RemoveRole": remove_role,
    "RemoveSource": remove_source,
    "SetPadding": set_padding,
}

"""Blocks of a moment, made once for all pages that show the same roles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.views import clouds, height_fields
from scene_graph_ros.views.browser.blocks import (
    contacts_block,
    mesh_block,
    picture_block,
    surfaces_block,
)
from scene_graph_ros.views.browser.shared_meshes import SharedMeshes, SharedTexture
from scene_graph_ros.views.browser.wishes import SHOWN_ROLES, Wish
from scene_graph_ros.views.deformables import deformable_items, DeformableItem
from scene_graph_ros.views.draggable import DraggableRobot
from scene_graph_ros.views.draw_list import DrawItem, DrawList
from scene_graph_ros.views.items import DEFAULT_COLOR, draw_items
from scene_graph_ros.views.looks import look_of
from scene_graph_ros.views.moment import Moment
from scene_graph_ros.views.sliders import Slider

__all__ = ["MOST_CONTACTS", "Deforming", "Drawing", "Scene"]

Entry = dict[str, Any]


class Deforming(NamedTuple):
    """A geometry whose vertices are told at each moment: deformable, a cloud or a height field."""

    item: DeformableItem
    role: Role
    geometry_id: GeometryId
    number: int

    @property
    def mesh(self) -> int:
        """Number of its mesh, which no other item has: below those of shared ones."""
        return -self.number

    @property
    def block(self) -> bytes:
        """Its mesh, whose vertices are told at each moment."""
        count = int(self.item.triangles.max(initial=-1)) + 1
        return mesh_block(self.mesh, np.zeros((count, 3)), self.item.triangles)

    @property
    def entry(self) -> Entry:
        """The item as a page knows it."""
        return {**_entry(self.item.item, self.number), "form": "vertices", "mesh": self.mesh}

    def version(self, snapshot: Snapshot) -> Any:
        """Return a value that differs, by ``!=``, where its vertices differ in a snapshot."""
        return snapshot.configuration(self.geometry_id)

    def vertices(self, snapshot: Snapshot) -> NDArray[np.float64]:
        """Return its vertices ``(v, 3)`` in W, in m."""
        (p_WVs,) = snapshot.driven_mesh_configurations(self.geometry_id, self.role)
        return p_WVs


class _Cloud(Deforming):
    """A cloud that is drawn."""

    __slots__ = ()

    def version(self, snapshot: Snapshot) -> Any:
        return clouds.placed_version(snapshot, self.geometry_id)

    def vertices(self, snapshot: Snapshot) -> NDArray[np.float64]:
        return clouds.octahedra_in_world(snapshot, self.geometry_id)


class _Field(Deforming):
    """A height field that is drawn."""

    __slots__ = ()

    def version(self, snapshot: Snapshot) -> Any:
        return height_fields.placed_heights(snapshot, self.geometry_id)

    def vertices(self, snapshot: Snapshot) -> NDArray[np.float64]:
        return height_fields.surface_in_world(snapshot, self.geometry_id)


class Scene(NamedTuple):
    """The items of one version of the world with some roles."""

    version: int
    roles: tuple[Role, ...]
    counts: Mapping[str, int]
    """Geometries by role, also of those that are not shown."""
    cameras: tuple[str, ...]
    """Names of those whose pictures can be asked for."""
    sliders: tuple[Slider, ...]
    """Joints that may be moved."""
    draggable: tuple[DraggableRobot, ...]
    """Robots whose links may be dragged."""
    listed: DrawList
    """The rigid ones; in their rows:"""
    numbers: NDArray[np.float64]
    entries: list[Entry]
    deforming: dict[int, Deforming]
    """The others, by number."""
    meshes: dict[int, bytes]
    """Blocks of the meshes of all rigid ones, by number."""
    textures: dict[int, bytes]
    """Blocks of the pictures on these, by number."""


def _number(geometry_id: int, role: Role) -> int:
    """Return the number of an item: a geometry has one for each role."""
    return 4 * geometry_id + role.value


def _entry(item: DrawItem, number: int) -> Entry:
    color = item.rgba or DEFAULT_COLOR
    return {
        "number": number,
        "geometry": item.geometry_id,
        "path": item.path,
        "shape": item.shape.type_name,
        "color": (color.r, color.g, color.b, color.a),
    }


class _Blocks(NamedTuple):
    """Blocks that a page gets once, by number."""

    meshes: dict[int, bytes]
    textures: dict[int, bytes]

    def add(self, *textures: SharedTexture) -> None:
        """Take pictures in."""
        self.textures.update((texture.number, texture.block) for texture in textures)


MOST_CONTACTS = 10_000
"""Points of one moment that are drawn, half a megabyte: 500 bodies in one place have 124 750."""


def _deepest(depths: NDArray[np.float64]) -> NDArray[np.int64] | slice:
    """Return the rows of the deepest contacts, in their order; all where that is not too many."""
    if len(depths) <= MOST_CONTACTS:
        return slice(None)
    return np.sort(np.argpartition(-depths, MOST_CONTACTS)[:MOST_CONTACTS])


class Drawing:
    """Makes the blocks of pages; to be used by one thread."""

    def __init__(self, cannot_show: Callable[[int, Exception], None]) -> None:
        """Call ``cannot_show`` with the id of a deformable geometry that can't be, and why."""
        self._cannot_show = cannot_show
        self._meshes = SharedMeshes()
        self._version = -1
        self._scenes: dict[tuple[Role, ...], Scene] = {}
        self._placed: tuple[int, dict[tuple[Role, ...], NDArray[np.float64]]] = (-1, {})
        self._contacts: tuple[tuple[int, int], bytes] = ((-1, -1), b"")
        self._pictures: tuple[int, dict[str, bytes]] = (-1, {})
        self.most_contacts = 0
        """Of one moment; of more than ``MOST_CONTACTS`` the deepest are shown."""

    def scene(self, moment: Moment, wish: Wish) -> Scene:
        """Return the scene of a page with this wish; the same object while it is the same."""
        if moment.scene_version != self._version:
            self._version = moment.scene_version
            self._scenes.clear()
            self._meshes.forget_old()
        roles = self._roles(moment, wish)
        scene = self._scenes.get(roles)
        if scene is None:
            scene = self._scenes[roles] = self._make_scene(moment, roles)
        return scene

    @staticmethod
    def _roles(moment: Moment, wish: Wish) -> tuple[Role, ...]:
        if wish.roles is not None:
            return wish.roles
        has_some = moment.inspector.num_geometries_with_role
        return next(((role,) for role in SHOWN_ROLES if has_some(role)), SHOWN_ROLES[:1])

    def _make_scene(self, moment: Moment, roles: tuple[Role, ...]) -> Scene:
        inspector, snapshot = moment.inspector, moment.query.snapshot
        items: list[DrawItem] = []
        deforming: dict[int, Deforming] = {}
        numbers: list[int] = []
        for role in roles:
            ids = [GeometryId(i) for i in snapshot.role_arrays(role).ids.tolist()]
            items += draw_items(inspector, role, ids, mesh_hulls=True)
            numbers += [_number(int(i), role) for i in ids]
            deforming.update(self._deforming(moment, role))
        blocks = _Blocks({}, {})
        entries = [
            self._entry(item, number, blocks) for item, number in zip(items, numbers, strict=True)
        ]
        counts = {
            role.name.lower(): inspector.num_geometries_with_role(role) for role in SHOWN_ROLES
        }
        return Scene(
            moment.scene_version,
            roles,
            counts,
            moment.cameras,
            moment.sliders,
            moment.draggable,
            DrawList(items),
            np.array(numbers, dtype=np.float64),
            entries,
            deforming,
            blocks.meshes,
            blocks.textures,
        )

    def _entry(self, item: DrawItem, number: int, blocks: _Blocks) -> Entry:
        form, size = look_of(item)
        if item.picture is not None and form != "half_space":
            form, size = "mesh", (1.0, 1.0, 1.0)
        entry = {**_entry(item, number), "form": form, "size": size}
        if form == "half_space":
            self._cover_plane(item, entry, blocks)
        if form == "mesh":
            mesh = self._meshes.of(item)
            if mesh.reason:
                entry["reason"] = mesh.reason
                return entry
            entry["mesh"] = mesh.number
            blocks.meshes[mesh.number] = mesh.block
            blocks.add(*mesh.textures)
            if mesh.is_painted:
                # What its own colour adds to those of the triangles: nothing.
                alpha = DEFAULT_COLOR.a if item.rgba is None else item.rgba.a
                entry["color"] = (0.0, 0.0, 0.0, alpha)
            if not all(texture.is_opaque for texture in mesh.textures):
                entry["sheer"] = True
        return entry

    def _cover_plane(self, item: DrawItem, entry: Entry, blocks: _Blocks) -> None:
        try:
            texture = self._meshes.texture_of_plane(item)
        except SceneGraphError as error:
            entry["reason"] = str(error)
            return
        if texture is not None and item.picture is not None:
            blocks.add(texture)
            entry.update(texture=texture.number, repeats=item.picture.scale)
            if item.rgba is None:
                entry["color"] = (1.0, 1.0, 1.0, 1.0)

    def _deforming(self, moment: Moment, role: Role) -> Iterable[tuple[int, Deforming]]:
        ids = {int(i): i for i in moment.query.snapshot.state.deformable_ids(role)}
        for each in deformable_items(moment.inspector, role, ids.values(), self._cannot_show):
            number = _number(each.item.geometry_id, role)
            yield number, Deforming(each, role, ids[each.item.geometry_id], number)
        snapshot = moment.query.snapshot
        ids = {int(i): i for i in clouds.cloud_ids(snapshot, role)}
        for each in clouds.cloud_items(moment.inspector, role, ids.values()):
            number = _number(each.item.geometry_id, role)
            yield number, _Cloud(each, role, ids[each.item.geometry_id], number)
        ids = {int(i): i for i in height_fields.field_ids(snapshot, role)}
        for each in height_fields.field_items(moment.inspector, role, ids.values()):
            number = _number(each.item.geometry_id, role)
            yield number, _Field(each, role, ids[each.item.geometry_id], number)

    def X_WG(self, moment: Moment, roles: tuple[Role, ...]) -> NDArray[np.float64]:
        """Return ``(n, 4, 4)`` where the rigid items of a scene with these roles are."""
        if self._placed[0] != moment.sequence:
            self._placed = (moment.sequence, {})
        placed = self._placed[1]
        if roles not in placed:
            of_roles = [moment.query.snapshot.X_WG_of(role) for role in roles]
            placed[roles] = np.concatenate([np.empty((0, 4, 4)), *of_roles])
        return placed[roles]

    def contacts(self, moment: Moment) -> bytes:
        """Return the blocks of contacts: points half-way between both witnesses, surfaces."""
        asked = (moment.sequence, moment.contact_sequence)
        if self._contacts[0] != asked:
            points, surfaces, scale = moment.contacts()
            rows = _deepest(points.depth)
            self.most_contacts = max(self.most_contacts, len(points.depth))
            middle = 0.5 * (points.p_WCa[rows] + points.p_WCb[rows])
            ids = np.stack([points.id_A[rows], points.id_B[rows]], axis=1)
            blocks = contacts_block(middle, ids, points.nhat_BA_W[rows], points.depth[rows])
            if surfaces is not None:
                # Only where something presses.
                from scene_graph_ros.views.surfaces import triangles_of

                corner = triangles_of(surfaces)[0].ravel()
                corners, pressures = surfaces.vertices_W[corner], surfaces.pressure[corner]
                blocks += surfaces_block(corners, pressures, scale)
            self._contacts = (asked, blocks)
        return self._contacts[1]

    def picture(self, moment: Moment, camera: str) -> bytes:
        """Return the block of a camera's image; the same object while it is of this moment."""
        if self._pictures[0] != moment.sequence:
            self._pictures = (moment.sequence, {})
        pictures = self._pictures[1]
        if camera not in pictures:
            pictures[camera] = picture_block(moment.picture(camera))
        return pictures[camera]

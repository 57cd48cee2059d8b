"""The state of one page, and the next message that brings it up to date."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from scene_graph_ros.views.browser.blocks import (
    poses_block,
    scene_block,
    sliders_block,
    time_block,
    troubles_block,
    vertices_block,
)
from scene_graph_ros.views.browser.drawing import Deforming, Drawing, Scene
from scene_graph_ros.views.browser.motions import MotionTold
from scene_graph_ros.views.browser.wishes import Wish
from scene_graph_ros.views.draw_list import Changes, Shown
from scene_graph_ros.views.moment import Moment, Trouble
from scene_graph_ros.views.sliders import SliderState

__all__ = ["Cursor", "Told"]


_NO_MOTION = MotionTold()


class Told(NamedTuple):
    """A message to a page."""

    blocks: list[bytes]
    own_bytes: int
    """Bytes of blocks that are there for this page alone; meshes and pictures are for all."""


class Cursor:
    """The state that a page is at: its next message has all changes since."""

    def __init__(self) -> None:
        self._shown = Shown()
        self._scene: Scene | None = None
        self._meshes: set[int] = set()
        self._textures: set[int] = set()
        self._deformed: dict[int, Any] = {}
        self._picture = ("", b"")
        self._sliders = SliderState()
        self._troubles: tuple[Trouble, ...] = ()
        self._motion = MotionTold()

    def message(self, moment: Moment, wish: Wish, drawing: Drawing) -> bytes:
        """Return the blocks of ``told`` as one."""
        return b"".join(self.told(moment, wish, drawing).blocks)

    def told(
        self, moment: Moment, wish: Wish, drawing: Drawing, motion: MotionTold = _NO_MOTION
    ) -> Told:
        """Return the message after which a page with all messages so far shows ``moment``.

        ``motion`` is for this page alone.

        Raises the errors of meshes and contacts; then begin anew.
        """
        scene = drawing.scene(moment, wish)
        X_WG = drawing.X_WG(moment, scene.roles)
        before = self._scene
        changes = self._shown.follow(scene.listed, X_WG)
        blocks = [time_block(moment.stamp, moment.sequence, moment.scene_version)]
        if scene is not before:
            blocks += self._scene_blocks(before, scene, changes)
        if len(changes.moved):
            blocks.append(poses_block(scene.numbers[changes.moved], X_WG[changes.moved]))
        blocks += self._vertices(moment, scene)
        if scene.sliders and (scene is not before or self._sliders != moment.slider_state()):
            self._sliders = moment.slider_state()
            blocks.append(sliders_block(self._sliders))
        if moment.troubles != self._troubles:
            self._troubles = moment.troubles
            blocks.append(troubles_block(moment.troubles))
        if wish.contacts:
            blocks.append(drawing.contacts(moment))
        blocks += self._pictures(moment, wish.camera, drawing)
        blocks += [new for new, old in zip(motion, self._motion, strict=True) if new is not old]
        self._motion = motion
        shared = {id(block) for made in (scene.meshes, scene.textures) for block in made.values()}
        return Told(blocks, sum(len(block) for block in blocks if id(block) not in shared))

    def _pictures(self, moment: Moment, camera: str, drawing: Drawing) -> list[bytes]:
        """Return the image of the chosen camera, if the page does not show it already."""
        before = self._picture
        self._picture = (camera, drawing.picture(moment, camera) if camera else b"")
        return [self._picture[1]] if camera and self._picture != before else []

    def _scene_blocks(self, before: Scene | None, scene: Scene, changes: Changes) -> list[bytes]:
        """Return the blocks of another scene: meshes, then the items that use them."""
        self._scene = scene
        deformed_before = {} if before is None else before.deforming
        new = [
            each
            for number, each in scene.deforming.items()
            if not _is_same(each, deformed_before.get(number))
        ]
        gone = [number for number in deformed_before if number not in scene.deforming]
        for number in (*gone, *(each.number for each in new)):
            self._deformed.pop(number, None)
        meshes = {**scene.meshes, **{each.mesh: b"" for each in scene.deforming.values()}}
        unused, self._meshes = self._meshes - meshes.keys(), self._meshes & meshes.keys()
        made = [block for n, block in scene.meshes.items() if n not in self._meshes]
        made += [each.block for each in new]
        self._meshes |= meshes.keys()
        stale = self._textures - scene.textures.keys()
        made += [block for n, block in scene.textures.items() if n not in self._textures]
        self._textures = set(scene.textures)
        entries = [scene.entries[row] for row in changes.appeared.tolist()]
        content = {
            "begins": before is None,
            "roles": [role.name.lower() for role in scene.roles],
            "counts": dict(scene.counts),
            "cameras": list(scene.cameras),
            "sliders": [slider._asdict() for slider in scene.sliders],
            "draggable": [each._asdict() for each in scene.draggable],
            "appeared": [*entries, *(each.entry for each in new)],
            "vanished": [*_numbers(before, changes), *gone],
            "meshes_gone": sorted(unused),
            "textures_gone": sorted(stale),
        }
        return [*made, scene_block(content)]

    def _vertices(self, moment: Moment, scene: Scene) -> Iterable[bytes]:
        """Return the vertices of items that have been deformed since the last message."""
        snapshot = moment.query.snapshot
        for number, each in scene.deforming.items():
            version = each.version(snapshot)
            if self._deformed.get(number) != version:
                self._deformed[number] = version
                yield vertices_block(number, each.vertices(snapshot))


def _is_same(each: Deforming, before: Deforming | None) -> bool:
    return (
        before is not None
        and each.item.item == before.item.item
        and each.item.triangles is before.item.triangles
    )


def _numbers(before: Scene | None, changes: Changes) -> list[Any]:
    """Return the numbers of rigid items that vanished."""
    if before is None:
        return []
    rows = [before.listed.rows[key] for key in changes.vanished]
    return before.numbers[rows].tolist()

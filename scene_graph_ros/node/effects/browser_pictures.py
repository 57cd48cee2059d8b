"""Images of cameras as files, for pages that ask; imported when one first does."""

from __future__ import annotations

from collections.abc import Callable

from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.perception import ImageKind
from scene_graph_ros.geometry.perception.image_forms import colors
from scene_graph_ros.node.effects.camera_frame import CameraFrame
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.png import png

__all__ = ["color_png"]

_COLOR = frozenset({ImageKind.COLOR})

_MOST_PIXELS = 1024
"""Of a picture's longer side: of a larger image every second pixel is shown, every third, ..."""


def color_png(camera: str, snapshot: WorldSnapshot, failed: Callable[[str], None]) -> bytes:
    """Return the colours that a camera sees; nothing where it, its frame or the image is missing.

    Why an image can't be made is told to ``failed``.
    """
    found = snapshot.cameras.get(camera)
    if found is None:
        return b""
    try:
        frame = CameraFrame(found, snapshot)
        frame.render(_COLOR)
    except UnknownIdError:  # its frame was removed: its diagnostics say so
        return b""
    except Exception as error:  # noqa: BLE001 - one camera never costs anything else
        failed(f"camera {camera} has no picture for the browser: {type(error).__name__}: {error}")
        return b""
    assert frame.images.color is not None
    step = -(-max(frame.images.color.shape) // _MOST_PIXELS)
    return png(colors(frame.images.color)[::step, ::step])

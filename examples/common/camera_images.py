"""What a camera of the node sees: images of one moment, gathered by their stamp, and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image as Picture
from PIL import ImageDraw, ImageFont
from rclpy.node import Node
from sensor_msgs.msg import Image

KINDS = ("color", "depth", "label")
CAPTION_HEIGHT = 34
FAR = 1.0
"""Metres shown as black; what is at the lens is white."""
LABEL_COLORS = (
    (228, 26, 28), (55, 126, 184), (77, 175, 74), (152, 78, 163), (255, 127, 0),
    (255, 217, 47), (166, 86, 40), (247, 129, 191), (23, 190, 207),
)  # fmt: skip
MOST_LABEL = 32763
"""The largest label that a user gives; larger ones mean nothing, or nothing of interest."""


class View(NamedTuple):
    """Images of one moment."""

    color: np.ndarray
    """(h, w, 3) uint8."""
    depth: np.ndarray
    """(h, w) float32 metres; -inf too near, +inf where nothing is."""
    label: np.ndarray
    """(h, w) uint16."""

    def num_labels(self) -> int:
        """Count the things with a label of their own that are to be seen."""
        return len(np.unique(self.label[self.label <= MOST_LABEL]))


def pixels_of(message: Image) -> np.ndarray:
    """Return the pixels of an image as its encoding says."""
    dtype = {"rgb8": np.uint8, "32FC1": np.float32, "16UC1": np.uint16}[message.encoding]
    pixels = np.frombuffer(bytes(message.data), dtype)
    return pixels.reshape(message.height, message.width, *([3] if dtype == np.uint8 else []))


class CameraListener:
    """Keeps, of all moments that a camera saw, the one with the most things in it."""

    def __init__(self, node: Node, camera: str) -> None:
        """Subscribe to the images of ``camera``, the absolute name of its topics."""
        self.frames = 0
        self.best: View | None = None
        self._waiting: dict[tuple[int, int], dict[str, Image]] = {}
        for kind in KINDS:
            node.create_subscription(
                Image, f"{camera}/{kind}/image", lambda m, kind=kind: self._take(kind, m), 5
            )

    def _take(self, kind: str, message: Image) -> None:
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        images = self._waiting.setdefault(stamp, {})
        images[kind] = message
        if len(images) == len(KINDS):
            view = View(*(pixels_of(images[kind]) for kind in KINDS))
            self.frames += 1
            if self.best is None or view.num_labels() > self.best.num_labels():
                self.best = view
            # Older ones are not going to be complete any more.
            self._waiting = {s: i for s, i in self._waiting.items() if s > stamp}


def _shown_depth(depth: np.ndarray) -> np.ndarray:
    share = np.clip(depth / FAR, 0.0, 1.0)
    return (255.0 * (1.0 - share)).astype(np.uint8)[..., None].repeat(3, axis=2)


def _shown_label(label: np.ndarray) -> np.ndarray:
    shown = np.full((*label.shape, 3), 60, np.uint8)
    is_named = label <= MOST_LABEL
    shown[is_named] = np.array(LABEL_COLORS, np.uint8)[label[is_named] % len(LABEL_COLORS)]
    return shown


def draw_view(path: Path, view: View) -> None:
    """Write colour, depth and labels beside each other to ``path`` (PNG)."""
    height, width = view.depth.shape
    picture = Picture.new("RGB", (3 * width, height + CAPTION_HEIGHT), "white")
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(20)
    panels = (
        ("color/image", view.color),
        (f"depth/image, white 0 m to black {FAR:g} m", _shown_depth(view.depth)),
        ("label/image, a colour for each label", _shown_label(view.label)),
    )
    for i, (caption, pixels) in enumerate(panels):
        picture.paste(Picture.fromarray(pixels), (i * width, CAPTION_HEIGHT))
        draw.text((i * width + 8, 5), caption, font=font, fill=(30, 30, 40))
    picture.save(path)

"""A letter F in a glTF file: one turn shows it upright, readable and from its front."""

import base64
import json

import numpy as np

__all__ = ["FACES", "POINTS", "TURNED", "letter_gltf"]

_BARS = [((0, 0), (0.25, 1)), ((0.25, 0.8), (0.8, 1)), ((0.25, 0.45), (0.6, 0.62))]
"""Of the letter, across and up; and a stud on its front, at the foot."""


def _box(lower, upper):
    axes = zip(lower, upper, strict=True)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


_BOXES = [_box((*low, 0.0), (*high, 0.2)) for low, high in _BARS]
_BOXES.append(_box((0.05, 0.05, 0.2), (0.2, 0.2, 0.4)))
POINTS = np.float32(np.vstack(_BOXES)).astype(float)
"""(32, 3) as the file has them: +X to the right, +Y up, +Z to the front."""
_SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array(
    [[8 * k + q[i] for i in t] for k in range(4) for q in _SIDES for t in ((0, 1, 2), (0, 2, 3))]
)
"""(48, 3)."""
TURNED = np.stack([POINTS[:, 0], -POINTS[:, 2], POINTS[:, 1]], axis=1)
"""(32, 3) as the points are to be: +Z up, and the front towards -Y."""


def letter_gltf():
    """Return the contents of the file."""
    points, corners = np.float32(POINTS).tobytes(), FACES.astype("<u4").tobytes()
    data = base64.b64encode(points + corners).decode()
    address = f"data:application/octet-stream;base64,{data}"
    limits = {"min": POINTS.min(axis=0).tolist(), "max": POINTS.max(axis=0).tolist()}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 32, "type": "VEC3", **limits},
            {"bufferView": 1, "componentType": 5125, "count": FACES.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(corners)},
        ],
        "buffers": [{"byteLength": len(points) + len(corners), "uri": address}],
    }
    return json.dumps(tree).encode()

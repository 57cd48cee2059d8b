"""The scene of the message benchmarks: mixed shapes, each on a frame that moves."""

from __future__ import annotations

import numpy as np

__all__ = ["FILL", "SOURCE", "frame_names", "poses", "scene_text"]

SOURCE = "objects"
FILL = 0.05
"""Part of the volume that the shapes fill."""

_SEED = 20
_SHAPES = (
    ("{type: sphere, radius: 0.1}", 4.0 / 3.0 * np.pi * 0.1**3),
    ("{type: box, size: [0.2, 0.15, 0.1]}", 0.2 * 0.15 * 0.1),
    ("{type: cylinder, radius: 0.08, length: 0.2}", np.pi * 0.08**2 * 0.2),
    ("{type: ellipsoid, semi_axes: [0.12, 0.08, 0.1]}", 4.0 / 3.0 * np.pi * 0.12 * 0.08 * 0.1),
)


def frame_names(count: int) -> list[str]:
    """Return the names of the frames."""
    return [f"object_{i}" for i in range(count)]


def _edge(count: int) -> float:
    """Return the edge of the cube that the shapes fill to FILL, metres."""
    volume = sum(_SHAPES[i % len(_SHAPES)][1] for i in range(count))
    return float((volume / FILL) ** (1.0 / 3.0))


def scene_text(count: int) -> str:
    """Return the scene file: ``count`` frames with a geometry each, that collides and is shown."""
    lines = ["version: 1", f"sources: [{{name: {SOURCE}}}]", "frames:"]
    # Apart from the start: frames without a pose would all be at the origin, in contact.
    for name, (x, y, z) in zip(frame_names(count), poses(count, 0)[:, :3].tolist(), strict=True):
        lines.append(f"  - {{name: {name}, source: {SOURCE}, pose: {{xyz: [{x}, {y}, {z}]}}}}")
    lines.append("geometries:")
    for i, name in enumerate(frame_names(count)):
        shape = _SHAPES[i % len(_SHAPES)][0]
        lines.append(f"  - {{name: g{i}, source: {SOURCE}, frame: {name}, shape: {shape}}}")
    return "\n".join(lines) + "\n"


def poses(count: int, step: int) -> np.ndarray:
    """Return ``(count, 7)`` positions and quaternions, all of them others at each step."""
    rng = np.random.default_rng((_SEED, step))
    rows = np.empty((count, 7))
    rows[:, :3] = rng.uniform(0.0, _edge(count), (count, 3))
    rows[:, 3:] = rng.normal(size=(count, 4))
    rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    return rows

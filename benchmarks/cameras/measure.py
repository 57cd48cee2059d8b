"""Times of frames and errors of depths, for one scene and all renderers that can draw it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from benchmarks.cameras.engines import KINDS, Ours
from benchmarks.cameras.scenes import CameraScene, CLIPPING, SETS
from benchmarks.cameras.seats import Seat
from benchmarks.cameras.truths import true_depth
from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, Mesh, Sphere
from scene_graph_ros.geometry.perception import CameraIntrinsics

__all__ = ["UNROUNDED", "Row", "load", "measure", "true_depths"]

UNROUNDED = "scene_graph_ros, before rounding"
"""The row of our depths before they become float32."""

ALL = "all"


@dataclass(frozen=True)
class Row:
    """One renderer and one scene; times are of the processor, NaN for what it does not have."""

    scene: str
    title: str
    engine: str
    depth_ms: float
    label_ms: float
    color_ms: float
    all_ms: float
    """Depth, label and colour of the same poses."""
    pixels: int
    """How many of the pixels drawn at random see something, by the truth."""
    median_m: float
    """Of the errors of their depths."""
    high_m: float
    """99 in a hundred are better."""
    elsewhere: int
    """How many see nothing, or see something where there is nothing."""

    @classmethod
    def from_text(cls, line: dict[str, str]) -> Row:
        """Return the row that a line of the CSV file holds."""
        kinds = {"str": str, "float": float, "int": int}
        return cls(**{f.name: kinds[str(f.type)](line[f.name]) for f in fields(cls)})


def load(
    seats: Sequence[Seat],
    scene: CameraScene,
    lens: CameraIntrinsics,
    say: Callable[[str], None],
) -> list[Seat]:
    """Return the renderers that can draw a scene, and have it; say why the others can't."""
    found = []
    for seat in seats:
        reason = seat.load(scene, lens)
        if reason:
            say(f"{seat.kind.name} is left out of {scene.title}: {reason}")
        else:
            found.append(seat)
    return found


def measure(
    seats: Sequence[Seat],
    scene: CameraScene,
    lens: CameraIntrinsics,
    *,
    frames: int,
    pixels: int,
    seed: int,
) -> Iterator[Row]:
    """Yield a row for each renderer, and one for our depths before rounding.

    The renderers take turns, frame by frame. ``pixels`` are drawn for the comparison with the
    truth, of the first set of poses.
    """
    times = _times(seats, frames)
    sample = _sample(lens, pixels, seed)
    truth = true_depths(scene, lens, sample)
    for seat in seats:
        name = seat.kind.name
        mine = {kind: times.get((name, kind), np.nan) for kind in (*KINDS, ALL)}
        seen = seat.depth(0)
        yield _row(scene, name, mine, seen[sample[:, 1], sample[:, 0]], truth)
        if seat.kind is Ours:
            exact = seat.unrounded(0)[sample[:, 1], sample[:, 0]]
            yield _row(scene, UNROUNDED, mine, exact, truth)


def _times(seats: Sequence[Seat], frames: int) -> dict[tuple[str, str], float]:
    """Return the median milliseconds of the processor by renderer and kind, poses included."""
    taken: dict[tuple[str, str], list[float]] = {}
    for frame in range(-1, frames):
        for seat in seats:
            asked = [(kind, (kind,)) for kind in seat.kind.kinds]
            if len(asked) > 1:
                asked.append((ALL, seat.kind.kinds))
            for place, (name, kinds) in enumerate(asked):
                seconds = seat.seconds((frame + place) % SETS, kinds)
                if frame >= 0:  # the one before loads and compiles
                    taken.setdefault((seat.kind.name, name), []).append(seconds * 1e3)
    return {key: float(np.median(values)) for key, values in taken.items()}


def _sample(lens: CameraIntrinsics, pixels: int, seed: int) -> np.ndarray:
    """Return pixels (u, v) drawn at random, (n, 2)."""
    rng = np.random.default_rng(seed)
    return np.stack([rng.integers(0, lens.width, pixels), rng.integers(0, lens.height, pixels)], 1)


def _reach(shape: Any) -> float:
    """Return how far a shape's surface is at most from its origin."""
    match shape:
        case Sphere():
            return shape.radius
        case Box():
            return 0.5 * float(np.linalg.norm(shape.size))
        case Capsule():
            return shape.radius + 0.5 * shape.length
        case Cylinder():
            return float(np.hypot(shape.radius, 0.5 * shape.length))
        case Ellipsoid():
            return max(shape.a, shape.b, shape.c)
        case Mesh():
            return float(np.linalg.norm(np.asarray(shape.vertices), axis=1).max())
    raise TypeError(f"{shape!r} is in no scene of this benchmark")


def true_depths(scene: CameraScene, lens: CameraIntrinsics, sample: np.ndarray) -> list[Any]:
    """Return the depth (mpf) of what each pixel (u, v) sees first, None where that is nothing."""
    X_WGs = scene.X_WGs[0]
    reach = np.array([_reach(shape) for shape in scene.shapes])
    found = []
    for u, v in sample.tolist():
        d = np.array([(u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, 1.0])
        away = np.linalg.norm(np.cross(X_WGs[:, :3, 3], d / np.linalg.norm(d)), axis=1)
        near = np.flatnonzero(away <= 1.001 * reach).tolist()
        depths = [
            true_depth(scene.shapes[k], X_WGs[k], np.eye(4), lens, (u, v), CLIPPING) for k in near
        ]
        first = min((t for t in depths if t is not None), default=None)
        found.append(None if first is None or first > CLIPPING.far else first)
    return found


def _row(
    scene: CameraScene, name: str, times: dict[str, float], seen: np.ndarray, truth: list[Any]
) -> Row:
    hits = np.isfinite(seen)
    is_there = np.array([t is not None for t in truth])
    errors = [
        abs(float(t - float(z)))
        for t, z, hit in zip(truth, seen, hits, strict=True)
        if hit and t is not None
    ]
    median, high = np.percentile(errors, (50.0, 99.0)).tolist() if errors else (np.nan, np.nan)
    return Row(
        scene.key,
        scene.title,
        name,
        *(times[kind] for kind in (*KINDS, ALL)),
        int(is_there.sum()),
        median,
        high,
        int(np.count_nonzero(hits != is_there)),
    )

"""How long it takes to read a closed mesh, and to unite parts beside manifold3d alone.

    python -m benchmarks.solids_speed [--rounds 9]

CPU seconds of one thread, medians of rounds in which each is measured in turn.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import time
from unittest import mock

import manifold3d
import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids import solid
from scene_graph_ros.geometry.meshes.surfaces import build_surface

__all__ = ["medians", "read_times", "unite_times"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PARTS = 20
_TRIANGLES = 100_000
"""Of all parts together."""


def sphere(rings: int, radius: float, middle: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return a sphere's vertices (v, 3) and triangles (4 rings (rings - 1), 3)."""
    around = 2 * rings
    theta = np.pi * np.arange(1, rings) / rings
    phi = 2.0 * np.pi * np.arange(around) / around
    ring = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    body = np.sin(theta)[:, None, None] * ring[None]
    height = np.broadcast_to(np.cos(theta)[:, None, None], (rings - 1, around, 1))
    at = np.concatenate([body, height], axis=2).reshape(-1, 3)
    points = np.vstack([at, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
    i, j = np.meshgrid(np.arange(rings - 2), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    faces = [np.stack([a, a + around, b], -1), np.stack([b, a + around, b + around], -1)]
    k, last, top = np.arange(around), (rings - 2) * around, len(points) - 2
    faces += [np.stack([np.full(around, top), k, (k + 1) % around], -1)]
    faces += [np.stack([np.full(around, top + 1), last + (k + 1) % around, last + k], -1)]
    return middle + radius * points, np.concatenate([f.reshape(-1, 3) for f in faces])


def medians(calls: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median CPU seconds of each call, measured in turn after one run of each."""
    taken: dict[str, list[float]] = {name: [] for name in calls}
    for k in range(rounds + 1):
        for name, call in calls.items():
            start = time.process_time()
            call()
            if k:
                taken[name].append(time.process_time() - start)
    return {name: float(np.median(times)) for name, times in taken.items()}


def unite_times(rounds: int) -> dict[str, float]:
    """Return CPU seconds of uniting 20 overlapping parts of together 100 000 triangles."""
    rng = np.random.default_rng(0)
    rings = int(np.sqrt(_TRIANGLES / _PARTS / 4.0)) + 1
    parts = [sphere(rings, 0.5, rng.uniform(0.0, 1.5, 3)) for _ in range(_PARTS)]
    starts = np.cumsum([0, *(len(v) for v, _ in parts)])
    vertices = np.vstack([v for v, _ in parts])
    faces = np.vstack([f + k for (_, f), k in zip(parts, starts, strict=False)])

    def library() -> object:
        bodies = [
            manifold3d.Manifold(
                manifold3d.Mesh64(vert_properties=v, tri_verts=f.astype(np.uint64))
            )
            for v, f in parts
        ]
        whole = manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)
        return whole.to_mesh64()

    def ours() -> object:
        # What is kept on disk would cost nothing.
        with mock.patch.object(solid, "kept_solid", lambda *given: given[-1]()):
            return build_surface(vertices, faces, name="parts")

    return medians({"manifold3d": library, "read and unite": ours}, rounds)


def read_times(rounds: int) -> dict[str, float]:
    """Return CPU seconds of reading one closed part, with the search for crossings and without."""
    vertices, faces = sphere(112, 1.0, np.zeros(3))

    def read() -> object:
        return build_surface(vertices, faces, name="sphere")

    def without_search() -> object:
        surfaces = build_surface.__globals__
        with mock.patch.dict(surfaces, {"_crossing": lambda *_: None}):
            return read()

    return medians({"read": read, "without the search": without_search}, rounds)


def main() -> None:
    """Print the times."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.solids_speed")
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    for name, seconds in {**unite_times(rounds), **read_times(rounds)}.items():
        print(f"{name:20} {seconds:.3f} s")


if __name__ == "__main__":
    main()

"""How long it takes to read a closed mesh, and to unite parts beside manifold3d alone.

    python -m benchmarks.solids_speed [--rounds 9] [--before 8a3c575] [--out docs]

CPU seconds of one thread, medians of rounds in which each is measured in turn. With ``--before``
the sources of that commit read the same mesh, in a process of their own that takes its turns;
8a3c575 is the last one before repairs. Writes a table into meshes.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import contextlib
import os
from pathlib import Path
import textwrap
import time
from unittest import mock

import manifold3d
import numpy as np
from numpy.typing import NDArray

from benchmarks.earlier_sources import sources_of, worker
from benchmarks.machine import machine
from scene_graph_ros.geometry.meshes.solids import solid
from scene_graph_ros.geometry.meshes.surfaces import build_surface

__all__ = ["medians", "read_times", "table_of", "unite_times"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_START, _END = "<!-- measured: reading -->", "<!-- end of reading -->"
_LIBRARY, _UNITED = "`manifold3d` alone", "reading and uniting them"
_READ, _PLAIN, _BEFORE = "reading it", "without the search for crossings", "before repairs"
_RINGS = 112
"""Of a sphere that is read: 49 728 triangles."""

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


def medians(
    calls: dict[str, Callable[[], object]],
    rounds: int,
    others: dict[str, Callable[[], float]] | None = None,
) -> dict[str, float]:
    """Return the median CPU seconds of each call, measured in turn after one run of each.

    ``others`` run elsewhere, and return their own CPU seconds.
    """
    others = others or {}
    taken: dict[str, list[float]] = {name: [] for name in (*calls, *others)}
    for k in range(rounds + 1):
        found = {}
        for name, call in calls.items():
            start = time.process_time()
            call()
            found[name] = time.process_time() - start
        found |= {name: call() for name, call in others.items()}
        if k:
            for name, seconds in found.items():
                taken[name].append(seconds)
    return {name: float(np.median(times)) for name, times in taken.items()}


_WORKER = """
import sys, time
import numpy as np
from scene_graph_ros.geometry.meshes.surfaces import build_surface
mesh = np.load(sys.argv[1])
vertices, faces = mesh["vertices"], mesh["faces"]
for _ in sys.stdin:
    start = time.process_time()
    build_surface(vertices, faces, name="sphere")
    print(time.process_time() - start, flush=True)
"""
"""What a process of an earlier version does: it reads the mesh once for each line that it gets."""


@contextlib.contextmanager
def _earlier(commit: str, vertices: FloatArray, faces: IntArray) -> Iterator[Callable[[], float]]:
    """Give a call that lets the sources of a commit read a mesh, and returns its CPU seconds."""
    with sources_of(commit) as folder:
        mesh = folder / "mesh.npz"
        np.savez(mesh, vertices=vertices, faces=faces)
        with worker(_WORKER, folder, str(mesh)) as process:
            yield lambda: float(process.ask("again"))


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

    return medians({_LIBRARY: library, _UNITED: ours}, rounds)


def read_times(rounds: int, before: str | None = None) -> dict[str, float]:
    """Return CPU seconds of reading one closed part, with the search for crossings and without.

    And with ``before``, of the sources of that commit.
    """
    vertices, faces = sphere(_RINGS, 1.0, np.zeros(3))

    def read() -> object:
        return build_surface(vertices, faces, name="sphere")

    def without_search() -> object:
        surfaces = build_surface.__globals__
        with mock.patch.dict(surfaces, {"_crossing": lambda *_: None}):
            return read()

    calls = {_READ: read, _PLAIN: without_search}
    if before is None:
        return medians(calls, rounds)
    with _earlier(before, vertices, faces) as earlier:
        return medians(calls, rounds, {_BEFORE: earlier})


def table_of(unite: dict[str, float], read: dict[str, float]) -> list[str]:
    """Return the lines of a table: seconds, and how they compare."""
    more = unite[_UNITED] - unite[_LIBRARY]
    lines = [
        "| what | ms | beside |",
        "| --- | ---: | ---: |",
        f"| 20 overlapping parts of together 100 000 triangles: {_LIBRARY} |"
        f" {1e3 * unite[_LIBRARY]:.0f} | |",
        f"| {_UNITED} | {1e3 * unite[_UNITED]:.0f} | {1e3 * more:.0f} ms more |",
    ]
    plain = read.get(_BEFORE)
    if plain is not None:
        lines.append(f"| a closed part of 49 728 triangles: {_BEFORE} | {1e3 * plain:.0f} | |")
    for name in (_PLAIN, _READ):
        ratio = "" if plain is None else f"{read[name] / plain:.2f} times"
        lines.append(f"| {name} | {1e3 * read[name]:.0f} | {ratio} |")
    return lines


def main() -> None:
    """Print the times, and write them down."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.solids_speed",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--before", default=None, metavar="COMMIT", help="an earlier version")
    parser.add_argument("--out", type=Path, default=None, help="folder of the page to write to")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    lines = table_of(unite_times(options.rounds), read_times(options.rounds, options.before))
    print("\n".join(lines))
    if options.out is None:
        return
    page = options.out / "meshes.md"
    before, _, rest = page.read_text().partition(_START)
    after = rest.partition(_END)[2]
    told = "\n".join(["", "", textwrap.fill(machine(load).strip(), 99), "", *lines, "", ""])
    page.write_text(before + _START + told + _END + after)


if __name__ == "__main__":
    main()

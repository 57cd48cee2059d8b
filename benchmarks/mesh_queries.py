"""Queries of a mesh by its triangles, beside those of an earlier version in the same minute.

    python -m benchmarks.mesh_queries [--rounds 40] [--before 8a3c575] [--out docs]

A closed mesh of one part, with hollows: nothing in it has to be repaired, so that both versions
have the same triangles to look at. Both run in processes of their own, which take turns; a time is
the least CPU time of all rounds, each at another pose. Results are counted: both have as many.
Writes a table into meshes.md; 8a3c575 is the last commit before meshes meant solids.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import tempfile
import textwrap

import numpy as np
from numpy.typing import NDArray

from benchmarks.earlier_sources import ROOT, sources_of, Worker, worker
from benchmarks.machine import machine
from benchmarks.solids_speed import sphere

__all__ = ["QUERIES", "bumpy_ball", "least_times", "rows_of"]

FloatArray = NDArray[np.float64]
Found = dict[str, tuple[float, int]]
"""Of each query the least CPU seconds, and how many rows it returned in all rounds."""

_START, _END = "<!-- measured: queries -->", "<!-- end of queries -->"
_RINGS = 50
"""Of the mesh: 9800 triangles."""

QUERIES = {
    "points": "2000 points of a mesh",
    "distances": "distances of 200 boxes from a mesh",
    "penetrations": "penetrations of 200 boxes and a mesh",
    "meshes": "distances of 8 meshes from a mesh",
    "surfaces": "contact surfaces of 200 compliant boxes and a mesh",
}

_WORKER = """
import sys, time
import numpy as np
from scene_graph_ros.geometry import *
given = np.load(sys.argv[1])
triangles = Mesh(vertices=given["vertices"], faces=given["faces"])

def properties():
    result = ProximityProperties()
    result.add_property("mesh", "representation", "triangles")
    return result

def world(others, kind):
    graph = SceneGraph()
    source = graph.register_source("one")
    frame = graph.register_frame(source, GeometryFrame("mesh"))
    for k, (X, shape) in enumerate(others):
        id_ = graph.register_anchored_geometry(source, GeometryInstance(X, shape, f"other{k}"))
        own = properties()
        if kind == "surfaces":
            add_compliant_hydroelastic_properties(own, 0.1, 1e5)
        graph.assign_role(source, id_, own)
    id_ = graph.register_geometry(source, frame, GeometryInstance(np.eye(4), triangles, "mesh"))
    own = properties()
    if kind == "surfaces":
        add_rigid_hydroelastic_properties(own, 0.1)
    graph.assign_role(source, id_, own)
    context = graph.create_default_context()
    return graph.query_object(context), context, source, frame

def asked(kind, query):
    if kind == "points":
        return query.compute_signed_distance_to_points(given["points"])
    if kind == "penetrations":
        return query.compute_point_pair_penetration()
    if kind == "surfaces":
        return query.compute_contact_surfaces("triangle")
    return query.compute_signed_distance_pairwise_closest_points(0.3)

boxes = [(X, Box(*sizes)) for X, sizes in zip(given["places"], given["sizes"])]
worlds = {}
for line in sys.stdin:
    kind, k = line.split()
    if kind not in worlds:
        others = [] if kind == "points" else boxes
        if kind == "meshes":
            others = [(X, triangles) for X in given["around"]]
        worlds[kind] = world(others, kind)
    query, context, source, frame = worlds[kind]
    context.set_frame_poses(source, {frame: given["poses"][int(k)]})
    start = time.process_time()
    found = asked(kind, query)
    print(time.process_time() - start, len(found), flush=True)
"""
"""Answers the word of a query and the number of a pose by CPU seconds and a number of rows."""


def bumpy_ball(rings: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return a ball with bumps and hollows, metres: vertices (v, 3) and triangles (m, 3)."""
    points, faces = sphere(rings, 1.0, np.zeros(3))
    radius = 0.5 + 0.1 * np.sin(5.0 * points[:, 0]) * np.cos(4.0 * points[:, 1] + points[:, 2])
    return radius[:, None] * points, faces


def _turned(rng: np.random.Generator, at: FloatArray) -> FloatArray:
    X = np.eye(4)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    X[:3, :3] = axes * np.sign(np.linalg.det(axes))
    X[:3, 3] = at
    return X


def _write(path: Path, rounds: int) -> None:
    rng = np.random.default_rng(7)
    vertices, faces = bumpy_ball(_RINGS)
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    np.savez(
        path,
        vertices=vertices,
        faces=faces,
        points=rng.uniform(-0.8, 0.8, (2000, 3)),
        places=[_turned(rng, d * rng.uniform(0.4, 0.9)) for d in directions],
        sizes=rng.uniform(0.05, 0.2, (200, 3)),
        around=[_turned(rng, 1.35 * d) for d in directions[:8]],
        poses=[_turned(rng, rng.uniform(-0.02, 0.02, 3)) for _ in range(rounds + 1)],
    )


def least_times(workers: list[Worker], rounds: int, queries: list[str]) -> list[Found]:
    """Return the times of each worker and query, in turns; the first round warms up."""
    found: list[Found] = [{} for _ in workers]
    for name in queries:
        for k in range(rounds + 1):
            # Now the one goes first, now the other.
            for w in range(len(workers))[:: 1 if k % 2 else -1]:
                seconds, count = workers[w].ask(f"{name} {k}").split()
                least, total = found[w].get(name, (np.inf, 0))
                if k:
                    found[w][name] = min(least, float(seconds)), total + int(count)
    return found


def rows_of(found: list[Found], rounds: int) -> list[str]:
    """Return the lines of a table of the earlier version, if there is one, and this one."""
    lines = ["| query | ms | before | ratio | rows |", "| --- | ---: | ---: | ---: | ---: |"]
    for name, (seconds, count) in found[0].items():
        before = found[1][name] if len(found) > 1 else None
        rows = f"{count / rounds:.0f}"
        if before is not None and before[1] != count:
            rows = f"{rows} (before {before[1] / rounds:.0f})"
        old = (
            ("", "")
            if before is None
            else (f"{1e3 * before[0]:.2f}", f"{seconds / before[0]:.2f}")
        )
        lines.append(f"| {QUERIES[name]} | {1e3 * seconds:.2f} | {old[0]} | {old[1]} | {rows} |")
    return lines


def main() -> None:
    """Print the times, and write them down."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.mesh_queries",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--before", default=None, metavar="COMMIT", help="an earlier version")
    parser.add_argument("--out", type=Path, default=None, help="folder of the page to write to")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "scene.npz"
        _write(data, options.rounds)
        with worker(_WORKER, ROOT, str(data)) as now:
            if options.before is None:
                found = least_times([now], options.rounds, list(QUERIES))
            else:
                with (
                    sources_of(options.before) as sources,
                    worker(_WORKER, sources, str(data)) as before,
                ):
                    found = least_times([now, before], options.rounds, list(QUERIES))
    lines = rows_of(found, options.rounds)
    print("\n".join(lines))
    if options.out is None:
        return
    page = options.out / "meshes.md"
    before_it, _, rest = page.read_text().partition(_START)
    after = rest.partition(_END)[2]
    told = "\n".join(["", "", textwrap.fill(machine(load).strip(), 99), "", *lines, "", ""])
    page.write_text(before_it + _START + told + _END + after)


if __name__ == "__main__":
    main()

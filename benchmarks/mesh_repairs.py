"""What repairing and uniting a mesh costs in time, and how exact its distances then are.

    python -m benchmarks.mesh_repairs [--quick] [--out docs]

Meshes of boxes, whose distances are known, of some hundred triangles and more, with faults of each
kind, and meshes with gaps read with one tolerance after another. Writes mesh_repairs.csv and
mesh_repairs.png, and the largest mesh of each kind into meshes.md. Times are the processor's, the
least of two; nothing is read that was kept of an earlier run.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import csv
from functools import partial
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import Any, NamedTuple

from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import machine
from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.surfaces import build_surface
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.shapes.mesh_shape import REPAIR_TOLERANCE
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

sys.path.insert(0, str(Path(__file__).parents[1] / "test" / "support"))
from boxes_in_one_mesh import Boxes  # type: ignore[import-not-found]

__all__ = [
    "GAPS",
    "KINDS",
    "Row",
    "main",
    "measure",
    "table_of",
    "table_of_tolerances",
    "write",
]

_DOCS = Path(__file__).parents[1] / "docs"
_START, _END = "<!-- measured: repairs -->", "<!-- end -->"
_SIZES = (500, 5_000, 30_000)
_POINTS = 2000
_ROUNDS = 2
_TOLERANCES = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
_OF_TOLERANCES = 5_000
"""Triangles of the meshes that are read with each tolerance."""

FloatArray = NDArray[np.float64]
Faulty = tuple[FloatArray, NDArray[np.int64]]


class Row(NamedTuple):
    """What was measured of one mesh."""

    kind: str
    triangles: int
    reading: float
    """Seconds from arrays to a surface with its tree."""
    error: float
    """The largest error of a distance, relative to the size."""
    query: float
    """Seconds of a point's distance."""
    tolerance: float
    """``("mesh", "repair_tolerance")``."""
    is_closed: bool
    """Whether the mesh is a solid by its report."""


def _grid(case: Any, cells: int) -> Faulty:
    """Return the triangles of boxes with each side cut into cells x cells squares."""
    points, faces, start = [], [], 0
    steps = np.linspace(0.0, 1.0, cells + 1)
    u, v = (a.ravel() for a in np.meshgrid(steps, steps, indexing="ij"))
    i, j = (a.ravel() for a in np.meshgrid(range(cells), range(cells), indexing="ij"))
    corner = i * (cells + 1) + j
    quads = np.stack([corner, corner + cells + 1, corner + cells + 2, corner + 1], axis=1)
    flat = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    for number, (lower, upper) in enumerate(case.boxes):
        for axis in range(3):
            for side in (0, 1):
                unit = np.zeros((len(u), 3))
                unit[:, axis], unit[:, (axis + 1) % 3], unit[:, (axis + 2) % 3] = side, u, v
                points.append(lower + unit * (upper - lower))
                is_turned = (side == 0) != (number in case.hollow)
                faces.append((flat[:, ::-1] if is_turned else flat) + start)
                start += len(u)
    return case.placed(np.vstack(points)), np.vstack(faces)


def _as_it_is(rng: Any, mesh: Faulty) -> Faulty:
    return mesh


def _shuffled(rng: Any, mesh: Faulty) -> Faulty:
    vertices, faces = mesh
    turned = rng.random(len(faces)) < 0.5
    return vertices, np.where(turned[:, None], faces[:, ::-1], faces)


def _with_seams(rng: Any, mesh: Faulty, by: float = 6e-8) -> Faulty:
    """Give each triangle vertices of its own, off by rounding to 32 bits or ``by``, relative."""
    corners = mesh[0][mesh[1]].reshape(-1, 3)
    noise = 1.0 + rng.uniform(-by, by, corners.shape)
    return corners * noise, np.arange(len(corners)).reshape(-1, 3)


def _doubled(rng: Any, mesh: Faulty) -> Faulty:
    vertices, faces = mesh
    again = faces[rng.integers(len(faces), size=1 + len(faces) // 100)]
    return vertices, np.concatenate([again[:, ::-1], faces])


def _with_t_vertices(rng: Any, mesh: Faulty) -> Faulty:
    """Cut one in a hundred triangles at the middle of a side, and not its neighbour."""
    vertices, faces = mesh
    chosen = rng.permutation(len(faces))[: 1 + len(faces) // 100]
    a, b, c = faces[chosen].T
    new = len(vertices) + np.arange(len(chosen))
    points = 0.5 * (vertices[a] + vertices[b])
    halves = [np.stack([a, new, c], axis=1), np.stack([new, b, c], axis=1)]
    rest = np.delete(faces, chosen, axis=0)
    return np.concatenate([vertices, points]), np.concatenate([rest, *halves])


_TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
_ONE = [((0, 0, 0), (1, 0.7, 0.6))]
_ROW = [((0.8 * k, 0.03 * k, 0.02 * k), (0.8 * k + 1, 1 + 0.03 * k, 1)) for k in range(20)]
_SHELLS = [((k, k, k), (10 - k, 10 - k, 10 - k)) for k in (0, 1, 2, 3)]

KINDS: dict[str, tuple[Any, Callable[[Any, Faulty], Faulty]]] = {
    "one closed part, as it is": (Boxes(*_ONE, R=_TURN), _as_it_is),
    "half of the triangles turned": (Boxes(*_ONE, R=_TURN), _shuffled),
    "doubled triangles, 1 %": (Boxes(*_ONE, R=_TURN), _doubled),
    "T vertices, 1 %": (Boxes(*_ONE, R=_TURN), _with_t_vertices),
    "seams of 32 bits": (Boxes(*_ONE, R=_TURN), _with_seams),
    "2 parts that overlap": (Boxes(*_ROW[:2], R=_TURN), _as_it_is),
    "20 parts that overlap": (Boxes(*_ROW, R=_TURN), _as_it_is),
    "4 shells, two hollow": (Boxes(*_SHELLS, hollow=[1, 3], R=_TURN), _as_it_is),
}
"""Boxes, and what is done to their triangles."""


GAPS: dict[str, tuple[Any, Callable[[Any, Faulty], Faulty]]] = {
    "seams of 32 bits": KINDS["seams of 32 bits"],
    "seams of 5e-6": (Boxes(*_ONE, R=_TURN), partial(_with_seams, by=5e-6)),
    "a slit of 5e-6": (Boxes(_ONE[0], ((1 + 1e-5, 0.1, 0.1), (2, 0.5, 0.5)), R=_TURN), _as_it_is),
}
"""The same with gaps of a width, as a part of the size, that some tolerances close."""

_PRESSED = {"a slit of 5e-6": Boxes(_ONE[0], ((1, 0.1, 0.1), (2, 0.5, 0.5)), R=_TURN)}
"""What is meant where the report says that a slit was pressed together."""


def measure(kind: str, triangles: int, tolerance: float = REPAIR_TOLERANCE) -> Row:
    """Measure a mesh of a kind, of about as many triangles, with a tolerance of its repair."""
    case, spoil = (KINDS | GAPS)[kind]
    cells = max(1, round((triangles / (12 * len(case.boxes))) ** 0.5))
    vertices, faces = spoil(np.random.default_rng(1), _grid(case, cells))
    seconds = []
    for turn in range(_ROUNDS):
        with tempfile.TemporaryDirectory() as empty:
            os.environ["SCENE_GRAPH_ROS_MESH_CACHE"] = empty
            start = time.process_time()
            surface = build_surface(
                vertices, np.roll(faces, turn, axis=0), name=kind, repair_tolerance=tolerance
            )
            seconds.append(time.process_time() - start)
    if any(repair.kind.startswith("slits") for repair in surface.report.repairs):
        case = _PRESSED.get(kind, case)
    rng, (lower, upper) = np.random.default_rng(2), case.reach
    points = rng.uniform(lower - 0.1, upper + 0.1, (_POINTS, 3))
    mesh = Mesh(vertices=vertices, faces=faces).with_repair_tolerance(tolerance)
    table = build_shape_table([mesh], [True])
    ask = [np.eye(4)[None].copy(), case.placed(points), np.inf]
    distance_points(table, *ask)
    start = time.process_time()
    found = distance_points(table, *ask)[2]
    query = (time.process_time() - start) / _POINTS
    size = float(np.ptp(vertices, axis=0).max())
    error = float(np.abs(found - case.distances(points)).max()) / size
    is_closed = surface.report.is_closed
    return Row(kind, len(faces), min(seconds), error, query, tolerance, is_closed)


def table_of(rows: list[Row]) -> list[str]:
    """Return the lines of a table, times relative to the mesh of one part as it is."""
    lines = [
        "| mesh | triangles | reading (ms) | of one part's | error / size | a point (µs) |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    plain = {r.triangles // 500: r.reading for r in rows if r.kind == next(iter(KINDS))}
    for row in rows:
        nearest = min(plain, key=lambda k, row=row: abs(k - row.triangles // 500))
        lines.append(
            f"| {row.kind} | {row.triangles} | {1e3 * row.reading:.3g} |"
            f" {row.reading / plain[nearest]:.2g} | {row.error:.0e} | {1e6 * row.query:.2g} |"
        )
    return lines


def table_of_tolerances(rows: list[Row]) -> list[str]:
    """Return the lines of a table of meshes that were read with several tolerances."""
    lines = [
        "| mesh | `repair_tolerance` | solid | reading (ms) | error / size |",
        "| --- | ---: | --- | ---: | ---: |",
    ]
    lines += [
        f"| {row.kind} | {row.tolerance:.0e} | {'yes' if row.is_closed else 'no'} |"
        f" {1e3 * row.reading:.3g} | {row.error:.0e} |"
        for row in rows
    ]
    return lines


def write(rows: list[Row], path: Path) -> None:
    """Write rows as a file for programs."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row._fields)
        for row in rows:
            writer.writerow([f"{v:.3g}" if isinstance(v, float) else v for v in row])


def _draw_tolerances(axes: Any, rows: list[Row]) -> None:
    """Plot errors against times, a line for each mesh; full marks are solids."""
    for kind in GAPS:
        own = [row for row in rows if row.kind == kind]
        times = [1e3 * row.reading for row in own]
        (line,) = axes.plot(times, [row.error for row in own], linewidth=1.0, label=kind)
        for row, x in zip(own, times, strict=True):
            face = line.get_color() if row.is_closed else "white"
            axes.plot(x, row.error, marker="o", color=line.get_color(), markerfacecolor=face)
        for row, x in ((own[0], times[0]), (own[-1], times[-1])):
            axes.annotate(
                f"{row.tolerance:.0e}",
                (x, row.error),
                textcoords="offset points",
                xytext=(5, 4),
                fontsize=7,
            )
    axes.set(xscale="log", yscale="log", xlabel="reading (ms), by tolerance")
    axes.set_title("meshes with gaps, read with tolerances from 1e-9 to 1e-3", fontsize=10)
    axes.legend(fontsize=8, title="filled: a solid", title_fontsize=8)
    axes.grid(visible=True, alpha=0.3)


def draw(rows: list[Row], of_tolerances: list[Row], picture: Path) -> None:
    """Plot errors against times, a line for each kind of mesh."""
    figure = Figure(figsize=(13.0, 5.0), layout="constrained")
    axes, beside = figure.subplots(1, 2)
    _draw_tolerances(beside, of_tolerances)
    for kind in KINDS:
        own = [row for row in rows if row.kind == kind]
        style = {"marker": "o", "markersize": 5, "linewidth": 1.0}
        axes.plot(
            [1e3 * r.reading for r in own], [max(r.error, 1e-17) for r in own], label=kind, **style
        )
    axes.set(xscale="log", yscale="log", xlabel="reading (ms), by size", ylabel="error / size")
    axes.axhline(1e-12, color="black", linewidth=0.8, linestyle=":")
    axes.text(axes.get_xlim()[0], 1.2e-12, " promised", va="bottom", fontsize=8)
    axes.set_title("largest error of a distance against the time of reading", fontsize=10)
    axes.grid(visible=True, alpha=0.3)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    figure.savefig(picture, dpi=100)


def main() -> None:
    """Measure all kinds and write them down."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mesh_repairs", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small meshes; print only")
    parser.add_argument("--out", type=Path, default=_DOCS)
    options = parser.parse_args()
    load = os.getloadavg()[0]
    sizes = _SIZES[:1] if options.quick else _SIZES
    rows = []
    for kind in KINDS:
        for size in sizes:
            rows.append(measure(kind, size))
            print(f"{rows[-1].kind}, {rows[-1].triangles}: {rows[-1].reading:.3g} s", flush=True)
    count = sizes[0] if options.quick else _OF_TOLERANCES
    of_tolerances = [measure(kind, count, tolerance) for kind in GAPS for tolerance in _TOLERANCES]
    print("\n".join(["", *table_of(rows), "", *table_of_tolerances(of_tolerances)]))
    if options.quick:
        return
    write([*rows, *of_tolerances], options.out / "mesh_repairs.csv")
    draw(rows, of_tolerances, options.out / "mesh_repairs.png")
    page = options.out / "meshes.md"
    before, _, rest = page.read_text().partition(_START)
    after = rest.partition(_END)[2]
    largest = table_of([row for row in rows if row.triangles > _SIZES[1] * 2])
    told = "\n".join(["", "", machine(load).strip(), "", *largest, "", ""])
    page.write_text(before + _START + told + _END + after)


if __name__ == "__main__":
    main()

"""What voxels cost, and what their size costs: ``python -m benchmarks.voxels --picture file.png``.

A Panda among boxes. A voxel is occupied where it meets a box; answers about random configurations
are compared with those of the boxes: false collisions among the free ones, and collisions that are
missed. Build, memory, configurations in a batch and edges of 1.25 rad are timed. Coal's octree of
voxels of the same size, which has points on the faces of the boxes, is built and asked about, body
by body, where it is installed. Then an image of 640 x 480 depths fills a grid, and maps are read
as messages have them. Times are of the processor, the least of some calls.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks import clouds
from benchmarks.machine import machine
from msg_adapters.voxel_maps import octomap_data, voxels_from_octomap
from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, VoxelGrid
from scene_graph_ros.geometry.perception import CameraIntrinsics
from scene_graph_ros.geometry.tables.voxel_bits import place_voxels
from scene_graph_ros.sensing import DepthRules, DepthView, voxels_after
from scene_graph_ros.sensing.voxel_resampling import resampled_states

__all__ = ["main"]

_EDGES = (0.01, 0.02, 0.04, 0.08)
"""m of a voxel."""
_CONFIGURATIONS, _MOST_EDGES, _OF_COAL, _REPEATS = 20_000, 300, 200, 3
_LENGTH, _MARGIN = 1.25, 0.1
_IMAGE = (480, 640)
_GRIDS = ((150, 0.02), (300, 0.01))
"""Voxels along each edge of the grids that an image fills, and their edges, m."""
_ROOM = 200
"""Voxels along two sides of a room that maps show."""


class _Row(NamedTuple):
    """Voxel, m; how many; ms and MB; shares of false and missed; us; us and ms of Coal."""

    voxel: float
    count: int
    build: float
    size: float
    false: float
    missed: float
    time: float
    edge: float
    coal_time: float
    coal_build: float


def occupancy_of_boxes(voxel: float) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return the states of voxels that meet the boxes, or are free, and the grid's corner, m."""
    centers, sizes = (np.array(column) for column in zip(*clouds.BOXES, strict=True))
    lower = (centers - 0.5 * sizes).min(axis=0) - _MARGIN
    counts = np.ceil(((centers + 0.5 * sizes).max(axis=0) + _MARGIN - lower) / voxel).astype(int)
    states = np.zeros(counts, np.uint8)
    for center, size in zip(centers, sizes, strict=True):
        first = np.floor((center - 0.5 * size - lower) / voxel).astype(int)
        last = np.floor((center + 0.5 * size - lower) / voxel).astype(int)
        states[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))] = 1
    return states, lower


def checker_of(voxel: float) -> Any:
    """Return the checker of a Panda in the voxels of that size."""
    states, lower = occupancy_of_boxes(voxel)
    X = np.eye(4)
    X[:3, 3] = lower
    grid = GeometryInstance(X, VoxelGrid(states, voxel), "map")
    grid.set_proximity_properties(ProximityProperties())
    return clouds.checker_of(None, more=(grid,))


def _rows() -> list[_Row]:
    truth = clouds.checker_of(None, boxes=True)
    tree = truth.plan.tree
    q = tree.sample(np.random.default_rng(1), _CONFIGURATIONS)
    is_free = truth.check_configs_collision_free(q)
    edges = clouds.edges_from(tree, q[is_free][:_MOST_EDGES])
    rows = []
    for voxel in _EDGES:
        states, _ = occupancy_of_boxes(voxel)
        solid = states != 0
        build = clouds.least(lambda s=solid, v=voxel: place_voxels(s, v), _REPEATS)
        bits = place_voxels(solid, voxel).bits.words.nbytes
        checker = checker_of(voxel)
        found = checker.check_configs_collision_free(q)
        some = q[:2000]
        time = clouds.least(lambda c=checker, q=some: c.check_configs_collision_free(q), _REPEATS)
        edge = clouds.least(lambda c=checker: c.check_edges_collision_free(edges), 1)
        coal_time, coal_build = clouds.coal_octree(_points_of(voxel), voxel, q[:_OF_COAL])
        rows.append(
            _Row(
                voxel,
                int(np.count_nonzero(solid)),
                1e3 * build,
                1e-6 * (bits + states.nbytes),
                float((~found & is_free).sum() / is_free.sum()),
                float((found & ~is_free).sum() / (~is_free).sum()),
                1e6 * time / len(some),
                1e6 * edge / len(edges),
                coal_time,
                coal_build,
            )
        )
    return rows


def _points_of(voxel: float) -> NDArray[np.float64]:
    """Return the middles of the occupied voxels: Coal's octree of these has the same."""
    states, lower = occupancy_of_boxes(voxel)
    result: NDArray[np.float64] = (np.argwhere(states != 0) + 0.5) * voxel + lower
    return result


def _draw(rows: Sequence[_Row], path: Path) -> None:
    """Draw false collisions and times. Raises ImportError without matplotlib."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    sizes = [1e3 * row.voxel for row in rows]
    left.plot(sizes, [1e2 * row.false for row in rows], "o-", label="false")
    left.plot(sizes, [1e2 * row.missed for row in rows], "x:", label="missed")
    right.plot(sizes, [row.time for row in rows], "o-", label="a configuration")
    right.plot(sizes, [row.edge for row in rows], "s-", label="a proven edge of 1.25 rad")
    if all(np.isfinite(row.coal_time) for row in rows):
        right.plot(sizes, [row.coal_time for row in rows], "x:", label="a configuration, Coal")
    right.set(yscale="log")
    for axes, name in ((left, "share of configurations, %"), (right, "time, µs")):
        axes.set(xscale="log", xlabel="edge of a voxel, mm", ylabel=name)
        axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    figure.savefig(path, dpi=110)


def image_rows() -> list[str]:
    """Return rows of an image that fills grids: voxels, edge, ms of the first and later ones."""
    rng = np.random.default_rng(0)
    height, width = _IMAGE
    focal = 600.0 / 640.0 * width
    lens = CameraIntrinsics(width, height, focal, focal, 0.5 * width - 0.5, 0.5 * height - 0.5)
    depth = np.full(_IMAGE, 2.0, np.float32)
    depth[height // 3 :, width // 3 : 2 * width // 3] = 1.0
    depth += rng.normal(0.0, 1e-3, _IMAGE).astype(np.float32)
    view = DepthView.of(depth, lens, np.eye(4), DepthRules())
    rows = []
    for count, voxel in _GRIDS:
        X_WG = np.eye(4)
        X_WG[:3, 3] = (-0.5 * count * voxel, -0.5 * count * voxel, 0.0)
        unknown = np.full((count, count, count), 2, np.uint8)
        known, counted = voxels_after(unknown, voxel, X_WG, view)
        times = [
            1e3 * clouds.least(lambda s=s, v=voxel, X=X_WG: voxels_after(s, v, X, view), _REPEATS)
            for s in (unknown, known)
        ]
        rows.append(
            f"| {count}³ | {1e3 * voxel:.0f} | {counted.freed} | {counted.hit} | {times[0]:.0f} |"
            f" {times[1]:.0f} |"
        )
    return rows


def map_rows() -> list[str]:
    """Return rows of maps of a room of 10 x 10 x 2.3 m in voxels of 5 cm: ms to read each."""
    rng, n = np.random.default_rng(0), _ROOM
    states = np.full((n, n, 46), 2, np.uint8)
    states[:, :, 4], states[:, :, 5:] = 1, 0
    states[rng.integers(0, n, 10_000), rng.integers(0, n, 10_000), rng.integers(5, 46, 10_000)] = 1
    grid, rows = VoxelGrid(states, 0.05), []
    for name, is_binary in (("binary octree", True), ("full octree", False)):
        data = np.array(octomap_data(grid, np.eye(4), binary=is_binary), np.int8)
        message = SimpleNamespace(data=data, binary=is_binary, resolution=0.05, id="OcTree")
        read = clouds.least(lambda m=message: voxels_from_octomap(m), _REPEATS)
        rows.append(f"| {name} | {len(data)} | {1e3 * read:.1f} |")
    shifted = np.eye(4)
    shifted[:3, 3] = 0.02
    turned = shifted.copy()
    turned[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    for name, X in (
        ("voxels that coincide", np.eye(4)),
        ("voxels that are shifted", shifted),
        ("voxels that are turned", turned),
    ):
        ask: Callable[[], Any] = lambda X=X: resampled_states(  # noqa: E731
            states, (0.05,) * 3, X, states.shape, 0.05
        )
        rows.append(f"| into {name} | {states.size} | {1e3 * clouds.least(ask, _REPEATS):.1f} |")
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, help="a file for the picture (PNG)")
    chosen = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    print(
        "| voxel mm | occupied | build ms | MB | false collisions % | missed % | configuration µs"
        " | edge µs | Coal's octree: build ms | configuration µs |"
    )
    print("| ---: " * 10 + "|")
    rows = _rows()
    for row in rows:
        print(
            f"| {1e3 * row.voxel:.0f} | {row.count} | {row.build:.1f} | {row.size:.2f} |"
            f" {1e2 * row.false:.2f} | {1e2 * row.missed:.2f} | {row.time:.2f} | {row.edge:.1f} |"
            f" {row.coal_build:.1f} | {row.coal_time:.0f} |",
            flush=True,
        )
    print("\n| grid | voxel mm | freed | hit | first image ms | next ms |")
    print("| ---: " * 6 + "|", *image_rows(), sep="\n", flush=True)
    print("\n| map | bytes or voxels | ms |")
    print("| --- | ---: | ---: |", *map_rows(), sep="\n")
    if chosen.picture is not None:
        _draw(rows, chosen.picture)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

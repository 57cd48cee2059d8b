"""What docs/accuracy.csv states of every pair and tier is true, and not out of date.

The truths are constructed (``benchmarks.accuracy.constructions``), the configurations those that
the table was made from.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import heat_map, report
from benchmarks.accuracy.bodies import KINDS, size
from benchmarks.accuracy.constructions import KnownPair
from benchmarks.accuracy.engines.ours import copied, Ours, Scene
from benchmarks.accuracy.measure import APART, DEEP, LEAST_STATED, OUR_TIERS, Row, Task, tasks
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.accuracy import Accuracy

DOCS = Path(__file__).parents[2] / "docs"

OUT_OF_DATE = 100.0
"""The table states 4 to 40 times the error that was measured."""

ENOUGH = 1e-3
"""Metres that a distance may be too large without being left out: more than any tier's error."""

ROUNDING = 1e-12
"""Relative to the pair's size."""

PAIRS = [
    (a, b) for k, a in enumerate(KINDS) for b in KINDS[k:] if (a, b) != ("HalfSpace", "HalfSpace")
]


@functools.cache
def table() -> dict[tuple[str, str, str, float, str], Row]:
    """Return the published rows of our tiers."""
    rows = report.read(DOCS / "accuracy.csv")
    return {
        (row.query, row.shape_1, row.shape_2, row.distance_m, row.engine): row
        for row in rows
        if row.engine in OUR_TIERS
    }


def sizes(pairs: list[KnownPair]) -> np.ndarray:
    """Return each pair's L, the size of its larger shape."""
    return np.array([max(size(pair.shape_A), size(pair.shape_B)) for pair in pairs])


def check_stated(task: Task, engine: str, errors: np.ndarray) -> None:
    """Assert that the table states what was measured: no larger, nor much smaller errors."""
    row = table()[task.query, task.shape_1, task.shape_2, task.distance, engine]
    worst = float(errors.max())
    assert worst <= row.stated_m, f"{row}: the error is {worst:.1e}"
    if row.stated_m > LEAST_STATED:
        assert worst >= row.stated_m / OUT_OF_DATE, f"{row} is out of date: {worst:.1e}"


def configurations(task: Task) -> list[KnownPair]:
    """Return those of the table."""
    return task.configurations(report.COUNT, report.SEED)


@pytest.mark.parametrize("distance", APART)
@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_distance_of_separated_pairs(kinds: tuple[str, str], distance: float) -> None:
    """Each tier keeps its promise and the table's, its identity and its certificate."""
    task = Task("distance", *kinds, distance)
    pairs = copied(configurations(task))
    scene, L = Scene.of_pairs(SceneGraph(), pairs), sizes(pairs)
    for tier in Accuracy:
        ask = scene.query.compute_signed_distance_pairwise_closest_points
        found = ask(distance + ENOUGH, accuracy=tier, certificate=True)
        assert len(found) == len(pairs)
        errors = np.abs(scene.by_pair(found, found.distance) - distance)
        assert (errors <= tier.bound * L).all()
        gap = scene.by_pair(found, found.gap)
        assert (errors <= gap + ROUNDING * L).all()
        assert (gap <= 1.01 * tier.bound * L + ROUNDING * L).all()
        check_stated(task, tier.value, errors)


@pytest.mark.parametrize("distance", APART)
@pytest.mark.parametrize("kinds", [pair for pair in PAIRS if "Mesh" in pair], ids="-".join)
def test_distance_to_triangles(kinds: tuple[str, str], distance: float) -> None:
    """Meshes that are measured by their triangles keep the promise of each tier, too.

    The sites are no part of the pit, so the hulls' distance is that of the triangles.
    """
    pairs = configurations(Task("distance", *kinds, distance))
    scene, L = Scene.of_pairs(SceneGraph(), pairs, meshes="triangles"), sizes(pairs)
    for tier in Accuracy:
        ask = scene.query.compute_signed_distance_pairwise_closest_points
        found = ask(distance + ENOUGH, accuracy=tier)
        errors = np.abs(scene.by_pair(found, found.distance) - distance)
        assert (errors <= tier.bound * L).all()


@pytest.mark.parametrize("distance", DEEP)
@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_depth_of_penetrating_pairs(kinds: tuple[str, str], distance: float) -> None:
    """Each tier keeps its promise and the table's, in both queries; all find the same pairs."""
    task, twin = (Task(query, *kinds, distance) for query in ("distance", "penetration"))
    pairs = copied(configurations(task))
    scene, L = Scene.of_pairs(SceneGraph(), pairs), sizes(pairs)
    for tier in Accuracy:
        found = scene.query.compute_point_pair_penetration(accuracy=tier, certificate=True)
        assert len(found) == len(pairs)
        identity = found.p_WCa - found.p_WCb + found.depth[:, None] * found.nhat_BA_W
        assert np.linalg.norm(identity, axis=1).max() <= ROUNDING * L.max()
        errors = np.abs(scene.by_pair(found, -found.depth) - distance)
        assert (errors <= tier.bound * L).all()
        check_stated(twin, tier.value, errors)
        ask = scene.query.compute_signed_distance_pairwise_closest_points
        distances = ask(0.0, accuracy=tier)
        np.testing.assert_array_equal(distances.distance, -found.depth)
        check_stated(task, tier.value, errors)


@pytest.mark.parametrize("distance", [*APART, *DEEP])
@pytest.mark.parametrize("kind", KINDS)
def test_distance_of_points(kind: str, distance: float) -> None:
    """Points are measured exactly whatever the tier, as the table states."""
    task = Task("point", kind, "Point", distance)
    points = configurations(task)
    errors = np.abs(Ours(Accuracy.QUICK).points(points).distances - distance)
    L = np.array([size(point.shape) for point in points])
    assert (errors <= Accuracy.EXACT.bound * np.where(L > 0.0, L, 0.2)).all()
    for tier in OUR_TIERS:
        check_stated(task, tier, errors)


def test_table_is_complete() -> None:
    """Every query, pair, distance and tier has its row, from the configurations used here."""
    wanted = {
        (task.query, task.shape_1, task.shape_2, task.distance, tier)
        for task in tasks()
        for tier in OUR_TIERS
    }
    measured = {key for key, row in table().items() if not math.isnan(row.stated_m)}
    assert measured == wanted
    assert all(table()[key].count == report.COUNT for key in wanted)


def test_page_shows_what_the_table_says() -> None:
    """docs/accuracy.md is made from docs/accuracy.csv."""
    rows = report.read(DOCS / "accuracy.csv")
    assert (DOCS / "accuracy.md").read_text() == report.page(rows)


def test_peers_were_measured() -> None:
    """The columns beside ours are there: each engine answered for most pairs."""
    rows = report.read(DOCS / "accuracy.csv")
    for engine in ("Drake", "Coal", "FCL", "MuJoCo"):
        mine = [r for r in rows if (r.engine, r.query, r.distance_m) == (engine, "distance", 2e-3)]
        assert len(mine) == len(PAIRS)
        assert sum(math.isfinite(row.worst_error_m) for row in mine) > 0.7 * len(PAIRS)


def test_the_map_shows_the_worst_of_all_distances() -> None:
    """On either side of contact by itself; what is refused at one distance has no colour."""
    errors = {1e-6: 3e-9, 0.1: 2e-7, -2e-3: 5e-4, -2e-2: math.nan}
    rows = [
        Row("distance", "Box", "Mesh", distance, "Drake", 36, error, 0.0, math.nan, 1.0)
        for distance, error in errors.items()
    ]
    assert heat_map.worst_errors(rows, is_deep=False) == {("Box", "Mesh"): {"Drake": 2e-7}}
    refused = heat_map.worst_errors(rows, is_deep=True)["Box", "Mesh"]["Drake"]
    assert math.isnan(refused)

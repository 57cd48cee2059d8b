"""What decides pairs, counted; run it to write the tables of docs/narrowphase.md anew.

``python test/support/deciding.py`` counts over the benchmark's scenes and over the hard corpus,
each in a process of its own: BLAS computes poses that touch to rounding, and those of its kernels
that every processor runs round them alike. ``--count NAME`` prints one count.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import json
import os
from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).parents[2]
if __name__ == "__main__":
    sys.path[:0] = [str(ROOT)]

from hard_corpus.adversarial import adversarial_cases, case_from_text, KEPT, mesh_cases  # noqa: E402
from hard_corpus.batches import solve, swapped, table_of  # noqa: E402
from hard_corpus.constructed import constructed, random_pose  # noqa: E402
from hard_corpus.extremes import concentric_cases, nearly_parallel_cases  # noqa: E402
import numpy as np  # noqa: E402

from benchmarks.speed import make_scenes  # noqa: E402
from benchmarks.speed.engines.ours import Ours  # noqa: E402
from benchmarks.speed.rows import MAX_DISTANCE  # noqa: E402
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism  # noqa: E402
from scene_graph_ros.geometry.shapes.kinds import ShapeKind  # noqa: E402
from scene_graph_ros.geometry.tables.hull_blocks import SCAN_LIMIT  # noqa: E402

__all__ = ["COUNTED", "PAGE", "corpus", "count_apart", "read", "scenes", "shares", "table"]

PAGE = ROOT / "docs" / "narrowphase.md"

Pair = tuple[str, str]
Counts = dict[Pair, Counter[Mechanism]]
"""How many pairs of two kinds each mechanism decided."""

LARGE_HULL = "large hull"
TRIANGLES = "triangles"
KINDS = [kind.name.lower().replace("_", " ") for kind in ShapeKind if kind < ShapeKind.CONVEX]
KINDS += ["hull", LARGE_HULL, TRIANGLES]

SEED = 11
SETS_ASKED = (0, 4)
"""Of the poses of a scene."""


def _kind_of(tables, row):
    """Return what a row of a shape table is to the narrow phase, a name of KINDS."""
    kind = ShapeKind(int(tables.kind[row]))
    if kind < ShapeKind.CONVEX:
        return KINDS[kind]
    if tables.exact[row]:
        return TRIANGLES
    vertices = tables.hulls.blocks[tables.hulls.block_start[tables.hull[row]]]
    return "hull" if vertices <= SCAN_LIMIT else LARGE_HULL


def _add(counts, tables, rows, decided_by):
    kinds = [_kind_of(tables, row) for row in range(len(tables.kind))]
    for (i, j), mechanism in zip(rows, decided_by, strict=True):
        pair = tuple(sorted((kinds[i], kinds[j]), key=KINDS.index))
        counts.setdefault(pair, Counter())[Mechanism(int(mechanism))] += 1


def _made_scenes():
    yield make_scenes.mixed(1000, SEED)
    yield make_scenes.hulls(SEED, 200)
    yield make_scenes.pile(SEED)
    yield make_scenes.robots(SEED)


def scenes() -> Counts:
    """Count over the pairs nearer than 0.1 m in scenes of the speed benchmark, exact tier."""
    counts: Counts = {}
    for scene in _made_scenes():
        engine = Ours(scene)
        for k in SETS_ASKED:
            engine.move(k)
            found = engine.query.compute_signed_distance_pairwise_closest_points(
                MAX_DISTANCE, certificate=True
            )
            proximity = engine.query.snapshot.proximity
            ids = np.stack([found.id_A, found.id_B], axis=1)
            _add(counts, proximity.table, np.searchsorted(proximity.ids, ids), found.decided_by)
    return counts


def _hard_cases() -> Iterator[list]:
    """Yield what the tests of test/numerics ask about, or the like of it."""
    X_WA = random_pose(np.random.default_rng(SEED))
    for distance in (2e-3, 1e-9, 0.0, -1e-9, -2e-3, -2e-2):
        yield constructed(distance)
    for gap in (0.0, 1e-3, 1e-9, -1e-9, -1e-3):
        yield nearly_parallel_cases(gap, X_WA)
    yield concentric_cases(X_WA)
    kept = [case_from_text(json.loads(line)) for line in KEPT.read_text().splitlines()]
    yield kept
    yield swapped(kept)
    yield adversarial_cases(4000, 300_000)
    yield mesh_cases(1000, 300_000)


def corpus() -> Counts:
    """Count over the hard corpus, exact tier."""
    counts: Counts = {}
    for cases in _hard_cases():
        rows = np.arange(2 * len(cases)).reshape(-1, 2)
        _add(counts, table_of(cases), rows, solve(cases, certify=True).decided_by)
    return counts


COUNTED = {"benchmark scenes": scenes, "hard corpus": corpus}
"""What is counted, by the name of its table on the page."""

ALIKE = {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"}
"""What every processor runs; BLAS reads it when it is loaded."""


def count_apart(name: str) -> Counts:
    """Count in a process of its own, whose BLAS rounds as on any other machine."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "test")])
    done = subprocess.run(
        [sys.executable, __file__, "--count", name],
        env={**os.environ, **ALIKE, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    rows = json.loads(done.stdout)
    return {
        (first, second): Counter({Mechanism[word]: n for word, n in row.items()})
        for first, second, row in rows
    }


def _print_count(name: str) -> None:
    rows = [
        (*pair, {mechanism.name: n for mechanism, n in row.items()})
        for pair, row in COUNTED[name]().items()
    ]
    print(json.dumps(rows))


def shares(counts: Counts) -> dict[Pair, dict[str, float]]:
    """Return the percentages of each pair's mechanisms, the largest first."""
    pairs = sorted(counts, key=lambda pair: [KINDS.index(kind) for kind in pair])
    return {pair: _percent(counts[pair]) for pair in pairs}


def _percent(row):
    return {
        mechanism.name.lower().replace("_", " "): 100.0 * n / row.total()
        for mechanism, n in sorted(row.items(), key=lambda item: (-item[1], item[0]))
    }


def table(counts: Counts) -> list[str]:
    """Return the lines of a table: a row for each pair, and one for all of them."""
    total: Counter[Mechanism] = sum(counts.values(), Counter())
    rows = [(" - ".join(pair), counts[pair], row) for pair, row in shares(counts).items()]
    lines = ["| pair | pairs | decided by, percent |", "| --- | --- | --- |"]
    for name, row, percent in (*rows, ("all", total, _percent(total))):
        cells = ", ".join(f"{mechanism} {share:.3g}" for mechanism, share in percent.items())
        lines.append(f"| {name} | {row.total()} | {cells} |")
    return lines


def read(name: str, page: str) -> dict[Pair, dict[str, float]]:
    """Return the shares that the table of this name states on the page."""
    text = re.search(rf"<!-- {name} -->(.*?)<!-- end -->", page, re.DOTALL)
    assert text, f"docs/narrowphase.md has no table '{name}'"
    found = {}
    for names, cells in re.findall(r"^\| ([a-z ]+ - [a-z ]+) \| \d+ \| (.*) \|$", text[1], re.M):
        row = dict(cell.rsplit(" ", 1) for cell in cells.split(", "))
        found[tuple(names.split(" - "))] = {key: float(value) for key, value in row.items()}
    return found


def main() -> None:
    """Write the tables, or print a count."""
    if sys.argv[1:2] == ["--count"]:
        _print_count(sys.argv[2])
        return
    page = PAGE.read_text()
    for name in COUNTED:
        text = f"<!-- {name} -->\n\n" + "\n".join(table(count_apart(name))) + "\n\n<!-- end -->"
        page, places = re.subn(rf"<!-- {name} -->.*?<!-- end -->", text, page, flags=re.DOTALL)
        assert places == 1, f"docs/narrowphase.md has {places} places for the table '{name}'"
    PAGE.write_text(page)


if __name__ == "__main__":
    main()

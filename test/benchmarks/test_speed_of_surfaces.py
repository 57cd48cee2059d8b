"""The rows about contact surfaces in the speed benchmark run, and say how much was found."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.speed import report
from benchmarks.speed.building import measure_building
from benchmarks.speed.engines.ours import Ours
from benchmarks.speed.make_scenes import compliant
from benchmarks.speed.measure import measure, Measurement
from benchmarks.speed.rows import BUILDING, SURFACE_ROWS

SHAPES = 60


@pytest.fixture(scope="module")
def scene():
    """Return a scene small enough for a test, with contacts in it."""
    return compliant(SHAPES, 1)


@pytest.fixture(scope="module")
def measured(scene):
    """Return our own rows."""
    engines = [Ours(scene)]
    rows = [m for row in SURFACE_ROWS for m in measure(engines, row, scene, 0.0, print)]
    return rows + measure_building(engines, lambda seed: compliant(SHAPES, seed), 1)


def test_both_representations_find_the_same_surfaces(scene, measured):
    """As many surfaces of triangles as of polygons, which are fewer; points find them, too."""
    triangles, polygons, building = measured
    assert [m.row for m in measured] == [*(row.key for row in SURFACE_ROWS), BUILDING.key]
    ours = Ours(replace(scene, compliance=None))
    touching = []
    for k in range(len(scene.X_WF)):
        ours.move(k)
        touching.append(len(ours.penetrations()))
    assert 0.5 * min(touching) <= triangles.found <= max(touching)
    assert polygons.found == pytest.approx(triangles.found, abs=1.0)
    assert triangles.faces > polygons.faces > 0.0
    assert building.found == SHAPES


def test_the_table_names_the_faces(measured):
    """Beside the time stands how many surfaces there are, of how many faces."""
    table = report.table(measured)
    assert f" · {measured[0].found:.0f}, {measured[0].faces:.0f} faces" in table
    assert "building the compliant bodies, once" in table


def test_a_page_is_begun_and_its_text_is_kept(measured, tmp_path):
    """A new folder gets a page of what was measured; text around it outlives the next run."""
    titles = {measured[0].scene: "soft shapes"}
    page = tmp_path / "performance.md"
    report.write(measured, titles, "Measured today.\n", tmp_path)
    assert "### Soft shapes" in page.read_text()
    page.write_text(f"# Ours\n{page.read_text()}The end.\n")
    report.write(measured, titles, "Measured again.\n", tmp_path)
    text = page.read_text()
    assert text.startswith("# Ours\n") and text.endswith("The end.\n")
    assert "Measured again." in text and "Measured today." not in text


def test_measurements_without_faces_are_read(tmp_path):
    """A file from before there were faces and streaks is read; their times are NaN then."""
    old = Measurement("mixed", 10, "candidates", "Drake", 3, 1.0, 0.5, 2.0, 7.0)
    with (tmp_path / "performance.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(Measurement._fields[:9])
        writer.writerow(old[:9])
    (read,) = report.read(tmp_path / "performance.csv")
    assert read[:9] == old[:9]
    assert read.turns == 0
    assert np.isnan([read.faces, read.first_median_ms]).all()

"""The benchmark of contact surfaces knows the truth, and its engines and tables say what it is."""

from __future__ import annotations

from pathlib import Path
import re

import numpy as np
import pytest

from benchmarks.surfaces import closed_forms, report
from benchmarks.surfaces.cases import CASES, DEEPEST, draw, HINTS, STIFFNESS
from benchmarks.surfaces.engines import Found, Ours
from benchmarks.surfaces.measure import measure, Row, Task, worst_errors

PAIRS = 3
ROUNDING = 1e-10
"""Part of a force: coordinates of metres, patches of millimetres."""
N = 400_000
CURVED = [case for case in CASES if case.has_hint]
FLAT = [case for case in CASES if not case.has_hint]


def _row(case, hint: float) -> Row:
    return next(measure([Ours], Task(case, hint), PAIRS, 0.0, 1))


@pytest.mark.parametrize("case", FLAT, ids=lambda case: case.name)
def test_boxes_are_exact(case):
    """Boxes have flat surfaces and fields that tetrahedra represent: nothing is lost."""
    row = _row(case, np.nan)
    assert row.found == PAIRS
    assert max(row.force_error, row.area_error, row.centre_error_m) < ROUNDING


@pytest.mark.parametrize("case", CURVED, ids=lambda case: case.name)
def test_curved_shapes_approach_the_closed_form(case):
    """A mesh a quarter as fine takes force and area near the closed form's, or nearer by far."""
    coarse, fine = (_row(case, hint) for hint in (HINTS[1], HINTS[3]))
    assert fine.found == PAIRS
    assert fine.force_error < max(0.25 * coarse.force_error, 0.005)
    assert fine.area_error < max(0.25 * coarse.area_error, 0.005)
    assert fine.force_error < 0.1


def _integrate(pressure, x: np.ndarray, y: np.ndarray) -> float:
    """Return the integral of a pressure over a rectangle, cut off below zero."""
    X, Y = np.meshgrid(x, y)
    return float(np.maximum(pressure(X, Y), 0.0).sum() * (x[1] - x[0]) * (y[1] - y[0]))


def test_forces_on_a_plane_are_the_integral_of_the_field():
    """A sum over a grid agrees with the closed forms of bodies on a rigid plane.

    Pressure is k times the distance to the body's surface, on the plane z = 0.
    """
    d, length, width = 0.02, 0.3, 0.24
    h = DEEPEST - d
    x = (np.arange(1200) + 0.5) / 1200 * 0.4 - 0.2
    cylinder = _integrate(
        lambda x, y: STIFFNESS * np.minimum(DEEPEST - np.hypot(h, y), 0.5 * length - np.abs(x)),
        x, x,
    )  # fmt: skip
    box = _integrate(
        lambda x, y: STIFFNESS
        * np.minimum(d, np.minimum(0.5 * length - np.abs(x), 0.5 * width - np.abs(y))),
        x, x,
    )  # fmt: skip
    ball = _integrate(lambda x, y: STIFFNESS * (DEEPEST - np.sqrt(h * h + x * x + y * y)), x, x)
    assert cylinder == pytest.approx(
        closed_forms.cylinder_on_plane(DEEPEST, length, d, STIFFNESS).force, rel=1e-3
    )
    assert box == pytest.approx(
        closed_forms.box_on_plane(length, width, d, STIFFNESS).force, rel=1e-3
    )
    assert ball == pytest.approx(closed_forms.ball_on_plane(DEEPEST, d, STIFFNESS).force, rel=1e-3)


def test_a_rigid_ball_in_a_ball_that_is_large_is_one_in_a_slab():
    """The cap's force is the integral of the other ball's pressure over it, summed directly."""
    d = 0.02
    D = 2.0 * DEEPEST - d
    f = (np.arange(N) + 0.5) / N * np.pi
    u = np.sqrt(DEEPEST**2 + D**2 - 2.0 * DEEPEST * D * np.cos(f))
    pressure = STIFFNESS * np.maximum(DEEPEST - u, 0.0)
    force = (pressure * np.cos(f) * 2.0 * np.pi * DEEPEST**2 * np.sin(f)).sum() * np.pi / N
    truth = closed_forms.ball_in_ball(DEEPEST, d, STIFFNESS)
    assert truth.force == pytest.approx(force, rel=1e-6)


def test_tables_survive_the_file(tmp_path: Path):
    """What is written is read back, and a page keeps what stands around the tables."""
    rows = [
        Row("a, b", "one compliant", "b rigid", HINTS[2], name, "polygon", 3, 3, 10.0, 0.125,
            0.5, 1e-3, 7.5)
        for name in ("scene_graph_ros", "Drake")
    ]  # fmt: skip
    page = tmp_path / "surfaces.md"
    report.write(rows, "kinds 1\n", "Measured today.\n", tmp_path)
    page.write_text("before\n" + page.read_text() + "after\n")
    report.write(rows, "kinds 2\n", "Measured again.\n", tmp_path)
    assert report.read(tmp_path / "surfaces.csv") == rows
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")
    assert "12 %" in text
    assert "again" in text
    assert not re.search("kinds 1|today", text)


def test_a_page_without_a_place_for_a_table_is_refused(tmp_path: Path):
    """A page whose comments were lost is named, instead of being written over."""
    (tmp_path / "surfaces.md").write_text("mine\n")
    with pytest.raises(ValueError, match=r"surfaces.md has no part 'kinds'"):
        report.write([], "", "", tmp_path)
    assert (tmp_path / "surfaces.md").read_text() == "mine\n"


def test_a_missing_surface_counts_as_no_force():
    """Where an engine finds nothing, its force and area are off by all of it."""
    pairs = draw(CURVED[0], PAIRS, np.random.default_rng(1))
    force, area, centre = worst_errors(pairs, [])
    assert (force, area) == (1.0, 1.0)
    assert np.isnan(centre)
    half = Found(0, 0.5 * pairs[0].force_W, np.zeros(3), pairs[0].area, 1)
    whole = [Found(k, pairs[k].force_W, np.zeros(3), pairs[k].area, 1) for k in (1, 2)]
    assert worst_errors(pairs, [half, *whole]) == pytest.approx((0.5, 0.0, 0.0))

"""The benchmark of cameras: our depths are the truth's, its table and its file say what was."""

from __future__ import annotations

import re

import numpy as np
import pytest

from benchmarks.__main__ import main as benchmarks_main
from benchmarks.cameras import compare, report
from benchmarks.cameras.engines import Ours
from benchmarks.cameras.measure import load, measure, Row, true_depths, UNROUNDED
from benchmarks.cameras.scenes import ball_mesh, CameraScene, lens, meshes, mixed, SETS
from benchmarks.cameras.seats import Here
from scene_graph_ros.geometry import Sphere

LENS = lens(64, 48)
ROUNDING = 1e-14
"""Metres, at up to four metres."""


class Missing(Ours):
    """A renderer that is not installed."""

    name = "Missing"

    def __init__(self, scene, lens):
        raise ImportError("no module named missing")


class Blind(Ours):
    """A renderer that sees spheres an inch too far, and nothing in the lower half of the image."""

    name = "Blind"

    def depth(self, answer):
        """See Engine."""
        depth = super().depth(answer) + 0.0254
        depth[24:] = np.inf
        return depth


@pytest.mark.parametrize("scene", [mixed(10, 1), meshes(3, 2, 1)], ids=lambda scene: scene.key)
def test_our_depths_are_the_truth(scene):
    """To rounding before they are float32, then to half a unit of it; every time is taken."""
    seats = load([Here(Ours)], scene, LENS, print)
    image, exact = measure(seats, scene, LENS, frames=1, pixels=60, seed=1)
    assert (image.engine, exact.engine) == (Ours.name, UNROUNDED)
    assert image.pixels > 10
    assert image.elsewhere == exact.elsewhere == 0
    assert exact.high_m < ROUNDING < image.median_m < image.high_m < 2.0**-23 * 2.0
    assert min(image.depth_ms, image.label_ms, image.color_ms, image.all_ms) > 0.0


def test_a_short_comparison_is_part_of_all(monkeypatch, capsys):
    """`python -m benchmarks` prints who took how long, and who was left out, once for a scene."""
    monkeypatch.setattr(compare, "ENGINES", (Ours, Missing))
    monkeypatch.setattr(compare, "Elsewhere", Here)
    monkeypatch.setattr(compare, "SHORT", ("mixed-10",))
    benchmarks_main(["--quick", "--rows", "cameras"])
    printed = capsys.readouterr().out
    (ours,) = re.findall(r"^\| scene_graph_ros \|(.*)\|$", printed, re.MULTILINE)
    times = [float(cell) for cell in ours.split("|")[:4]]
    assert min(times) > 0.0
    assert printed.count("Missing is left out of 10 shapes: it is not installed") == 1


def test_a_renderer_that_is_wrong_is_seen_to_be():
    """Its error is an inch, and it misses what the lower half of the image has."""
    ball = Sphere(0.5)
    X_WGs = np.tile(np.eye(4), (SETS, 1, 1, 1))
    X_WGs[..., 2, 3] = 1.0
    scene = CameraScene("ball", "a ball", [ball], X_WGs)
    seats = load([Here(Blind)], scene, LENS, print)
    (row,) = measure(seats, scene, LENS, frames=0, pixels=200, seed=2)
    assert row.median_m == pytest.approx(0.0254, abs=1e-6)
    assert np.isnan(row.depth_ms)
    # Half of the pixels on the ball, by chance.
    assert 0.3 < row.elsewhere / row.pixels < 0.7


def test_truths_are_of_what_is_first():
    """A ball before another: 2 - 0.5 on the axis; in the corner nothing; the far one is hidden."""
    X_WGs = np.tile(np.eye(4), (SETS, 2, 1, 1))
    X_WGs[:, 0, 2, 3], X_WGs[:, 1, 2, 3] = 4.0, 2.0
    scene = CameraScene("balls", "two balls", [Sphere(0.75), Sphere(0.5)], X_WGs)
    axis = (np.array([[31, 23]]), np.array([[0, 0]]))
    centered = lens(63, 47)  # with a pixel on the axis
    (first,), (nothing,) = (true_depths(scene, centered, pixel) for pixel in axis)
    assert first == 1.5
    assert nothing is None


def test_a_renderer_that_is_missing_is_named():
    """And the others go on."""
    said = []
    seats = load([Here(Missing), Here(Ours)], mixed(10, 1), LENS, said.append)
    assert [seat.kind for seat in seats] == [Ours]
    assert said == [
        "Missing is left out of 10 shapes: it is not installed: no module named missing"
    ]


def _rows():
    mine = ("mixed-10", "10 shapes")
    return [
        Row(*mine, Ours.name, 2.0, 3.0, 4.0, 5.0, 90, 1e-8, 2e-8, 0),
        Row(*mine, UNROUNDED, 2.0, 3.0, 4.0, 5.0, 90, 1e-16, 2e-16, 0),
        Row(*mine, "Other", 20.0, np.nan, 6.0, np.nan, 90, 1e-3, 2e-3, 7),
    ]


def test_the_table_has_ratios_to_ours():
    """Twenty is ten times two; what a renderer does not have is empty."""
    lines = report.table(_rows()).splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    error = "1.0e-03, 99 %: 2.0e-03"
    assert cells[5] == ["Other", "20 (10 x)", "", "6 (1.5 x)", "", error, "7 of 90"]
    assert cells[4][1:5] == [""] * 4


def test_the_summary_has_a_line_for_each_scene():
    """All three images, beside ours; a renderer of depths alone says so."""
    depths = Row("mixed-10", "10 shapes", "Depths", 3.0, *[np.nan] * 3, 90, 1e-3, 2e-3, 0)
    lines = report.summary([*_rows(), depths]).splitlines()
    assert lines[0] == f"|  | {Ours.name} | Other | Depths |"
    assert lines[2:] == ["| 10 shapes | 5 | depth: 20 (10 x) | depth: 3 (1.5 x) |"]


def test_the_page_keeps_what_is_around_the_table(tmp_path):
    """And the file for programs is read as it was written."""
    page = tmp_path / "cameras_measured.md"
    page.write_text("before\n<!-- measured -->\nold\n<!-- end -->\nafter\n")
    report.write(_rows(), "A machine.\n", tmp_path)
    text = page.read_text()
    assert text.startswith("before\n<!-- measured -->\n\nA machine.\n")
    assert text.endswith("<!-- end -->\nafter\n")
    assert "old" not in text
    assert [str(row) for row in report.read(tmp_path / "cameras.csv")] == list(map(str, _rows()))
    page.write_text("no place")
    with pytest.raises(ValueError, match="has no part between"):
        report.write(_rows(), "", tmp_path)


def test_the_bumpy_ball_is_closed():
    """Twenty triangles, divided into four each; each edge has two."""
    faces = np.asarray(ball_mesh(1, 0.5).faces)
    assert len(faces) == 80
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()

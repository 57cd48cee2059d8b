"""The message benchmarks run, and memory stays flat under everything at once."""

from __future__ import annotations

import importlib.util

import pytest

if importlib.util.find_spec("rclpy") is None:
    pytest.skip("needs ROS", allow_module_level=True)

from node_harness import wait_until
import numpy as np
from searching import times

from benchmarks.messages import edits, everything, images, micro, report
from benchmarks.messages.beside_camera import beside_camera, ratio
from benchmarks.messages.demo_cell import demo_cell
from benchmarks.messages.soak import soak
from benchmarks.messages.sustained import rig

SECONDS = times(10)
FLAT = 6e6
"""Bytes that memory may grow by within half of that: a leak of one contact message per update
would be five times as much, and allocators breathe by less."""


@pytest.mark.parametrize("job", [micro.markers, micro.received_poses])
def test_single_jobs_do_the_same_both_ways(job):
    """Both ways publish all markers, and take over all poses."""
    _, ordinary, ours, size = job(10, 5)
    assert min(ordinary, ours) > 0.0
    assert size in ("10 and 10 markers", "10 and 10 poses")


@pytest.mark.parametrize("is_ordinary", [True, False])
def test_poses_have_contacts_of_their_own(is_ordinary):
    """The node, and the ordinary way beside it, answer poses with contacts of their stamp."""
    with rig(20, is_ordinary=is_ordinary) as one:
        # On a busy machine all answers of a second may come later than they are waited for.
        measured = wait_until(lambda: (m := one.run(20.0, 1.0)).answered and m, "own contacts")
    assert measured.sent == 20
    assert measured.latencies.min() > 0.0


def test_answers_become_a_table_of_the_page(tmp_path, monkeypatch):
    """A line for each load with median and 99th percentile; what stands around it is kept."""
    ramp = np.linspace(0.0, 10.0, 101)
    rows = [
        report.Answers(load, service, factor * ramp, 200.0)
        for factor, load in ((1.0, "the demo"), (2.0, "10 frames"))
        for service in ("has_collisions", "all")
    ]
    page = tmp_path / "messages.md"
    page.write_text("before\n<!-- answers: begin -->old<!-- answers: end -->\nafter\n")
    monkeypatch.setattr(report, "PAGE", page)
    report.write_answers(rows, 0.5)
    text = page.read_text()
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "old" not in text
    assert "| load | updates/s | `has_collisions` | all |" in text
    assert "| the demo | 200 | 5.0, **9.9** | 5.0, **9.9** |" in text
    assert "| 10 frames | 200 | 10.0, **19.8** | 10.0, **19.8** |" in text
    page.write_text("no place")
    with pytest.raises(ValueError, match="no place for the table"):
        report.write_answers(rows, 0.5)


def test_latencies_of_cells_become_a_table_of_the_page(tmp_path, monkeypatch):
    """A line for each cell, with median, 99th percentile and worst."""
    page = tmp_path / "messages.md"
    page.write_text("before\n<!-- panda: begin --><!-- panda: end -->\nafter\n")
    monkeypatch.setattr(report, "PAGE", page)
    ramp = np.linspace(0.0, 10.0, 101)
    report.write_cells([report.Cell("the demo", "1 ms", ramp, 199.6, 0.251)], 0.5)
    assert "| the demo | 1 ms | 5.00 | 9.90 | 10.00 | 200 | 0.25 |" in page.read_text()


def test_changes_of_the_scene_become_a_table_of_the_page(tmp_path, monkeypatch):
    """Small and large changes are made and measured, and each kind has its line."""
    monkeypatch.setattr(edits, "SMALL", (20, 2, 20))
    rows = edits.edits(is_quick=True)
    assert [len(row.held_up) for row in rows] == [2, 2, 2, 1, 1, 1]
    assert all((row.answers > 0.0).all() for row in rows)
    page = tmp_path / "messages.md"
    page.write_text("before\n<!-- edits: begin -->old<!-- edits: end -->\nafter\n")
    monkeypatch.setattr(report, "PAGE", page)
    report.write_edits([report.Edited("nothing", ramp := np.linspace(0.0, 10.0, 101), ramp)], 0.5)
    assert "| nothing | 101 | 5 | 5.0 | 9.9 | 10.0 |" in page.read_text()


def test_holes_become_a_table_of_the_page(tmp_path, monkeypatch):
    """A line for each transport: how many, the longest, and the latency beside them."""
    page = tmp_path / "messages.md"
    page.write_text("before\n<!-- holes: begin --><!-- holes: end -->\nafter\n")
    monkeypatch.setattr(report, "PAGE", page)
    rows = [
        report.Holes("UDP", 60.0, 12, 0, 6000, [], 1.5e-3, 3.25e-3, 0.151),
        report.Holes("pigeons", 60.0, 12, 1, 60, [0.25, 0.333], 1.5e-3, 3.25e-3, 0.151),
    ]
    report.write_holes(rows, 0.5)
    text = page.read_text()
    assert "| UDP | 60 | 12 | 0 | 0 | 0 | 1.50 | 3.25 | 0.15 |" in text
    assert "| pigeons | 60 | 12 | 1 | 2 | 333 | 1.50 | 3.25 | 0.15 |" in text


def test_sources_of_the_demo_send_when_they_are_told_to():
    """The stamps are those of turns: the Panda's at multiples of 50 ms, the objects' 20 later."""

    def are_in_turn(arrivals):
        late = np.array([stamp for stamp, _ in arrivals]) % 50_000_000 * 1e-6
        panda, objects = np.mean(late < 10.0), np.mean((late > 20.0) & (late < 30.0))
        return panda > 0.25 and objects > 0.25 and panda + objects > 0.75

    # On a busy machine a source may wake up late now and then; at other phases it always would.
    with demo_cell(rate=20.0, phase=0.02) as (_, _, listener):
        listener.arrivals.clear()
        wait_until(
            lambda: len(listener.arrivals) >= 16 and are_in_turn(listener.arrivals[-16:]),
            "contacts of 8 turns of both",
        )


@pytest.mark.search
def test_memory_is_flat_while_everything_goes_on():
    """Poses at full rate, contacts, markers, requests and changes of the scene leave nothing."""
    result = soak(SECONDS, frames=200, geometries=500)
    assert result.sent > 100 * SECONDS
    assert result.requests > SECONDS / 2
    assert result.growth < FLAT, f"{result.growth / 1e6:.1f} MB more at the end"
    # A geometry is a few names, poses and properties, a marker and its bytes.
    assert result.per_geometry < 100_000


def test_images_are_counted_by_their_stamps():
    """A reliable reader with time to spare gets the depth images of the poses that were sent."""
    row = images.measure(["depth/image"], is_reliable=True, frames=3)
    assert row["sent"] == 3
    assert 0 < row["arrived"]["depth/image"] <= 3
    assert row["median"]["depth/image"] > 0.0


def test_contacts_are_timed_beside_a_camera():
    """Both without and with somebody who takes its images."""
    ((without, beside),) = beside_camera(turns=1, seconds=0.5)
    assert without > 0.0
    assert beside > 0.0


def test_the_ratio_is_of_turns():
    """Turn by turn, so that what slows both cancels. Half of the ratios are 1.1, half are 1.3."""
    medians = [(k, (1.1 if k % 2 else 1.3) * k) for k in range(1, 52)]
    middle, low, high = ratio(medians)
    assert middle == pytest.approx(1.1)
    assert (low, high) == (pytest.approx(1.1), pytest.approx(1.3))


def test_everything_at_once_is_measured_and_drawn(tmp_path):
    """A few seconds of the soak: pieces without clients of the page, then with them."""
    pieces = everything.everything(5.0, frames=20, rate=50.0)
    assert [piece.has_clients for piece in pieces] == sorted(p.has_clients for p in pieces)
    assert {piece.has_clients for piece in pieces} == {False, True}
    assert max(piece.contacts_per_second for piece in pieces) > 0.0
    assert all(piece.memory_mb > 0.0 for piece in pieces)
    everything.write_csv(pieces, tmp_path / "soak.csv")
    lines = (tmp_path / "soak.csv").read_text().splitlines()
    assert lines[0].split(",") == list(everything.Piece._fields)
    assert len(lines) == len(pieces) + 1
    everything.draw(pieces, tmp_path / "soak.png")
    assert (tmp_path / "soak.png").stat().st_size > 1000
    assert "with them" in everything.summary(pieces)

"""The message benchmarks run, and memory stays flat under everything at once."""

from __future__ import annotations

import importlib.util

import pytest

if importlib.util.find_spec("rclpy") is None:
    pytest.skip("needs ROS", allow_module_level=True)

from benchmarks.messages import micro
from benchmarks.messages.soak import soak
from benchmarks.messages.sustained import rig

SECONDS = 60.0
FLAT = 6e6
"""Bytes that memory may grow by within half a minute: a leak of one contact message per update
would be 30 times as much, and allocators breathe by less."""


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
        measured = one.run(20.0, 1.0)
    assert measured.sent == 20
    assert measured.answered > 0
    assert measured.latencies.min() > 0.0


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_memory_is_flat_over_a_minute_of_everything():
    """Poses at full rate, contacts, markers, requests and changes of the scene leave nothing."""
    result = soak(SECONDS, frames=200, geometries=500)
    assert result.sent > 0.9 * 200 * SECONDS
    assert result.requests > SECONDS
    assert result.growth < FLAT, f"{result.growth / 1e6:.1f} MB more at the end"
    # A geometry is a few names, poses and properties, a marker and its bytes.
    assert result.per_geometry < 100_000

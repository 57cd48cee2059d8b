"""A kind of core that the package does not know is measured, given the one file that answers."""

import json
import os
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism

ROOT = Path(__file__).parents[3]
SUPPORT = ROOT / "test" / "support"
OTHERS = {"truncated cone", "box", "cylinder", "ellipsoid", "segment", "point"}


def measured(what, count):
    """Return what a process says that has the ninth core: an array of each column, and names."""
    command = [sys.executable, str(SUPPORT / "ninth_core.py"), what, str(count)]
    environment = {
        **os.environ,
        "NUMBA_DISABLE_JIT": "1",  # half a second instead of the minute that compiling it takes
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(SUPPORT)]),
    }
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(rows) == count
    assert {row["name"] for row in rows} == OTHERS
    return {key: np.array([row[key] for row in rows]) for key in rows[0] if key != "name"}


@pytest.fixture(scope="module")
def apart():
    """Return pairs whose distance is constructed, relative to their size."""
    return measured("pairs", 600)


def test_distances_are_exact(apart):
    """To 1e-13 of the size nine of ten, the others to what their certificates say."""
    error = np.abs(apart["phi"] - apart["truth"])
    assert (error <= apart["gap"] + 1e-13).all()
    assert apart["gap"].max() <= 1e-8
    assert (error <= 1e-13).mean() >= 0.9
    assert apart["misfit"].max() <= 1e-14


def test_most_are_proven_by_its_features(apart):
    """Features of its own file decide, not bounds that close in on them."""
    by_features = (Mechanism.LIFTED, Mechanism.REFINED)
    assert np.isin(apart["by"], [int(each) for each in by_features]).mean() >= 0.9


def test_depths_are_the_least():
    """No direction of thousands is less deep than the answer, which its normal attains."""
    deep = measured("overlaps", 60)
    assert (deep["phi"] < 0.0).mean() >= 0.9
    assert (deep["phi"] >= deep["truth"] - deep["gap"] - 1e-13).all()
    np.testing.assert_allclose(deep["along"], deep["phi"], rtol=0.0, atol=1e-12)
    assert (deep["gap"] <= 1e-13).mean() >= 0.8

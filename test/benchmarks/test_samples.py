"""Samples of the machine code: where kernels are, and the table by kernels."""

import itertools
import os
import platform
import stat

import numpy as np
import pytest

from benchmarks import samples
from benchmarks.compiled_places import compiled_places, Place
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.pose_kernels import store_poses

pytestmark = [
    pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels"),
    pytest.mark.skipif(platform.system() != "Linux", reason="processes are read as on Linux"),
]


def _place_of_store_poses() -> Place:
    store_poses(np.eye(4)[None], np.zeros(1, np.int64), np.empty((1, 4, 4)))
    ends = ".spatial.pose_kernels.store_poses"
    places = [place for place in compiled_places() if place.name.endswith(ends)]
    return max(places, key=lambda place: place.size)  # there is a wrapper, too


def test_kernels_are_found_in_order_and_apart():
    """Those that were loaded from the cache as well as those that were compiled just now."""

    @kernel
    def just_now(number):
        return 2.0 * number

    assert just_now(2.0) == 4.0
    assert _place_of_store_poses().size > 100
    places = compiled_places()
    assert any("just_now" in place.name for place in places)
    assert all(a.start + a.size <= b.start for a, b in itertools.pairwise(places))


def test_an_address_counts_for_the_function_it_is_in():
    """Its first and last byte are in it, what is before and after is not."""
    places = [Place(100, 10, "a"), Place(120, 5, "b")]
    found = samples.by_place([99, 100, 109, 110, 124, 125], places)
    assert found == {"a": 2, "b": 1, samples.OTHERS: 3}


def test_a_row_is_asked_and_its_samples_are_told(tmp_path, monkeypatch, capsys):
    """A perf of ours says that the processor was in one kernel, three times of four."""
    place = _place_of_store_poses()
    inside = f"{place.start + 8:x}"
    perf = tmp_path / "perf"
    perf.write_text(
        "#!/bin/sh\n"
        f'if [ "$1" = script ]; then printf "%s\\n" {inside} {inside} {inside} 10; exit; fi\n'
        "exec sleep 60\n"
    )
    perf.chmod(perf.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    samples.main(["--row", "collides", "--size", "10", "--seconds", "0.01"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Measured on")
    assert "4 samples" in lines[3]
    assert lines[5].split()[1:] == ["75.0", "%", "spatial.pose_kernels.store_poses"]
    assert lines[6].endswith(f"25.0 %  {samples.OTHERS}")


def test_perf_that_is_missing_or_refuses_is_told(tmp_path, monkeypatch):
    """With what to install, and with perf's own words."""
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SystemExit, match="linux-perf"):
        samples.main(["--size", "10"])
    perf = tmp_path / "perf"
    perf.write_text("#!/bin/sh\necho no access to the clock >&2\n")
    perf.chmod(perf.stat().st_mode | stat.S_IXUSR)
    with pytest.raises(SystemExit, match="no access to the clock"):
        samples.main(["--row", "collides", "--size", "10", "--seconds", "0.01"])


@pytest.mark.parametrize(
    ("option", "value"), [("--row", "nonsense"), ("--size", "many"), ("--seconds", "long")]
)
def test_what_makes_no_sense_is_refused(option, value, capsys):
    """By the name of the option."""
    with pytest.raises(SystemExit):
        samples.main([option, value])
    assert option in capsys.readouterr().err

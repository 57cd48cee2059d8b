"""Results on disk are the user's own and whole, or found anew."""

import os
import threading

import numpy as np
import pytest

from scene_graph_ros.geometry import kept_results
from scene_graph_ros.geometry.kept_results import kept, KeptResultsWarning


@pytest.fixture
def root(tmp_path, monkeypatch):
    """Keep results in a folder of this test's own."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_MESH_CACHE", str(tmp_path / "kept"))
    kept_results._warn_once.cache_clear()
    return tmp_path / "kept"


def counting(count):
    """Return what finds an array, and counts how often it is asked."""

    def find():
        count.append(1)
        return {"a": np.arange(1000.0), "b": np.array(3)}

    return find


def ask(count, name="00ff"):
    """Return the array that is kept, or found."""
    result = kept("sums", name, counting(count))
    assert result["a"].tolist() == list(range(1000))
    assert int(result["b"]) == 3


def test_a_result_is_found_once(root):
    """Another name has a result of its own; the folder is the user's alone."""
    count = []
    for _ in range(3):
        ask(count)
    assert len(count) == 1
    ask(count, "00fe")
    assert len(count) == 2
    assert root.stat().st_mode & 0o777 == 0o700


def test_of_those_who_ask_at_once_one_finds(root):
    """The other waits, and takes what is kept then; another result is found meanwhile."""
    count, second = [], threading.Event()

    def find():
        count.append(1)
        if len(count) == 1:
            other.start()
            ask([], "00fe")
            second.wait(0.2)  # comes at once where nobody waits for this
        else:
            second.set()
        return {"a": np.arange(1000.0), "b": np.array(3)}

    other = threading.Thread(target=kept, args=("sums", "00ff", find))
    kept("sums", "00ff", find)
    other.join()
    assert len(count) == 1


def test_a_damaged_file_is_found_anew(root):
    """One that was cut short at any place, or has another byte, is replaced, with a warning."""
    count = []
    ask(count)
    (path,) = (root / "sums").iterdir()
    whole = path.read_bytes()
    changed = bytearray(whole)
    changed[len(whole) // 2] ^= 1
    for content in (b"", whole[:7], whole[:100], whole[:-1], bytes(changed)):
        path.write_bytes(content)
        kept_results._warn_once.cache_clear()
        with pytest.warns(KeptResultsWarning, match="is damaged, and found again"):
            ask(count)
        assert path.read_bytes() == whole
    assert len(count) == 6


@pytest.mark.parametrize("which", ["", "sums"])
def test_a_folder_that_others_can_write_is_not_used(root, which):
    """Neither read nor written, whichever of the two it is; the result is right."""
    count = []
    ask(count)
    (root / which).chmod(0o777)
    with pytest.warns(KeptResultsWarning, match="can be written by other users: remove it"):
        ask(count)
    ask(count, "1234")
    assert len(count) == 3
    assert len(list((root / "sums").iterdir())) == 1


def test_a_file_that_others_can_write_is_replaced(root):
    """Somebody may have written another result with its digest."""
    count = []
    ask(count)
    (path,) = (root / "sums").iterdir()
    path.chmod(0o666)
    with pytest.warns(KeptResultsWarning, match="can be written by other users"):
        ask(count)
    assert path.stat().st_mode & 0o022 == 0
    ask(count)
    assert len(count) == 2


def test_without_a_folder_results_are_found_each_time(root, monkeypatch):
    """A file is where the folder would be."""
    root.write_text("here")
    count = []
    with pytest.warns(KeptResultsWarning, match="results can't be kept"):
        ask(count)
    ask(count)
    assert len(count) == 2


def test_the_longest_unused_go_first(root, monkeypatch):
    """Of three files two have room; the first was used since."""
    monkeypatch.setattr(kept_results, "MAX_BYTES", 20_000)
    count = []
    for age, name in ((30, "0a"), (20, "0b")):
        ask(count, name)
        path = root / "sums" / f"{name}.npz"
        os.utime(path, ns=(0, path.stat().st_mtime_ns - age * 10**9))
    ask(count, "0a")
    assert len(count) == 2
    ask(count, "0c")
    assert sorted(path.stem for path in (root / "sums").iterdir()) == ["0a", "0c"]

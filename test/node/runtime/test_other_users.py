"""Another user of the machine, in fact: a process with another user's number tries it."""

from __future__ import annotations

import os
from pathlib import Path
import shutil
import subprocess
import tempfile

import pytest

from scene_graph_ros.geometry.compiled.cache import cache_problem
from scene_graph_ros.geometry.compiled.kernel_files import make_folder
from scene_graph_ros.node.effects.page_file import write_page_file

OTHER = 65534
"""The number of nobody."""
SECRET = "http://127.0.0.1:8780/?token=a-secret"

pytestmark = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="only root, with setpriv, can become another user",
)


@pytest.fixture(name="room")
def _room():
    """A folder that all users of the machine can enter and write to, as /tmp."""
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        Path(folder).chmod(0o1777)
        yield Path(folder)


def as_other(*command):
    """Run a command as the other user; return whether it succeeded, and what it printed."""
    user = ["setpriv", f"--reuid={OTHER}", f"--regid={OTHER}", "--clear-groups", "--"]
    done = subprocess.run([*user, *map(str, command)], check=False, capture_output=True, text=True)
    return done.returncode == 0, done.stdout


def test_the_other_user_is_another_one(room):
    """What follows means something: it reads and makes files here, and is who it says."""
    (room / "open").write_text("seen")
    (room / "open").chmod(0o644)
    assert as_other("cat", room / "open") == (True, "seen")
    assert as_other("touch", room / "own")[0]
    assert (room / "own").stat().st_uid == OTHER


@pytest.mark.parametrize("mask", [0o022, 0o000])
def test_nobody_else_reads_the_token_of_the_page(room, monkeypatch, mask):
    """Nor lists the folder, nor takes the file away, whatever the user's umask."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(room))
    before = os.umask(mask)
    try:
        path = write_page_file(SECRET)
    finally:
        os.umask(before)
    assert SECRET in path.read_text()
    assert as_other("cat", path) == (False, "")
    assert as_other("ls", path.parent) == (False, "")
    assert not as_other("rm", "-f", path)[0]
    assert not as_other("mv", path.parent, room / "away")[0]
    assert path.exists()


@pytest.mark.parametrize("plant", ["folder", "open folder", "link"])
def test_no_token_goes_where_another_user_was_first(room, monkeypatch, plant):
    """A folder of its own under the name that is known, one for all, or a link to the user's."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(room))
    folder = room / "scene_graph_ros"
    (room / "mine").mkdir()
    made = ("ln", "-s", room / "mine", folder) if plant == "link" else ("mkdir", folder)
    assert as_other(*made)[0]
    if plant == "open folder":
        assert as_other("chmod", "777", folder)[0]
    with pytest.raises(OSError, match=r"XDG_RUNTIME_DIR|File exists"):
        write_page_file(SECRET)
    assert not list(folder.iterdir())


def test_kernels_of_another_user_are_not_run(room, monkeypatch):
    """Nor can it put any where the user's own are kept."""
    theirs, own = room / "theirs", room / "own"
    assert as_other("mkdir", theirs)[0]
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(theirs))
    assert f"belongs to another user, {OTHER}" in cache_problem()
    make_folder(own, own / "kernels")
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(own))
    assert cache_problem() == ""
    for place in (own, own / "kernels"):
        assert not as_other("touch", place / "planted.nbi")[0]
        assert not as_other("ls", place)[0]

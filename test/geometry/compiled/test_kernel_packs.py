"""Kernels that an installation brings along are run where they fit, and nowhere else."""

import os
from pathlib import Path
import shutil
import subprocess
import sys
from typing import NamedTuple

from numba.core import codegen
import numba.core.config
import pytest

from scene_graph_ros.geometry.compiled import kernel_packs
from scene_graph_ros.geometry.compiled.kernel_packs import (
    BASELINES,
    baselines_here,
    first_line,
    open_pack,
    Pack,
    PackError,
)
from scene_graph_ros.geometry.compiled.pack_writer import Contents, write_pack

_ROOT = Path(__file__).parents[3]
_BASELINE = "x86-64-v2"
_V2, _V3, _V4 = (BASELINES[f"x86-64-v{level}"] for level in (2, 3, 4))

pytestmark = pytest.mark.skipif(
    bool(numba.core.config.DISABLE_JIT), reason="nothing is compiled without numba's compiler"
)


@pytest.fixture(autouse=True)
def _no_processor_is_asked_for(monkeypatch):
    """Whatever the variables of this run ask numba for."""
    for name in ("CPU_NAME", "CPU_FEATURES"):
        monkeypatch.setattr(numba.core.config, name, None)


@pytest.fixture(name="pack")
def _pack(tmp_path):
    """Write a pack of three kernels of two functions, whose code is a word."""
    words = {name: kernel_packs.pickle.dumps(name) for name in ("one", "two", "three")}
    keys = {number: kernel_packs.pickle.dumps(number) for number in (1, 2)}
    functions = {
        "sources/f": {keys[1]: words["one"], keys[2]: words["two"]},
        "others/g": {keys[1]: words["three"]},
    }
    path = tmp_path / f"{_BASELINE}.pack"
    modules = {"of_f": "sources", "of_g": "others"}
    write_pack(path, Contents(_BASELINE, {"main": "digest"}, modules, functions))
    return path


def _read_all(path):
    read = Pack(path)
    return [
        read.find(*names)
        for names in (("sources", "f", 1), ("sources", "f", 2), ("others", "g", 1))
    ]


def test_a_kernel_is_found_by_sources_function_and_key(pack):
    """And nothing else is."""
    read = Pack(pack)
    assert [read.find("sources", "f", key) for key in (1, 2, 3)] == ["one", "two", None]
    assert read.find("others", "g", 1) == "three"
    assert read.find("others", "f", 1) is None
    is_other = read.is_of_other_sources
    asked = (("of_f", "sources"), ("of_f", "changed"), ("of_none", "new"))
    assert [is_other(*each) for each in asked] == [False, True, False]
    assert read.groups() == {"main": "digest"}


def test_no_byte_of_a_pack_can_change_unnoticed(pack):
    """Whatever is read of it; the sentence names the file and the remedy."""
    content = pack.read_bytes()
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1 << place % 8
        pack.write_bytes(changed)
        with pytest.raises(PackError, match=r"\.pack is damaged: `pip install --force-reinstall`"):
            _read_all(pack)


@pytest.mark.parametrize("size", [0, 1, 20, 200, -1])
def test_a_pack_that_was_cut_short_is_damaged(pack, size):
    """In its first line, its head, or its last kernel."""
    content = pack.read_bytes()
    pack.write_bytes(content[:size])
    with pytest.raises(PackError, match="is damaged"):
        _read_all(pack)


@pytest.mark.parametrize("what", ["numba", "Python", "system"])
def test_a_pack_for_another_process_says_whom_it_is_for(pack, what, monkeypatch):
    """The version or system that it was made for, and the one that it met."""
    here = kernel_packs.made_for()
    monkeypatch.setattr(kernel_packs, "made_for", lambda: here | {what: "another"})
    with pytest.raises(PackError, match=f"are for {what} {here[what]}, and this is another: inst"):
        Pack(pack)


@pytest.mark.parametrize("which", ["file", "folder"])
@pytest.mark.parametrize("rights", [0o002, 0o022])
def test_a_pack_that_others_can_write_is_not_run(pack, which, rights):
    """Nor one in a folder in which they could replace it."""
    path = pack if which == "file" else pack.parent
    path.chmod(path.stat().st_mode | rights)
    with pytest.raises(PackError, match=rf"{path} can be written .* chmod -R go-w {pack.parent}"):
        Pack(pack)


def test_the_users_own_group_may_write_a_pack(pack, monkeypatch):
    """Where each user has such a group, pip lets it write all that it installs."""
    pack.chmod(0o664)
    for is_own in (True, False):
        monkeypatch.setattr(kernel_packs, "_is_users_own", lambda gid, told=is_own: told)
        if is_own:
            Pack(pack)
        else:
            with pytest.raises(PackError, match="can be written by other users"):
                Pack(pack)


class _Processor(NamedTuple):
    features: tuple[str, ...]
    there: tuple[str, ...]
    best: str | None


@pytest.mark.parametrize(
    "processor",
    [
        _Processor(_V4, ("x86-64-v2", "x86-64-v3", "x86-64-v4"), "x86-64-v4"),
        _Processor(_V4, ("x86-64-v2", "x86-64-v3"), "x86-64-v3"),
        _Processor(_V3, ("x86-64-v2", "x86-64-v3", "x86-64-v4"), "x86-64-v3"),
        _Processor(_V2, ("x86-64-v2", "x86-64-v3", "x86-64-v4"), "x86-64-v2"),
        _Processor((*_V2, "avx", "avx2"), ("x86-64-v2", "x86-64-v3"), "x86-64-v2"),
        _Processor(_V4, (), None),
    ],
)
def test_the_best_pack_that_the_processor_runs_is_taken(tmp_path, monkeypatch, processor):
    """A level needs all of its features."""
    for name in processor.there:
        write_pack(tmp_path / f"{name}.pack", Contents(name, {name: ""}, {}, {}))
    flat = ",".join(f"+{feature}" for feature in processor.features)
    monkeypatch.setattr(codegen, "get_host_cpu_features", lambda: f"-sse9,{flat}")
    found = open_pack(tmp_path)
    assert (found and next(iter(found.groups()))) == processor.best


def test_a_processor_below_every_pack_is_told_its_features(tmp_path, monkeypatch):
    """One sentence, with the remedy."""
    write_pack(tmp_path / "x86-64-v3.pack", Contents("x86-64-v3", {}, {}, {}))
    monkeypatch.setattr(codegen, "get_host_cpu_features", lambda: "+sse3,-avx2")
    with pytest.raises(PackError, match=r"processors with .*avx2, .* `make wheels`"):
        open_pack(tmp_path)


def test_whoever_names_a_processor_gets_kernels_for_it(tmp_path, monkeypatch):
    """A baseline's pack for the baseline, none for others or with checked indices."""
    for name in BASELINES:
        write_pack(tmp_path / f"{name}.pack", Contents(name, {name: ""}, {}, {}))
    monkeypatch.setattr(numba.core.config, "CPU_NAME", _BASELINE)
    if _BASELINE in baselines_here():
        assert list(open_pack(tmp_path).groups()) == [_BASELINE]
    monkeypatch.setattr(numba.core.config, "CPU_NAME", "znver3")
    assert open_pack(tmp_path) is None
    monkeypatch.setattr(numba.core.config, "CPU_NAME", None)
    monkeypatch.setattr(numba.core.config, "BOUNDSCHECK", 1)
    assert open_pack(tmp_path) is None


def test_the_first_line_says_how_long_the_head_is():
    """So that a pack is told from any other file before anything of it is read."""
    magic, digest, length = first_line(b"{}").rsplit(maxsplit=2)
    assert magic.startswith(b"scene_graph_ros kernels")
    assert (len(digest), int(length)) == (32, 2)


_PACK = """
import sys
import numpy as np
from pathlib import Path
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions
from scene_graph_ros.geometry.compiled.pack_writer import pack_kernels

poses_from_quaternions(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]))
modules = [name for name in sys.modules if name.startswith("scene_graph_ros.")]
assert pack_kernels(Path(sys.argv[1]), modules, []) > 0
"""

_ASK = """
import warnings
import numpy as np
from scene_graph_ros.geometry.compiled import kernel
from scene_graph_ros.geometry.compiled.cache import KernelCacheWarning
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions

with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always", KernelCacheWarning)
    X = poses_from_quaternions(np.zeros((2, 3)), np.array([[0.0, 0.0, 0.0, 1.0]] * 2))
    again = poses_from_quaternions(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]))
told = [str(each.message) for each in told if each.category is KernelCacheWarning]
print(X.sum() + again.sum(), kernel.compilation_count(), *told, sep="|")
"""

_ON_TOP = """
import itertools
import numpy as np
import numba
from numba.core.bytecode import FunctionIdentity
from scene_graph_ros.geometry.compiled import kernel
from scene_graph_ros.geometry.spatial.quaternion_kernels import poses_from_quaternions_kernel

p, q, X = np.array([[1.0, 2.0, 3.0]]), np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 4, 4))
poses_from_quaternions_kernel(p, q, X)
(packed,) = poses_from_quaternions_kernel.overloads.values()
assert type(packed.library).__name__ == "_LeanLibrary"

@numba.njit
def shifted(p, q, X):
    row, status = poses_from_quaternions_kernel(p, q, X)
    return row + X[0, 0, 3] + X[0, 1, 3] + X[0, 2, 3]

print(shifted(p, q, X), poses_from_quaternions_kernel(p, q, X)[0])
(merged,) = poses_from_quaternions_kernel.callees.results.values()
print(merged is packed, merged.fndesc.unique_name == packed.fndesc.unique_name)
"""


class _Installation(NamedTuple):
    root: Path
    cache: Path

    def run(self, script: str, *arguments: str, **variables: str) -> str:
        """Run a script as a user of the installation would; return what it prints."""
        environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
        variables = {
            "SCENE_GRAPH_ROS_KERNEL_CACHE": str(self.cache),
            "PYTHONPATH": str(self.root),
            **variables,
        }
        done = subprocess.run(
            [sys.executable, "-c", script, *arguments],
            env=environment | variables,
            cwd=self.root,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        return done.stdout.strip()


@pytest.fixture(name="packed", scope="module")
def _packed(tmp_path_factory):
    """Make a copy of the package that has a pack of a few kernels."""
    root = tmp_path_factory.mktemp("installation")
    shutil.copytree(_ROOT / "scene_graph_ros", root / "scene_graph_ros")
    file = root / "scene_graph_ros" / "kernels" / f"{_BASELINE}.pack"
    made = _Installation(root, root / "cache")
    made.run(_PACK, str(file), NUMBA_CPU_NAME=_BASELINE, NUMBA_CPU_FEATURES="")
    return root


@pytest.fixture(name="installation")
def _installation(packed, tmp_path):
    """Make a copy of it for one test, whose user has no kernels yet."""
    shutil.copytree(packed / "scene_graph_ros", tmp_path / "scene_graph_ros")
    return _Installation(tmp_path, tmp_path / "cache")


_RIGHT = "12.0"  # three unit matrices


def test_a_user_of_an_installation_compiles_and_writes_nothing(installation):
    """The kernels that it brings along are run."""
    assert installation.run(_ASK) == f"{_RIGHT}|0"
    assert not installation.cache.exists()


def test_kernels_that_are_loaded_have_numba_register_nothing(installation):
    """That is for compiling, and takes longer than all else of a first answer."""
    is_there = "import sys; print('numba.np.linalg' in sys.modules)"
    assert installation.run(f"{_ASK}{is_there}").split() == [f"{_RIGHT}|0", "False"]
    (pack,) = installation.root.rglob("*.pack")
    pack.unlink()
    assert installation.run(f"{_ASK}{is_there}").split()[1] == "True"


def test_a_users_kernel_on_top_of_packed_ones_compiles_and_is_right(installation):
    """The kernels below are compiled for it, once; calls from Python go on with packed ones."""
    for _ in range(2):
        assert installation.run(_ON_TOP).split()[:3] == ["5.0", "-1", "False"]
    assert installation.run(_ASK) == f"{_RIGHT}|0"


def test_machine_code_may_have_the_name_that_it_has_in_the_pack(installation):
    """Numba numbers functions as it compiles them: two of one name may be in a process."""
    same = _ON_TOP.replace(
        "@numba.njit",
        """
number = int(packed.fndesc.unique_name.rpartition("$")[2])
FunctionIdentity._unique_ids = itertools.count(number - 1)

@numba.njit""",
    )
    assert installation.run(same).split() == ["5.0", "-1", "False", "True"]


@pytest.mark.parametrize("damage", ["kernels", "empty", "other sources", "others may write"])
def test_what_does_not_fit_is_compiled_with_one_sentence(installation, damage):
    """And is not compiled again by the next process."""
    (pack,) = installation.root.rglob("*.pack")
    if damage == "kernels":
        line, rest = pack.read_bytes().split(b"\n", 1)
        length = int(line.split()[-1])
        pack.write_bytes(line + b"\n" + rest[:length] + bytes(len(rest) - length))
    elif damage == "empty":
        pack.write_bytes(b"")
    elif damage == "others may write":
        pack.parent.chmod(0o777)
    else:
        poses = installation.root / "scene_graph_ros/geometry/spatial/pose_kernels.py"
        poses.write_text(poses.read_text() + "# changed\n")
    said = {"other sources": "is not as it was installed", "others may write": "chmod -R go-w"}
    for is_first in (True, False):
        answer, compiled, *told = installation.run(_ASK).split("|")
        assert answer == _RIGHT
        assert (int(compiled) > 0) == is_first
        assert len(told) == 1
        assert said.get(damage, "--force-reinstall") in told[0]

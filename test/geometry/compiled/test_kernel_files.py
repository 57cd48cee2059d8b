"""What is unpickled and run of the cache is whole and the user's own, else it is compiled anew."""

import hashlib
import itertools
import os
from pathlib import Path
import pickle
import subprocess
import sys
import warnings

import numba
import numba.core.config
import pytest

from scene_graph_ros.geometry.compiled import cache
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.kernel_files import KernelFiles, why_not_trusted

_COMPILED = pytest.mark.skipif(
    bool(numba.core.config.DISABLE_JIT), reason="nothing is compiled without numba's compiler"
)


def _tripled(x):
    return 3 * x


@pytest.fixture(name="folder")
def _folder(tmp_path, monkeypatch):
    """Place the cache in a folder of the test's own, where each warning is told again."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path / "cache"))
    cache._warn_once.cache_clear()
    yield tmp_path / "cache"
    cache._warn_once.cache_clear()


def _ask() -> tuple[int, list[str]]:
    """Call the kernel as a new process would; return how often it compiled, and the warnings."""
    tripled = kernel(_tripled)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", cache.KernelCacheWarning)
        assert tripled(2) == 6
    found = [str(each.message) for each in told if each.category is cache.KernelCacheWarning]
    return sum(tripled.stats.cache_misses.values()), found


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*.nb[ic]"))


def _flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8 % len(content)] ^= 1 << bit % 8
    return bytes(changed)


_DAMAGES = {
    "empty": lambda content: b"",
    "cut short": lambda content: content[: len(content) // 2],
    "one byte short": lambda content: content[:-1],
    "zeros": lambda content: bytes(len(content)),
    "a bit of the beginning": lambda content: _flipped(content, 3),
    "a bit of the middle": lambda content: _flipped(content, 4 * len(content)),
    "more": lambda content: content + b"\0",
    "another pickle": lambda content: pickle.dumps([1, 2]),
}


@_COMPILED
@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_a_damaged_file_is_removed_told_once_and_written_anew(folder, suffix):
    """Each answer is right, and the next process finds a whole kernel."""
    assert _ask()[0] == 1
    for damage in _DAMAGES.values():
        cache._warn_once.cache_clear()
        (path,) = (each for each in _files(folder) if each.suffix == suffix)
        path.write_bytes(damage(path.read_bytes()))
        compiled, told = _ask()
        assert compiled == 1
        assert len(told) == 1 and "damaged" in told[0] and str(folder) in told[0]
        assert _ask() == (0, [])
        assert len(_files(folder)) == 2


@_COMPILED
def test_what_can_be_read_but_not_loaded_is_compiled_anew(folder):
    """A file that is as it was written, but of which numba can't make a kernel."""
    _ask()
    (index,) = folder.rglob("*.nbi")
    stored = kernel(_tripled)._cache._cache_file
    (key,) = stored._names()
    stored.save(key, ("not", "a", "kernel"))
    compiled, told = _ask()
    assert (compiled, len(told)) == (1, 1)
    assert _ask() == (0, [])
    assert index.exists()


def _ask_on_top() -> tuple[int, list[str]]:
    """Call a kernel that calls another, whose code is loaded; say how often that was compiled."""
    tripled = kernel(_tripled)
    assert tripled(2) == 6
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", cache.KernelCacheWarning)
        assert numba.njit(lambda x: tripled(x) + 1)(2) == 7
        assert tripled(3) == 9
    return sum(tripled.stats.cache_misses.values()), [str(each.message) for each in told]


@_COMPILED
def test_bitcode_is_read_when_a_caller_is_compiled(folder):
    """A call from Python opens none of it; one that is gone or damaged is made anew, once."""
    _ask()
    (bitcode,) = folder.rglob("*.nbb")
    assert _ask_on_top() == (0, [])
    content = bitcode.read_bytes()
    for damage, told in ((None, 0), (content[:-1], 1), (b"", 1)):
        cache._warn_once.cache_clear()
        (bitcode,) = folder.rglob("*.nbb")
        if damage is None:
            bitcode.unlink()
        else:
            bitcode.write_bytes(damage)
        assert _ask() == (0, [])
        compiled, said = _ask_on_top()
        assert (compiled, len(said)) == (1, told)
        assert _ask_on_top() == (0, [])


def test_no_bit_of_a_file_can_be_flipped_unnoticed(tmp_path):
    """Bits of all bytes of an index and of an entry."""
    files = KernelFiles(str(tmp_path), "f", "stamp")
    files.save("key", "machine code")
    for path in _files(tmp_path):
        content = path.read_bytes()
        for bit in range(0, 8 * len(content), 7):
            path.write_bytes(_flipped(content, bit))
            with pytest.raises(ValueError, match="is damaged"):
                files.load("key")
        path.write_bytes(content)
    assert files.load("key") == "machine code"


def test_nothing_is_unpickled_before_its_digest_is_checked(tmp_path, monkeypatch):
    """A pickle may call anything."""
    files = KernelFiles(str(tmp_path), "f", "stamp")
    files.save("key", "machine code")
    for path in _files(tmp_path):
        content = path.read_bytes()
        path.write_bytes(b"cos\nabort\n(tR.")
        with pytest.raises(ValueError, match="is damaged"):
            files.load("key")
        path.write_bytes(content)


def test_an_entry_replaces_the_older_one_of_its_key_only(tmp_path):
    """Files that no entry leads to are removed."""
    files = KernelFiles(str(tmp_path), "f", "stamp")
    for key, data in (("a", 1), ("b", 2), ("a", 3)):
        files.save(key, data)
    assert [files.load(key) for key in "abc"] == [3, 2, None]
    assert len(_files(tmp_path)) == 3
    assert KernelFiles(str(tmp_path), "f", "another stamp").load("a") is None


def test_an_entry_of_another_key_is_never_loaded(tmp_path):
    """Also not after the index was lost, and then a new one was written without its entry."""
    files = KernelFiles(str(tmp_path), "f", "stamp")
    files.save("a", "code of a")
    (old,) = tmp_path.glob("*.nbc")
    content = old.read_bytes()
    (tmp_path / "f.nbi").unlink()
    files.save("b", "code of b")
    (new,) = tmp_path.glob("*.nbc")
    new.write_bytes(content)
    with pytest.raises(ValueError, match="is damaged"):
        files.load("b")


_POWER_CUT = """
import os
import sys

synced = set()
fsync, replace = os.fsync, os.replace

def identity(status):
    return status.st_dev, status.st_ino

def note(handle):
    fsync(handle)
    synced.add(identity(os.fstat(handle)))

def replace_as_if_the_power_went_then(source, target, **folders):
    if identity(os.stat(source)) not in synced:
        os.truncate(source, 0)
    replace(source, target, **folders)

os.fsync, os.replace = note, replace_as_if_the_power_went_then

from scene_graph_ros.geometry.compiled.kernel_files import KernelFiles

KernelFiles(sys.argv[1], "f", "stamp").save("key", "machine code")
"""


def test_a_power_cut_leaves_whole_files(tmp_path):
    """What was not synced before it replaced a file is empty after a power cut."""
    subprocess.run([sys.executable, "-c", _POWER_CUT, str(tmp_path)], check=True)
    assert KernelFiles(str(tmp_path), "f", "stamp").load("key") == "machine code"


def test_the_shim_of_the_power_cut_drops_what_was_not_synced(tmp_path):
    """Else the test above would prove nothing."""
    unsynced = _POWER_CUT.replace("    fsync(handle)\n    synced", "    return\n    synced")
    subprocess.run([sys.executable, "-c", unsynced, str(tmp_path)], check=True)
    assert [path.stat().st_size for path in _files(tmp_path)] == [0, 0]


def _status(mode: int, user: int) -> os.stat_result:
    return os.stat_result((mode, 0, 0, 1, user, 0, 0, 0, 0, 0))


def test_folders_of_the_user_and_of_root_that_nobody_else_writes_are_trusted():
    """All combinations of owners and rights."""
    me = os.geteuid()
    for user, mode in itertools.product((me, 0, me + 1), (0o700, 0o755, 0o775, 0o702)):
        is_trusted = user in (me, 0) and mode in (0o700, 0o755)
        assert (why_not_trusted(_status(mode, user)) == "") == is_trusted


@_COMPILED
def test_a_new_cache_is_the_users_alone(folder):
    """Whatever the umask."""
    before = os.umask(0)
    try:
        _ask()
    finally:
        os.umask(before)
    assert folder.stat().st_mode & 0o777 == 0o700
    for path in folder.rglob("*.nb[ic]"):
        assert not why_not_trusted(path.stat()) and not why_not_trusted(path.parent.stat())


@_COMPILED
@pytest.mark.parametrize("which", ["the cache", "a module's folder", "a file"])
def test_code_that_others_may_have_written_is_not_run(folder, which):
    """It is compiled without being kept, or kept anew; one sentence says why."""
    _ask()
    (path,) = folder.rglob("*.nbc")
    path = {"the cache": folder, "a module's folder": path.parent, "a file": path}[which]
    path.chmod(path.stat().st_mode | 0o022)
    digests = {each: hashlib.blake2b(each.read_bytes()).digest() for each in _files(folder)}
    compiled, told = _ask()
    assert (compiled, len(told)) == (1, 1)
    if which == "a file":
        assert _ask() == (0, [])
        return
    assert f"{path} can be written by other users" in told[0]
    assert "SCENE_GRAPH_ROS_KERNEL_CACHE" in told[0]
    assert _ask()[0] == 1
    assert digests == {
        each: hashlib.blake2b(each.read_bytes()).digest() for each in _files(folder)
    }


def test_the_command_that_compiles_refuses_a_folder_that_others_may_write(folder):
    """``cache_problem`` says it to all who ask before they compile."""
    folder.mkdir(mode=0o700)
    assert cache.cache_problem() == ""
    folder.chmod(0o777)
    assert "neither read nor kept" in cache.cache_problem()

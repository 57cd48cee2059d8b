"""The cache of compiled kernels, shared by all processes of a user."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

_MODULE = """
import sys
import time
from scene_graph_ros.geometry.compiled import kernel

from scene_graph_ros.geometry.compiled.kernel_files import KernelFiles

slow_index = KernelFiles._save_index
def save_slowly(self, entries):
    time.sleep(1.0)  # so that the processes overlap in saving
    slow_index(self, entries)
KernelFiles._save_index = save_slowly

@kernel.kernel
def doubled(x):
    return x + x

print(*(doubled(value) for value in eval(sys.argv[1])), kernel.compilation_count())
"""


_ASK = """
import sys
import numpy as np
from scene_graph_ros.geometry.compiled import cache, kernel
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions

print(poses_from_quaternions(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]))[0].trace())
print(kernel.compilation_count())
"""
_PACKAGE = Path(__file__).parents[3] / "scene_graph_ros"


def _ask(root: Path, cache: Path) -> tuple[list[str], str]:
    """Run a kernel of the package below ``root``; return the printed lines and the warnings."""
    variables = {"SCENE_GRAPH_ROS_KERNEL_CACHE": str(cache), "PYTHONPATH": str(root)}
    command = [sys.executable, "-c", _ASK]
    done = subprocess.run(
        command, env=os.environ | variables, cwd=root, capture_output=True, text=True, check=True
    )
    return done.stdout.split(), done.stderr


def _copy(root: Path) -> Path:
    shutil.copytree(_PACKAGE, root / "scene_graph_ros")
    return root


def test_a_copied_installation_finds_its_kernels(tmp_path):
    """Kernels are found by what their sources say, wherever the sources are."""
    cache = tmp_path / "cache"
    (_, compiled), _ = _ask(_copy(tmp_path / "first"), cache)
    assert int(compiled) > 0
    assert _ask(_copy(tmp_path / "second"), cache)[0] == ["4.0", "0"]


def test_the_first_kernel_to_be_compiled_is_told_with_the_remedy(tmp_path):
    """Whoever uses the core as a library is warned once; with the kernels there, not at all."""
    root = _copy(tmp_path)
    for told in (1, 0):
        _, warnings = _ask(root, tmp_path / "cache")
        assert warnings.count("KernelCompilationWarning: kernel ") == told
        assert warnings.count("`python -m scene_graph_ros.warmup`") == told


def test_only_what_depends_on_a_changed_file_is_compiled_again(tmp_path):
    """A change of a file that a kernel's module does not import leaves the kernel's code valid."""
    cache, root = tmp_path / "cache", _copy(tmp_path)
    _ask(root, cache)
    geometry = root / "scene_graph_ros" / "geometry"
    with (geometry / "broadphase" / "aabb.py").open("a") as file:
        file.write("# changed\n")
    assert _ask(root, cache)[0] == ["4.0", "0"]
    with (geometry / "spatial" / "pose_kernels.py").open("a") as file:
        file.write("# changed\n")
    assert int(_ask(root, cache)[0][1]) > 0


def test_a_change_of_how_kernels_are_compiled_counts_for_all(tmp_path):
    """Also for a kernel whose module imports little: it may be called with lanes."""
    cache, root = tmp_path / "cache", _copy(tmp_path)
    _ask(root, cache)
    with (root / "scene_graph_ros" / "geometry" / "compiled" / "lanes.py").open("a") as file:
        file.write("# changed\n")
    assert int(_ask(root, cache)[0][1]) > 0


def test_kernels_of_sources_that_changed_since_they_were_imported_are_not_kept(tmp_path):
    """Else the code of the old ones would be kept for the new ones."""
    root = _copy(tmp_path)
    file = root / "scene_graph_ros" / "geometry" / "spatial" / "pose_kernels.py"
    change = f"with open({str(file)!r}, 'a') as file: file.write('# changed')\nprint("
    command = [sys.executable, "-c", _ASK.replace("print(", change, 1)]
    variables = {"SCENE_GRAPH_ROS_KERNEL_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(root)}
    done = subprocess.run(
        command, env=os.environ | variables, cwd=root, capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[0] == "4.0"
    assert done.stderr.count(f"{file} was changed while this process runs") == 1
    assert not [*(tmp_path / "cache").rglob("*.nbc")]


def test_a_cache_that_cannot_be_written_costs_one_warning(tmp_path):
    """Answers are right, the warning names the cause, and nothing is written elsewhere."""
    blocked = tmp_path / "a_file"
    blocked.touch()
    root = _copy(tmp_path)
    (trace, compiled), warnings = _ask(root, blocked / "cache")
    assert (trace, int(compiled) > 0) == ("4.0", True)
    assert warnings.count("KernelCacheWarning") == 1
    assert "KernelCompilationWarning" not in warnings
    assert str(blocked) in warnings
    assert not [*root.rglob("*.nbi"), *root.rglob("*.nbc")]


def _start(script: Path, values: str, cache: Path) -> subprocess.Popen[str]:
    environment = os.environ | {
        "SCENE_GRAPH_ROS_KERNEL_CACHE": str(cache),
        "PYTHONPATH": str(Path(__file__).parents[3]),
    }
    command = [sys.executable, str(script), values]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def _answer(process: subprocess.Popen[str]) -> str:
    answer, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    return answer.strip()


def test_processes_that_compile_one_kernel_at_once_keep_each_others_work(tmp_path):
    """Two types of one kernel, compiled at the same time, are both loaded later."""
    script = tmp_path / "module.py"
    script.write_text(_MODULE)
    both = [_start(script, values, tmp_path / "cache") for values in ("(3,)", "(0.5,)")]
    assert [_answer(process) for process in both] == ["6 1", "1.0 1"]
    assert _answer(_start(script, "(3, 0.5)", tmp_path / "cache")) == "6 1.0 0"


_MADE = """
from scene_graph_ros.geometry.compiled import kernel

def made(change, summand):
    @kernel.kernel
    def changed(x):
        return change(x) + summand

    return changed

@kernel.kernel
def doubled(x):
    return x + x

@kernel.kernel
def squared(x):
    return x * x

functions = [made(made(doubled, 1), 1), made(made(squared, 1), 1), made(squared, 2)]
names = {function.py_func.__qualname__ for function in functions}
print(*(function(5) for function in functions), kernel.compilation_count(), len(names))
"""


def test_kernels_made_around_kernels_are_found_again_and_told_apart(tmp_path):
    """A function that makes kernels gives each its own code and name, in each process the same."""
    script = tmp_path / "module.py"
    script.write_text(_MADE)
    assert _answer(_start(script, "", tmp_path / "cache")) == "12 27 27 7 3"
    assert _answer(_start(script, "", tmp_path / "cache")) == "12 27 27 0 3"


_KERNEL = """
from scene_graph_ros.geometry.compiled import kernel

@kernel.kernel
def first(pair):
    return pair.x
"""
_PAIR = """
from typing import NamedTuple

class Pair(NamedTuple):
    x: float
"""
_CALL = """
from scene_graph_ros.geometry.compiled import kernel
from {module} import Pair
import use

print(use.first(Pair({values})), kernel.compilation_count())
"""


def test_kernels_of_a_type_that_is_not_there_cost_no_others(tmp_path):
    """What is kept for a tuple names its module: without that it can't be read, the rest can.

    So a module that was moved leaves nothing behind that hurts, and two checkouts of which one has
    another module keep their kernels in one cache.
    """
    (tmp_path / "use.py").write_text(_KERNEL)
    script = tmp_path / "call.py"
    for module, compiled in (("here", 1), ("here", 0), ("there", 1), ("there", 0), ("here", 0)):
        for name in ("here", "there"):
            (tmp_path / f"{name}.py").unlink(missing_ok=True)
        (tmp_path / f"{module}.py").write_text(_PAIR)
        script.write_text(_CALL.format(module=module, values="0.5"))
        assert _answer(_start(script, "()", tmp_path / "cache")) == f"0.5 {compiled}"


def test_kernels_of_a_tuple_whose_fields_changed_places_are_compiled_again(tmp_path):
    """A kernel reads them by their place, and its own source says nothing of where they are."""
    (tmp_path / "use.py").write_text(_KERNEL)
    script = tmp_path / "call.py"
    script.write_text(_CALL.format(module="here", values="x=0.5, y=2.0"))
    for fields in ("x: float; y: float", "y: float; x: float", "x: float; y: float"):
        (tmp_path / "here.py").write_text(_PAIR.replace("x: float", fields))
        assert _answer(_start(script, "()", tmp_path / "cache")).startswith("0.5 ")

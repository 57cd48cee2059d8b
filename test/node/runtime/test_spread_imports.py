"""Imports in a thread that works in steps: a step before each, and libraries are bound beside."""

import _imp
import ctypes
import importlib
from importlib.machinery import ExtensionFileLoader
import shutil
import subprocess
import sys
import threading

import pytest

from scene_graph_ros.geometry.steps import calling_between_steps
from scene_graph_ros.node.runtime.spread_imports import bind_library, spread_imports

COMPILER = shutil.which("cc") or shutil.which("gcc")

# Bound, it waits until a file is there, for ten seconds at most, and keeps whether it came.
WAITS = """
#include <unistd.h>
int came = 0;
__attribute__((constructor)) static void wait_for_the_file(void) {
  for (int k = 0; k < 10000 && !came; ++k) {
    came = access("%s", F_OK) == 0;
    usleep(1000);
  }
}
"""


@pytest.fixture
def spread(monkeypatch):
    """Spread imports meanwhile."""
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    spread_imports()


def test_there_is_a_step_before_each_module(tmp_path, monkeypatch, spread):
    """Of a package that imports others; in no thread that does not work in steps."""
    for package in ("spread_a", "spread_b"):
        folder = tmp_path / package
        folder.mkdir()
        (folder / "__init__.py").write_text("".join(f"from . import m{k}\n" for k in range(5)))
        for k in range(5):
            (folder / f"m{k}.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    steps = []
    with calling_between_steps(lambda: steps.append(_imp.lock_held())):
        importlib.import_module("spread_a")
    # The lock of all imports is free, so that an update that imports something goes on.
    assert steps == 6 * [False]
    importlib.import_module("spread_b")
    assert len(steps) == 6


def test_a_library_is_bound_before_its_import_holds_the_interpreter(monkeypatch, spread):
    """In a thread that works in steps alone."""
    bound = []
    monkeypatch.setattr(
        "scene_graph_ros.node.runtime.spread_imports.bind_library",
        lambda path: bound.append((path, _imp.lock_held())),
    )
    name = next(
        name
        for name, module in list(sys.modules.items())
        if "." in name and isinstance(getattr(module, "__loader__", None), ExtensionFileLoader)
    )
    path = sys.modules[name].__file__
    package = sys.modules[name.rpartition(".")[0]]
    finders = [finder for finder in sys.meta_path if type(finder).__name__ == "_Spread"]
    assert finders[0].find_spec(name, package.__path__) is None
    with calling_between_steps(lambda: None):
        spec = finders[0].find_spec(name, package.__path__)
        assert (spec.origin, bound) == (path, [])
        spec.loader.create_module(spec)
    assert bound == [(path, False)]


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
def test_others_go_on_while_a_library_is_bound(tmp_path):
    """Its constructor waits for a file that another thread of this interpreter makes."""
    source, library, file = (tmp_path / name for name in ("waits.c", "waits.so", "file"))
    source.write_text(WAITS % file)
    subprocess.run([COMPILER, "-shared", "-fPIC", "-o", library, source], check=True)
    began = threading.Event()

    def make_the_file():
        began.wait()
        file.touch()

    beside = threading.Thread(target=make_the_file)
    beside.start()
    began.set()
    bind_library(str(library))
    beside.join()
    assert ctypes.c_int.in_dll(ctypes.CDLL(str(library)), "came").value == 1


def test_what_is_no_library_is_left_to_the_import(tmp_path):
    """Neither a file that is not there nor one of another kind is an error here."""
    (tmp_path / "text.so").write_text("text")
    bind_library(str(tmp_path / "text.so"))
    bind_library(str(tmp_path / "none.so"))

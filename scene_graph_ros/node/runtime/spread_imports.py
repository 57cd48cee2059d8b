"""Imports that a change of the scene brings about, without holding updates up.

Readers of meshes and scenes are imported when they are first needed: some six hundred modules, of
which a hundred and forty are shared libraries. The interpreter is held while such a library is
read from the disk and bound, 0.1 to 0.8 s in all, and no other thread goes on meanwhile. So, in a
thread that works in steps (`geometry.steps`), there is a step before each module, and the library
is bound by a call that holds nothing; the import then finds it bound. All that is done where a
module is made, not where it is found: finders are called with the lock of all imports held, for
which an update that imports something would wait.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import ctypes
import importlib.abc
from importlib.machinery import ExtensionFileLoader, ModuleSpec, PathFinder, SourceFileLoader
import os
import sys
from types import ModuleType

from scene_graph_ros.geometry.steps import between_steps, is_in_steps

__all__ = ["bind_library", "spread_imports"]


def bind_library(path: str) -> None:
    """Have the dynamic linker read and bind a library; other threads go on meanwhile.

    Where it can't be bound nothing happens: the import that follows says why.
    """
    with contextlib.suppress(OSError):
        file = os.open(path, os.O_RDONLY)
        try:
            os.posix_fadvise(file, 0, 0, os.POSIX_FADV_WILLNEED)
        finally:
            os.close(file)
    # ctypes.CDLL(path) would hold the interpreter; a function that it calls does not.
    dlopen = ctypes.CDLL(None).dlopen
    dlopen.argtypes, dlopen.restype = (ctypes.c_char_p, ctypes.c_int), ctypes.c_void_p
    dlopen(os.fsencode(path), sys.getdlopenflags())


class _Spread(importlib.abc.MetaPathFinder):
    """Finds modules as Python's own finder does, after a step; for threads that work in steps."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a module's place; None, for the next finder, where it is not in a folder."""
        if not is_in_steps():
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, ExtensionFileLoader | SourceFileLoader):
            _stand_back_before(spec.loader)
        return spec


def _stand_back_before(loader: ExtensionFileLoader | SourceFileLoader) -> None:
    """Have a step, and bind a library, before a loader makes its module; it makes no other."""
    make: Callable[[ModuleSpec], ModuleType | None] = loader.create_module

    def create_module(spec: ModuleSpec) -> ModuleType | None:
        between_steps()
        if isinstance(loader, ExtensionFileLoader):
            bind_library(loader.path)
        return make(spec)

    vars(loader)["create_module"] = create_module


def spread_imports() -> None:
    """Let imports in threads that work in steps stand back; for the node's own process."""
    if not any(isinstance(finder, _Spread) for finder in sys.meta_path):
        where = sys.meta_path.index(PathFinder) if PathFinder in sys.meta_path else 0
        sys.meta_path.insert(where, _Spread())

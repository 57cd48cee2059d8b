"""Run a library in a process of its own: one that ends it where it fails, or writes files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import subprocess
import sys
import tempfile
import time

import numpy as np
from numpy.typing import NDArray

__all__ = ["LibraryError", "run_library"]

_FIRST_NOTE = 3.0
_NOTES = 10.0
"""Seconds until somebody who waits is told so, and between one time and the next."""


class LibraryError(Exception):
    """The library failed, or took too long; says how."""


def run_library(
    program: str, arrays: Mapping[str, NDArray], *, patience: float, note: str
) -> dict[str, NDArray]:
    """Return the arrays that a program writes to ``result.npz`` of those in ``given.npz``.

    Both are in the folder in which it runs. On stderr ``note`` names the work, where it
    takes some seconds.

    Raises:
        LibraryError: it fails, or takes longer than ``patience`` seconds.

    """
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder, "given.npz"), **dict(arrays))  # type: ignore[arg-type]
        with subprocess.Popen(  # noqa: S603
            [sys.executable, "-c", program],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        ) as process:
            try:
                said = _wait(process, patience, note)
            except BaseException:
                process.kill()
                raise
        result = Path(folder, "result.npz")
        if process.returncode != 0 or not result.exists():
            last = said.strip().splitlines()[-1:] or [f"exit code {process.returncode}"]
            raise LibraryError(last[0])
        with np.load(result) as found:
            return {name: found[name] for name in found.files}


def _wait(process: subprocess.Popen[str], patience: float, note: str) -> str:
    """Return a process's stderr. Raises LibraryError where it has no end."""
    start, pause = time.monotonic(), _FIRST_NOTE
    while True:
        passed = time.monotonic() - start
        try:
            return process.communicate(timeout=min(pause, patience - passed))[1]
        except subprocess.TimeoutExpired:
            passed, pause = time.monotonic() - start, _NOTES
            if passed >= patience:
                raise LibraryError(f"no result in {patience:g} s") from None
            sys.stderr.write(f"{note}: {passed:.0f} s\n")
            sys.stderr.flush()

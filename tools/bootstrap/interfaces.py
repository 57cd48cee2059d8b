"""Build interface packages with the ordinary rosidl generators."""

from __future__ import annotations

from collections.abc import Sequence
import os
from pathlib import Path
import shutil

from tools.bootstrap.environment import environment_variables
from tools.bootstrap.progress import Setup

__all__ = ["build_interfaces"]

# Messages are written and read as fast as with -O3, which takes a fifth longer to build.
_FLAGS = "-O1 -DNDEBUG"


def build_interfaces(
    setup: Setup, source: Path, venv: Path, prefix: Path, options: Sequence[str] = ()
) -> None:
    """Build the package at ``source`` and install it below ``prefix``."""
    build = venv / "build" / source.name
    manifest = build / "install_manifest.txt"
    before = set(manifest.read_text().splitlines()) if manifest.exists() else set()
    cmake, env = venv / "bin" / "cmake", environment_variables(venv)
    generator = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={venv / 'bin' / 'ninja'}"]
    definitions = [
        f"-DCMAKE_INSTALL_PREFIX={prefix}",
        f"-DPython3_EXECUTABLE={venv / 'bin' / 'python'}",
        "-DCMAKE_BUILD_TYPE=Release",
        *(f"-DCMAKE_{language}_FLAGS_RELEASE={_FLAGS}" for language in ("C", "CXX")),
        "-DBUILD_TESTING=OFF",
        *options,
    ]
    setup.run([cmake, *generator, "-S", source, "-B", build, *definitions], env)
    # Ninja would take two more, which the kernels that are compiled beside it wait for.
    setup.run([cmake, "--build", build, "--parallel", str(os.cpu_count() or 1)], env)
    setup.run([cmake, "--install", build], env)
    for stale in before - set(manifest.read_text().splitlines()):
        Path(stale).unlink(missing_ok=True)
    for cache in prefix.glob(f"lib/python*/site-packages/{source.name}/**/__pycache__"):
        shutil.rmtree(cache)

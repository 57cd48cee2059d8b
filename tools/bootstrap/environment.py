"""The virtual environment: interpreter, pinned wheels, and the project itself inside it."""

from __future__ import annotations

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import sysconfig

from tools.bootstrap.progress import Setup, SetupError

__all__ = [
    "IMPORTABLE",
    "check_machine",
    "environment_variables",
    "install_locked",
    "link_project",
    "lock_files",
    "make_venv",
    "relocate_cmake_files",
    "site_packages",
]

IMPORTABLE = ("scene_graph_ros", "msg_adapters")
"""The checkout's packages that are imported by name; the messages are built and installed."""

_VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
_BUILD_MACHINE = re.compile(r"/opt/python/[^;\"<>$\s]*")


def check_machine(*, with_compiler: bool) -> None:
    """Name everything that is missing on this machine, with the remedy, before anything starts."""
    missing = []
    if sys.version_info < (3, 11):  # noqa: UP036 - anybody may start this with an older one
        missing.append(f"Python 3.11 or later (this is {_VERSION}). Remedy: install python3.12")
    try:
        import ensurepip  # noqa: F401 - probing: Debian leaves both out of python3
        import venv  # noqa: F401
    except ImportError:
        missing.append(f"Python's venv module. Remedy: apt-get install python{_VERSION}-venv")
    if with_compiler:
        for variable, names in (
            ("CC", ("cc", "gcc", "clang")),
            ("CXX", ("c++", "g++", "clang++")),
        ):
            wanted = [os.environ[variable].split()[0]] if os.environ.get(variable) else names
            if not any(shutil.which(name) for name in wanted):
                missing.append(
                    f"a compiler ({' or '.join(wanted)}), which the messages are built with. "
                    "Remedy: apt-get install gcc g++"
                )
        if not Path(sysconfig.get_path("include"), "Python.h").is_file():
            missing.append(f"Python's headers. Remedy: apt-get install python{_VERSION}-dev")
    if missing:
        raise SetupError("Missing on this machine:\n" + "\n".join(f"- {m}" for m in missing))


def site_packages(venv: Path) -> Path:
    """Return the folder that holds the packages of a virtual environment of this Python."""
    return venv / "lib" / f"python{_VERSION}" / "site-packages"


def make_venv(setup: Setup, venv: Path) -> None:
    """Make a virtual environment, or accept the one that is there if it is of this Python."""
    python = venv / "bin" / "python"
    if not python.exists():
        setup.run([sys.executable, "-m", "venv", venv])
        return
    probe: list[str | Path] = [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
    found = subprocess.run(probe, capture_output=True, text=True, check=False)
    if found.returncode != 0 or found.stdout.strip() != _VERSION:
        what = f"has Python {found.stdout.strip()}" if found.stdout else "has no Python that runs"
        raise SetupError(
            f"{venv} {what}, but the set-up runs with {_VERSION}.\nRemedy: make clean setup, "
            f"or make setup PYTHON=python<its version>"
        )


def lock_files(root: Path, name: str) -> list[Path]:
    """Return the files that say what is installed for ``name``: first what builds, then all."""
    folder = root / "requirements" / "locked"
    return [folder / "build.txt", folder / f"{name}.txt"]


def install_locked(setup: Setup, root: Path, venv: Path, name: str) -> None:
    """Install what ``requirements/locked/<name>.txt`` lists, each file if its hash is listed.

    The lists are complete, so there is nothing to resolve. Packages that come as sources are built
    with what is installed, since no hashes are looked at of what is fetched to build them. Where
    uv can't fetch a file, pip tries: only pip reads pip's configuration, with mirrors and proxies.
    """
    pip: list[str | Path] = [venv / "bin" / "python", "-m", "pip", "install", "--no-input"]
    pip += ["--disable-pip-version-check", "--progress-bar", "off", "--no-compile"]
    locked = ["--require-hashes", "--no-deps", "--no-build-isolation", "-r"]
    build, wanted = lock_files(root, name)
    setup.run([*pip, *locked, build])
    # A cache of its own, whose files become those of the environment without being copied.
    cache = venv / "setup" / "uv"
    uv: list[str | Path] = [venv / "bin" / "uv", "pip", "install", "--python", venv / "bin/python"]
    uv += ["--cache-dir", cache, "--link-mode", "hardlink"]
    try:
        setup.run([*uv, *locked, wanted])
    except SetupError as error:
        if setup.is_stopped:
            raise
        print(f"wheels {name}: uv could not install them, so pip does: {_last_line(error)}")
        setup.run([*pip, *locked, wanted])
    finally:
        shutil.rmtree(cache, ignore_errors=True)


def _last_line(error: SetupError) -> str:
    """Return the last line of what a command said that failed."""
    lines = [line.strip() for line in str(error).splitlines()[:-1] if line.strip()]
    return lines[-1]


def relocate_cmake_files(venv: Path) -> None:
    """Replace the build machine's include folders in the wheels' CMake files by this one's."""
    numpy_include = site_packages(venv) / "numpy" / "_core" / "include"
    python_include = sysconfig.get_path("include")
    for file in sorted((venv / "share").glob("*/cmake/*.cmake")):
        text = file.read_text()
        for found in set(_BUILD_MACHINE.findall(text)):
            if found.endswith("/numpy/_core/include"):
                text = text.replace(found, str(numpy_include))
            elif found.endswith(f"/include/python{_VERSION}"):
                text = text.replace(found, python_include)
            else:
                raise SetupError(f"{file} has an unknown path of its build machine: {found}")
        if text != file.read_text():
            file.write_text(text)


def environment_variables(venv: Path) -> dict[str, str]:
    """Return the variables with which CMake and the generators find the environment."""
    path = os.pathsep.join([str(venv / "bin"), os.environ.get("PATH", os.defpath)])
    return {
        **os.environ,
        "PATH": path,
        "AMENT_PREFIX_PATH": str(venv),
        "CMAKE_PREFIX_PATH": str(venv),
    }


def link_project(root: Path, venv: Path, *, with_ros: bool) -> None:
    """Make the checkout importable and findable, as `colcon build --symlink-install` would.

    Only its packages are importable, by links: a checkout on ``sys.path`` has folders that are
    called as modules of others, such as ``launch``. Any `.venv/bin/python` finds them without a
    `source` first: ROS's wheels look after the library path, and the line written here after the
    ament index.
    """
    installed = site_packages(venv)
    for name in IMPORTABLE:
        _link(installed / name, root / name)
    start = installed / "scene_graph_ros.pth"
    if not with_ros:
        start.unlink(missing_ok=True)
        return
    index_line = "import os, sys; os.environ.setdefault('AMENT_PREFIX_PATH', sys.prefix)"
    start.write_text(index_line + "\n")
    share = venv / "share" / "scene_graph_ros"
    share.mkdir(parents=True, exist_ok=True)
    for name in ("package.xml", "launch", "config"):
        _link(share / name, root / name)
    index = venv / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / "scene_graph_ros").touch()


def _link(link: Path, target: Path) -> None:
    """Have a link lead to a file or folder, also where it led to another one."""
    if not link.is_symlink() or link.readlink() != target:
        link.unlink(missing_ok=True)
        link.symlink_to(target)

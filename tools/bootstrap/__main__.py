"""Set the project up: `python3 -m tools.bootstrap`, from the project's root."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import fcntl
import functools
import os
from pathlib import Path
import subprocess
import sys
import time

from tools.bootstrap import environment, interfaces
from tools.bootstrap.progress import digest, Setup, SetupError

_ROOT = Path(__file__).resolve().parents[2]
_OWN_SOURCE = Path(__file__).resolve().parent


def _wheels(setup: Setup, venv: Path, name: str, product: str = "numpy") -> str:
    """Make the environment and install what is locked for ``name``; return a key of it."""
    python = venv / "bin" / "python"
    make = functools.partial(environment.make_venv, setup, venv)
    setup.step("Python environment", sys.version, [python], make)
    return _install(setup, venv, name, product)


def _install(setup: Setup, venv: Path, name: str, product: str) -> str:
    """Install what is locked for ``name`` and not there yet; return a key of it."""

    def install() -> None:
        environment.install_locked(setup, _ROOT, venv, name)
        environment.relocate_cmake_files(venv)

    key = digest(environment.lock_files(_ROOT, name), sys.version)
    products = [environment.site_packages(venv) / product]
    setup.step(f"wheels {name}", key, products, install)
    return key


def _interfaces(
    setup: Setup, venv: Path, source: Path, prefix: Path, wheels: str, *options: str
) -> None:
    packages = prefix / environment.site_packages(venv).relative_to(venv)
    setup.step(
        f"messages {source.name}",
        digest([source, _OWN_SOURCE / "interfaces.py"], wheels, *options),
        [packages / source.name],
        lambda: interfaces.build_interfaces(setup, source, venv, prefix, options),
    )


def _kernels(setup: Setup, venv: Path, wheels: str, name: str, options: list[str] | None) -> None:
    """Compile kernels now, so that no query ever does; they are kept in the user's cache.

    Without ``options`` there is nothing to do any more but to remember it.
    """
    python = venv / "bin" / "python"
    record = venv / "setup" / "kernel_cache"
    ask = "from scene_graph_ros.geometry.compiled.cache import cache_root; print(cache_root())"

    def compile_kernels() -> None:
        if options is None:
            return
        # Without ROS's libraries, which may be half installed when these begin.
        env = {**os.environ, "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
        setup.run([python, "-m", "scene_graph_ros.warmup", *options], env)
        answer = subprocess.run(
            [python, "-c", ask], env=env, capture_output=True, text=True, check=True
        )
        record.write_text(answer.stdout.strip())

    cache = [Path(record.read_text())] if record.is_file() else []
    variables = [
        f"{n}={os.environ.get(n)}" for n in ("SCENE_GRAPH_ROS_KERNEL_CACHE", "XDG_CACHE_HOME")
    ]
    package = _ROOT / "scene_graph_ros"
    with_kernels = ("convex", "geometry", "planning", "robots", "trajectories", "warmup")
    sources = [package / folder for folder in with_kernels]
    setup.step(name, digest(sources, wheels, *variables), [record, *cache], compile_kernels)


def _set_up_project(
    venv: Path, kernels: Sequence[str], *beside: Callable[[], None], with_tests: bool
) -> None:
    """Make `.venv`: what a node, its tests and the checks of the source need.

    ``kernels`` are "main" for those of the main job and of points, "demo" for those of the main
    job and of cameras, "all" for those of all capabilities, too. They need the core's wheels
    alone, so they are compiled while all else is installed and built, most of which is done by
    one process at a time; ``beside`` is done then, too.
    """
    environment.check_machine(with_compiler=True)
    setup = Setup(venv / "setup", count=4 + 2 * with_tests + len(kernels))

    def compile_kernels(core: str) -> None:
        # All at once: the last ones of the main job do not keep all processors busy.
        if "all" in kernels:
            _kernels(setup, venv, core, "kernels on demand", ["--all"])
        if "demo" in kernels:
            _kernels(setup, venv, core, "kernels of the demo", ["cameras"])
        if "main" in kernels:
            _kernels(setup, venv, core, "kernels", None if "all" in kernels else [])

    def install_and_compile() -> None:
        core = _wheels(setup, venv, "core")
        setup.side_by_side(
            lambda: compile_kernels(core), lambda: _install_ros(setup, venv, with_tests)
        )

    setup.side_by_side(install_and_compile, *beside)
    environment.link_project(_ROOT, venv, with_ros=True)


def _install_ros(setup: Setup, venv: Path, with_tests: bool) -> None:
    """Install the wheels that the core does without, and build the messages, also the tests'."""
    wheels = _install(setup, venv, "project", "rclpy")
    only_python = "-DONLY_PYTHON=ON"
    _interfaces(setup, venv, _ROOT / "scene_graph_msgs", venv, wheels, only_python)
    if with_tests:
        workspace = _ROOT / "test" / "workspace"
        for package in ("control_msgs", "octomap_msgs", "tf2_msgs"):
            _interfaces(setup, venv, workspace / package, venv / "test_workspace", wheels)


def _set_up_core(venv: Path) -> None:
    """Make `.venv-core`: the core and its tests, without ROS."""
    environment.check_machine(with_compiler=False)
    _wheels(Setup(venv / "setup", count=2), venv, "core")
    environment.link_project(_ROOT, venv, with_ros=False)


def _set_up_peers(venv: Path) -> None:
    """Add to `.venv` the engines that benchmarks compare with."""
    environment.check_machine(with_compiler=False)
    _wheels(Setup(venv / "setup", count=2), venv, "peers", "mujoco")


def _set_up_workspace(venv: Path) -> None:
    """Make `.venv-colcon`: what builds a workspace, with a Python of its own, as Debian's has."""
    environment.check_machine(with_compiler=True)
    _wheels(Setup(venv / "setup", count=2), venv, "workspace", "colcon_core")


def _set_up_docs(venv: Path) -> None:
    """Add to `.venv` what writes the pages and the API reference."""
    environment.check_machine(with_compiler=False)
    _wheels(Setup(venv / "setup", count=2), venv, "docs", "pdoc")


def _absolute(path: str) -> Path:
    """Return a path that CMake's files may name, wherever they are read."""
    return Path(path).absolute()


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python3 -m tools.bootstrap", description=__doc__)
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--core", action="store_true", help="only .venv-core, without ROS")
    choice.add_argument("--docs", action="store_true", help="only what writes pages, into .venv")
    choice.add_argument("--peers", action="store_true", help="only the peers, into .venv")
    choice.add_argument("--workspace", action="store_true", help="only colcon, into .venv-colcon")
    choice.add_argument("--without-kernels", action="store_true", help="do not compile kernels")
    choice.add_argument("--demo", action="store_true", help="only the kernels that it asks for")
    choice.add_argument(
        "--all-kernels", action="store_true", help="compile also what scenes may ask for"
    )
    choice.add_argument(
        "--for-tests", action="store_true", help="all kernels, and .venv-core beside"
    )
    parser.add_argument(
        "--venv", type=_absolute, default=_ROOT / ".venv", help="another environment than .venv"
    )
    arguments = parser.parse_args()
    start = time.monotonic()
    lock = os.open(_ROOT, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print("Another set-up of this checkout is running: waiting for it to end.", flush=True)
        fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        if arguments.core:
            _set_up_core(_ROOT / ".venv-core")
        elif arguments.docs:
            _set_up_docs(_ROOT / ".venv")
        elif arguments.peers:
            _set_up_peers(_ROOT / ".venv")
        elif arguments.workspace:
            _set_up_workspace(_ROOT / ".venv-colcon")
        else:
            is_for_tests = arguments.all_kernels or arguments.for_tests
            wanted = {
                "all": is_for_tests,
                "demo": arguments.demo,
                "main": not (arguments.without_kernels or arguments.demo),
            }
            core = functools.partial(_set_up_core, _ROOT / ".venv-core")
            _set_up_project(
                arguments.venv,
                [name for name in wanted if wanted[name]],
                *[core] * arguments.for_tests,
                with_tests=is_for_tests,
            )
    except SetupError as error:
        print(f"\nThe set-up stopped: {error}", file=sys.stderr)
        return 1
    print(f"Set up in {time.monotonic() - start:.1f} s.")
    return 0


if __name__ == "__main__":
    sys.exit(_main())

"""Build both packages with colcon from a copy of the checkout, and use what is installed.

Run as `.venv/bin/python -m tools.workspace` from the project's root. The interpreter's prefix
stands for the ROS installation; everything of the project itself must come from the workspace.
Colcon is that of another environment, with another Python, as Debian's is: `.venv` is active, and
has none. The node is started by its installed program, as `ros2 run` does it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

from tools.bootstrap.environment import environment_variables
from tools.bootstrap.progress import Setup, SetupError

_ROOT = Path(__file__).resolve().parents[2]
_VENV = Path(sys.prefix)
_COLCON = _ROOT / ".venv-colcon" / "bin" / "colcon"
_WORKSPACE = _VENV / "workspace"
_SCENE = "package://scene_graph_ros/config/scenes/panda_cell.yaml"
_STOP_SECONDS = 20.0
_ACTIVE_PYTHON = "/env python3"
"""What runs programs of a workspace: the Python of the environment that is active."""


def copy_checkout(source: Path, target: Path) -> None:
    """Copy what git tracks, or would, of a checkout, with the times of its files."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=source, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        raise SetupError(f"git does not list the files of {source}: {listed.stderr.strip()}")
    for name in filter(None, listed.stdout.split("\0")):
        if (source / name).is_file():  # not one that was removed since
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source / name, target / name)


def _prepare() -> None:
    """Lay out the workspace; of an older one only the built messages stay."""
    for old in ("src", "install", "build/scene_graph_ros"):
        shutil.rmtree(_WORKSPACE / old, ignore_errors=True)
    copy_checkout(_ROOT, _WORKSPACE / "src" / "scene_graph_ros")


def _build(setup: Setup) -> None:
    """Build as README says, with the compiler's driver that the environment has."""
    source = _WORKSPACE / "src" / "scene_graph_ros"
    folders: list[str | Path] = [
        *("--build-base", _WORKSPACE / "build", "--install-base", _WORKSPACE / "install"),
        *("--base-paths", source, source / "scene_graph_msgs"),
    ]
    cmake: list[str | Path] = [
        *("--cmake-args", "-GNinja", f"-DCMAKE_MAKE_PROGRAM={_VENV / 'bin' / 'ninja'}"),
        f"-DPython3_EXECUTABLE={_VENV / 'bin' / 'python'}",
        "-DBUILD_TESTING=OFF",
    ]
    colcon: list[str | Path] = [_COLCON, "--log-base", _WORKSPACE / "log"]
    # Else colcon has one thing compiled at a time while others are at work on the machine.
    jobs = str(os.cpu_count() or 1)
    parallel = {"MAKEFLAGS": f"-j{jobs}", "CMAKE_BUILD_PARALLEL_LEVEL": jobs}
    setup.run([*colcon, "build", *folders, *cmake], {**environment_variables(_VENV), **parallel})


def sourced(script: Path, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a shell that has sourced ``script``."""
    command = ["bash", "-c", 'source "$0" && env -0', str(script)]
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        raise SetupError(f"{script} can't be sourced: {answer.stderr.strip()}")
    return dict(line.split("=", 1) for line in answer.stdout.split("\0") if line)


def program(package: str, name: str, environment: Mapping[str, str]) -> Path:
    """Return the program that `ros2 run` would start, in a sourced environment."""
    prefixes = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    for prefix in map(Path, prefixes):
        if (prefix / "share/ament_index/resource_index/packages" / package).is_file():
            found = prefix / "lib" / package / name
            if not os.access(found, os.X_OK):
                raise SetupError(f"{prefix} holds {package}, but no program {found}")
            return found
    raise SetupError(f"no prefix of {prefixes} holds the package {package}")


def first_line(script: Path) -> str:
    """Return the line that says what runs a program."""
    with script.open("rb") as file:
        return file.readline(1000).decode(errors="replace").strip()


@contextlib.contextmanager
def _node(environment: Mapping[str, str]) -> Iterator[None]:
    """Run the installed node on the example scene; it must end well when it is asked to."""
    installed = program("scene_graph_ros", "scene_graph_node", environment)
    if not installed.is_relative_to(_WORKSPACE):
        raise SetupError(f"{installed} would run, which is not of {_WORKSPACE}")
    first = first_line(installed)
    if not first.endswith(_ACTIVE_PYTHON):
        raise SetupError(f"{installed} begins with {first!r}: it would run with another Python")
    print(f"node: {installed}, {first}")
    command = [str(installed), "--ros-args", "-p", f"scene:={_SCENE}", "--log-level", "warn"]
    process = subprocess.Popen(command, env=dict(environment), cwd=_WORKSPACE)
    try:
        yield
        if process.poll() is not None:
            raise SetupError(f"the node ended by itself with exit code {process.returncode}")
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            code = process.wait(_STOP_SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
    if code != 0:
        raise SetupError(f"the node ended with exit code {code} when it was interrupted")
    print("node: ended when it was interrupted, exit code 0")


def _use() -> None:
    """Ask the installed node, from a process that has nothing but the workspace either."""
    environment = environment_variables(_VENV)
    environment.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    environment.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    environment = sourced(_WORKSPACE / "install" / "setup.bash", environment)
    client = [sys.executable, str(Path(__file__).with_name("client.py")), str(_WORKSPACE)]
    with _node(environment):
        subprocess.run(client, env=environment, cwd=_WORKSPACE, check=True)


def _main() -> int:
    start = time.monotonic()
    setup = Setup(_WORKSPACE, count=2)
    always = str(time.time_ns())
    try:
        setup.step("copy of the checkout", always, [_WORKSPACE / "src"], _prepare)
        product = _WORKSPACE / "install" / "setup.bash"
        setup.step("colcon build", always, [product], lambda: _build(setup))
        _use()
    except SetupError as error:
        print(f"\nThe workspace does not work: {error}", file=sys.stderr)
        return 1
    except subprocess.CalledProcessError as error:
        print(f"\nThe client ended with exit code {error.returncode}", file=sys.stderr)
        return 1
    print(f"The workspace works: built and used in {time.monotonic() - start:.0f} s.")
    return 0


if __name__ == "__main__":
    sys.exit(_main())

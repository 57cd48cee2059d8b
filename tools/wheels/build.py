"""Write the wheels of this environment's Python: ``python -m tools.wheels.build --out FOLDER``."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys

from scene_graph_ros.geometry.compiled.kernel_packs import BASELINES
from scene_graph_ros.warmup.groups import GROUPS
from tools.wheels.messages import write_messages_wheel

_ROOT = Path(__file__).resolve().parents[2]
_SOURCES = ("scene_graph_ros", "msg_adapters", "launch", "config", "resource")
_FILES = ("setup.py", "setup.cfg", "package.xml", "README.md", "LICENSE")
_TAG = f"cp{sys.version_info.major}{sys.version_info.minor}"
_PLATFORM = f"linux_{platform.machine()}"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tools.wheels.build", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--venv", type=Path, required=True, help="in which messages were built")
    parser.add_argument("--groups", nargs="+", choices=list(GROUPS), default=list(GROUPS))
    parser.add_argument("--baselines", nargs="+", choices=list(BASELINES), default=list(BASELINES))
    given = parser.parse_args()
    if platform.machine() != "x86_64":
        sys.exit(f"kernels are packed for levels of x86-64; this machine is {platform.machine()}")
    work = _ROOT / "build" / "wheels" / _TAG
    packs = [_pack(work, baseline, given.groups) for baseline in given.baselines]
    given.out.mkdir(parents=True, exist_ok=True)
    tag = f"{_TAG}-{_TAG}-{_PLATFORM}"
    print(write_messages_wheel(_ROOT, given.venv, given.out, tag))
    print(_write_core_wheel(work, packs, given.out))


def _pack(work: Path, baseline: str, groups: list[str]) -> Path:
    """Compile kernels for a baseline, as far as they are not compiled yet, and pack them."""
    pack = work / "packs" / f"{baseline}.pack"
    command = [sys.executable, "-m", "scene_graph_ros.warmup.pack", str(pack), "--groups", *groups]
    variables = {
        "NUMBA_CPU_NAME": baseline,
        "NUMBA_CPU_FEATURES": "",
        "SCENE_GRAPH_ROS_KERNEL_CACHE": str(work / "kernels" / baseline),
    }
    print(f"kernels for {baseline}", flush=True)
    subprocess.run(command, env=os.environ | variables, check=True)
    return pack


def _write_core_wheel(work: Path, packs: list[Path], out: Path) -> Path:
    """Build the wheel of the packages from a copy that has the kernels."""
    stage = work / "stage"
    shutil.rmtree(stage, ignore_errors=True)
    stage.mkdir(parents=True)
    for name in _SOURCES:
        ignored = shutil.ignore_patterns("__pycache__", "kernels" if name == _SOURCES[0] else "")
        shutil.copytree(_ROOT / name, stage / name, ignore=ignored)
    for name in _FILES:
        shutil.copy(_ROOT / name, stage / name)
    folder = stage / "scene_graph_ros" / "kernels"
    folder.mkdir()
    for pack in packs:
        shutil.copy(pack, folder / pack.name)
    kind = ["bdist_wheel", "--python-tag", _TAG, "--plat-name", _PLATFORM]
    made = stage / "dist"
    subprocess.run(
        [sys.executable, "-W", "ignore", "setup.py", "--quiet", *kind, "--dist-dir", str(made)],
        cwd=stage,
        check=True,
    )
    (wheel,) = made.glob("*.whl")
    return Path(shutil.move(wheel, out / wheel.name))


if __name__ == "__main__":
    main()

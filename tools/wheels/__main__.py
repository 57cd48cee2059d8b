"""Write wheels to `dist`: `python3 -m tools.wheels [3.11 3.12]`, from the project's root.

Each Python gets an environment of its own, in which the messages are built; without versions it is
the one that runs this, with `.venv`. Only the standard library is imported here.
"""

from __future__ import annotations

import argparse
import hashlib
import os
from pathlib import Path
import shutil
import subprocess
import sys

_ROOT = Path(__file__).resolve().parents[2]


def _python(version: str) -> str:
    """Return the first interpreter of a version that runs: a version manager's shim may not.

    Raises SystemExit where none does.
    """
    for folder in os.get_exec_path():
        found = shutil.which(f"python{version}", path=folder)
        if found and _version_of(found) == version:
            return found
    raise SystemExit(
        f"PYTHONS: no python{version} runs here. Remedy: apt-get install python{version} "
        f"python{version}-venv python{version}-dev"
    )


def _version_of(python: str) -> str:
    """Return an interpreter's version, "" where it does not run."""
    probe = [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
    done = subprocess.run(probe, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def _write(python: str, venv: Path, out: Path, options: list[str]) -> None:
    """Make a Python's environment, and in it the wheels."""
    setup = [python, "-m", "tools.bootstrap", "--without-kernels", "--venv", str(venv)]
    subprocess.run(setup, cwd=_ROOT, check=True)
    if out.exists():
        for old in out.glob("scene_graph_*.whl"):
            old.unlink()
    build = [str(venv / "bin" / "python"), "-m", "tools.wheels.build", "--venv", str(venv)]
    environment = {**os.environ, "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}  # nothing of ROS is run
    subprocess.run([*build, "--out", str(out), *options], cwd=_ROOT, env=environment, check=True)
    wheels = sorted(out.glob("*.whl"))
    digests = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}" for path in wheels]
    (out / "SHA256SUMS").write_text("\n".join(digests) + "\n")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python3 -m tools.wheels", description=__doc__)
    parser.add_argument("versions", nargs="*", help="of Python, such as 3.12: a folder for each")
    parser.add_argument("--groups", nargs="+", help="of kernels; all by default")
    parser.add_argument("--baselines", nargs="+", help="of processors; all by default")
    given = parser.parse_args()
    options = []
    for name in ("groups", "baselines"):
        if getattr(given, name):
            options += [f"--{name}", *getattr(given, name)]
    if not given.versions:
        _write(sys.executable, _ROOT / ".venv", _ROOT / "dist", options)
    pythons = {version: _python(version) for version in given.versions}
    for version, python in pythons.items():
        venv = _ROOT / "build" / "wheels" / f"venv-{version}"
        _write(python, venv, _ROOT / "dist" / version, options)


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as error:
        sys.exit(f"\nNo wheels were written: {' '.join(error.cmd)} ended with {error.returncode}")

"""What an installation makes importable, and what types it has."""

import json
from pathlib import Path
import re
import runpy
import shutil
import subprocess
import sys

import pytest
import setuptools
import yaml

import scene_graph_ros

ROOT = Path(__file__).parents[2]
SAMPLE = Path(__file__).with_name("sample_package")
ASK = """
import importlib.util, json, sys
found = {}
for name in sys.argv[1:]:
    spec = importlib.util.find_spec(name)
    if spec is not None:
        found[name] = [*(spec.submodule_search_locations or []), spec.origin or ""]
print(json.dumps(found))
"""


def _of_the_checkout(python, folder) -> set[str]:
    """Return which folders and modules of the checkout a Python imports by their names."""
    command = [python, "-I", "-c", ASK, *_folders()]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return {
        name
        for name, places in json.loads(done.stdout).items()
        if {Path(place).resolve() for place in places} & {ROOT / name, ROOT / f"{name}.py"}
    }


def _folders() -> list[str]:
    """Each folder and module of the checkout that has a name of Python."""
    return sorted(
        path.stem
        for path in ROOT.iterdir()
        if (path.is_dir() or path.suffix == ".py") and path.stem.isidentifier()
    )


def test_nothing_else_of_a_checkout_is_importable(installed, tmp_path):
    """Of all folders of a checkout two packages can be imported; launch is that of ROS."""
    assert {"launch", "tools", "docs", "test", "config", "examples", "setup"} <= set(_folders())
    assert _of_the_checkout(installed, tmp_path) == {"scene_graph_ros", "msg_adapters"}


def test_the_checkouts_own_environment_is_set_up_so(tmp_path):
    """The environment of `make setup` has the links, and no line that adds the checkout."""
    if not Path(sys.prefix).is_relative_to(ROOT):
        pytest.skip("this Python is not that of the checkout's own environment")
    assert _of_the_checkout(sys.executable, tmp_path) == {"scene_graph_ros", "msg_adapters"}


def test_the_version_is_one():
    """It is the same wherever it is said."""
    said = {
        re.search(pattern, (ROOT / name).read_text()).group(1)
        for name, pattern in {
            "setup.py": r'version="([^"]+)"',
            "package.xml": r"<version>([^<]+)<",
            "scene_graph_msgs/package.xml": r"<version>([^<]+)<",
            "CHANGELOG.md": r"## (\d[\d.]*)",
        }.items()
    }
    said.add(yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"])
    assert said == {scene_graph_ros.__version__}


@pytest.fixture
def sample(tmp_path) -> Path:
    """A package of a user's, which calls most of what is public."""
    copy = Path(shutil.copytree(SAMPLE, tmp_path / "sample_package"))
    (copy / "wrong.txt").rename(copy / "wrong.py")
    return copy


def test_mypy_sees_the_types(installed, sample):
    """A package is right under --strict but for the lines that are wrong: nothing is Any."""
    done = _checked(
        sample,
        "mypy",
        "--strict",
        "--no-color-output",
        *("--python-executable", str(installed), "--cache-dir", str(sample.parent / "cache")),
    )
    found = re.findall(r"^(.*):(\d+): error:", done, re.MULTILINE)
    assert {Path(file).name for file, _ in found} == {"wrong.py"}, done
    assert {int(line) for _, line in found} == _marked(sample / "wrong.py"), done


def test_pyright_sees_the_types(installed, sample):
    """The same by basedpyright, at its standard level."""
    settings = {"typeCheckingMode": "standard", "pythonVersion": "3.11"}
    (sample.parent / "pyrightconfig.json").write_text(json.dumps(settings))
    done = _checked(sample, "basedpyright", "--outputjson", "--pythonpath", str(installed))
    found = [d for d in json.loads(done)["generalDiagnostics"] if d["severity"] == "error"]
    assert {Path(d["file"]).name for d in found} == {"wrong.py"}, done
    lines = {d["range"]["start"]["line"] + 1 for d in found}
    assert lines == _marked(sample / "wrong.py"), done


def _checked(sample: Path, program: str, *options: str) -> str:
    """Return what a checker says of the package."""
    command = [sys.executable, "-m", program, *options, sample.name]
    done = subprocess.run(command, cwd=sample.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stdout + done.stderr
    return done.stdout


def _marked(file: Path) -> set[int]:
    lines = file.read_text().splitlines()
    return {number for number, line in enumerate(lines, start=1) if "# wrong" in line}


def test_an_installation_has_two_packages_and_their_types(monkeypatch):
    """`pip install` of a checkout adds no other top-level name, and the marks of types."""
    said = {}
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(setuptools, "setup", lambda **given: said.update(given))
    runpy.run_path("setup.py")
    top = {name.partition(".")[0] for name in said["packages"]}
    assert top == {"scene_graph_ros", "msg_adapters"}
    for package in ("scene_graph_ros", "msg_adapters"):
        assert "py.typed" in said["package_data"][package]
        assert (ROOT / package / "py.typed").is_file()
    folders = {p.parent.relative_to(ROOT) for p in ROOT.glob("scene_graph_ros/**/*.py")}
    assert {".".join(folder.parts) for folder in folders} <= set(said["packages"])

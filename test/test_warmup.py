"""Compiling beforehand: the groups, what each leaves to compile, and the command."""

import json
import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

from scene_graph_ros.warmup import compiler
from scene_graph_ros.warmup.__main__ import main
from scene_graph_ros.warmup.groups import GROUPS

_ROOT = Path(__file__).parents[1]

needs_kernels = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels"
)


def run(code: str) -> str:
    """Return what code prints in a process of its own, which has called no kernel yet."""
    path = [str(_ROOT), str(_ROOT / "test" / "support"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return done.stdout


@needs_kernels
@pytest.mark.timeout(900)
def test_no_query_compiles_after_the_warm_up():
    """Once warmed up, new processes that ask every query load all kernels and compile none."""
    command = [sys.executable, "-m", "scene_graph_ros.warmup", "--all"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout.startswith(f"kernels ({', '.join(GROUPS)}) are ready in ")
    assert " late)" not in done.stdout, done.stdout


def test_what_is_built_on_others_is_compiled_after_them(monkeypatch):
    """What builds on nothing that takes long is compiled beside the last of the main job."""
    monkeypatch.setattr(compiler, "is_ready", lambda group: False)
    first, then, last = compiler.Compiler(GROUPS.values())._stages()
    main, apart = GROUPS["main"], ("cameras", "convex")
    expected = [*main.tasks, *(task for name in apart for task in GROUPS[name].tasks)]
    assert [task.function for task in first] == expected
    built_on_it = [g for name, g in GROUPS.items() if name not in ("main", *apart)]
    expected = [*main.checks, *(task for group in built_on_it for task in group.tasks)]
    assert [task.function for task in then] == expected
    assert last == []


_GROUPS = """
import json
from warm_kernels import called_kernels, run_checks, run_tasks
known, found = set(), []
for run, group in {runs!r}:
    globals()[run](group)
    found.append(sorted([*kernel] for kernel in called_kernels() - known))
    known = called_kernels()
print(json.dumps(found))
"""


@needs_kernels
def test_each_group_has_what_it_adds():
    """The main one covers all main queries, and of others only what registering a body calls."""
    runs = [
        ("run_tasks", "main"),
        ("run_checks", "main"),
        ("run_tasks", "surfaces"),
        ("run_tasks", "deformable"),
        ("run_tasks", "cameras"),
        ("run_tasks", "convex"),
    ]
    base, late, *others = json.loads(run(_GROUPS.format(runs=runs)))
    on_demand = tuple(
        f"scene_graph_ros.geometry.{name}"
        for name in ("hydroelastic", "deformable", "perception", "optimization")
    )
    early = [name for module, name, _ in base if module.startswith(on_demand)]
    assert early == ["element_boxes", "linear_fields"]
    assert late == []
    for kernels, package in zip(others, on_demand, strict=True):
        assert kernels
        assert all(module.startswith(package) for module, *_ in kernels)


_OUTSIDE = """
import importlib
from warm_kernels import run_checks, run_tasks
modules = [importlib.import_module(name) for name in {names!r}]
run_tasks("main")
run_checks("main")
for module in modules:
    for name, value in vars(module).items():
        if hasattr(value, "nopython_signatures") and not value.nopython_signatures:
            print(module.__name__, name)
"""


@needs_kernels
def test_the_warm_up_has_every_kernel_that_is_called_from_outside_the_core():
    """Whoever calls a kernel directly, as what takes poses in does, finds it compiled."""
    importers = re.compile(r"from scene_graph_ros\.geometry\.[\w.]*(kernels|poses) import")
    files = [
        path.relative_to(_ROOT)
        for folder in ("scene_graph_ros/node", "scene_graph_ros/scene_files", "msg_adapters")
        for path in (_ROOT / folder).rglob("*.py")
        if importers.search(path.read_text())
    ]
    assert files
    names = [".".join(path.with_suffix("").parts) for path in files]
    assert run(_OUTSIDE.format(names=names)) == ""


def test_help_lists_the_groups(capsys):
    """With what each is for."""
    with pytest.raises(SystemExit):
        main(["--help"])
    said = capsys.readouterr().out
    for group in GROUPS.values():
        assert re.search(rf"^  {group.name} +{group.what}$", said, re.M)


def test_an_unknown_group_is_refused_by_name(capsys):
    """Those that there are, are listed."""
    with pytest.raises(SystemExit, match="2"):
        main(["surfaces", "no_group"])
    said = capsys.readouterr().err
    assert f"no group is called no_group; there are {', '.join(GROUPS)}" in said


def test_a_cache_that_can_not_be_written_is_named(tmp_path, monkeypatch, capsys):
    """Nothing is compiled that could not be kept."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path / "file" / "kernels"))
    assert main([]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "compiled kernels can't be kept" in line
    assert str(tmp_path) in line

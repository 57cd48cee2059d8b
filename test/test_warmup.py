"""Compiling beforehand: the groups, what each leaves to compile, and the command."""

import dataclasses
import heapq
import json
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

import pytest

from scene_graph_ros.warmup import __main__ as command_line
from scene_graph_ros.warmup import compiler
from scene_graph_ros.warmup.__main__ import main
from scene_graph_ros.warmup.groups import GROUPS, KernelGroup

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


class _Pretended(compiler.Compiler):
    """Says when tasks would begin and end, of some of which it is known how long they take."""

    def __init__(self, groups, seconds, processes):
        super().__init__(groups, processes=processes)
        self.seconds, self.now = seconds, 0.0
        self.began, self.ended, self.running = {}, {}, []
        self._lines = self

    def _start(self, task):
        self.began[task.function, task.is_check] = self.now
        end = self.now + self.seconds.get(task.function, 1.0)
        heapq.heappush(self.running, (end, id(task), task))

    def get(self):
        """Return the line that the next process to end leaves."""
        self.now, _, task = heapq.heappop(self.running)
        self.ended[task.function, task.is_check] = self.now
        return compiler._Line(task, "", 0)


def pretend(monkeypatch, tmp_path, seconds, processes, ready=()):
    """Compile all groups but those that are ready, in no time."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path))
    monkeypatch.setattr(compiler, "is_ready", ready.__contains__)
    pretended = _Pretended(GROUPS.values(), seconds, processes)
    assert pretended.run() == []
    return pretended


@pytest.mark.parametrize("processes", [1, 2, 3, 20])
def test_what_is_built_on_others_is_compiled_after_them(processes, monkeypatch, tmp_path):
    """Each task once, and each check after what it asks."""
    seconds = {task: 1.0 + k for k, task in enumerate(GROUPS["main"].tasks)}
    done = pretend(monkeypatch, tmp_path, seconds, processes)
    wanted = {(f, False) for g in GROUPS.values() for f in g.tasks}
    wanted |= {(f, True) for g in GROUPS.values() for f in g.checks}
    assert done.began.keys() == done.ended.keys() == wanted
    last_of_main = max(done.ended[task, False] for task in GROUPS["main"].tasks)
    for group in GROUPS.values():
        for check in group.checks:
            own = max(done.ended[task, False] for task in group.tasks)
            assert done.began[check, True] >= max(own, last_of_main)
        if group.name != "main" and not group.is_apart:
            assert all(done.began[task, False] >= last_of_main for task in group.tasks)


def test_no_process_waits_while_there_is_something_to_compile(monkeypatch, tmp_path):
    """What builds on nothing that takes long is compiled beside the rest, also for long."""
    pairs, convex, plan = (GROUPS[name].tasks[0] for name in ("main", "convex", "planning"))
    seconds = {pairs: 30.0, convex: 60.0, plan: 40.0}
    done = pretend(monkeypatch, tmp_path, seconds, 2)
    assert done.ended[pairs, False] == 30.0
    assert done.began[convex, False] < 30.0 < done.ended[convex, False]
    # Only short checks come before it.
    assert done.began[plan, False] == 30.0 + len(GROUPS["main"].checks)
    compiled = [end for (_, is_check), end in done.ended.items() if not is_check]
    # But for one of the short ones, which take a second, both end together.
    assert done.ended[plan, False] >= max(compiled) - 1.0
    # Where the main job's are there, the longest begins first, among as many as on two processors.
    done = pretend(monkeypatch, tmp_path, seconds, 3, ready=["main"])
    assert done.ended[convex, False] == 60.0 == max(done.ended.values())


def test_groups_that_are_ready_are_checked(monkeypatch, tmp_path):
    """Beside what is compiled for another."""
    done = pretend(monkeypatch, tmp_path, {}, 2, ready=[name for name in GROUPS if name != "main"])
    assert {task for task, is_check in done.began if not is_check} == set(GROUPS["main"].tasks)
    checks = {check for group in GROUPS.values() for check in group.checks or group.tasks}
    assert {task for task, is_check in done.began if is_check} == checks


class _Counted(_Pretended):
    """Compiles one kernel for each task, in the second before it ends."""

    def get(self):
        """Return the line of the kernel, then that of the end."""
        if self.running and self.running[0][2] not in self.told:
            self.told.add(self.running[0][2])
            return compiler._Line(self.running[0][2], f"{compiler.COMPILED}kernel")
        return super().get()

    def run(self, tell):
        """Compile, and keep what is told."""
        self.told, self.seen = set(), []
        return super().run(lambda progress: (self.seen.append(progress), tell(progress)))


@pytest.mark.parametrize("expected", [2, 700])
def test_the_bar_is_full_when_all_is_done_and_not_before(expected, monkeypatch, tmp_path, capsys):
    """However many kernels were expected, and with a last one that takes as long as many."""
    main = dataclasses.replace(
        GROUPS["main"], kernels=expected, checks=(), long_ends={GROUPS["main"].tasks[0]: 100}
    )
    done = _Counted([main], {main.tasks[0]: 60.0}, 3)
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path))
    monkeypatch.setattr(compiler, "is_ready", lambda group: False)
    monkeypatch.setattr(command_line, "Compiler", lambda groups, processes: done)
    assert command_line.warm_up(["main"]) == []
    count = len(main.tasks)
    last = 100.0 / (max(expected, count) + 100.0)
    shares = [progress.share for progress in done.seen]
    assert shares == sorted(shares)
    assert shares[-2] <= 1.0 - last
    assert done.seen[-1] == (count, count, 1.0)
    assert all(progress.done < progress.total for progress in done.seen[:-2])
    told = capsys.readouterr().err.splitlines()[-1]
    assert "100%" in told
    assert f"{count} of {count} kernels" in told


def test_a_process_does_one_task_after_the_other(monkeypatch, tmp_path):
    """But a check has one of its own; a task that crashes is named."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path))
    begun = []

    class Told(compiler.Compiler):
        def _follow(self, worker):
            begun.append(worker.process)
            super()._follow(worker)

    group = KernelGroup("main", "", 0, ("os:getpid", "os:getcwd"), ("os:getpid",))
    assert Told([group]).run() == []
    assert len(begun) == 2
    assert all(process.poll() is not None for process in begun)
    with pytest.raises(compiler.CompilingError, match="'other' with os:abort ended with exit"):
        Told([KernelGroup("other", "", 0, ("os:getpid", "os:abort"))]).run()
    assert len(begun) == 3
    assert begun[2].poll() == -signal.SIGABRT


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
        f"scene_graph_ros.{name}"
        for name in (
            "geometry.hydroelastic",
            "geometry.deformable",
            "geometry.perception",
            "convex",
        )
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


_PICTURES = """
from camera_scenes import color_camera, instance, pose, scene_of, WORLD
import numpy as np
from PIL import Image
from scene_graph_ros.geometry import Sphere
from warm_kernels import called_kernels, run_tasks
run_tasks("cameras")
known = called_kernels()
files = [f"{folder}/{alpha}.png" for alpha in (255, 100)]
Image.new("RGB", (4, 4)).save(files[0])
Image.new("RGBA", (4, 4), (200, 100, 0, 100)).save(files[1])
for pictures in ([], files[:1], files[1:], files):
    bodies = [instance(Sphere(0.1), pose(p=(0.0, 0.0, 1.0)), "plain")]
    for k, file in enumerate(pictures):
        X = pose(p=(k, 0.0, 2.0))
        bodies.append(instance(Sphere(0.3), X, str(k), phong=("diffuse_map", file)))
    scene_of(bodies).render_color_image(color_camera(), WORLD, np.eye(4))
print(sorted(called_kernels() - known))
"""


@needs_kernels
def test_images_with_pictures_find_their_kernels(tmp_path):
    """With none, with one that has alpha or has not, and with several."""
    assert run(f"folder = {str(tmp_path)!r}\n{_PICTURES}") == "[]\n"


_ROWS = """
import numpy as np
from scene_graph_ros.geometry.optimization import HPolyhedron
from scene_graph_ros.planning.regions.hit_and_run import walked
from warm_kernels import called_kernels, run_tasks
run_tasks("planning", "convex")
known, generator = called_kernels(), np.random.default_rng(0)
cut = HPolyhedron(np.vstack([np.eye(7), -np.eye(7), np.ones(7)]), np.ones(15))
cut.calc_volume_interval(generator, desired_rel_accuracy=1.0, max_num_samples=100)
walked(cut.A, cut.b, np.zeros((2, 7)), 1, np.eye(7), generator)
print([(name, "True, aligned" in types) for _, name, types in called_kernels() - known])
"""


@needs_kernels
def test_rows_of_sets_find_their_kernels():
    """They can't be written, which is a type of its own; these kernels are of rows that can.

    `largest_within` is compiled as a part of another.
    """
    assert run(_ROWS) == "[('largest_within', False)]\n"


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

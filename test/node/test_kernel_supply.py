"""Kernels of capabilities: compiled in a process of their own when something asks for them."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import threading

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_harness import NodeProcess, ROOT, wait_until
import pytest
import slow_kernels

from scene_graph_msgs.msg import ContactArray, GeometryDescription, RoleProperties, Shape, Status
from scene_graph_ros.geometry.compiled.cache import cache_root
from scene_graph_ros.geometry.compiled.readiness import is_ready, ready_marker
from scene_graph_ros.node.runtime.kernel_supply import KernelSupply
from scene_graph_ros.warmup.groups import GROUPS

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels"
)
CACHE = "SCENE_GRAPH_ROS_KERNEL_CACHE"
SUPPORT = str(ROOT / "test" / "support")
PATIENCE = 250.0
"""Seconds: what compiles gives way to all that runs on a busy machine."""
COMPILING = "the kernels of slow things are being compiled: 1 of 2"


class Log:
    """Stands for a logger."""

    def __init__(self):
        self.infos, self.warnings = [], []
        self.info, self.warning = self.infos.append, self.warnings.append


class Files:
    """The folder by which a test and the process that compiles know of each other."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def pid(self) -> int:
        """Wait until one kernel is compiled; return the process that is at it."""
        wait_until((self.folder / "begun").exists, "the process that compiles", PATIENCE)
        return int((self.folder / "begun").read_text())

    def go(self) -> None:
        """Let the other kernel be compiled."""
        (self.folder / "go").touch()


def has_ended(pid: int) -> bool:
    """Tell whether a process is gone, or waits for nothing but its parent's interest."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        # Not there, or gone between opening and reading.
        return True


@pytest.fixture
def files(tmp_path, monkeypatch):
    """An empty cache, and what the slow kernels look at."""
    path = os.pathsep.join([str(ROOT), SUPPORT, os.environ.get("PYTHONPATH", "")])
    monkeypatch.setenv("PYTHONPATH", path)
    monkeypatch.setenv(CACHE, str(tmp_path / "kernels"))
    monkeypatch.setenv(slow_kernels.FOLDER, str(tmp_path))
    return Files(tmp_path)


@pytest.fixture
def log():
    """A logger."""
    return Log()


def test_a_group_is_compiled_beside_whoever_asks(files, log):
    """Who asks is told how far it is; when it is done that is told, and all are ready."""
    came = threading.Event()
    supply = KernelSupply(log, came.set, {"slow": slow_kernels.group()})
    assert supply.lack("") == ""
    assert supply.lack("slow") == "the kernels of slow things are about to be compiled"
    files.pid()
    wait_until(lambda: supply.lack("slow") == COMPILING, "one kernel", PATIENCE)
    assert not came.is_set()
    assert not is_ready("slow")
    files.go()
    assert came.wait(PATIENCE)
    assert supply.lack("slow") == ""
    assert is_ready("slow")
    assert log.infos[0].startswith("slow things: asked for, but their kernels have to be compiled")
    assert log.infos[-1].startswith("slow things: their kernels are compiled, after ")
    assert log.warnings == []
    # Who comes later finds them.
    assert KernelSupply(log, pytest.fail, {"slow": slow_kernels.group()}).lack("slow") == ""


def test_groups_are_compiled_one_after_the_other(files, log):
    """The second waits, and says so."""
    groups = {name: slow_kernels.group(name) for name in ("one", "two")}
    came = threading.Semaphore(0)
    supply = KernelSupply(log, came.release, groups)
    supply.lack("one")
    supply.lack("two")
    files.pid()
    wait_until(lambda: supply.lack("one") == COMPILING, "one kernel", PATIENCE)
    assert supply.lack("two").endswith("are about to be compiled")
    files.go()
    for _ in groups:
        assert came.acquire(timeout=PATIENCE)
    assert is_ready("one") and is_ready("two")


def test_what_can_not_be_compiled_beside_counts_as_ready(files, log):
    """Then whoever calls the kernels compiles them; the log says why."""
    came = threading.Event()
    supply = KernelSupply(log, came.set, {"slow": slow_kernels.group(function="fail")})
    assert supply.lack("slow") != ""
    assert came.wait(PATIENCE)
    assert supply.lack("slow") == ""
    assert not is_ready("slow")
    (warning,) = log.warnings
    assert "compiled within the node" in warning
    assert "slow_kernels:fail ended with exit code 1" in warning
    assert "no compiler today" in warning


def test_where_kernels_can_not_be_kept_nothing_is_compiled_beside(files, log, monkeypatch):
    """It would be in vain: as always with such a cache, each process compiles its own."""
    (files.folder / "file").touch()
    monkeypatch.setenv(CACHE, str(files.folder / "file" / "kernels"))
    supply = KernelSupply(log, pytest.fail, {"slow": slow_kernels.group()})
    assert supply.lack("slow") == ""
    assert log.infos == log.warnings == []


def test_the_end_of_the_node_ends_what_compiles(files, log):
    """Nothing came, and nothing is wrong; nothing is begun any more."""
    supply = KernelSupply(log, pytest.fail, {"slow": slow_kernels.group()})
    supply.lack("slow")
    pid = files.pid()
    supply.stop()
    wait_until(lambda: has_ended(pid), "the end of the process that compiles")
    assert log.warnings == []
    assert supply.lack("slow") != ""
    assert not is_ready("slow")


SCENE = """
version: 1
sources: [{name: cell}, {name: gripper}]
frames:
  - {name: pad, source: gripper, pose: {xyz: [0, 0, 0.19]}}
geometries:
  - {name: floor, source: cell, shape: {type: half_space}}
  - name: pad
    source: gripper
    frame: pad
    shape: {type: box, size: [0.2, 0.3, 0.4]}
    roles: {proximity: {hydroelastic: {compliance_type: compliant, hydroelastic_modulus: 1e5}}}
  - name: ground
    source: cell
    shape: {type: half_space}
    roles: {proximity: {hydroelastic: {compliance_type: rigid}}}
"""

PROGRAM = """
import slow_kernels
from scene_graph_ros.node.main import main
from scene_graph_ros.warmup.groups import GROUPS
GROUPS["%s"] = slow_kernels.group("%s")
main()
"""


@pytest.fixture
def slow_node(domain, tmp_path, request):
    """A node for which kernels of surfaces seem to be missing, the slow ones in their place.

    Or those of another group. Its cache has everything that is compiled here, but does not say
    that the group is ready.
    """
    group = getattr(request, "param", "surfaces")
    cache = tmp_path / "kernels"
    cache.mkdir()
    # The slow kernels are among the others. To name a marker reads all sources.
    left_out = ("others", ready_marker(group).name)
    for path in cache_root().iterdir():
        if path.name not in left_out:
            (cache / path.name).symlink_to(path)
    (tmp_path / "scene.yaml").write_text(SCENE)
    node = NodeProcess(
        domain,
        {"scene": tmp_path / "scene.yaml", "diagnostics_rate": 20.0},
        program=PROGRAM.replace("%s", group),
        extra_environment={
            CACHE: str(cache),
            slow_kernels.FOLDER: str(tmp_path),
            "PYTHONPATH": SUPPORT,
        },
    )
    node.wait_for_output("running:")
    yield node
    node.stop()


def effect_of(client, name):
    """Return what the node says about an effect."""
    return next(e for e in client.call("ListEffects").effects if e.name == name)


def test_contacts_go_on_while_surfaces_are_made_ready(client, slow_node, tmp_path):
    """Points come meanwhile; log, diagnostics and services say why; then surfaces come on."""
    files = Files(tmp_path)
    files.pid()
    contacts = client.listen(ContactArray, "contacts")
    first = contacts.count
    wait_until(lambda: contacts.count >= first + 5, "contacts while kernels are compiled")
    assert all(m.points and not m.surfaces for m in list(contacts.messages))

    def is_waiting():
        report = effect_of(client, "contact_surfaces")
        return not report.is_on and report.reason.startswith(f"not yet: {COMPILING}; 1 geometry")

    wait_until(is_waiting, "the effect that waits")
    answer = client.call("ComputeContactSurfaces", with_fallback=True)
    assert (answer.status.code, answer.status.message) == (
        Status.UNAVAILABLE,
        f"not yet: {COMPILING}",
    )
    assert client.call("ComputePointPairPenetration").status.code == Status.OK
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def says_so(message):
        return any(
            status.name.endswith("effect: contact_surfaces")
            and status.level == DiagnosticStatus.WARN
            and COMPILING in status.message
            for status in message.status
        )

    diagnostics.wait_for(says_so, "a warning in the diagnostics")
    assert "slow things: asked for, but their kernels have to be compiled" in slow_node.output()
    assert "effect contact_surfaces is on" not in slow_node.output()

    files.go()
    wait_until(lambda: contacts.newest.surfaces, "surfaces", PATIENCE)
    assert effect_of(client, "contact_surfaces").is_on
    assert client.call("ComputeContactSurfaces", with_fallback=True).status.code == Status.OK
    slow_node.wait_for_output("effect contact_surfaces is on: 1 geometry is compliant")
    assert "not in the cache any more" not in slow_node.output()
    client.forget(contacts)
    client.forget(diagnostics)


@pytest.mark.parametrize("slow_node", ["clouds"], indirect=True)
def test_the_first_cloud_has_contacts_wait(client, slow_node, tmp_path):
    """Nothing is compiled within an update; all that measures pairs says that it waits."""
    files = Files(tmp_path)
    contacts = client.listen(ContactArray, "contacts")
    contacts.wait_for(lambda m: m.points or m.surfaces, "contacts without clouds")
    source = client.call("RegisterSource", name="camera").source
    cloud = GeometryDescription(
        name="seen",
        shape=Shape(kind=Shape.POINT_CLOUD, dimensions=[0.1], vertices=[0.0, 0.0, 0.5]),
        roles=[RoleProperties(role=RoleProperties.PROXIMITY)],
    )
    cloud.pose.orientation.w = 1.0
    answer = client.call("RegisterAnchoredGeometry", source=source, geometries=[cloud])
    assert answer.status.code == Status.OK, answer.status
    files.pid()
    # The node reads of the first kernel when its turn comes.
    is_told = lambda: COMPILING in client.call("HasCollisions").status.message  # noqa: E731
    wait_until(is_told, "one kernel")
    for service in ("ComputePointPairPenetration", "HasCollisions", "CheckConfigurations"):
        status = client.call(service).status
        assert (status.code, COMPILING in status.message) == (Status.UNAVAILABLE, True), status
    assert client.call("DescribeScene").status.code == Status.OK
    wait_until(lambda: not effect_of(client, "point_contact").is_on, "contacts that wait")
    assert effect_of(client, "point_contact").reason.startswith(f"not yet: {COMPILING}; ")
    slow_node.wait_for_output("effect point_contact is off: it waits for its kernels")
    files.go()
    version = answer.scene_version
    wait_until(
        lambda: contacts.newest.scene_version == version and contacts.newest.points,
        "contacts with the cloud",
        PATIENCE,
    )
    assert client.call("HasCollisions").status.code == Status.OK
    client.forget(contacts)


def test_a_node_that_is_killed_leaves_no_process_that_compiles(slow_node, tmp_path):
    """It ends with the node, however that ends."""
    pid = Files(tmp_path).pid()
    slow_node.process.send_signal(signal.SIGKILL)
    wait_until(lambda: has_ended(pid), "the end of the process that compiles")


def test_each_group_that_the_node_asks_for_is_there():
    """The names in the lists of effects and queries are those of groups."""
    from scene_graph_ros.node.effects.declarations import EFFECTS
    from scene_graph_ros.node.services.queries import QUERIES

    asked = {each.kernels for each in EFFECTS}.union(*(each.kernels for each in QUERIES.values()))
    assert asked - {""} <= set(GROUPS)
    assert {"surfaces", "deformable", "points"} <= asked

"""What `make setup` promises: nothing done twice, progress shown, what is missing named."""

from concurrent.futures import ThreadPoolExecutor, wait
import sys
import sysconfig
import threading

import pytest

from tools.bootstrap import environment
from tools.bootstrap.progress import digest, Setup, SetupError


@pytest.fixture
def setup(tmp_path):
    """A set-up that keeps its records in a folder of the test."""
    return Setup(tmp_path / "setup", count=1)


def test_a_step_runs_once_for_the_same_key(setup, tmp_path):
    """A step is repeated when its key changes or its product is gone, and only then."""
    product, calls = tmp_path / "product", []

    def action():
        calls.append(1)
        product.touch()

    setup.step("step", "key", [product], action)
    setup.step("step", "key", [product], action)
    assert len(calls) == 1
    setup.step("step", "other key", [product], action)
    assert len(calls) == 2
    product.unlink()
    setup.step("step", "other key", [product], action)
    assert len(calls) == 3


def test_a_failed_step_is_not_taken_for_done(setup):
    """A step that failed runs again, also where it had been done before for the same key."""
    calls = []

    def fail():
        calls.append(1)
        setup.run([sys.executable, "-c", "raise SystemExit(3)"])

    setup.step("step", "key", [], lambda: None)
    with pytest.raises(SetupError):
        setup.step("step", "new key", [], fail)
    with pytest.raises(SetupError):
        setup.step("step", "key", [], fail)
    assert len(calls) == 2


def test_a_step_that_does_not_make_its_product_fails(setup, tmp_path):
    """The error of a step without a product names the product."""
    with pytest.raises(SetupError, match="absent"):
        setup.step("step", "key", [tmp_path / "absent"], lambda: None)


def test_the_error_of_a_command_shows_its_output(setup):
    """The message has the exit code, the end of the output and the place of all of it."""
    script = "print('first'); print('the reason'); raise SystemExit(7)"
    with pytest.raises(SetupError, match=r"(?s)exit code 7.*the reason.*log"):
        setup.step("step", "key", [], lambda: setup.run([sys.executable, "-c", script]))


def test_a_long_step_shows_that_it_moves(setup, tmp_path, capsys, monkeypatch):
    """While a command runs, lines with the seconds and its last output appear."""
    monkeypatch.setattr(setup, "_is_terminal", False)
    monkeypatch.setattr("tools.bootstrap.progress.QUIET_SECONDS", 0.05)
    told, say = tmp_path / "told", setup._print

    def note(step, text, **options):
        say(step, text, **options)
        if "half way" in text:
            told.touch()

    monkeypatch.setattr(setup, "_print", note)
    wait = f"while not pathlib.Path({str(told)!r}).exists(): time.sleep(0.01)"
    script = f"import pathlib, time; print('half way', flush=True)\n{wait}"
    setup.step("step", "key", [], lambda: setup.run([sys.executable, "-c", script]))
    assert "half way" in capsys.readouterr().out


def test_steps_go_side_by_side(setup, tmp_path, capsys):
    """Each waits for a file that the other makes; both are told, and have a log of their own."""
    wait = "import pathlib as p, time\nwhile not p.Path({there!r}).exists(): time.sleep(0.01)"
    folder = str(tmp_path)
    make = "p.Path({here!r}).touch(); print('{name} is done')"

    def chain(name, other):
        here, there = f"{folder}/{name}", f"{folder}/{other}"
        script = f"import pathlib as p; {make.format(here=here, name=name)}\n"
        command = [sys.executable, "-c", script + wait.format(there=there)]
        setup.step(name, "key", [tmp_path / name], lambda: setup.run(command))

    setup.side_by_side(lambda: chain("one", "two"), lambda: chain("two", "one"))
    said = capsys.readouterr().out
    for name in ("one", "two"):
        assert f"] {name}: done in" in said
        log = tmp_path / "setup" / "log" / f"{name}.txt"
        assert log.read_text() == f"{name} is done\n"


def test_the_first_step_that_fails_ends_those_beside_it(setup, tmp_path):
    """What it said is the error; the other, which would never end, is killed and not done."""
    forever = "import pathlib, time\npathlib.Path({!r}).touch()\nwhile True: time.sleep(1)"
    begun = tmp_path / "begun"
    wait = (
        f"import pathlib, time\nwhile not pathlib.Path({str(begun)!r}).exists(): time.sleep(0.01)"
    )

    def endless():
        script = forever.format(str(begun))
        setup.step("endless", "key", [], lambda: setup.run([sys.executable, "-c", script]))

    def failing():
        script = f"{wait}\nraise SystemExit('the reason')"
        setup.step("failing", "key", [], lambda: setup.run([sys.executable, "-c", script]))

    with pytest.raises(SetupError, match=r"(?s)'failing' failed.*the reason"):
        setup.side_by_side(endless, failing)
    assert not (tmp_path / "setup" / "stamps" / "endless").exists()


def test_a_command_may_end_while_those_beside_it_are_ended(setup):
    """What is walked through does not change meanwhile."""
    endless = [sys.executable, "-c", "import time; time.sleep(600)"]

    class Slow:
        def terminate(self):
            # The other one is ended, too, and forgotten at once where nothing holds that up.
            for process in setup._processes - {self}:
                process.terminate()
            wait([other], 0.5)

    slow = Slow()
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(setup.step, "endless", "key", [], lambda: setup.run(endless))
        while not setup._processes:
            wait([other], 0.01)
        setup._processes.add(slow)
        setup._stop()
        with pytest.raises(SetupError, match="'endless' failed"):
            other.result(60.0)


def test_a_digest_sees_contents_and_names(tmp_path):
    """Changing a file, renaming it or adding a word changes the digest; nothing else does."""
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a.txt").write_text("one")
    first = digest([folder])
    assert digest([folder]) == first
    assert digest([folder], "word") != first
    (folder / "a.txt").rename(folder / "b.txt")
    assert digest([folder]) != first
    (folder / "b.txt").rename(folder / "a.txt")
    assert digest([folder]) == first
    (folder / "a.txt").write_text("two")
    assert digest([folder]) != first
    (folder / "__pycache__").mkdir()
    (folder / "__pycache__" / "a.pyc").write_text("ignored")
    (folder / "a.txt").write_text("one")
    assert digest([folder]) == first


def test_a_missing_compiler_is_named_with_the_remedy(monkeypatch, tmp_path):
    """On a machine without compilers both are named, and what to install."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CXX", raising=False)
    with pytest.raises(SetupError, match=r"(?s)gcc.*g\+\+.*Remedy: apt-get install"):
        environment.check_machine(with_compiler=True)
    environment.check_machine(with_compiler=False)


def test_an_environment_that_does_not_run_is_refused(setup, tmp_path):
    """A `.venv` whose Python does not run is not used and not replaced, but named."""
    python = tmp_path / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text("#!/bin/sh\nexit 1\n")
    python.chmod(0o755)
    with pytest.raises(SetupError, match=r"(?s)no Python that runs.*make clean"):
        environment.make_venv(setup, tmp_path / ".venv")


def test_cmake_files_get_this_machines_include_folders(tmp_path):
    """Paths of the machine that built a wheel are replaced; unknown ones are an error."""
    file = tmp_path / "share" / "package" / "cmake" / "export.cmake"
    file.parent.mkdir(parents=True)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    built = f"/opt/python/cp3x/include/{version}"
    numpy = f"/opt/python/cp3x/lib/{version}/site-packages/numpy/_core/include"
    file.write_text(f'set(x "{built};{numpy};${{_IMPORT_PREFIX}}/include")')
    environment.relocate_cmake_files(tmp_path)
    here = environment.site_packages(tmp_path) / "numpy" / "_core" / "include"
    expected = f'set(x "{sysconfig.get_path("include")};{here};${{_IMPORT_PREFIX}}/include")'
    assert file.read_text() == expected
    file.write_text('set(x "/opt/python/cp3x/lib/libsomething.so")')
    with pytest.raises(SetupError, match=r"libsomething\.so"):
        environment.relocate_cmake_files(tmp_path)


def test_steps_at_once_are_numbered_as_they_end(tmp_path, capsys):
    """Whichever began first."""
    setup, first = Setup(tmp_path / "setup", count=3), threading.Event()
    setup.step("before", "key", [], lambda: None)
    setup.side_by_side(
        lambda: (setup.step("slow", "key", [], lambda: first.wait(60.0)), None)[1],
        lambda: (setup.step("quick", "key", [], lambda: None), first.set())[1],
    )
    numbers = [line.partition(":")[0] for line in capsys.readouterr().out.splitlines()]
    assert numbers == ["[1/3] before", "[2/3] quick", "[3/3] slow"]


@pytest.mark.parametrize("fails", [False, True])
def test_pip_installs_what_uv_can_not_fetch(setup, tmp_path, monkeypatch, capsys, fails):
    """The same list with the same hashes; that is told with the reason."""
    commands = []

    def run(command, env=None):
        commands.append([str(part) for part in command])
        if commands[-1][0].endswith("/uv") and fails:
            raise SetupError("step failed: uv\nerror: no such host\nThe whole output is in log")

    monkeypatch.setattr(setup, "run", run)
    environment.install_locked(setup, tmp_path, tmp_path / "venv", "core")
    installers = ["uv" if command[0].endswith("/uv") else "pip" for command in commands]
    assert installers == ["pip", "uv", *["pip"] * fails]
    lists = [command[-1].rpartition("/")[2] for command in commands]
    assert lists == ["build.txt", "core.txt", *["core.txt"] * fails]
    assert all("--require-hashes" in command for command in commands)
    assert ("no such host" in capsys.readouterr().out) == fails

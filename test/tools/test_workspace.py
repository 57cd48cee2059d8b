"""What `make workspace` relies on: a clean copy, a sourced environment, the program installed."""

import subprocess

import pytest

from tools.bootstrap.progress import SetupError
from tools.workspace.__main__ import copy_checkout, program, sourced


def test_the_copy_has_what_git_would_have(tmp_path):
    """Tracked and new files are copied, ignored and removed ones are not."""
    source, target = tmp_path / "source", tmp_path / "target"
    (source / "folder").mkdir(parents=True)
    (source / ".gitignore").write_text("*.pyc\n")
    for name in ("kept.py", "folder/new name.py", "ignored.pyc", "removed.py"):
        (source / name).write_text(name)
    subprocess.run(["git", "init", "-q"], cwd=source, check=True)
    subprocess.run(["git", "add", "kept.py", "removed.py"], cwd=source, check=True)
    (source / "removed.py").unlink()
    copy_checkout(source, target)
    copied = {str(p.relative_to(target)) for p in target.rglob("*") if p.is_file()}
    assert copied == {".gitignore", "kept.py", "folder/new name.py"}
    assert (target / "kept.py").stat().st_mtime_ns == (source / "kept.py").stat().st_mtime_ns


def test_a_folder_that_is_no_checkout_is_named(tmp_path):
    """Without git there is nothing to copy, and the folder is named."""
    with pytest.raises(SetupError, match=str(tmp_path)):
        copy_checkout(tmp_path, tmp_path / "target")


def test_a_sourced_environment_is_that_of_the_shell(tmp_path):
    """Values come as they are, also with newlines and equal signs."""
    script = tmp_path / "setup.bash"
    script.write_text("export VALUE=$'a=b\\nc'\n")
    assert sourced(script, {"PATH": "/usr/bin:/bin"})["VALUE"] == "a=b\nc"
    with pytest.raises(SetupError, match=r"absent\.bash"):
        sourced(tmp_path / "absent.bash", {"PATH": "/usr/bin:/bin"})


def test_the_program_is_that_of_the_first_prefix(tmp_path):
    """As `ros2 run` does it: the first prefix that knows the package, and its program only."""
    prefixes = [tmp_path / name for name in ("without", "first", "second")]
    for prefix in prefixes[1:]:
        index = prefix / "share/ament_index/resource_index/packages"
        index.mkdir(parents=True)
        (index / "package").touch()
    environment = {"AMENT_PREFIX_PATH": ":".join(map(str, prefixes))}
    with pytest.raises(SetupError, match=r"first.*no program"):
        program("package", "node", environment)
    file = tmp_path / "first" / "lib" / "package" / "node"
    file.parent.mkdir(parents=True)
    file.touch(0o755)
    assert program("package", "node", environment) == file
    with pytest.raises(SetupError, match="other"):
        program("other", "node", environment)

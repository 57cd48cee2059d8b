"""Wheels of messages have what Python runs, and digests of all of it."""

import base64
import hashlib
from pathlib import Path
import sys
import zipfile

import pytest

from tools.wheels.__main__ import _python
from tools.wheels.messages import write_messages_wheel

_PACKAGE = """<package format="3"><name>scene_graph_msgs</name><version>1.2.3</version>
<description>Messages.</description><license>Apache-2.0</license></package>"""
_PYTHON = "lib/python3.11/site-packages/scene_graph_msgs"
_INSTALLED = {
    f"{_PYTHON}/__init__.py": "",
    f"{_PYTHON}/msg/_contact.py": "numbers = 1",
    f"{_PYTHON}/msg/_contact_s.c": "left out",
    f"{_PYTHON}/scene_graph_msgs_s.so": "machine code",
    "lib/python3.11/site-packages/scene_graph_msgs-1.2.3-py3.11.egg-info/PKG-INFO": "left out",
    "lib/libscene_graph_msgs__rosidl_generator_c.so": "machine code",
    "include/scene_graph_msgs/msg/contact.h": "left out",
    "share/scene_graph_msgs/cmake/scene_graph_msgsConfig.cmake": "left out",
    "share/scene_graph_msgs/msg/Contact.msg": "float64 depth",
    "share/ament_index/resource_index/packages/scene_graph_msgs": "",
}


@pytest.fixture(name="wheel")
def _wheel(tmp_path):
    """Write a wheel of an environment in which a build has installed these files."""
    (tmp_path / "root" / "scene_graph_msgs").mkdir(parents=True)
    (tmp_path / "root" / "scene_graph_msgs" / "package.xml").write_text(_PACKAGE)
    venv, out = tmp_path / "venv", tmp_path / "out"
    out.mkdir()
    for name, text in _INSTALLED.items():
        (venv / name).parent.mkdir(parents=True, exist_ok=True)
        (venv / name).write_text(text)
    manifest = venv / "build" / "scene_graph_msgs" / "install_manifest.txt"
    manifest.parent.mkdir(parents=True)
    manifest.write_text("\n".join(str(venv / name) for name in _INSTALLED))
    return write_messages_wheel(tmp_path / "root", venv, out, "cp311-cp311-linux_x86_64")


def test_python_is_in_the_root_and_libraries_in_the_environment(wheel):
    """What nobody runs is left out."""
    assert wheel.name == "scene_graph_msgs-1.2.3-cp311-cp311-linux_x86_64.whl"
    data, info = "scene_graph_msgs-1.2.3.data/data", "scene_graph_msgs-1.2.3.dist-info"
    with zipfile.ZipFile(wheel) as opened:
        assert set(opened.namelist()) == {
            "scene_graph_msgs.pth",
            "scene_graph_msgs/__init__.py",
            "scene_graph_msgs/msg/_contact.py",
            "scene_graph_msgs/scene_graph_msgs_s.so",
            f"{data}/lib/libscene_graph_msgs__rosidl_generator_c.so",
            f"{data}/share/scene_graph_msgs/msg/Contact.msg",
            f"{data}/share/ament_index/resource_index/packages/scene_graph_msgs",
            *(f"{info}/{name}" for name in ("METADATA", "WHEEL", "RECORD")),
        }
        assert "Requires-Python: ==3.11.*" in opened.read(f"{info}/METADATA").decode()


def test_the_record_has_the_digest_of_every_other_file(wheel):
    """As PEP 427 has it."""
    with zipfile.ZipFile(wheel) as opened:
        (record,) = (name for name in opened.namelist() if name.endswith("RECORD"))
        rows = [row.split(",") for row in opened.read(record).decode().splitlines()]
        assert sorted(name for name, _, _ in rows) == sorted(opened.namelist())
        for name, digest, size in rows:
            if name != record:
                sha = base64.urlsafe_b64encode(hashlib.sha256(opened.read(name)).digest())
                assert (digest, size) == (
                    f"sha256={sha.decode().rstrip('=')}",
                    str(opened.getinfo(name).file_size),
                )


def test_the_same_files_make_the_same_wheel(wheel, tmp_path):
    """Byte by byte, whenever it is written."""
    content = wheel.read_bytes()
    tag = "cp311-cp311-linux_x86_64"
    again = write_messages_wheel(tmp_path / "root", tmp_path / "venv", tmp_path / "out", tag)
    assert again.read_bytes() == content


def test_a_python_that_does_not_run_is_named_with_the_remedy(tmp_path, monkeypatch):
    """A version manager's shim of that name is none that runs, also where it comes first."""
    version = "{}.{}".format(*sys.version_info)
    for name in ("python3.98", f"python{version}"):
        shim = tmp_path / name
        shim.write_text("#!/bin/sh\nexit 127\n")
        shim.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{Path(sys.executable).parent}")
    assert Path(_python(version)).name == f"python{version}"
    with pytest.raises(SystemExit, match=r"no python3\.99 runs here.*apt-get install python3\.99"):
        _python("3.99")
    with pytest.raises(SystemExit, match=r"no python3\.98 runs here"):
        _python("3.98")

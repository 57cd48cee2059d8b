"""The wheel of the messages, made of what `make environment` built and installed.

Python's part lies in the wheel's root, libraries and the ament index in the environment's folders
of their kind, as the wheels of ROS have it. C headers and CMake's files are left out: whoever
compiles against the messages builds them from source.
"""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path
import re
import zipfile

__all__ = ["write_messages_wheel"]

_NAME = "scene_graph_msgs"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time of a zip: the same files make the same wheel
_FIND_INDEX = (
    "import os, sys; os.path.isdir(os.path.join(sys.prefix, 'share', 'ament_index')) and "
    "os.environ.setdefault('AMENT_PREFIX_PATH', sys.prefix)\n"
)
"""A line that Python runs at its start: rclpy looks for messages where it says."""


def write_messages_wheel(root: Path, venv: Path, out: Path, tag: str) -> Path:
    """Write the wheel to the folder ``out``; return its path. Raises FileNotFoundError."""
    package = (root / _NAME / "package.xml").read_text()
    version = _element(package, "version")
    info = f"{_NAME}-{version}.dist-info"
    files = {f"{_NAME}.pth": _FIND_INDEX.encode()}
    manifest = venv / "build" / _NAME / "install_manifest.txt"
    for line in manifest.read_text().splitlines():
        place = _place(Path(line).relative_to(venv), f"{_NAME}-{version}.data/data")
        if place is not None:
            files[place] = Path(line).read_bytes()
    files[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: {_NAME}\nVersion: {version}\n"
        f"Summary: {_element(package, 'description')}\n"
        f"License: {_element(package, 'license')}\nRequires-Python: {_python(tag)}\n"
    ).encode()
    files[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: tools.wheels\nRoot-Is-Purelib: false\nTag: {tag}\n"
    ).encode()
    path = out / f"{_NAME}-{version}-{tag}.whl"
    _write(path, files, f"{info}/RECORD")
    return path


def _element(package: str, name: str) -> str:
    found = re.search(rf"<{name}>(.*?)</{name}>", package, re.S)
    assert found is not None
    return found[1]


def _python(tag: str) -> str:
    major, minor = re.fullmatch(r"cp(\d)(\d+)", tag.partition("-")[0]).groups()  # type: ignore[union-attr]
    return f"=={major}.{minor}.*"


def _place(installed: Path, data: str) -> str | None:
    """Return where an installed file lies in the wheel, None where it is left out."""
    parts = installed.parts
    if parts[0] == "lib" and "site-packages" in parts:
        inside = parts[parts.index("site-packages") + 1 :]
        is_source = installed.suffix in (".c", ".pyc") or inside[0] != _NAME
        return None if is_source else "/".join(inside)
    is_library = parts[0] == "lib" and installed.suffix == ".so"
    is_shared = parts[:2] == ("share", "ament_index") or (
        parts[:2] == ("share", _NAME) and parts[2] in ("msg", "srv", "action", "package.xml")
    )
    return f"{data}/{installed}" if is_library or is_shared else None


def _write(path: Path, files: dict[str, bytes], record: str) -> None:
    """Write a zip of the files, and the record of their digests (PEP 427)."""
    rows = []
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, content in sorted(files.items()):
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=")
            rows.append(f"{name},sha256={digest.decode()},{len(content)}\n")
            _add(wheel, name, content)
        _add(wheel, record, "".join([*rows, f"{record},,\n"]).encode())


def _add(wheel: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, _EPOCH)
    entry.external_attr = 0o100644 << 16
    entry.compress_type = zipfile.ZIP_DEFLATED
    wheel.writestr(entry, content)

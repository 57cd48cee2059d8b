"""All URDFs below some folders: read, and registered with their meshes, or refused in a sentence.

    python -m benchmarks.robot_files FOLDER ...

A line for each file that is refused, or of which a mesh is not found, and the counts. With
``--meshes`` geometry is registered, too, which reads every mesh.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from pathlib import Path
import re
from typing import NamedTuple

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.scene_files import load_urdf, register_robot

__all__ = ["FileRead", "read_all", "urdfs_below"]

_RANDOM = "random_urdfs"
"""Folder of a wheel with a thousand numbered objects, all alike."""


class FileRead(NamedTuple):
    """What came of a file."""

    path: Path
    refused: str
    """Why it does not load; "" where it does."""
    left_out: tuple[str, ...]
    """Of a file that loads: meshes that were not found, and geometry that is refused."""

    @property
    def has_place(self) -> bool:
        """Whether a refusal begins with the file and a line of it."""
        return re.match(re.escape(str(self.path)) + r":\d+: ", self.refused) is not None


def urdfs_below(folders: Iterable[Path]) -> list[Path]:
    """Return all URDFs below folders, however their ending is written."""
    found = [f for folder in folders for f in folder.rglob("*") if f.suffix.lower() == ".urdf"]
    return sorted(file for file in found if file.is_file() and _RANDOM not in file.parts)


def read_all(files: Iterable[Path], *, with_meshes: bool) -> Iterator[FileRead]:
    """Yield what comes of each file. What is no SceneGraphError goes through."""
    for file in files:
        dirs = packages_near(file)
        try:
            robot = load_urdf(file, package_dirs=dirs, package_map=packages_of(file))
        except SceneGraphError as error:
            yield FileRead(file, str(error), ())
            continue
        left_out = [text for text in robot.warnings if "not found" in text]
        if with_meshes and not left_out:
            scene = SceneGraph()
            try:
                register_robot(robot, scene, scene.register_source("robot"), all_links=True)
            except SceneGraphError as error:
                left_out.append(str(error))
        yield FileRead(file, "", tuple(left_out))


def packages_near(file: Path) -> tuple[Path, ...]:
    """Return the folders that hold the one in which a file's folder is."""
    return tuple(file.resolve().parents[1:3])


def packages_of(file: Path) -> dict[str, Path]:
    """Return the packages that a file names and that are called otherwise where it lies.

    Of ``x_support`` copies are called ``x``, or ``x_description``.
    """
    names = re.findall(rb"package://(\w+)_support/", file.read_bytes())
    above = file.resolve().parents[1]
    called = {name.decode() for name in names}
    return {
        f"{name}_support": above for name in called if above.name in (name, f"{name}_description")
    }


def main() -> None:
    """Print what came of all files."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.robot_files")
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--meshes", action="store_true")
    arguments = parser.parse_args()
    reads = []
    for each in read_all(urdfs_below(arguments.folders), with_meshes=arguments.meshes):
        reads.append(each)
        for text in (each.refused, *each.left_out[:1]):
            if text:
                print(text, flush=True)
    refused = sum(bool(each.refused) for each in reads)
    partly = sum(bool(each.left_out) for each in reads)
    print(f"{len(reads)} files: {refused} refused, {partly} with meshes missing or refused")


if __name__ == "__main__":
    main()

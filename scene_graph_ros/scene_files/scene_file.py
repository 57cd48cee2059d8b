"""A scene file that was read and checked, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scene_graph_ros.scene_files.packages import Packages
from scene_graph_ros.scene_files.schema import SceneSpec
from scene_graph_ros.scene_files.yaml_document import YamlDocument

__all__ = ["SceneFile"]


@dataclass(frozen=True)
class SceneFile:
    """A file's content, and the base for reading the files that it names."""

    spec: SceneSpec
    document: YamlDocument
    base: Path | None
    """The file, if there is one: relative paths in it start from its folder."""
    packages: Packages

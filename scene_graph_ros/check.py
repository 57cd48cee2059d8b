"""Check scene, robot, parameter and mesh files without a running node.

    python -m scene_graph_ros.check cell.yaml robot.urdf robot.srdf parameters.yaml part.stl

Prints a summary of each file, or its faults with their places. Ends with 0 if all files are
usable, 1 if one is not, and 2 for a wrong call.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
import json
from pathlib import Path
import sys
from typing import Any

from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.geometry.errors import SceneGraphError, UnsupportedPairError
from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, read_limited
from scene_graph_ros.geometry.meshes.color_warnings import mesh_color_warnings_told
from scene_graph_ros.geometry.model.mesh_notes import mesh_notes, piece_notes
from scene_graph_ros.geometry.shapes.mesh_pieces import BY_COACD, BY_OBJECTS
from scene_graph_ros.located import SceneFileError, suggestion
from scene_graph_ros.mesh_check import (
    draw_open_edges,
    is_mesh_file,
    mesh_file_report,
    mesh_summary,
)
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.effects.demand import count_compliant, count_deformable
from scene_graph_ros.node.runtime.parameter_sections import sections_of
from scene_graph_ros.node.topic_names import topic_problems
from scene_graph_ros.node.world.half_spaces import check_half_spaces
from scene_graph_ros.node.world.source_topics import SourceTopic, topics_of
from scene_graph_ros.parameter_check import check_parameters
from scene_graph_ros.robots.registration import register_robot
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.semantic_model import SemanticModel
from scene_graph_ros.scene_files.loaded_scene import LoadedScene
from scene_graph_ros.scene_files.packages import Packages, resolve_resource
from scene_graph_ros.scene_files.scene import load_scene, Scene
from scene_graph_ros.scene_files.schema import json_schema
from scene_graph_ros.scene_files.srdf import load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf
from scene_graph_ros.scene_files.xml_tree import parse_xml
from scene_graph_ros.scene_files.yaml_document import parse_yaml, YamlDocument

__all__ = ["Checker", "Report", "main"]


@dataclass
class Report:
    """The result of a check of one file."""

    file: str
    kind: str
    summary: str = ""
    errors: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class Checker:
    """Checks files one after the other; an SRDF is checked with the last URDF before it."""

    def __init__(
        self,
        packages: Packages,
        picture: Path | None = None,
        node: str = "",
        pieces: str | None = None,
    ) -> None:
        """Check with packages; ``picture`` is where mesh files are drawn, if anywhere.

        ``node`` is the whole name of the node that parameters are for; empty: any namespace.
        ``pieces`` says into which ones mesh files are taken apart, if any.
        """
        self._node, self._pieces = node, pieces
        self._packages = packages
        self._picture = picture
        self._robot: RobotModel | None = None

    def check(self, file: str) -> Report:
        """Return the report on a file, a ``package://`` or a ``file://`` address."""
        report = Report(file, "file")
        with mesh_color_warnings_told(lambda text: report.warnings.append(f"{file}: {text}")):
            self._check(report, file)
        return report

    def _check(self, report: Report, file: str) -> None:
        try:
            path = resolve_resource(file, packages=self._packages)
            report.kind, document = _kind(path, file)
            if report.kind == "parameters":
                assert document is not None
                self._check_parameters(report, document)
            elif report.kind == "scene":
                self._check_scene(report)
            elif report.kind == "URDF":
                self._check_urdf(report)
            elif report.kind == "mesh":
                self._check_mesh(report, path)
            else:
                self._check_srdf(report)
        except SceneFileError as error:
            report.errors.extend(error.problems)
        except SceneGraphError as error:
            report.errors.append(f"{file}: {error}")
        except OSError as error:
            report.errors.append(f"{file}: cannot be read: {error.strerror}")

    def _search(self) -> dict[str, Any]:
        return {
            "package_map": self._packages.package_map,
            "package_dirs": self._packages.package_dirs,
        }

    def _check_scene(self, report: Report) -> None:
        scene = load_scene(report.file, **self._search())
        for name in scene.spec.effects:
            if name not in EFFECT_NAMES:
                hint = suggestion(name, EFFECT_NAMES)
                place = scene.document.location("effects", name)
                report.errors.append(f"{place}: no effect {name!r}{hint}")
        scene_graph = SceneGraph()
        loaded = scene.apply(scene_graph)
        report.warnings.extend(loaded.warnings)
        report.errors.extend(loaded.doubts)
        report.notes.extend(loaded.notes)
        report.warnings.extend(_mesh_notes(report, scene_graph))
        report.notes.extend(piece_notes(scene_graph.model_inspector()))
        self._check_topics(report, scene, loaded, scene_graph)
        try:
            check_half_spaces(scene_graph.model_inspector())
        except UnsupportedPairError as error:
            report.errors.append(f"{scene.document.location('geometries')}: {error}")
        report.summary = _count(len(loaded.sources), "source") + ", " + _contents(scene_graph)
        if loaded.cameras:
            report.summary += ", " + _count(len(loaded.cameras), "camera")

    def _check_topics(
        self, report: Report, scene: Scene, loaded: LoadedScene, scene_graph: SceneGraph
    ) -> None:
        inspector = scene_graph.model_inspector()
        deforming = {
            inspector.get_owning_source_name(geometry_id)
            for geometry_id in inspector.get_all_deformable_geometry_ids()
        }
        sensing = {inspector.get_owning_source_name(i) for i in inspector.get_all_cloud_ids()}
        fields = {
            inspector.get_owning_source_name(i) for i in inspector.get_all_height_field_ids()
        }
        grids = {inspector.get_owning_source_name(i) for i in inspector.get_all_voxel_grid_ids()}
        topics = topics_of(loaded.sources.values(), deforming, sensing, fields, grids)
        for topic, problem in topic_problems(topics):
            place = scene.document.location(*_place_of_topic(scene, topic))
            report.errors.append(f"{place}: {problem}")

    def _check_urdf(self, report: Report) -> None:
        robot = load_urdf(report.file, **self._search())
        self._robot = robot
        scene_graph = SceneGraph()
        register_robot(robot, scene_graph, scene_graph.register_source(robot.name))
        report.warnings.extend(robot.warnings)
        report.errors.extend(robot.doubts)
        report.notes.extend(robot.notes)
        report.warnings.extend(_mesh_notes(report, scene_graph))
        movable = len(list(robot.positioned_joints()))
        report.summary = (
            f"robot {robot.name!r}, {_count(len(robot.links), 'link')},"
            f" {_count(movable, 'movable joint')}, {_contents(scene_graph)}"
        )

    def _check_mesh(self, report: Report, path: Path) -> None:
        found = mesh_file_report(path, self._pieces)
        if found.reason:
            report.warnings.append(f"{report.file}: {found.reason}")
        report.summary = mesh_summary(path, found)
        if self._picture is not None:
            draw_open_edges(path, self._picture)

    def _check_srdf(self, report: Report) -> None:
        if self._robot is None:
            raise SceneFileError(f"{report.file}: name the robot's URDF before its SRDF")
        semantics = load_srdf(report.file, self._robot, **self._search())
        report.warnings.extend(semantics.warnings)
        report.summary = _semantics(semantics, self._robot)

    def _check_parameters(self, report: Report, document: YamlDocument) -> None:
        found = check_parameters(document, self._node)
        report.errors.extend(found.errors)
        report.warnings.extend(found.warnings)
        report.notes.extend(found.notes)
        for place, scene in found.scenes:
            nested = self.check(scene)
            report.errors.extend(f"{place}: {error}" for error in nested.errors)
            report.warnings.extend(nested.warnings)
        if self._node and not found.taken:
            report.warnings.append(f"{report.file}: {self._node} takes nothing of this file")
        report.summary = _count(found.taken, "parameter")


def _place_of_topic(scene: Scene, topic: SourceTopic) -> tuple[str | int, ...]:
    """Return the place in a scene file of a source's topic, or else of the source."""
    for index, source in enumerate(scene.spec.sources):
        if source.name == topic.source:
            place = ("sources", index)
            return (*place, "name") if topic.is_default else (*place, topic.noun, "topic")
    names = [robot.name for robot in scene.spec.robots]
    keys = {"base poses": ("base",), "joint poses": ("multi_dof_joint_states",)}
    where = keys.get(topic.noun, ("urdf",) if topic.noun == "descriptions" else ("joint_states",))
    return ("robots", names.index(topic.source), *where)


def _mesh_notes(report: Report, scene_graph: SceneGraph) -> list[str]:
    """Return a sentence for each mesh that is no solid."""
    notes = mesh_notes(scene_graph.model_inspector())
    return [f"{report.file}: {note}" for note in notes]


def _kind(path: Path, label: str) -> tuple[str, YamlDocument | None]:
    """Return the kind of a file.

    It is a "mesh" by its name, and by its content "scene", "parameters", "URDF" or "SRDF".
    """
    if is_mesh_file(path):
        return "mesh", None
    data = read_limited(path, MAX_TEXT_BYTES)
    if path.suffix in (".yaml", ".yml"):
        document = parse_yaml(data, label)
        if any(True for _ in sections_of(document.data)):
            return "parameters", document
        return "scene", document
    if path.suffix in (".urdf", ".srdf"):
        return path.suffix[1:].upper(), None
    if not data.lstrip().startswith(b"<"):
        raise SceneFileError(f"{label}: is neither YAML (named .yaml or .yml) nor a URDF or SRDF")
    return "SRDF" if parse_xml(data, label).child("link") is None else "URDF", None


def _count(number: int, noun: str) -> str:
    if number == 1:
        return f"1 {noun}"
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{number} {plural}"


def _contents(scene_graph: SceneGraph) -> str:
    inspector = scene_graph.model_inspector()
    solid = inspector.get_all_geometry_ids(Role.PROXIMITY)
    filtered = inspector.num_excluded_pairs()
    kinds = [f"{len(solid)} with proximity role"]
    counts = {"compliant": count_compliant(inspector), "deformable": count_deformable(inspector)}
    kinds += [f"{count} of them {kind}" for kind, count in counts.items() if count]
    # The world frame is always there, and nobody's.
    return (
        f"{_count(inspector.num_frames() - 1, 'frame')},"
        f" {_count(inspector.num_geometries(), 'geometry')} ({', '.join(kinds)}),"
        f" {_count(filtered, 'filtered pair')}"
    )


def _semantics(semantics: SemanticModel, robot: RobotModel) -> str:
    pairs = semantics.filtered_pairs(robot.links)
    return (
        f"for robot {robot.name!r}, {_count(len(pairs), 'filtered pair')} of links,"
        f" {_count(len(semantics.group_states), 'group state')}"
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m scene_graph_ros.check",
        description="Check scene, URDF, SRDF, parameter and mesh files without a running node.",
        epilog="An SRDF is checked with the last URDF before it. Exit status: 0 if all files are"
        " usable, 1 if one is not, 2 for a wrong call.",
    )
    parser.add_argument("files", nargs="*", metavar="FILE", help="path, package:// or file://")
    parser.add_argument(
        "--package",
        action="append",
        default=[],
        metavar="NAME=FOLDER",
        help="where a package is, before any other search; can be repeated",
    )
    parser.add_argument(
        "--package-path",
        action="append",
        default=[],
        metavar="FOLDER",
        help="search packages here before the ament index; can be repeated",
    )
    parser.add_argument(
        "--draw", type=Path, metavar="PICTURE", help="draw the last mesh file and its open edges"
    )
    parser.add_argument(
        "--node",
        default="",
        metavar="NAME",
        help="say which parameters a node of this name, such as /cell/scene_graph, takes",
    )
    parser.add_argument(
        "--pieces",
        choices=(BY_COACD, BY_OBJECTS),
        help="take mesh files apart, and say by how much the pieces' hulls leave the solid",
    )
    parser.add_argument("--strict", action="store_true", help="take warnings for errors")
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.add_argument(
        "--schema", action="store_true", help="print the JSON schema of scenes for editors"
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.schema:
        print(json.dumps(json_schema(), indent=2))
        return 0
    if not options.files:
        parser.error("name at least one FILE")
    if options.draw is not None and not any(is_mesh_file(Path(file)) for file in options.files):
        parser.error("argument --draw: none of the files is a mesh, by its name")
    package_map = {}
    for entry in options.package:
        name, separator, folder = entry.partition("=")
        if not (name and separator and folder):
            parser.error(f"argument --package: expected NAME=FOLDER, got {entry!r}")
        package_map[name] = folder
    packages = Packages(package_map, tuple(options.package_path))
    node = options.node and f"/{options.node.strip('/')}"
    checker = Checker(packages, options.draw, node, options.pieces)
    failed = 0
    for file in options.files:
        report = checker.check(file)
        bad = bool(report.errors or (options.strict and report.warnings))
        failed += bad
        _print(report, bad=bad, quiet=options.quiet)
    return 1 if failed else 0


def _print(report: Report, *, bad: bool, quiet: bool) -> None:
    for error in report.errors:
        print(f"error: {error}", file=sys.stderr)
    if quiet and not bad:
        return
    for note in report.notes:
        print(f"note: {note}")
    for warning in report.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    noted = f", {_count(len(report.warnings), 'warning')}" if report.warnings else ""
    if bad:
        problems = _count(len(report.errors), "error")
        print(f"{report.file}: {report.kind} not usable: {problems}{noted}")
    elif not quiet:
        print(f"{report.file}: {report.kind} ok: {report.summary}{noted}")


if __name__ == "__main__":
    sys.exit(main())

"""Read URDF files.

Everything about geometry and kinematics is checked. An inertia that can't be is a warning, and its
link has none. Transmissions, sensors and the extensions of simulators are passed over.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
import itertools
import math
from pathlib import Path
from typing import TypeVar

import numpy as np

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, Reach, read_limited
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.geometry.tolerances import MIN_SCALE
from scene_graph_ros.located import Location, SceneFileError
from scene_graph_ros.robots.registration import shape_of
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import (
    Inertial,
    Joint,
    JointType,
    Link,
    LinkGeometry,
    MeshFile,
    Mimic,
    Pose,
    PrimitiveShape,
)
from scene_graph_ros.scene_files.dialects import (
    check_dialect,
    joint_dialect,
    part_dialect,
    shape_dialect,
)
from scene_graph_ros.scene_files.inertials import inertial_of
from scene_graph_ros.scene_files.joint_limits import check_ranges, joint_limits, velocity_limit
from scene_graph_ros.scene_files.packages import Packages, resolve_resource
from scene_graph_ros.scene_files.urdf_tree import (
    arrange_joints,
    check_mimics,
    free_of_the_missing,
)
from scene_graph_ros.scene_files.xml_tree import parse_xml, XmlElement

__all__ = ["free_name", "load_urdf", "read_robot_text"]

Rgba = tuple[float, float, float, float]
Named = TypeVar("Named", Link, Joint)


def load_urdf(
    path_or_xml: str | Path,
    *,
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
    skip_unreadable: bool = False,
    reach: Reach | None = None,
) -> RobotModel:
    """Read a robot from a file, a ``package://`` or ``file://`` address, or URDF text.

    Poses are in m and rad. A mesh that is not found is a warning here, and an error when its
    geometry is registered; with ``skip_unreadable`` geometry that can't be read is left out with
    a warning. ``reach`` says which files may be named; by default all that the user may read.
    Raises SceneFileError naming file, line, element and attribute.
    """
    packages = Packages.of(package_map, package_dirs, reach)
    text, label, base = read_robot_text(path_or_xml, packages)
    root = parse_xml(text, label)
    check_dialect(root)
    return _Reader(root, base, packages, skip_unreadable=skip_unreadable).robot()


def read_robot_text(
    path_or_xml: str | Path, packages: Packages
) -> tuple[str | bytes, str, Path | None]:
    """Return the XML, its label for messages, and the file it comes from, if any."""
    if isinstance(path_or_xml, str) and path_or_xml.lstrip(" \t\r\n\0\ufeff").startswith("<"):
        # Declared encodings of text that is decoded already would be wrong: hand over UTF-8.
        return path_or_xml, "<text>", None
    path = resolve_resource(str(path_or_xml), packages=packages)
    try:
        return read_limited(path, MAX_TEXT_BYTES), str(path_or_xml), path
    except OSError as error:
        raise SceneFileError(f"{path}: cannot be read: {error.strerror}") from error


class _Reader:
    """Turns the XML tree of one file into a RobotModel."""

    def __init__(
        self, root: XmlElement, base: Path | None, packages: Packages, *, skip_unreadable: bool
    ) -> None:
        self.skips = skip_unreadable
        self.doubts: list[str] = []
        self.notes: list[str] = []
        self.root = root
        self.base = base
        self.packages = packages
        self.warnings: list[str] = []
        self.colours = self._colours()

    def robot(self) -> RobotModel:
        links = self._unique(self._link(element) for element in self.root.all("link"))
        if not links:
            place = Location(self.root.file, self.root.line)
            raise SceneFileError(f"{place}: no <link>{part_dialect(self.root)}")
        joints = self._unique(self._joint(element) for element in self.root.all("joint"))
        joints, warnings = free_of_the_missing(joints)
        self.warnings.extend(warnings)
        base, ordered = arrange_joints(self.root, links, joints)
        check_mimics(ordered)
        check_ranges(ordered)
        self.warnings.extend(self.root.remarks)
        return RobotModel(
            name=self.root.attributes.get("name", "").strip() or "robot",
            file=self.root.file,
            links=links,
            joints=ordered,
            root=base,
            warnings=tuple(self.warnings),
            notes=tuple(self.notes),
            doubts=tuple(self.doubts),
        )

    @staticmethod
    def _unique(items: Iterable[Named]) -> dict[str, Named]:
        found: dict[str, Named] = {}
        for item in items:
            if item.name in found:
                first = found[item.name].location.line
                raise SceneFileError(f"{item.location}: the name is taken by line {first}")
            found[item.name] = item
        return found

    def _colours(self) -> dict[str, Rgba]:
        """Collect the robot's named materials; those inside links may define names as well."""
        colours: dict[str, Rgba] = {}
        in_links = (
            material
            for link in self.root.all("link")
            for visual in link.all("visual")
            for material in visual.all("material")
        )
        for material in (*self.root.all("material"), *in_links):
            color = material.only_child("color")
            if color is not None and material.attributes.get("name"):
                colours.setdefault(material.attributes["name"], _rgba(color))
        return colours

    def _link(self, element: XmlElement) -> Link:
        return Link(
            name=element.name("name"),
            collisions=self._geometries(element, "collision"),
            visuals=self._geometries(element, "visual"),
            location=element.location(),
            inertial=self._inertial(element),
        )

    def _inertial(self, link: XmlElement) -> Inertial | None:
        """Read a link's inertia; a bad one is only a warning, since geometry does not need it."""
        try:
            return inertial_of(link)
        except SceneFileError as error:
            self.warnings.append(str(error))
            return None

    def _geometries(self, link: XmlElement, tag: str) -> tuple[LinkGeometry, ...]:
        """Read a link's geometry; names are made unique, as URDF does not ask them to be."""
        result: list[LinkGeometry] = []
        given = {element.attributes.get("name", "").strip() for element in link.all(tag)}
        taken: set[str] = set()
        for index, element in enumerate(link.all(tag)):
            name = element.attributes.get("name", "").strip()
            if not name or name in taken:
                generated = f"{link.name('name')}_{tag}_{index}"
                name = free_name(generated, given | taken)
            taken.add(name)
            if tag == "visual" and _shows_nothing(element):
                self.warnings.append(f"{element.location()}: a size of 0 shows nothing: left out")
                continue
            try:
                geometry = LinkGeometry(
                    name=name,
                    X_LG=_origin(element),
                    shape=self._shape(element.required_child("geometry")),
                    rgba=self._material(element),
                    location=element.location(),
                )
                if self.skips:
                    shape_of(geometry)
            except SceneFileError as error:
                if not self.skips:
                    raise
                self.warnings.append(f"{error}: left out")
            else:
                result.append(geometry)
        return tuple(result)

    def _shape(self, geometry: XmlElement) -> PrimitiveShape | MeshFile:
        shapes = [child for child in geometry.children if child.tag in _SHAPES]
        if len(shapes) != 1:
            got = ", ".join(f"<{child.tag}>" for child in geometry.children) or "nothing"
            raise geometry.error(
                f"expected one of {', '.join(_SHAPES)}, got {got}{shape_dialect(geometry)}"
            )
        shape = shapes[0]
        match shape.tag:
            case "box":
                size = shape.numbers("size", 3)
                if min(size) <= 0.0:
                    text = shape.attributes["size"]
                    raise shape.error(f"must be positive, got {text!r}", "size")
                return PrimitiveShape("box", size)
            case "sphere":
                return PrimitiveShape("sphere", (shape.positive("radius"),))
            case "mesh":
                return self._mesh(shape)
            case "drake:ellipsoid":
                axes = tuple(shape.positive(name) for name in "abc")
                return PrimitiveShape("ellipsoid", axes)
            case tag:
                kind = tag.removeprefix("drake:")
                return PrimitiveShape(kind, (shape.positive("radius"), shape.positive("length")))

    def _mesh(self, element: XmlElement) -> MeshFile:
        resource = element.string("filename")
        x, y, z = element.numbers("scale", 3, "1 1 1")
        if min(abs(x), abs(y), abs(z)) < MIN_SCALE:
            text = element.attributes["scale"]
            raise element.error(
                f"must be at least {MIN_SCALE:g} in magnitude, got {text!r}", "scale"
            )
        try:
            path = resolve_resource(resource, base=self.base, packages=self.packages)
        except SceneFileError as error:
            self.warnings.append(f"{element.location('filename')}: {error}")
            return MeshFile(resource, (x, y, z), None, str(error))
        return MeshFile(resource, (x, y, z), path)

    def _material(self, element: XmlElement) -> Rgba | None:
        material = element.only_child("material")
        if material is None:
            return None
        color = material.only_child("color")
        if color is not None:
            return _rgba(color)
        name = material.attributes.get("name", "").strip()
        if name in self.colours:
            return self.colours[name]
        if name and not any(child.tag == "texture" for child in material.children):
            self.warnings.append(f"{material.location()}: no material of this name has a color")
        return None

    def _joint(self, element: XmlElement) -> Joint:
        name = element.name("name")
        word = element.string("type")
        try:
            kind = JointType(word)
        except ValueError:
            words = ", ".join(member.value for member in JointType)
            raise element.error(
                f"expected one of {words}, got {word!r}{joint_dialect(word)}", "type"
            ) from None
        limit = element.only_child("limit")
        if limit is None and kind in (JointType.REVOLUTE, JointType.PRISMATIC):
            self.doubts.append(
                f"{element.location()}: a {word} joint needs a <limit>; without one it is taken"
                " as having none"
            )
        mimic = element.only_child("mimic")
        if mimic is not None and not kind.has_position:
            self.warnings.append(f"{mimic.location()}: ignored, as a {word} joint has no position")
            mimic = None
        lower, upper, soft = joint_limits(element, kind)
        self.notes.extend(soft)
        return Joint(
            name=name,
            type=kind,
            parent=element.required_child("parent").name("link"),
            child=element.required_child("child").name("link"),
            X_PC=_origin(element),
            axis=_axis(element, kind),
            lower=lower,
            upper=upper,
            mimic=None if mimic is None else _mimic(mimic),
            location=element.location(),
            velocity=velocity_limit(limit, kind),
        )


_SHAPES = ("box", "sphere", "cylinder", "capsule", "mesh", "drake:capsule", "drake:ellipsoid")


def _shows_nothing(visual: XmlElement) -> bool:
    """Tell whether a ``<visual>`` has a size of 0, as some files have them to switch it off."""
    geometry = visual.child("geometry")
    texts = [
        shape.attributes.get(name, "")
        for shape in (() if geometry is None else geometry.children)
        for name in ("size", "radius", "length", "scale")
    ]
    return any(_is_zero(part) for text in texts for part in text.split())


def _is_zero(text: str) -> bool:
    try:
        return float(text) == 0.0
    except ValueError:
        return False


def free_name(name: str, taken: Container[str]) -> str:
    """Return a name, with a number behind it where it is taken."""
    numbered = (f"{name}_{number}" for number in itertools.count(2))
    return next(each for each in itertools.chain([name], numbered) if each not in taken)


def _origin(element: XmlElement) -> Pose:
    """Return the pose in ``<origin>``, identity without one; angles are about fixed axes."""
    origin = element.only_child("origin")
    if origin is None:
        return np.eye(4)
    return pose_from_xyz_rpy(origin.numbers("xyz", 3, "0 0 0"), origin.numbers("rpy", 3, "0 0 0"))


def _rgba(color: XmlElement) -> Rgba:
    red, green, blue, alpha = color.numbers("rgba", 4)
    if not all(0.0 <= channel <= 1.0 for channel in (red, green, blue, alpha)):
        raise color.error(f"must be between 0 and 1, got {color.attributes['rgba']!r}", "rgba")
    return (red, green, blue, alpha)


def _axis(element: XmlElement, kind: JointType) -> tuple[float, float, float]:
    axis = element.only_child("axis")
    if axis is None:
        return (1.0, 0.0, 0.0)
    x, y, z = axis.numbers("xyz", 3, "1 0 0")
    length = math.hypot(x, y, z)
    if not length > 0.0:
        if kind in (JointType.FIXED, JointType.FLOATING):
            return (1.0, 0.0, 0.0)
        raise axis.error(f"must not be zero, got {axis.attributes['xyz']!r}", "xyz")
    return (x / length, y / length, z / length)


def _mimic(mimic: XmlElement) -> Mimic:
    return Mimic(mimic.name("joint"), mimic.number("multiplier", "1"), mimic.number("offset", "0"))

"""Files that look like URDF and are another program's: named, with the remedy."""

from __future__ import annotations

from scene_graph_ros.located import Location, SceneFileError
from scene_graph_ros.scene_files.xml_tree import XmlElement

__all__ = ["check_dialect", "joint_dialect", "link_dialect", "part_dialect", "shape_dialect"]

_ROOTS = {
    "sdf": "an SDF, as Gazebo has them",
    "mujoco": "an MJCF, as MuJoCo has them",
    "mujocoinclude": "a part of an MJCF, as MuJoCo has them",
    "launch": "a launch file",
    "COLLADA": "a mesh",
    "package": "a package's manifest",
}
_JOINTS = {
    "spherical": "Bullet's word for a ball joint, which URDF does not have: three revolute joints"
    " about one point do the same",
    "ball": "MuJoCo's and Drake's word for a joint that URDF does not have: three revolute joints"
    " about one point do the same",
    "universal": "Drake's word for a joint that URDF does not have: two revolute joints do",
    "hinge": "MuJoCo's word for a revolute joint",
    "slide": "MuJoCo's word for a prismatic joint",
    "free": "MuJoCo's word for a floating joint",
}
_SHAPES = {
    "plane": "Bullet's word for a half space: use a large box, or a half space of the scene file",
    "cdf": "Bullet's word for a field of distances, which is not read",
    "heightmap": "Gazebo's word for a field of heights, which is not read",
    "ellipsoid": "not URDF's: <drake:ellipsoid a= b= c=> is read",
}


_PARTS = {
    "deformable": "Bullet's word for a body that deforms, which a scene file's geometries may",
    "model": "SDF's word for a robot",
    "body": "MJCF's word for a link",
}


def part_dialect(root: XmlElement) -> str:
    """Return the program of a word in a robot without links, to follow a sentence; or ""."""
    for child in root.children:
        if child.tag in _PARTS:
            return f", but <{child.tag}>: it is {_PARTS[child.tag]}"
    return ""


def link_dialect(name: str) -> str:
    """Return the program of the name of a missing link, to follow a sentence; or ""."""
    if name != "world":
        return ""
    return ': Drake has such a link in every file; <link name="world"/> says so to all'


def check_dialect(root: XmlElement) -> None:
    """Raise SceneFileError for a file that is no URDF, or has joints that only Drake reads."""
    if root.tag != "robot":
        what = _ROOTS.get(root.tag, "")
        raise SceneFileError(
            f"{Location(root.file, root.line)}: expected <robot>, got <{root.tag}>"
            + (f": it is {what}" if what else "")
        )
    for element in root.all("drake:joint"):
        kind = element.attributes.get("type", "")
        raise element.error(
            f"is a joint of Drake's, which URDF does not have{joint_dialect(kind)}"
        )


def joint_dialect(word: str) -> str:
    """Return the program of a type of joint, to follow a sentence; "" where it is unknown."""
    return f": it is {_JOINTS[word]}" if word in _JOINTS else ""


def shape_dialect(geometry: XmlElement) -> str:
    """Return the same of the content of a ``<geometry>``."""
    for child in geometry.children:
        word = child.tag.removeprefix("drake:")
        if word in _SHAPES:
            return f": it is {_SHAPES[word]}"
    return ""

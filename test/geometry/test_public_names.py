"""The public names of the core, and what importing it brings along."""

import subprocess
import sys

import pytest

import scene_graph_ros.geometry
from scene_graph_ros.geometry import errors

PUBLIC = [
    "SceneGraph",
    "GeometryFrame",
    "GeometryInstance",
    "GeometrySet",
    "CollisionFilterDeclaration",
    "Sphere",
    "Box",
    "Capsule",
    "Cylinder",
    "Ellipsoid",
    "HalfSpace",
    "Convex",
    "Mesh",
    "Role",
    "RoleAssign",
    "ProximityProperties",
    "IllustrationProperties",
    "PerceptionProperties",
    "Rgba",
    "add_rigid_hydroelastic_properties",
    "add_compliant_hydroelastic_properties",
    "PenetrationAsPointPair",
    "SignedDistancePair",
    "SignedDistanceToPoint",
    "SurfaceMesh",
    "read_obj_to_surface_mesh",
]


@pytest.mark.parametrize("name", PUBLIC)
def test_promised_name_is_public(name):
    """Every promised name can be imported from the core."""
    assert name in scene_graph_ros.geometry.__all__
    assert hasattr(scene_graph_ros.geometry, name)


def test_all_names_exist_once():
    """The list of public names is sorted, without repetition, and all of them exist."""
    names = scene_graph_ros.geometry.__all__
    assert sorted(set(names), key=lambda n: (n.islower(), n)) == names
    assert all(hasattr(scene_graph_ros.geometry, name) for name in names)


@pytest.mark.parametrize("name", [n for n in errors.__all__ if n != "SceneGraphError"])
def test_errors_are_of_two_families(name):
    """An error can be caught as one of ours or as the built-in one, and prints as written."""
    error = getattr(errors, name)("the name 'x' is bad")
    assert isinstance(error, errors.SceneGraphError)
    assert isinstance(error, (ValueError, KeyError))
    assert str(error) == "the name 'x' is bad"


def test_import_brings_no_ros_and_no_mesh_readers():
    """Importing the core and making a scene imports neither rclpy nor a mesh library."""
    code = """
import sys
import numpy as np
from scene_graph_ros.geometry import *
graph = SceneGraph()
source = graph.register_source("s")
graph.register_anchored_geometry(source, GeometryInstance(np.eye(4), Sphere(1.0), "ball"))
unwanted = {"rclpy", "trimesh", "scipy.spatial", "pydantic", "pinocchio", "matplotlib"}
print(sorted(unwanted & set(sys.modules)))
"""
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert result.stdout.strip() == "[]"

"""Contact surfaces of round bodies approach their closed forms with the square of the hint.

A compliant body presses with its modulus E times its extent, which falls linearly from 1 at the
centre (of a capsule: on its middle line) to 0 on the surface. On a plane at distance k (in radii)
from there, cut out of a ball of radius 1, force and area are

    F(k) = 2 pi E int_0^s (1 - sqrt(k^2 + u^2)) u du,  A(k) = pi s^2,  s = sqrt(1 - k^2).
"""

import math

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Capsule,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Sphere,
)

E = 2e5
R = 0.12
DEPTH = 0.2 * R
HINTS = [R / 4, R / 8, R / 16]


def _unit_ball(k):
    """Return force and area of a ball of radius 1 on a plane at distance k from its centre."""
    s = math.sqrt(1.0 - k * k)
    return 2.0 * math.pi * E * (0.5 * s * s - (1.0 - k**3) / 3.0), math.pi * s * s


def _sphere():
    force, area = _unit_ball(1.0 - DEPTH / R)
    return R * R * force, R * R * area


def _ellipsoid():
    # An affine image of the ball, scaled by a and b along the plane.
    force, area = _unit_ball(1.0 - DEPTH / R)
    return 1.3 * 0.8 * R * R * force, 1.3 * 0.8 * R * R * area


def _capsule():
    # The two halves of a ball, and between them a strip of half width w:
    # int_-w^w (1 - sqrt(h^2 + y^2) / R) dy = 2 w - (w R + h^2 asinh(w / h)) / R.
    force, area = _sphere()
    h = R - DEPTH
    w = math.sqrt(R * R - h * h)
    strip = 2.0 * w - (w * R + h * h * math.asinh(w / h)) / R
    length = 0.25
    return force + E * length * strip, area + 2.0 * w * length


LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
CASES = {
    "sphere": (Sphere(R), np.eye(3), _sphere),
    "ellipsoid": (Ellipsoid(1.3 * R, 0.8 * R, R), np.eye(3), _ellipsoid),
    "capsule on its side": (Capsule(R, 0.25), LYING, _capsule),
}


def _surface(bodies):
    """Return the surface of two bodies: shape, pose and properties each."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("s")
    poses = {}
    for name, (shape, X_WF, properties) in zip("AB", bodies, strict=True):
        frame = scene_graph.register_frame(source, GeometryFrame(name))
        instance = GeometryInstance(np.eye(4), shape, name)
        geometry = scene_graph.register_geometry(source, frame, instance)
        scene_graph.assign_role(source, geometry, properties)
        poses[frame] = X_WF
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, poses)
    (surface,) = scene_graph.query_object(context).compute_contact_surfaces("polygon")
    return surface


def _soft(hint):
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties(properties, hint, E)
    return properties


def _pose(rotation, z):
    X = np.eye(4)
    X[:3, :3] = rotation
    X[2, 3] = z
    return X


def _falls_with_the_square(errors, bound):
    """Check errors at hints that halve; the last one is to be within a bound.

    The order is that of all steps together: in each, how the plane lies in the mesh counts, too.
    """
    assert errors[-1] < bound
    order = math.log2(errors[0] / errors[-1]) / (len(errors) - 1)
    assert order > 1.6, (errors, order)


@pytest.mark.parametrize("name", list(CASES))
def test_force_and_area_on_rigid_ground(name):
    """Force and area approach the closed form, and the force is straight up."""
    shape, rotation, closed_form = CASES[name]
    force, area = closed_form()
    ground = ProximityProperties()
    add_rigid_hydroelastic_properties(ground)
    forces, areas = [], []
    for hint in HINTS:
        bodies = (shape, _pose(rotation, R - DEPTH), _soft(hint)), (HalfSpace(), np.eye(4), ground)
        surface = _surface(bodies)
        found, _ = surface.force_and_moment(surface.centroid_W)
        np.testing.assert_allclose(found[:2], 0.0, atol=1e-10 * force)
        forces.append(abs(found[2] - force) / force)
        areas.append(abs(surface.total_area - area) / area)
    _falls_with_the_square(forces, 0.02)
    _falls_with_the_square(areas, 0.02)


def test_two_equal_spheres():
    """Between equal spheres pressures are equal on the plane in the middle, as on rigid ground."""
    force, area = _sphere()
    forces, areas = [], []
    for hint in HINTS:
        bodies = (
            (Sphere(R), _pose(np.eye(3), R - DEPTH), _soft(hint)),
            (Sphere(R), _pose(np.eye(3), DEPTH - R), _soft(hint)),
        )
        surface = _surface(bodies)
        found, _ = surface.force_and_moment(surface.centroid_W)
        forces.append(abs(found[2] - force) / force)
        areas.append(abs(surface.total_area - area) / area)
    _falls_with_the_square(forces, 0.03)
    _falls_with_the_square(areas, 0.03)

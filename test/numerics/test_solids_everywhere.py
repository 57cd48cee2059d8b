"""One meaning of a mesh of parts: points, pairs, collisions, pressure, reports and refusals."""

import numpy as np
from pressing_bodies import at, rigid, Scene
import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties_for_half_space,
    HalfSpace,
    Mesh,
    ProximityProperties,
    Sphere,
)
from scene_graph_ros.geometry.errors import MeshError

FACES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)
E = 1e6


def boxes(*bounds):
    """Return boxes (lower, upper, is_turned) as one mesh."""
    vertices, faces = [], []
    for k, (lower, upper, is_turned) in enumerate(bounds):
        axes = list(zip(lower, upper, strict=True))
        vertices += [(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]]
        faces.append((FACES[:, ::-1] if is_turned else FACES) + 8 * k)
    return Mesh(vertices=np.array(vertices, dtype=float), faces=np.vstack(faces))


def triangles(**more):
    """Return properties by which a mesh is its triangles."""
    properties = ProximityProperties()
    properties.add_property("mesh", "representation", "triangles")
    for key, value in more.items():
        properties.add_property("mesh", key, value)
    return properties


STACKED = boxes(((-1, -1, 0), (1, 1, 1), False), ((-0.5, -0.5, 1), (0.5, 0.5, 3), False))
OVERLAPPING = boxes(((-1, -1, 0), (1, 1, 2), False), ((-0.5, -0.5, 1), (0.5, 0.5, 3), False))
NESTED = boxes(((-1, -1, 0), (1, 1, 2), False), ((-0.2, -0.2, 0.5), (0.2, 0.2, 1), False))
HOLLOW = boxes(((-1, -1, 0), (1, 1, 2), False), ((-0.5, -0.5, 0.5), (0.5, 0.5, 1.5), True))
ASKED = [
    # By hand: the distance to the nearest face or edge of the union, negative inside.
    (STACKED, (0.0, 0.0, 1.0), -np.sqrt(0.5**2), 1.0),
    (STACKED, (0.0, 0.0, 0.9), -np.hypot(0.5, 0.1), 1.0),
    (OVERLAPPING, (0.0, 0.0, 1.4), -np.hypot(0.5, 0.6), 1.0),
    (NESTED, (0.0, 0.0, 0.75), -0.75, 1.0),
    (NESTED, (0.25, 0.0, 0.75), -0.75, 1.0),
    (HOLLOW, (0.0, 0.0, 1.0), 0.5, 1.0),
    (HOLLOW, (0.75, 0.0, 1.0), -0.25, 1.0),
]


@pytest.mark.parametrize("case", range(len(ASKED)))
def test_points_balls_and_collisions_agree(case):
    """The distance of a point, of a small ball about it, and whether the ball collides."""
    mesh, place, expected, _ = ASKED[case]
    radius = 0.05
    scene = Scene()
    solid = scene.add(mesh, triangles(), at())
    ball = scene.add(Sphere(radius), ProximityProperties(), at(*place))
    query = scene.query()
    found = query.compute_signed_distance_to_point(np.array(place))
    assert next(f.distance for f in found if f.id_G == solid) == pytest.approx(expected, abs=6e-12)
    pair = query.compute_signed_distance_pair_closest_points(solid, ball)
    assert pair.distance == pytest.approx(expected - radius, abs=6e-12)
    assert query.has_collisions() == (expected < radius)


@pytest.mark.parametrize(
    ("mesh", "depth"), [(STACKED, 0.8), (OVERLAPPING, 1.2), (NESTED, 0.8), (HOLLOW, 0.4)]
)
def test_pressure_is_that_of_the_outer_faces(mesh, depth):
    """On the bottom of 4 m2 the pressure is E times the depth: hidden faces press nothing."""
    scene = Scene()
    scene.add(mesh, rigid(), at(z=-depth))
    scene.add(HalfSpace(), soft_floor(), at())
    surfaces = scene.query().compute_contact_surfaces()
    assert len(surfaces) == 1
    forces = surfaces[0].face_areas * surfaces[0].face_pressures
    lift = float((forces * surfaces[0].face_normals_W[:, 2]).sum())
    assert abs(lift) == pytest.approx(4.0 * E * depth, rel=1e-9)


def soft_floor():
    """Return a half space that is 1 m thick."""
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties_for_half_space(properties, 1.0, E)
    return properties


def test_reports_and_refusals_agree():
    """Each solid is closed by its report and may be required; an open one may not."""
    for mesh, parts, cavities in (
        (STACKED, 2, 0),
        (OVERLAPPING, 2, 0),
        (NESTED, 2, 0),
        (HOLLOW, 2, 1),
    ):
        scene = Scene()
        solid = scene.add(mesh, triangles(solid="required"), at())
        report = scene.graph.model_inspector().get_mesh_report(solid)
        assert (report.parts, report.cavities, report.is_closed) == (parts, cavities, True)
    lid = Mesh(vertices=STACKED.vertices, faces=STACKED.faces[1:])
    with pytest.raises(MeshError, match="edges are open, one at"):
        Scene().add(lid, triangles(solid="required"), at())

"""Surfaces that cross themselves along edges, where no edge goes through a triangle."""

from fractions import Fraction

from constructed_solids import convex_body
from mesh_distances import signed_distances
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from winding_truth import solid_angles

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.sources import surface_of

# Corners of rings in the order in which they are joined, and apexes above and below them.
RINGS = {
    # Triangles have an apex in common and cross from there to where two sides of the ring do.
    "five sides that cross": ([(0, 2, 0), (3, 0, 0), (3, 4, 0), (0, 1, 0), (4, 3, 0)], (1.9, 2.1)),
    "sides that cross at one point": (
        [(0, 0, 0), (4, 2, 0), (0, 1, 0), (4, 0, 0), (2, 4, 0)],
        (2.2, 0.9),
    ),
    # An edge from each apex to a corner lies in triangles on the plane y=1.
    "an edge in triangles": (
        [(4, 1, 0), (3, -1, 0), (3, 1, 0), (1, 2, 1), (2, 1, 0)],
        (3.0, 1.0),
    ),
}


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.3, -0.8, 0.5)])
@pytest.mark.parametrize("name", RINGS)
@pytest.mark.parametrize("is_alone", [True, False])
def test_a_surface_that_crosses_itself_along_edges_is_cut(name, turn, is_alone):
    """Alone, or beside a body that it touches: sides are those of the winding numbers."""
    ring, middle = RINGS[name]
    n, R = len(ring), Rotation.from_rotvec(turn).as_matrix()
    k = np.arange(n)
    vertices = np.array([*ring, (*middle, 3), (*middle, -3)], dtype=float)
    j = (k + 1) % n
    faces = np.vstack([np.stack([k, j, 0 * k + n], 1), np.stack([j, k, 0 * k + n + 1], 1)])
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
        faces = faces[:, ::-1]
    if not is_alone:
        box = [(x, y, z) for x in (1, 3) for y in (1, 3) for z in (3, 4)]
        sides = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
        sides += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
        faces = np.vstack([faces, np.array(sides) + len(vertices)])
        vertices = np.vstack([vertices, box])
    vertices = vertices @ R.T
    mesh = Mesh(vertices=vertices, faces=faces)
    report = surface_of(mesh).report
    assert (report.is_closed, report.parts) == (True, 2 - is_alone), str(report)
    assert any(r.kind == "bodies cut where they cross themselves" for r in report.repairs)
    rng = np.random.default_rng(4)
    points = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (1500, 3))
    winding = solid_angles(points, vertices, faces)
    assert winding.min() < -0.5 or winding.max() > 1.5
    phi = signed_distances(mesh, points)
    clear = np.abs(phi) > 1e-9
    np.testing.assert_array_equal((phi < 0.0)[clear], (winding > 0.5)[clear])


def test_what_is_inside_out_takes_away_from_a_body_around_it():
    """A lobe wound around by -1, in a ball: the solid has its winding number of 0 nowhere inside.

    All of the crossing is inside of the ball, and not on the surface of a union.
    """
    rng = np.random.default_rng(1)
    ring = [(-3, -1, 0), (0.3, 0.1, 0), (0.3, -0.1, 0), (-3, 1, 0)]
    vertices = np.array([*ring, (-1, 0, 1), (-1, 0, -1)], dtype=float)
    k = np.arange(4)
    j = (k + 1) % 4
    faces = np.vstack([np.stack([k, j, 0 * k + 5], 1), np.stack([j, k, 0 * k + 4], 1)])[:, ::-1]
    assert solid_angles(np.array([(-2.0, 0.0, 0.0)]), vertices, faces)[0] > 0.99
    on_ball = rng.normal(size=(300, 3))
    ball = convex_body(2.0 * on_ball / np.linalg.norm(on_ball, axis=1)[:, None])
    points = np.vstack([vertices, ball.vertices - (0.5, 0, 0)])
    triangles = np.vstack([faces, ball.faces + len(vertices)])
    asked = rng.uniform((-0.2, -0.1, -0.3), (0.3, 0.1, 0.3), (400, 3))
    alone = solid_angles(asked, vertices, faces)
    np.testing.assert_allclose(alone, np.round(alone), atol=1e-6)
    assert (np.unique(np.round(alone)) == (-1, 0, 1)).all()
    mesh = Mesh(vertices=points, faces=triangles)
    assert surface_of(mesh).report.is_closed
    phi = signed_distances(mesh, asked)
    np.testing.assert_array_equal(phi < 0.0, solid_angles(asked, points, triangles) > 0.5)


def meet(one, other):
    """Tell whether the insides of two triangles of whole numbers share a segment, exactly.

    None where they are in parallel planes, or one has no area.
    """
    n, m = (np.cross(t[1] - t[0], t[2] - t[0]) for t in (one, other))
    along = np.cross(n, m)
    if not along.any():
        return None
    spans = []
    for triangle, normal, origin in ((one, m, other[0]), (other, n, one[0])):
        heights = [int(h) for h in (triangle - origin) @ normal]
        if max(heights) <= 0 or min(heights) >= 0:
            return False
        places = [int(x) for x in triangle @ along]
        ends = [
            places[k]
            + Fraction(heights[k], heights[k] - heights[k - 2]) * (places[k - 2] - places[k])
            for k in range(3)
            if (heights[k] > 0) != (heights[k - 2] > 0)
        ]
        spans.append((min(ends), max(ends)))
    return max(span[0] for span in spans) < min(span[1] for span in spans)


def test_triangles_cross_where_whole_numbers_say_so():
    """Turned, moved and scaled: those that have a corner, an edge or nothing in common."""
    rng = np.random.default_rng(5)
    found = np.zeros(2, dtype=int)
    for _ in range(3000):
        reach = int(rng.choice([3, 5, 12]))
        corners = rng.integers(-reach, reach + 1, (6, 3))
        if rng.random() < 0.6:
            corners[3] = corners[rng.integers(3)]
        crosses = meet(corners[:3], corners[3:])
        points, rows = np.unique(corners, axis=0, return_inverse=True)
        triangles = rows.reshape(2, 3)
        if crosses is None or any(len(set(row)) < 3 for row in triangles.tolist()):
            continue
        # Those with an edge in common have no more in common, unless they are folded.
        crosses = crosses and len(np.intersect1d(*triangles)) < 2
        place = points @ Rotation.random(rng=rng).as_matrix().T + rng.normal(size=3)
        at = first_crossing(place * 10.0 ** rng.uniform(-6, 6), triangles)
        assert (at is not None) == crosses, corners.tolist()
        found[int(crosses)] += 1
    assert found.min() > 500

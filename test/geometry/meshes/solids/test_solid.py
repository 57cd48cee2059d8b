"""Triangles as solids: parts, cavities, sheets, repairs, in any order and orientation."""

import re

from mesh_distances import signed_distances
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from winding_truth import solid_angles

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.meshes.solids.cut import hold_to_winding, NotUnitedError
from scene_graph_ros.geometry.meshes.solids.solid import solid_of
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.sources import is_convex, surface_of
from scene_graph_ros.geometry.model.mesh_properties import check_solid, mesh_meant
from scene_graph_ros.geometry.model.properties import ProximityProperties

FACES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)


def body(lower, upper):
    """Return the corners of a box, and FACES."""
    axes = list(zip(lower, upper, strict=True))
    corners = [(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]]
    return np.array(corners, dtype=float), FACES


def together(*parts):
    """Return the parts as one mesh."""
    starts = np.cumsum([0, *(len(v) for v, _ in parts)])
    faces = [f + k for (_, f), k in zip(parts, starts, strict=False)]
    return np.vstack([v for v, _ in parts]), np.vstack(faces)


def turned_back(part):
    """Return a part inside out."""
    return part[0], part[1][:, ::-1]


def shuffled(mesh, seed):
    """Return the triangles of a mesh in another order, half of them the other way round."""
    rng = np.random.default_rng(seed)
    vertices, faces = mesh
    faces = faces[rng.permutation(len(faces))]
    is_turned = rng.random(len(faces)) < 0.5
    return vertices, np.where(is_turned[:, None], faces[:, ::-1], faces)


UNIT = body((0, 0, 0), (1, 1, 1))
SPLIT = np.array([t for t in FACES.tolist() if t != [0, 4, 5]] + [[0, 8, 5], [8, 4, 5]])
RNG = np.random.default_rng(1)
SEAMS = np.float32(UNIT[0][FACES].reshape(-1, 3) + 0.1) * (1 + RNG.uniform(-6e-8, 6e-8, (36, 1)))
LINE = np.vstack([UNIT[0], [[0.2, 0.2, 1], [0.5, 0.5, 1], [0.8, 0.8, 1]]])
WALL = [(x, y, z) for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)]
WALL_FACES = [
    *([0, 2, 3], [0, 3, 1], [8, 9, 11], [8, 11, 10], [4, 6, 7], [4, 7, 5]),
    *(
        corners
        for k in (0, 4)
        for a, b in ((0, 1), (1, 3), (3, 2), (2, 0))
        for corners in ([k + a, k + b, k + 4 + b], [k + a, k + 4 + b, k + 4 + a])
    ),
]
CLOSED = {
    "T vertex": ((np.vstack([UNIT[0], [0.5, 0, 0]]), SPLIT), 1.0, "T vertices"),
    "seams": ((SEAMS, np.arange(36).reshape(-1, 3)), 1.0, "vertices welded"),
    "an edge in common": (together(UNIT, body((1, 1, 0), (2, 2, 1))), 2.0, None),
    "a face in common": (together(UNIT, body((1, 0, 0), (2, 1, 1))), 2.0, None),
    "doubled before": ((UNIT[0], np.vstack([FACES[:2, ::-1], FACES])), 1.0, "doubled triangles"),
    "doubled after": ((UNIT[0], np.vstack([FACES, FACES[:2, ::-1]])), 1.0, "doubled triangles"),
    "a stray": ((LINE, np.vstack([FACES, [[8, 9, 10]]])), 1.0, "triangles without area"),
    "a wall inside": (
        (np.array(WALL, dtype=float), np.array(WALL_FACES)),
        2.0,
        "triangles inside of the solid dropped",
    ),
    "stacked": (
        together(body((-1, -1, 0), (1, 1, 1)), body((-0.5, -0.5, 1), (0.5, 0.5, 2))),
        5.0,
        None,
    ),
    "nested": (together(body((0, 0, 0), (2, 2, 2)), body((0.8,) * 3, (1.2,) * 3)), 8.0, None),
}


def volume(solid):
    """Return the volume inside by the divergence theorem."""
    a, b, c = (solid.vertices[solid.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@pytest.mark.parametrize("seed", [None, 1, 2])
@pytest.mark.parametrize("name", list(CLOSED))
def test_what_is_nearly_closed_or_in_parts_is_one_solid(name, seed):
    """Its volume is that of the boxes' union, its boundary closed; what was repaired is told."""
    mesh, expected, kind = CLOSED[name]
    solid = solid_of(*(mesh if seed is None else shuffled(mesh, seed)), 1e-6)
    assert solid.report.is_closed
    assert not solid.report.reason
    assert volume(solid) == pytest.approx(expected, rel=1e-6 if name == "seams" else 2e-11)
    if kind is not None:
        assert kind in [repair.kind for repair in solid.report.repairs]


def test_a_cavity_stays_a_cavity():
    """A part in another one that runs the other way bounds a hollow; what is in it, a solid."""
    outer, hollow = body((0, 0, 0), (3, 3, 3)), turned_back(body((1, 1, 1), (2, 2, 2)))
    core = body((1.4,) * 3, (1.6,) * 3)
    solid = solid_of(*together(outer, hollow, core), 1e-6)
    assert (solid.report.parts, solid.report.cavities) == (3, 1)
    assert volume(solid) == pytest.approx(27.0 - 1.0 + 0.008, rel=1e-12)
    middles = np.array([(0.5, 1.5, 1.5), (1.2, 1.5, 1.5), (1.5, 1.5, 1.5), (3.5, 1.5, 1.5)])
    found = winding_numbers(middles, solid.vertices, solid.triangles)
    assert found.tolist() == [1, 0, 1, 0]


def test_a_part_that_crosses_a_cavity_fills_it():
    """Points of the hollow that are in another part wind once."""
    outer, hollow = body((0, 0, 0), (3, 3, 3)), turned_back(body((1, 1, 1), (2, 2, 2)))
    bar = body((1.4, 1.4, -1), (1.6, 1.6, 4))
    solid = solid_of(*together(outer, hollow, bar), 1e-6)
    # 27 - 1, the bar's 0.04 in the hollow and 0.08 outside.
    assert volume(solid) == pytest.approx(26.12, rel=1e-11)


def test_an_open_edge_makes_a_sheet_that_ends_at_the_solid():
    """Of a triangle through a box, the pieces outside of the box are left."""
    points = np.vstack([UNIT[0], [[0.5, 0.4, -2], [0.5, 0.6, 3], [0.4, 0.5, 4]]])
    solid = solid_of(points, np.vstack([FACES, [[8, 9, 10]]]), 1e-6)
    assert (solid.report.parts, solid.report.sheets, solid.solid_parts) == (1, 1, 1)
    assert not solid.report.is_closed
    assert "3 edges are open" in solid.report.reason
    sheet = solid.vertices[solid.triangles[solid.part >= 1]].reshape(-1, 3)
    assert not ((sheet > 1e-9) & (sheet < 1.0 - 1e-9)).all(axis=1).any()
    assert sheet[:, 2].min() == -2.0
    assert sheet[:, 2].max() == 4.0


def test_a_gap_is_repaired_up_to_the_tolerance():
    """A corner that is off by 1e-4 is closed where that is asked for, else open."""
    points = UNIT[0][FACES].reshape(-1, 3).copy()
    points[0] += 1e-4
    faces = np.arange(36).reshape(-1, 3)
    assert not solid_of(points, faces, 1e-6).report.is_closed
    assert solid_of(points, faces, 1e-3).report.is_closed


def test_convex_is_what_has_no_hollow_edge():
    """Parts that overlap by as much as a hollow holds have their hull's volume, and no more."""
    hollow = together(
        body((0, 0, 0), (3, 1, 1)), body((0, 0, 0.5), (1.2, 1, 3)), body((1.8, 0, 0.5), (3, 1, 3))
    )
    assert not is_convex(Mesh(vertices=hollow[0], faces=hollow[1]))
    flush = together(UNIT, body((1, 0, 0), (2, 1, 1)))
    assert is_convex(Mesh(vertices=flush[0], faces=flush[1]))


def test_a_surface_that_crosses_itself_is_cut_there():
    """A corner pulled through the top: what is above the top is outside, by winding numbers."""
    points = UNIT[0].copy()
    points[0] = (0.5, 0.5, 1.5)  # its edges pass through the top
    surface = surface_of(Mesh(vertices=points, faces=FACES))
    assert surface.report.is_closed
    assert "cut where they cross themselves" in str(surface.report)
    asked = np.random.default_rng(5).uniform(-0.2, 1.7, (2000, 3))
    wanted = solid_angles(asked, points, FACES) > 0.5
    assert 50 < wanted.sum() < 1950
    found = winding_numbers(asked, surface.vertices, surface.triangles[surface.is_solid])
    np.testing.assert_array_equal(found, wanted)


def test_a_triangle_with_a_vertex_twice_is_none():
    """Triangles along edges: the surface is cut where it crosses itself as it is without them."""
    points = UNIT[0].copy()
    points[0] = (0.5, 0.5, 1.5)
    faces = np.vstack([FACES, [(2, 0, 2), (2, 6, 6), (3, 0, 3), (6, 0, 6), (6, 4, 4), (6, 7, 6)]])
    solid = solid_of(points, faces, 1e-6)
    assert (solid.report.is_closed, solid.report.reason) == (True, "")
    clean = solid_of(points, FACES, 1e-6)
    assert volume(solid) == pytest.approx(volume(clean), abs=1e-11)


def test_a_solid_can_be_required():
    """A mesh with a sheet is refused with the report's reason; wrong words by their name."""
    properties = ProximityProperties()
    properties.add_property("mesh", "solid", "required")
    mesh = Mesh(vertices=UNIT[0], faces=FACES[1:])
    with pytest.raises(MeshError, match=r"'lid' must be a solid.*3 edges are open, one at"):
        check_solid(mesh, properties, "lid")
    check_solid(Mesh(vertices=UNIT[0], faces=FACES), properties, "box")
    properties.update_property("mesh", "solid", "always")
    with pytest.raises(PropertyError, match=r"must be 'required' or 'if_closed', not 'always'"):
        check_solid(mesh, properties, "lid")


def test_a_tolerance_out_of_range_is_refused():
    """By the property's name and the value."""
    properties = ProximityProperties()
    properties.add_property("mesh", "repair_tolerance", 0.5)
    with pytest.raises(PropertyError, match=r"'repair_tolerance'\) must be a number from 0 to"):
        mesh_meant(Mesh(vertices=UNIT[0], faces=FACES), properties)


def crumpled():
    """Return a closed surface that crosses itself all over: a ball's, its corners at random."""
    rng = np.random.default_rng(3)
    on_ball = rng.normal(size=(40, 3))
    hull = ConvexHull(on_ball / np.linalg.norm(on_ball, axis=1)[:, None])
    return rng.uniform(size=(40, 3)), hull.simplices.astype(np.int64)


@pytest.mark.parametrize(
    ("limit", "scale", "sentence"),
    [
        ("arrangement.MOST_PIECES", 2.0, "triangles would be cut into more than 300 pieces"),
        ("piercing._MOST_PAIRS", 3.0, "more than 300 pairs of triangles may cross"),
    ],
)
def test_what_crosses_itself_too_often_stays_as_it_is(monkeypatch, limit, scale, sentence):
    """The work is bounded, and the report says that it stopped there; else it is cut."""
    vertices, faces = crumpled()
    whole = surface_of(Mesh(vertices=vertices, faces=faces))
    assert whole.report.is_closed, str(whole.report)
    assert len(whole.triangles) > 300
    monkeypatch.setattr(f"scene_graph_ros.geometry.meshes.solids.{limit}", 300)
    # Of another size, since the solid of the first one is known.
    mesh = Mesh(vertices=scale * vertices, faces=faces)
    surface = surface_of(mesh)
    assert not surface.report.is_closed
    assert sentence in surface.report.reason
    assert len(surface.triangles) == len(faces)
    properties = ProximityProperties()
    properties.add_property("mesh", "solid", "required")
    with pytest.raises(MeshError, match=sentence):
        check_solid(mesh_meant(mesh, properties), properties, "crumple")


@pytest.mark.parametrize("others", [[], [((3, 0, 0), (4, 1, 1))]])
def test_a_part_nested_in_itself_along_common_edges_has_no_walls_inside(others):
    """A box with a smaller one in it, that has a face in common, cut the other way."""
    outer, inner = body((0, 0, 0), (3, 1, 1)), body((2, 0, 0), (3, 1, 1))
    at_end = (inner[0][inner[1]][:, :, 0] == 3).all(axis=1)
    flipped = np.concatenate([inner[1][~at_end], [(4, 6, 5), (5, 6, 7)]])
    mesh = together(outer, (inner[0], flipped), *(body(*box) for box in others))
    surface = surface_of(Mesh(vertices=mesh[0], faces=mesh[1]))
    assert surface.report.is_closed, str(surface.report)
    depth = signed_distances(Mesh(vertices=mesh[0], faces=mesh[1]), np.array([[2.0, 0.5, 0.5]]))
    assert depth[0] == pytest.approx(-0.5, abs=1e-9)


def test_a_union_with_walls_inside_is_refused():
    """A box in a box, both kept: points of the inner one are wound around twice."""
    mesh = together(body((0, 0, 0), (3, 1, 1)), body((1, 0.1, 0.1), (2, 0.9, 0.9)))
    with pytest.raises(NotUnitedError) as refused:
        hold_to_winding(mesh, mesh)
    told = refused.value.told(np.array([100.0, 200.0, 300.0]))
    place = re.fullmatch(r"parts can't be united near \((.*), (.*), (.*)\)", told)
    lower, upper = np.array([101, 200.1, 300.1]), np.array([102, 200.9, 300.9])
    at = np.array([float(x) for x in place.groups()])
    assert ((at > lower) & (at < upper)).all(), told

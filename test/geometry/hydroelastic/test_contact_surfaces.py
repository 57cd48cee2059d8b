"""The queries about contact surfaces: what they return, for which pairs, what they refuse."""

import math
import os
import pickle
import subprocess
import sys

import numpy as np
from pressing_bodies import at, compliant, E, rigid, Scene, two
import pytest
from warm_kernels import called_kernels, run_tasks

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties_for_half_space,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    ContactRepresentation,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    Mesh,
    ProximityProperties,
    Sphere,
)
from scene_graph_ros.geometry.errors import QueryArgumentError, UnsupportedPairError

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.2
FACES = [
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
]  # fmt: skip
SHAPES = {
    "sphere": Sphere(0.2),
    "capsule": Capsule(0.2, 0.2),
    "box": Box(0.4, 0.4, 0.4),
    "cylinder": Cylinder(0.2, 0.4),
    "ellipsoid": Ellipsoid(0.2, 0.25, 0.2),
    "convex": Convex(vertices=CORNERS),
    "mesh": Mesh(vertices=CORNERS, faces=FACES),
}


def soft_ground():
    """Properties of a compliant half space."""
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties_for_half_space(properties, 0.5, E)
    return properties


@pytest.mark.parametrize("name", list(SHAPES))
def test_every_shape_has_surfaces_compliant_and_rigid(name):
    """Each shape presses up on a rigid floor, a compliant floor and a rigid or compliant box."""
    shape = SHAPES[name]
    # The lowest point of each is 0.2 below its centre, but for the capsule's 0.3.
    low = 0.3 if name == "capsule" else 0.2
    partners = [
        (compliant(), HalfSpace(), rigid(), 0.0),
        (compliant(), HalfSpace(), soft_ground(), 0.0),
        (rigid(), HalfSpace(), soft_ground(), 0.0),
        (compliant(), Box(1.0, 1.0, 0.4), rigid(), 0.2),
        (rigid(), Box(1.0, 1.0, 0.4), compliant(), 0.2),
        (compliant(), Box(1.0, 1.0, 0.4), compliant(), 0.2),
    ]
    for own, other, properties, top in partners:
        scene = Scene()
        id_M = scene.add(shape, own, at(z=top + low - 0.05))
        id_N = scene.add(other, properties, at(), anchored=True)
        (surface,) = scene.query().compute_contact_surfaces()
        assert (surface.id_M, surface.id_N) == (id_M, id_N)
        force, _ = surface.force_and_moment(surface.centroid_W)
        assert force[2] > 0.0
        assert np.hypot(force[0], force[1]) < 0.05 * force[2]
        assert abs(surface.centroid_W[:2]).max() < 0.01
        assert 0.0 < surface.pressure.max() <= 0.3 * E
        # No more than the shadow of the shape, with a box's walls 0.05 deep.
        assert 0.0 < surface.total_area < 0.4 * 0.6 + 4 * 0.4 * 0.05 + 0.01


def test_cylinder_on_its_side():
    """A lying cylinder on a rigid floor, with the pressure E depth / r of its medial axis.

    With delta(s) = r - sqrt(h^2 + s^2) and ends at |z| = L / 2 that are delta away where
    L / 2 - |z| < delta: F = E / r int (L delta - delta^2) ds over |s| < sqrt(r^2 - h^2).
    """
    r, length, h = 0.2, 0.8, 0.15
    s = np.linspace(-1.0, 1.0, 20001) * math.sqrt(r * r - h * h)
    delta = r - np.hypot(h, s)
    integrand = length * delta - delta**2
    expected = E / r * 0.5 * (integrand[1:] + integrand[:-1]) @ np.diff(s)
    errors = []
    for resolution in (0.1, 0.05, 0.025):
        scene = Scene()
        pose = at(z=h)
        pose[:3, :3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        scene.add(Cylinder(r, length), compliant(resolution=resolution), pose)
        scene.add(HalfSpace(), rigid(), at(), anchored=True)
        (surface,) = scene.query().compute_contact_surfaces()
        errors.append(abs(surface.force_and_moment(np.zeros(3))[0][2] - expected) / expected)
    assert errors[-1] < 0.03
    assert errors[0] > 2.5 * errors[1] > 6.0 * errors[2]


def test_representation_is_a_word_or_its_enum():
    """Both words and the enum's members are accepted and the same; anything else is refused."""
    query = two(Sphere(0.2), compliant(), Sphere(0.2), compliant())
    for word in ("triangle", "polygon"):
        assert query.compute_contact_surfaces(word) is query.compute_contact_surfaces(
            ContactRepresentation(word)
        )
    for bad in ("triangles", None, 3):
        with pytest.raises(QueryArgumentError, match="representation"):
            query.compute_contact_surfaces(bad)
        with pytest.raises(QueryArgumentError, match="representation"):
            query.compute_contact_surfaces_with_fallback(bad)


@pytest.mark.parametrize(
    ("shape_A", "properties_A", "shape_B", "properties_B", "words"),
    [
        (Sphere(0.2), rigid(), Box(1, 1, 0.4), rigid(), "is rigid"),
        (Sphere(0.2), compliant(), Box(1, 1, 0.4), ProximityProperties(), "without hydroelastic"),
        (Sphere(0.2), rigid(), HalfSpace(), rigid(), "a rigid half space"),
    ],
)
def test_pairs_without_a_surface(shape_A, properties_A, shape_B, properties_B, words):
    """They are refused by both names while they penetrate, and points in the fallback."""
    query = two(shape_A, properties_A, shape_B, properties_B, z=0.18)
    with pytest.raises(UnsupportedPairError, match=words) as caught:
        query.compute_contact_surfaces()
    assert "'g0'" in str(caught.value)
    assert "'g1'" in str(caught.value)
    surfaces, points = query.compute_contact_surfaces_with_fallback()
    assert len(surfaces) == 0
    (expected,) = query.compute_point_pair_penetration()
    assert points[0].id_A == expected.id_A
    assert points[0].depth == expected.depth
    apart = two(shape_A, properties_A, shape_B, properties_B, z=0.41)
    assert len(apart.compute_contact_surfaces()) == 0


def test_two_half_spaces_are_refused_by_both():
    """Half spaces overlap without bound: neither query has an answer, unless both are anchored."""
    query = two(HalfSpace(), soft_ground(), HalfSpace(), rigid())
    for ask in (query.compute_contact_surfaces, query.compute_contact_surfaces_with_fallback):
        with pytest.raises(UnsupportedPairError, match="half spaces"):
            ask()
    scene = Scene()
    scene.add(HalfSpace(), soft_ground(), at(), anchored=True)
    scene.add(HalfSpace(), rigid(), at(), anchored=True)
    assert len(scene.query().compute_contact_surfaces()) == 0


def test_fallback_has_each_pair_once():
    """Pairs with a surface are surfaces, the others points, none both, each sorted."""
    scene = Scene()
    scene.add(Sphere(0.2), compliant(), at(z=0.18))
    scene.add(Sphere(0.2), rigid(), at(x=0.35, z=0.18))
    scene.add(Sphere(0.2), ProximityProperties(), at(x=0.7, z=0.18))
    scene.add(HalfSpace(), rigid(), at(), anchored=True)
    surfaces, points = scene.query().compute_contact_surfaces_with_fallback()
    a, b, c, floor = scene.ids
    assert [(s.id_M, s.id_N) for s in surfaces] == [(a, b), (a, floor)]
    assert [(p.id_A, p.id_B) for p in points] == [(b, c), (b, floor), (c, floor)]


def test_filters_frames_and_anchors():
    """Filtered pairs, pairs on one frame and anchored pairs are not reported."""
    scene = Scene()
    a = scene.add(Sphere(0.2), compliant(), at())
    b = scene.add(Sphere(0.2), compliant(), at(z=0.3))
    instance = GeometryInstance(at(z=0.1), Sphere(0.2), "second")
    second = scene.graph.register_geometry(scene.source, scene.frames[0], instance)
    scene.graph.assign_role(scene.source, second, compliant())
    scene.add(Box(1, 1, 1), compliant(), at(x=5.0), anchored=True)
    scene.add(Box(1, 1, 1), compliant(), at(x=5.5), anchored=True)
    pairs = [(s.id_M, s.id_N) for s in scene.query().compute_contact_surfaces()]
    assert pairs == [(a, b), (b, second)]
    declaration = CollisionFilterDeclaration().exclude_within(GeometrySet([a, b]))
    scene.graph.collision_filter_manager().apply(declaration)
    pairs = [(s.id_M, s.id_N) for s in scene.query().compute_contact_surfaces()]
    assert pairs == [(b, second)]


def test_margins_reach_beyond_the_shapes():
    """Bodies that are apart by less than their margins have a surface without force."""
    scene = Scene()
    scene.add(Sphere(0.2), compliant(margin=0.03), at(z=0.44))
    scene.add(Sphere(0.2), compliant(margin=0.03), at())
    (surface,) = scene.query().compute_contact_surfaces()
    assert (surface.pressure < 0.0).all()
    force, moment = surface.force_and_moment([1.0, 0.0, 0.0])
    assert not force.any()
    assert not moment.any()


def test_answers_are_kept_and_follow_the_poses():
    """Asking twice about one moment computes once; another pose has another answer."""
    scene = Scene()
    scene.add(Sphere(0.2), compliant(), at(z=0.18))
    scene.add(HalfSpace(), rigid(), at(), anchored=True)
    context = scene.graph.create_default_context()
    context.set_frame_poses(scene.source, scene.poses)
    query = scene.graph.query_object(context)
    before = query.compute_contact_surfaces()
    assert query.compute_contact_surfaces() is before
    frozen = query.bake()
    context.set_frame_poses(scene.source, {scene.frames[0]: at(z=0.15)})
    assert query.compute_contact_surfaces().total_area[0] > before.total_area[0]
    assert frozen.compute_contact_surfaces() is before


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels")
@pytest.mark.timeout(900)  # alone, on a machine that was not warmed up, it compiles first
def test_no_surface_compiles():
    """With the main kernels and those of surfaces, nothing that is asked compiles another."""
    run_tasks("main", "surfaces")
    before = called_kernels()
    scene = Scene()
    for k, shape in enumerate(SHAPES.values()):
        scene.add(shape, compliant(), at(x=0.3 * k, z=0.15))
        scene.add(shape, rigid(), at(x=0.3 * k, y=0.3, z=0.15))
    scene.add(HalfSpace(), soft_ground(), at(), anchored=True)
    for word in ("triangle", "polygon"):
        surfaces, points = scene.query().compute_contact_surfaces_with_fallback(word)
        assert len(surfaces) > 2 * len(SHAPES)
        assert len(points) > 0
        assert surfaces[1:].grad_pressure_M_W.any()
        assert surfaces.grad_pressure_N_W.any()
        assert pickle.loads(pickle.dumps(surfaces)).grad_pressure_M_W.any()
    assert called_kernels() == before


_WITHOUT = """
import sys
import numpy as np
from scene_graph_ros.geometry import *
graph = SceneGraph()
source = graph.register_source("s")
frame = graph.register_frame(source, GeometryFrame("f"))
for k, parent in enumerate((frame, graph.world_frame_id())):
    instance = GeometryInstance(np.eye(4), Sphere(1.0), f"ball {k}")
    ball = graph.register_geometry(source, parent, instance)
    graph.assign_role(source, ball, ProximityProperties())
query = graph.query_object(graph.create_default_context())
assert len(query.compute_point_pair_penetration()) == 1
assert len(query.compute_signed_distance_pairwise_closest_points()) == 1
query.find_collision_candidates()
loaded = [m for m in sys.modules if "hydroelastic" in m or "tessellate" in m or "clip" in m]
print([m for m in loaded if not m.endswith("model.hydroelastic_properties")])
"""


def test_nobody_asks_nothing_is_imported():
    """Other queries of a scene without compliance import nothing of contact surfaces."""
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT], capture_output=True, text=True, check=True, timeout=240
    )
    assert done.stdout.strip() == "[]"

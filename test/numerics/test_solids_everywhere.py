"""One meaning of a mesh of parts: a table of meshes, and of all that asks what they are.

Each mesh is boxes, so that what it means is known cell by cell (``boxes_in_one_mesh``).
"""

from boxes_in_one_mesh import Boxes
from camera_scenes import instance as seen_instance
from camera_scenes import scene_of, seen
from gantry import gantry
import numpy as np
from pressing_bodies import compliant, E, rigid, Scene
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.iris.scene_obstacles import make_iris_obstacles
from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties_for_half_space,
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    ProximityProperties,
    Sphere,
)
from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid, VPolytope
from scene_graph_ros.geometry.perception import CameraIntrinsics, ClippingRange
from scene_graph_ros.geometry.tolerances import PRESSURE_DIRECTION
from scene_graph_ros.planning import (
    EdgeStatus,
    iris_zo,
    IrisZoOptions,
)
from scene_graph_ros.views.triangles import surface_triangles

TURN = Rotation.from_rotvec((0.3, -0.5, 0.7)).as_matrix()
BASE, UPPER = ((-1, -1, 0), (1, 1, 1)), ((-0.5, -0.4, 1), (0.5, 0.4, 2.2))
CROSSING = ((-0.5, -0.4, 0.3), (0.5, 0.4, 2.2))
ROOM = [((-2, -2, -2), (2, 2, 2)), ((-1.5, -1.6, -1.4), (1.5, 1.6, 1.4))]
CORE = [((-0.8, -0.7, -0.9), (0.8, 0.7, 0.9)), ((-0.4, -0.5, -0.3), (0.4, 0.5, 0.3))]
BAR = ((-0.2, -0.3, -3), (0.3, 0.2, 3))
SHELF = ((1.2, -0.5, 0.4), (1.9, 0.5, 0.4))
CASES = {
    "overlapping": Boxes(BASE, CROSSING),
    "stacked": Boxes(BASE, UPPER),
    "flush": Boxes(((0, 0, 0), (1, 1, 1)), ((1, 0, 0), (2.5, 1, 1))),
    "nested": Boxes(BASE, ((-0.2, -0.3, 0.4), (0.3, 0.2, 0.8))),
    "cavity": Boxes(*ROOM, hollow=[1]),
    "solid in a cavity": Boxes(*ROOM, CORE[0], hollow=[1]),
    "four levels": Boxes(*ROOM, *CORE, hollow=[1, 3]),
    "bar through a cavity": Boxes(*ROOM, BAR, hollow=[1]),
    "an edge in common": Boxes(((0, 0, 0), (1, 1, 1)), ((1, 1, 0), (2, 2.5, 1))),
    "a corner in common": Boxes(((0, 0, 0), (1, 1, 1)), ((1, 1, 1), (2, 2.5, 1.5))),
    "a sheet beside": Boxes(BASE, CROSSING, sheets=[SHELF]),
    "turned": Boxes(*ROOM, BAR, hollow=[1], R=TURN),
    "turned and stacked": Boxes(BASE, UPPER, R=TURN, origin=(3, -2, 1)),
    "far": Boxes(BASE, CROSSING, origin=(2e4, -1e4, 3e4)),
    "far and turned": Boxes(*ROOM, *CORE, hollow=[1, 3], R=TURN, origin=(2e3, -1e3, 3e3)),
    "small": Boxes(*ROOM, *CORE, hollow=[1, 3], R=TURN, size=1e-2),
    "tiny": Boxes(*ROOM, *CORE, hollow=[1, 3], R=TURN, size=1e-5),
    "huge": Boxes(BASE, CROSSING, R=TURN, size=1e5),
}


def camera_axes(ahead):
    """Return a rotation whose third column is a unit vector."""
    right = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(ahead, right), ahead])


def triangles():
    """Return properties by which a mesh is its triangles."""
    properties = ProximityProperties()
    properties.add_property("mesh", "representation", "triangles")
    return properties


def random_points(case, count, seed=0):
    """Return points of B in and around a mesh, none on the surface."""
    rng = np.random.default_rng(seed)
    lower, upper = case.reach
    spread = 0.15 * (upper - lower)
    points = rng.uniform(lower - spread, upper + spread, (3 * count, 3))
    clear = np.abs(case.distances(points)) > 1e-3 * case.size
    return points[clear][:count]


def distances_of_points(case):
    """Signed, to the boundary of the union and the sheets, with its nearest point."""
    points = random_points(case, 300)
    scene = Scene()
    scene.add(case.mesh, ProximityProperties(), np.eye(4), anchored=True)
    found = scene.query().compute_signed_distance_to_points(case.placed(points))
    np.testing.assert_allclose(found.distance, case.distances(points), atol=case.error, rtol=0)


def distances_of_balls(case):
    """By triangles: the centre's distance less the radius, in and out, and its certificate."""
    points = random_points(case, 25)
    radius = 0.02 * case.size
    scene = Scene()
    solid = scene.add(case.mesh, triangles(), np.eye(4))
    balls = [scene.add(Sphere(radius), triangles(), case.pose(p)) for p in points]
    query = scene.query()
    for ball, expected in zip(balls, case.distances(points) - radius, strict=True):
        found = query.compute_signed_distance_pair_closest_points(solid, ball, certificate=True)
        assert found.distance == pytest.approx(expected, abs=case.error)
        assert found.gap <= case.error


def collisions_of_shapes(case):
    """By triangles: a shape smaller than its distance from the surface collides if inside."""
    r = 1e-3 * case.size / 2.0
    corners = r * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / np.sqrt(3.0)
    faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
    shapes = [
        Box(r, r, r),
        Capsule(r / 2, r),
        Convex(vertices=corners),
        Cylinder(r / 2, r),
        Ellipsoid(r, r / 2, r / 3),
        Mesh(vertices=corners, faces=faces),
    ]
    scene, expected = Scene(), set()
    solid = scene.add(case.mesh, triangles(), np.eye(4))
    points = random_points(case, 60)
    for k, (point, is_inside) in enumerate(zip(points, case.inside(points), strict=True)):
        one = scene.add(shapes[k % len(shapes)], triangles(), case.pose(point))
        expected |= {one} if is_inside else set()
    assert 0 < len(expected) < len(points)
    query = scene.query()
    assert query.has_collisions()
    found = query.compute_point_pair_penetration()
    pairs = {frozenset((row.id_A, row.id_B)) for row in found}
    assert {one for pair in pairs if solid in pair for one in pair - {solid}} == expected


def part_of(case):
    """Return corners of a box in B that cuts through a mesh."""
    lower, upper = case.reach
    return lower + (upper - lower) * 0.27, lower + (upper - lower) * 0.93


def pressure_in_a_soft_box(case):
    """Its contact surface and force are those of the solid's surface, of no hidden face."""
    lower, upper = part_of(case)
    size, middle = case.size * (upper - lower), case.pose(0.5 * (lower + upper))
    found = []
    for mesh in (case.mesh, case.surface_mesh):
        scene = Scene()
        scene.add(mesh, rigid(), np.eye(4))
        scene.add(Box(*size), compliant(resolution=size.max()), middle)
        surfaces = scene.query().compute_contact_surfaces()
        found.append(sum((resultant(surface) for surface in surfaces), np.zeros(4)))
    assert (found[0][0] > 0.0) == (case.area(lower, upper) > 0.0)
    np.testing.assert_allclose(found[0], found[1], atol=1e-8 * np.abs(found[1]).max())


def resultant(surface):
    """Return the area, as a force under the modulus, and the force."""
    forces = (surface.face_areas * surface.face_pressures)[:, None] * surface.face_normals_W
    return np.array([E * surface.face_areas.sum(), *forces.sum(axis=0)])


def pressure_in_a_soft_floor(case, tilt=0.4):
    """Sunk as a whole, each face that looks into the floor is pressed by its depth, no other."""
    scene = Scene()
    scene.add(case.mesh, rigid(), np.eye(4))
    properties, thickness = ProximityProperties(), 10.0 * case.size
    add_compliant_hydroelastic_properties_for_half_space(properties, thickness, E)
    up_B = Rotation.from_rotvec((tilt, 0.5 * tilt, 0.0)).as_matrix()
    X_MF = case.pose(case.reach.mean(axis=0))
    X_MF[:3, :3] = case.R @ up_B
    X_MF[:3, 3] += 5.0 * case.size * X_MF[:3, 2]
    scene.add(HalfSpace(), properties, X_MF)
    (surface,) = scene.query().compute_contact_surfaces()
    walls, outward = case.walls, case.outward
    lengths = walls[:, 1] - walls[:, 0]
    lengths[lengths == 0.0] = 1.0
    areas, middles = case.size**2 * lengths.prod(axis=1), walls.mean(axis=1)
    depths = 5.0 - (middles - case.reach.mean(axis=0)) @ up_B[:, 2]
    looks_down = -outward @ up_B[:, 2] > PRESSURE_DIRECTION
    forces = (areas * depths / 10.0 * E)[:, None] * outward @ case.R.T
    found = resultant(surface)
    if not len(case.sheets):
        assert found[0] / E == pytest.approx(areas[looks_down].sum(), rel=1e-8)
        expected = forces[looks_down].sum(axis=0)
        np.testing.assert_allclose(
            np.sign(found[1:] @ expected) * found[1:], expected, atol=1e-8 * np.abs(expected).max()
        )


def deformables(case):
    """A soft box in its first form meets the solid's surface, with its directions outwards."""
    lower, upper = part_of(case)
    scene = Scene()
    solid = scene.add(case.mesh, triangles(), np.eye(4), anchored=True)
    size = case.size * (upper - lower)
    scene.add_deformable(Box(*size), case.pose(0.5 * (lower + upper)), size.max() / 3.0)
    surfaces = list(scene.query().compute_deformable_contact())
    assert sum(s.total_area for s in surfaces) == pytest.approx(case.area(lower, upper), rel=1e-8)
    for surface in surfaces:
        assert surface.id_B == solid
        outwards = surface.nhats_BA_W * 1e-6 * case.size
        for side, wanted in ((outwards, False), (-outwards, True)):
            points = (surface.contact_points_W + side) / case.size - case.origin
            assert (case.inside(points @ case.R) == wanted).all()


def proofs(case, folder):
    """An edge through the solid is not proven free, one that keeps away from it is."""
    radius = 0.05 * case.size
    checker = gantry(case, folder, radius)
    ends = random_points(case, 40, seed=2).reshape(-1, 2, 3)
    counts = dict.fromkeys(EdgeStatus, 0)
    t = np.linspace(0.0, 1.0, 1001)[:, None]
    for p1, p2 in ends:
        clear = (case.distances(p1 + t * (p2 - p1)) - radius).min()
        status = checker.measure_edge(*case.placed([p1, p2])).status
        counts[status] += 1
        near = max(1e-2 * case.size, 5e-6)
        assert status is not EdgeStatus.FREE or clear > 0.0, (p1, p2)
        assert status is EdgeStatus.FREE or clear < near, (p1, p2)
        assert status is EdgeStatus.COLLIDES or clear > -near, (p1, p2)
    assert min(counts[EdgeStatus.FREE], counts[EdgeStatus.COLLIDES]) > 0


def regions(case, folder):
    """A region of free configurations around a free seed has hardly a point of the solid."""
    radius = 0.05 * case.size
    checker = gantry(case, folder, radius)
    seeds = random_points(case, 400, seed=2)
    seeds = seeds[case.distances(seeds) > 2.0 * radius]
    seed = seeds[np.linalg.norm(seeds - case.reach.mean(axis=0), axis=1).argmin()]
    corners = case.placed(seeds)
    domain = HPolyhedron.make_box(corners.min(axis=0), corners.max(axis=0))
    options = IrisZoOptions(num_particles=300, epsilon=0.02, max_iterations=1)
    start = Hyperellipsoid.make_hypersphere(1e-3 * case.size, case.placed([seed])[0])
    region = iris_zo(checker, start, domain, options)
    points = random_points(case, 8000, seed=3)
    within = points[region.point_in_set(case.placed(points), 0.0)]
    assert len(within) > 20
    assert (case.distances(within) < radius).mean() <= 0.05


def obstacles_and_sets(case):
    """The obstacle is the hull; a set of the mesh itself is refused unless it is its hull."""
    scene = Scene()
    solid = scene.add(case.mesh, triangles(), np.eye(4))
    query = scene.query()
    (obstacle,) = make_iris_obstacles(query)
    hull = ConvexHull(case.corners)
    assert volume_of(obstacle, case) == pytest.approx(hull.volume, rel=1e-8)
    if hull.volume == pytest.approx(case.volume / case.size**3, rel=1e-9):
        assert volume_of(VPolytope(query, solid), case) == pytest.approx(hull.volume, rel=1e-8)
    else:
        with pytest.raises(ConvexSetError, match="must be a Box, a Convex or a convex Mesh"):
            VPolytope(query, solid)


def volume_of(polytope, case):
    """Return a polytope's volume in B."""
    return ConvexHull(polytope.vertices / case.size - case.origin).volume


def report_and_refusal(case):
    """Closed parts and cavities are counted as built; a sheet is no solid."""
    scene = Scene()
    solid = scene.add(case.mesh, triangles(), np.eye(4))
    report = scene.graph.model_inspector().get_mesh_report(solid)
    counts = report.parts, report.cavities, report.sheets
    assert counts == (len(case.boxes), len(case.hollow), len(case.sheets))
    assert report.is_closed == (not len(case.sheets))
    required = triangles()
    required.add_property("mesh", "solid", "required")
    if len(case.sheets):
        with pytest.raises(MeshError, match="edges are open"):
            Scene().add(case.mesh, required, np.eye(4))
    else:
        Scene().add(case.mesh, required, np.eye(4))


def cameras(case):
    """They see the triangles of the file, hidden ones too, from wherever they are."""
    rng = np.random.default_rng(5)
    query = scene_of([seen_instance(case.mesh, np.eye(4), "mesh")])
    one_pixel = CameraIntrinsics(1, 1, 1.0, 1.0, 0.0, 0.0)
    for eye in random_points(case, 6, seed=4):
        lower, upper = case.faces_of_file[rng.integers(len(case.faces_of_file))]
        ahead = lower + rng.uniform(0.1, 0.9, 3) * (upper - lower) - eye
        ahead /= np.linalg.norm(ahead)
        X_MC = case.pose(eye)
        X_MC[:3, :3] = case.R @ camera_axes(ahead)
        clipping = ClippingRange(1e-4 * case.size, 1e2 * case.size)
        depth = seen(query, X_MC, one_pixel, clipping)[0][0, 0]
        assert depth == pytest.approx(case.first_hit(eye, ahead), rel=1e-9, abs=10.0 * case.error)


def drawings(case):
    """Markers, page and recordings draw the file's triangles, as many and where they are."""
    drawn = surface_triangles(case.mesh)
    np.testing.assert_array_equal(drawn.vertices, case.mesh.vertices)
    np.testing.assert_array_equal(drawn.triangles, case.mesh.faces)


EVERYBODY = {
    distances_of_points: CASES,
    distances_of_balls: CASES,
    collisions_of_shapes: CASES,
    pressure_in_a_soft_box: CASES,
    pressure_in_a_soft_floor: CASES,
    deformables: CASES,
    proofs: [name for name in CASES if name != "tiny"],  # an edge keeps a micrometre
    regions: ["stacked", "cavity", "bar through a cavity", "a sheet beside", "turned", "huge"],
    obstacles_and_sets: CASES,
    report_and_refusal: CASES,
    cameras: CASES,
    drawings: CASES,
}
"""Consumers, and the meshes that each of them is asked about."""


@pytest.mark.parametrize(
    ("consumer", "name"),
    [(consumer, name) for consumer, names in EVERYBODY.items() for name in names],
    ids=lambda one: getattr(one, "__name__", one),
)
def test_everybody_takes_a_mesh_for_the_same_solid(consumer, name, tmp_path):
    """As the function of each consumer says."""
    consumer(CASES[name], *((tmp_path,) if consumer in (proofs, regions) else ()))


def test_a_body_that_is_filled_is_the_same_solid():
    """Deformable (or compliant): the tetrahedra have its volume, and none is in a hollow."""
    case = Boxes(*ROOM, BAR, hollow=[1], R=TURN, origin=(3, -2, 1))
    scene = Scene()
    soft = scene.add_deformable(case.mesh, np.eye(4))
    mesh = scene.graph.model_inspector().get_reference_mesh(soft)
    assert mesh.volumes().sum() == pytest.approx(case.volume, rel=1e-2)
    middles = mesh.vertices[mesh.tetrahedra].mean(axis=1) - case.origin
    # The library may move the surface by a thousandth of the diagonal.
    assert (case.distances(middles @ case.R) < 1e-3 * np.sqrt(4**2 + 4**2 + 6**2)).all()


def test_a_deformable_takes_a_mesh_as_its_properties_say():
    """A gap within the tolerance that they name is closed, and a solid is required."""
    box = Boxes(BASE).mesh
    corners, faces = box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    corners[0] += 1e-4
    gap = Mesh(vertices=corners, faces=faces)
    for add in (Scene.add, Scene.add_deformable):
        with pytest.raises(MeshError, match="edges are open, one at"):
            add(Scene(), gap, *arguments(add, solid="required"))
        scene = Scene()
        one = add(scene, gap, *arguments(add, solid="required", repair_tolerance=1e-3))
        if add is Scene.add_deformable:
            volumes = scene.graph.model_inspector().get_reference_mesh(one).volumes()
            assert volumes.sum() == pytest.approx(4.0, rel=1e-3)
        with pytest.raises(PropertyError, match="repair_tolerance"):
            add(Scene(), gap, *arguments(add, repair_tolerance=0.5))


def arguments(add, **said):
    """Return the properties that say something of a mesh, and a pose, in the order of a method."""
    properties = ProximityProperties()
    for key, value in said.items():
        properties.add_property("mesh", key, value)
    both = (properties, np.eye(4))
    return both if add is Scene.add else (np.eye(4), None, properties)

"""Digests of what kernels alone answer: the same on every processor.

Run it as ``python test/numerics/same_bits.py [part ...]``; each line is a part and a digest. The
inputs come from uniform numbers, sums, products and roots alone, which are rounded alike
everywhere. `tools/same_everywhere.py` compares the lines of several baselines, of BLAS's and
NumPy's kernels, and of the C library with and without newer instructions.
"""

import hashlib
from pathlib import Path
import sys
import tempfile

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

from scene_graph_ros.geometry import (  # noqa: E402
    add_compliant_hydroelastic_properties,
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.meshes.sources import report_of, surface_of  # noqa: E402
from scene_graph_ros.geometry.optimization import HPolyhedron, VPolytope  # noqa: E402
from scene_graph_ros.geometry.perception import (  # noqa: E402
    CameraIntrinsics,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)
from scene_graph_ros.geometry.perception.exact.parametrization import (  # noqa: E402
    picture_coordinates,
)
from scene_graph_ros.geometry.shapes.kinds import ShapeKind  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    load_robot_diagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots.tree_kernels import FLOATING, REVOLUTE  # noqa: E402

_COUNT = 64
_CORNERS = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.3]])
_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])

# A drone with a gripper on a rail: a floating joint, a revolute, a continuous and a prismatic one.
_ROBOT = """<robot name="drone"><link name="world"/>
  <link name="body"><collision><origin rpy="0.1 0.2 0.3"/><geometry><box size="0.4 0.1 0.05"/>
  </geometry></collision></link>
  <link name="arm"><collision><origin xyz="0.2 0 0"/><geometry><box size="0.3 0.04 0.06"/>
  </geometry></collision></link>
  <link name="wheel"><collision><geometry><cylinder radius="0.1" length="0.03"/></geometry>
  </collision></link>
  <link name="tip"><collision><geometry><sphere radius="0.03"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="body"/><child link="arm"/>
  <origin xyz="0.2 0 0.06" rpy="0.3 -0.2 0.7"/><axis xyz="1 2 3"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="spin" type="continuous"><parent link="arm"/><child link="wheel"/>
  <origin xyz="0.45 0 0" rpy="1.2 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="rail" type="prismatic"><parent link="wheel"/><child link="tip"/>
  <origin xyz="0 0 0.1"/><axis xyz="1 0 2"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="free" type="floating"><parent link="world"/><child link="body"/></joint></robot>"""
_CELL = """
version: 1
sources: [{name: around}]
robots: [{name: drone, urdf: robot.urdf}]
geometries:
  - {name: floor, source: around, pose: {xyz: [0, 0, -0.9]}, shape: {type: half_space}}
  - {name: ball, source: around, pose: {xyz: [1, 0.4, 0]}, shape: {type: sphere, radius: 0.2}}
  - {name: box, source: around, pose: {xyz: [-1, 0.3, 0.2], rpy: [0.1, 0.7, -0.4]},
     shape: {type: box, size: [0.3, 0.4, 0.5]}}
  - {name: rod, source: around, pose: {xyz: [0.3, -1, 0.2], rpy: [1.5, 0.1, 0]},
     shape: {type: cylinder, radius: 0.01, length: 2}}
"""


def _hull(generator):
    return Convex(vertices=generator.uniform(-0.15, 0.15, (12, 3)))


_SHAPES = (
    lambda generator: Sphere(generator.uniform(0.05, 0.15)),
    lambda generator: Capsule(*generator.uniform(0.05, 0.15, 2)),
    lambda generator: Box(*generator.uniform(0.1, 0.3, 3)),
    lambda generator: Cylinder(*generator.uniform(0.05, 0.2, 2)),
    lambda generator: Ellipsoid(*generator.uniform(0.05, 0.2, 3)),
    _hull,
    lambda generator: Mesh(vertices=_CORNERS, faces=_FACES),
)


def _poses(generator, count, width):
    """Return poses (n, 4, 4) from uniform numbers."""
    x, y, z, w = (generator.uniform(-1.0, 1.0, (4, count))).copy()
    s = 2.0 / (x * x + y * y + z * z + w * w)
    X = np.zeros((count, 4, 4))
    X[:, 0, 0], X[:, 1, 1] = 1.0 - s * (y * y + z * z), 1.0 - s * (x * x + z * z)
    X[:, 2, 2], X[:, 3, 3] = 1.0 - s * (x * x + y * y), 1.0
    X[:, 0, 1], X[:, 1, 0] = s * (x * y - z * w), s * (x * y + z * w)
    X[:, 0, 2], X[:, 2, 0] = s * (x * z + y * w), s * (x * z - y * w)
    X[:, 1, 2], X[:, 2, 1] = s * (y * z - x * w), s * (y * z + x * w)
    X[:, :3, 3] = generator.uniform(-width, width, (count, 3))
    return X


def _scene(seed, *, is_soft=False):
    """Return queries of a scene with all shapes."""
    generator = np.random.default_rng(seed)
    scene_graph = SceneGraph()
    source = scene_graph.register_source("bits")
    properties = ProximityProperties()
    if is_soft:
        add_compliant_hydroelastic_properties(properties, 0.05, 1e6)
    frames = []
    for k in range(_COUNT):
        shape = _SHAPES[k % (len(_SHAPES) - is_soft)](generator)
        frames.append(scene_graph.register_frame(source, GeometryFrame(f"frame_{k}")))
        instance = GeometryInstance(np.eye(4), shape, f"body_{k}")
        instance.set_proximity_properties(properties)
        scene_graph.register_geometry(source, frames[-1], instance)
    floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
    floor.set_proximity_properties(ProximityProperties())
    if not is_soft:
        scene_graph.register_anchored_geometry(source, floor)
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, _poses(generator, _COUNT, 0.4))
    return scene_graph.query_object(context), generator


def _tables(*tables):
    """Return the numbers of tables of results; ids are counted from the first."""
    for table in tables:
        for name in sorted(table.columns):
            column = table.columns[name]
            is_id = name.startswith("id") and len(column)
            yield name, np.unique(column, return_inverse=True)[1] if is_id else column


def pairs():
    """Candidates, penetrations, distances and their proofs."""
    for seed in range(3):
        query, _ = _scene(seed)
        yield "colliding", np.array([query.has_collisions()])
        yield from _tables(
            query.find_collision_candidates(),
            query.compute_point_pair_penetration(certificate=True),
            query.compute_signed_distance_pairwise_closest_points(0.2, certificate=True),
        )


def derivatives():
    """How distances and witnesses move with the poses."""
    query, _ = _scene(0)
    yield from _tables(
        query.compute_signed_distance_pairwise_closest_points(0.2, derivatives=True),
        query.compute_point_pair_penetration(derivatives=True),
    )


def points():
    """Distances of points."""
    query, generator = _scene(1)
    for count in (1, 200):
        where = generator.uniform(-0.5, 0.5, (count, 3))
        yield from _tables(query.compute_signed_distance_to_points(where, 0.3))


def meshes():
    """What is made of meshes as they come: two bodies in one, a sheet through them, no inside."""
    generator = np.random.default_rng(5)
    for _ in range(3):
        turned = _CORNERS[:, [1, 2, 0]] + generator.uniform(0.01, 0.05, 3)
        sheet = generator.uniform(-0.1, 0.2, (3, 3))
        vertices = np.concatenate([_CORNERS, turned, sheet])
        faces = np.concatenate([_FACES, _FACES + 4, [[8, 9, 10]]])
        shape = Mesh(vertices=vertices, faces=faces)
        solid = surface_of(shape)
        yield "vertices", solid.vertices
        yield "triangles", solid.triangles
        report = report_of(shape)
        yield "report", np.array([str(report)], dtype="S")


def surfaces():
    """Contact surfaces of soft bodies, as triangles and as polygons."""
    query, _ = _scene(2, is_soft=True)
    for representation in ("triangle", "polygon"):
        found = query.compute_contact_surfaces(representation)
        yield "start", found.face_start
        yield "corners", found.corners
        for name in (
            "vertices_W",
            "pressure",
            "face_normals_W",
            "face_areas",
            "face_centroids_W",
            "face_pressures",
            "grad_pressure_M_W",
            "grad_pressure_N_W",
        ):
            yield name, getattr(found, name)
        yield from _tables(found)
        for surface in found:
            yield "force and moment", np.concatenate(surface.force_and_moment([0.1, 0.2, 0.3]))


def deformables():
    """Contact of bodies that deform with each other, with rigid ones and with a floor."""
    generator = np.random.default_rng(6)
    scene_graph = SceneGraph()
    source, world = scene_graph.register_source("bits"), scene_graph.world_frame_id()
    poses = _poses(generator, len(_SHAPES) + 3, 0.15)
    soft = []
    for shape in (Box(0.2, 0.25, 0.3), Sphere(0.15), Cylinder(0.1, 0.2)):
        instance = GeometryInstance(poses[len(soft)], shape, f"soft_{len(soft)}")
        instance.set_proximity_properties(ProximityProperties())
        soft.append(scene_graph.register_deformable_geometry(source, world, instance, 0.08))
    shapes = [shape(generator) for shape in _SHAPES[:-1]]
    for X_WG, shape in zip(poses[3:], [*shapes, HalfSpace()], strict=True):
        rigid = GeometryInstance(X_WG, shape, shape.type_name)
        rigid.set_proximity_properties(ProximityProperties())
        scene_graph.register_anchored_geometry(source, rigid)
    context = scene_graph.create_default_context()
    query = scene_graph.query_object(context)
    at = {each: query.get_configurations_in_world(each) for each in soft}
    moved = {each: q + generator.uniform(-0.004, 0.004, q.shape) for each, q in at.items()}
    context.set_configurations(source, moved)
    for surface in query.compute_deformable_contact():
        for name in vars(surface):
            if not name.startswith(("id_", "_")) and getattr(surface, name) is not None:
                yield name, getattr(surface, name)
        yield "frames", surface.R_WCs


def cameras():
    """Colours, depths and labels, of bodies without pictures and of glass."""
    generator = np.random.default_rng(7)
    scene_graph = SceneGraph()
    scene_graph.add_renderer("exact", ExactRenderEngine())
    source = scene_graph.register_source("bits")
    poses = _poses(generator, 28, 0.5)
    poses[:, 2, 3] += 1.5
    for k, X_WG in enumerate(poses):
        instance = GeometryInstance(X_WG, _SHAPES[k % len(_SHAPES)](generator), f"body_{k}")
        seen = PerceptionProperties()
        color = Rgba(*generator.uniform(0.0, 1.0, 3), 0.5 if k % 5 == 0 else 1.0)
        seen.add_property("phong", "diffuse", color)
        seen.add_property("label", "id", k)
        instance.set_perception_properties(seen)
        scene_graph.register_anchored_geometry(source, instance)
    query = scene_graph.query_object(scene_graph.create_default_context())
    lens = CameraIntrinsics.from_fov_y(160, 120, 1.0)
    core = RenderCameraCore("exact", lens, ClippingRange(0.01, 10.0))
    camera = DepthRenderCamera(core, DepthRange(0.01, 10.0))
    images = query.render_images(camera, scene_graph.world_frame_id(), np.eye(4))
    yield from zip(("color", "depth", "label"), images, strict=True)
    yield "pixels", picture_places(generator)


def picture_places(generator):
    """Where points of shapes with a closed form are on a picture that covers them."""
    kinds = (ShapeKind.SPHERE, ShapeKind.ELLIPSOID, ShapeKind.CAPSULE, ShapeKind.CYLINDER)
    where, size = generator.uniform(-0.2, 0.2, (50, 3)).tolist(), (0.2, 0.15, 0.1)
    return np.array([picture_coordinates(int(k), size, tuple(p)) for k in kinds for p in where])


def sets():
    """Which polytopes meet, are empty, bounded or in each other, and what proves it."""
    generator = np.random.default_rng(3)
    boxes = [HPolyhedron.make_box(low, low + 0.5) for low in generator.uniform(-1, 1, (8, 3))]
    hulls = [VPolytope(generator.uniform(-1.0, 1.0, (6, 3))) for _ in range(8)]
    rows = [
        HPolyhedron(generator.uniform(-1, 1, (9, 3)), generator.uniform(-0.2, 1, 9))
        for _ in range(8)
    ]
    for box in (*boxes, *rows):
        for hull in hulls:
            yield from _decided("meets", hull.intersects_with(box, certificate=True))
    for each in rows:
        yield from _decided("empty", each.is_empty(certificate=True))
        yield from _decided("bounded", each.is_bounded(certificate=True))
        for other in boxes:
            yield from _decided("inside", other.contained_in(each, certificate=True))
    for each in hulls:
        way = generator.uniform(-1.0, 1.0, 3)
        yield "support", np.array([each.support(way).value, *each.support(way).point])


def _decided(name, decision):
    yield name, np.array([decision.value])
    yield decision.certificate.kind, np.asarray(decision.certificate.vector)


def edges():
    """Clearances of a robot, which edges are free, how far, and what proves it."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "robot.urdf").write_text(_ROBOT)
        Path(folder, "scene.yaml").write_text(_CELL)
        robots = load_robot_diagram(str(Path(folder, "scene.yaml")))
    checker = SceneGraphCollisionChecker(robots)
    generator = np.random.default_rng(4)
    q = generator.uniform(-1.0, 1.0, (80, robots.tree.num_positions))
    kinds = robots.tree.table.kinds[1:]
    turned, floating = (1 + np.flatnonzero(kinds == kind)[0] for kind in (REVOLUTE, FLOATING))
    q[::4, robots.tree.table.starts[turned]] += 1e6
    yield "free", checker.check_configs_collision_free(q)
    for each in q[:10]:
        near = checker.calc_robot_clearance(each, 0.5)
        yield "distances", near.distances
        yield "jacobians", near.jacobians
    for width in (2, 4):
        ends = q[: 80 // width * width].reshape(-1, width, q.shape[1])
        if width == 4:
            start = robots.tree.table.starts[floating]
            ends[..., start : start + 4] = ends[:, :1, start : start + 4]
        yield "statuses", checker.edge_statuses(ends)
        for measure in checker.measure_edges(ends):
            yield "alpha", np.array([measure.alpha, measure.distance])


def poses():
    """Configurations of an arm on a rail that reach poses, or come near, and how near."""
    from scene_graph_ros.planning import inverse_kinematics_of_poses
    from scene_graph_ros.robots.kinematic_tree import KinematicTree
    from scene_graph_ros.robots.tree_joint import TreeJoint
    from scene_graph_ros.robots.tree_kernels import PRISMATIC, REVOLUTE

    generator = np.random.default_rng(4)
    frames = _poses(generator, 7, 0.3)
    joints = tuple(
        TreeJoint(f"j{k}", REVOLUTE if k else PRISMATIC, k, frames[k], lower=-2.0, upper=2.0)
        for k in range(7)
    )
    tree = KinematicTree("arm", joints, ("tool",), (7,), np.eye(4)[np.newaxis])
    q = generator.uniform(-2.0, 2.0, (_COUNT, 7))
    X_WTs = tree.link_poses(q, ["tool"])[:, 0]
    X_WTs[-4:, :3, 3] += 9.0
    for near in (None, np.full(7, 0.1)):
        found = inverse_kinematics_of_poses(tree, "tool", X_WTs, near=near)
        yield "configurations", found.configurations
        yield "errors", np.stack([found.position_errors, found.rotation_errors])


PARTS = (
    pairs,
    derivatives,
    points,
    meshes,
    surfaces,
    deformables,
    cameras,
    sets,
    edges,
    poses,
)


def digest(part):
    """Hash all numbers of a part, bit by bit; also how many there are, so that none is empty."""
    result, count = hashlib.blake2b(digest_size=12), 0
    for name, numbers in part():
        array = np.ascontiguousarray(numbers)
        if array.dtype == object:
            array = np.array([str(each) for each in array.ravel()], dtype="S")
        count += array.size
        result.update(f"{name} {array.dtype} {array.shape}".encode())
        result.update(array.tobytes())
    return f"{result.hexdigest()} {count} numbers"


def main(names):
    """Print the digest of each part, or of those that are named."""
    for part in PARTS:
        if not names or part.__name__ in names:
            print(f"{part.__name__:12} {digest(part)}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

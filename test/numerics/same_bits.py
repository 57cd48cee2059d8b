"""Digests of what kernels alone answer: the same on every processor.

Run it as ``python test/numerics/same_bits.py [part ...]``; each line is a part and a digest. The
inputs come from uniform numbers, sums, products and roots alone, which are rounded alike
everywhere. `tools/same_everywhere.py` compares the lines of several baselines. Derivatives of
witnesses are left out: they solve small systems with LAPACK, whose last bits depend on the
processor (test/numerics/test_derivatives.py holds them to their error).
"""

import hashlib
from pathlib import Path
import sys

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
    ProximityProperties,
    SceneGraph,
    Sphere,
)

_COUNT = 64
_CORNERS = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.3]])
_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


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


def points():
    """Distances of points."""
    query, generator = _scene(1)
    for count in (1, 200):
        where = generator.uniform(-0.5, 0.5, (count, 3))
        yield from _tables(query.compute_signed_distance_to_points(where, 0.3))


def surfaces():
    """Contact surfaces of soft bodies."""
    query, _ = _scene(2, is_soft=True)
    found = query.compute_contact_surfaces()
    yield "start", found.face_start
    yield "vertices", found.vertices_W
    yield "faces", np.concatenate([surface.faces for surface in found])
    yield "pressure", np.concatenate([surface.pressure for surface in found])


def sets():
    """Which polytopes meet, and the points or planes that prove it."""
    from scene_graph_ros.geometry.optimization import HPolyhedron, VPolytope

    generator = np.random.default_rng(3)
    boxes = [HPolyhedron.make_box(low, low + 0.5) for low in generator.uniform(-1, 1, (8, 3))]
    hulls = [VPolytope(generator.uniform(-1.0, 1.0, (6, 3))) for _ in range(8)]
    for box in boxes:
        for hull in hulls:
            answer = hull.intersects_with(box, certificate=True)
            yield "meets", np.array([answer.value])
            yield answer.certificate.kind, np.asarray(answer.certificate.vector)


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


PARTS = (pairs, points, surfaces, sets, poses)


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

"""Bodies with pressure fields made by hand, and tables of them, for tests of the contact kernels.

A body is (kind, vertices, elements, pressures, margin); pressures are those at the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass, field
import itertools

import numpy as np

from scene_graph_ros.geometry.hydroelastic.body_table import BodyKind, BodyTable
from scene_graph_ros.geometry.hydroelastic.driver import solve_surfaces
from scene_graph_ros.geometry.hydroelastic.element_table import build_element_table
from scene_graph_ros.geometry.meshes.bvh import build_bvh


@dataclass
class Body:
    """One body; ``slope`` is the pressure per metre of depth of a compliant half space."""

    kind: BodyKind
    vertices: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    elements: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.int64))
    pressure: np.ndarray = field(default_factory=lambda: np.zeros(0))
    slope: float = 0.0
    margin: float = 0.0


def rigid_half_space():
    """The half space z <= 0, rigid."""
    return Body(BodyKind.RIGID_HALF_SPACE)


def compliant_half_space(modulus, slab_thickness, margin=0.0):
    """The half space z <= 0 with the pressure modulus at the depth of the slab."""
    return Body(BodyKind.COMPLIANT_HALF_SPACE, slope=modulus / slab_thickness, margin=margin)


def rigid(vertices, triangles):
    """A rigid surface."""
    triangles = np.asarray(triangles, np.int64)
    elements = np.column_stack([triangles, np.full(len(triangles), -1)])
    return Body(BodyKind.RIGID_SURFACE, np.asarray(vertices, float), elements)


def volume(vertices, tetrahedra, pressure, margin=0.0):
    """A compliant volume; its tetrahedra are turned to be positive."""
    vertices = np.asarray(vertices, float)
    tetrahedra = np.array(tetrahedra, np.int64)
    a, b, c, d = (vertices[tetrahedra[:, k]] for k in range(4))
    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    tetrahedra[negative] = tetrahedra[negative][:, [0, 2, 1, 3]]
    pressure = np.asarray(pressure, float)
    return Body(BodyKind.COMPLIANT_VOLUME, vertices, tetrahedra, pressure, margin=margin)


BOX_CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
BOX_TRIANGLES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5],
        [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
        [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def rigid_box(half):
    """A rigid box with half extents ``half``."""
    return rigid(BOX_CORNERS * half, BOX_TRIANGLES)


def star(vertices, triangles, modulus, margin=0.0):
    """A body of one tetrahedron from the origin to each triangle: 0 outside, modulus inside."""
    vertices = np.vstack([vertices, np.zeros(3)])
    centre = np.full((len(triangles), 1), len(vertices) - 1)
    pressure = np.zeros(len(vertices))
    pressure[-1] = modulus
    return volume(vertices, np.hstack([triangles, centre]), pressure, margin)


def compliant_box(half, modulus):
    """A compliant box whose pressure grows linearly from its faces to its centre."""
    return star(BOX_CORNERS * half, BOX_TRIANGLES, modulus)


def slab(half, modulus, cells=1):
    """A compliant box whose pressure is modulus times the relative depth below its top face.

    Each of ``cells`` x ``cells`` columns is one cube cut into six tetrahedra about its diagonal,
    so that p = modulus (h - z) / (2 h) everywhere.
    """
    steps = np.linspace(-1.0, 1.0, cells + 1)
    grid = np.array([(x, y, z) for x in steps for y in steps for z in (-1.0, 1.0)]) * half

    def index(i, j, k):
        return (i * (cells + 1) + j) * 2 + k

    tetrahedra = []
    for i, j in itertools.product(range(cells), repeat=2):
        for axes in itertools.permutations(range(3)):
            corner = np.array([i, j, 0])
            path = [index(*corner)]
            for axis in axes:
                corner[axis] += 1
                path.append(index(*corner))
            tetrahedra.append(path)
    pressure = modulus * (half[2] - grid[:, 2]) / (2.0 * half[2])
    return volume(grid, tetrahedra, pressure)


def sphere_triangles(level):
    """An octahedron whose faces were divided ``level`` times, projected to the unit sphere."""
    vertices = np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float
    )
    triangles = np.array(
        [
            [0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4],
            [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5],
        ]
    )  # fmt: skip
    for _ in range(level):
        corners = vertices[triangles]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        a, b, c = (corners[:, k] for k in range(3))
        p, q, r = (middles[:, k] for k in range(3))
        parts = np.concatenate(
            [np.stack(t, axis=1) for t in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))]
        )
        vertices, triangles = np.unique(
            parts.reshape(-1, 3).round(14), axis=0, return_inverse=True
        )
        triangles = triangles.reshape(-1, 3)
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, triangles


def compliant_sphere(radius, modulus, level):
    """A ball of tetrahedra about its centre, the pressure linear along its radii."""
    vertices, triangles = sphere_triangles(level)
    return star(vertices * radius, triangles, modulus)


def rigid_sphere(radius, level):
    """A rigid sphere."""
    vertices, triangles = sphere_triangles(level)
    return rigid(vertices * radius, triangles)


def table_of(bodies):
    """Return the BodyTable of bodies, one row each."""
    rows = range(len(bodies))
    starts = np.cumsum([0] + [len(b.vertices) for b in bodies])
    columns = {"elements": [], "gradient": [], "constant": [], "normals": []}
    counts, trees = [], []
    for i, body in enumerate(bodies):
        elements, fields, normals = _elements(body)
        columns["elements"].append(np.where(elements < 0, -1, elements + starts[i]))
        columns["gradient"].append(fields[:, :3])
        columns["constant"].append(fields[:, 3])
        columns["normals"].append(normals)
        counts.append(len(elements))
        if len(body.vertices):
            used = body.vertices[elements[:, : 3 if body.kind == BodyKind.RIGID_SURFACE else 4]]
            trees.append(build_bvh(used.min(axis=1), used.max(axis=1)))
        else:
            none = np.zeros(0, np.int64)
            trees.append((np.zeros((0, 3)), np.zeros((0, 3)), none, none, none[: len(elements)]))
    nodes = [np.concatenate([tree[k] for tree in trees]) for k in range(4)]
    orders = [
        tree[4] if len(tree[4]) else np.zeros(n, np.int64)
        for tree, n in zip(trees, counts, strict=True)
    ]
    return BodyTable(
        kind=np.array([b.kind for b in bodies], np.int32),
        body=np.array(rows, np.int64),
        margin=np.array([b.margin for b in bodies]),
        element_start=np.cumsum([0, *counts]),
        elements=np.concatenate(columns["elements"]),
        vertex_start=starts,
        vertices=np.concatenate([b.vertices for b in bodies]),
        pressure=np.concatenate(
            [b.pressure if len(b.pressure) else np.zeros(len(b.vertices)) for b in bodies]
        ),
        gradient_G=np.concatenate(columns["gradient"]),
        constant=np.concatenate(columns["constant"]),
        normals=np.concatenate(columns["normals"]),
        node_start=np.cumsum([0] + [len(tree[2]) for tree in trees]),
        node_lower=nodes[0],
        node_upper=nodes[1],
        node_left=nodes[2],
        node_right=nodes[3],
        order=np.concatenate(orders),
    )


def _pressure(body):
    return body.pressure if len(body.pressure) else np.zeros(len(body.vertices))


def _elements(body):
    """Return elements, fields (n, 4) and normals (n, 3) of a body."""
    if body.kind == BodyKind.COMPLIANT_HALF_SPACE:
        return np.full((1, 4), -1), np.array([[0.0, 0.0, -body.slope, 0.0]]), np.zeros((1, 3))
    n = len(body.elements)
    if body.kind == BodyKind.COMPLIANT_VOLUME:
        corners = np.concatenate([body.vertices[body.elements], np.ones((n, 4, 1))], axis=2)
        fields = np.linalg.solve(corners, body.pressure[body.elements][:, :, None])[:, :, 0]
        return body.elements, fields, np.zeros((n, 3))
    normals = np.zeros((n, 3))
    if body.kind == BodyKind.RIGID_SURFACE:
        a, b, c = (body.vertices[body.elements[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return body.elements, np.zeros((n, 4)), normals


def solve(bodies, poses, triangles=True, pairs=None):
    """Return the Patches of bodies in poses, of all pairs i < j or those given."""
    table = build_element_table(table_of(bodies))
    if pairs is None:
        pairs = list(itertools.combinations(range(len(bodies)), 2))
    X_WG = np.ascontiguousarray(np.stack(poses), float)
    return solve_surfaces(table, X_WG, np.array(pairs, np.int64).reshape(-1, 2), triangles)


def at(x=0.0, y=0.0, z=0.0, R=None):
    """Return a pose."""
    X = np.eye(4)
    X[:3, 3] = x, y, z
    if R is not None:
        X[:3, :3] = R
    return X

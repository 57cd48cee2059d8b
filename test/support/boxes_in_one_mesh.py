"""Boxes in one mesh, solid or hollow, and what they mean, cell by cell of the grid of their faces.

Nothing here is the product's: a cell of the grid is in the solid where the boxes around it, hollow
ones taken off, count to one at least, and the surface is where a cell of each kind meet.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import Mesh

__all__ = ["FACES", "Boxes"]

FACES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)
"""Of a box whose corners are counted with z fastest."""


class Boxes:
    """Boxes (lower, upper), all solid but for those that are named, and rectangles beside them."""

    def __init__(self, *boxes, hollow=(), sheets=(), R=None, size=1.0, origin=(0.0, 0.0, 0.0)):
        """Take boxes in B, placed in the mesh's frame by p_M = size * (R @ p_B + origin).

        ``hollow`` are numbers of boxes whose triangles run the other way, ``sheets`` (lower,
        upper) of rectangles outside of the solid.
        """
        self.boxes = np.array(boxes, dtype=float).reshape(-1, 2, 3)
        self.hollow = set(hollow)
        self.sheets = np.array(sheets, dtype=float).reshape(-1, 2, 3)
        self.R = np.eye(3) if R is None else np.asarray(R)
        self.size, self.origin = size, np.asarray(origin, dtype=float)
        self._cuts = [np.unique(self.boxes[:, :, axis]) for axis in range(3)]
        middles = [0.5 * (c[1:] + c[:-1]) for c in self._cuts]
        points = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
        self._is_solid = self._count(points.reshape(-1, 3)).reshape(points.shape[:3]) >= 1
        self.walls, self.outward = self._walls()

    @property
    def mesh(self):
        """The boxes and sheets as one mesh."""
        bodies = [
            (_corners(*box), FACES[:, ::-1] if k in self.hollow else FACES)
            for k, box in enumerate(self.boxes)
        ]
        return self._mesh(bodies + [_rectangle(*sheet) for sheet in self.sheets])

    @property
    def surface_mesh(self):
        """The surface alone: the walls between cells, and the sheets."""
        walls = zip(self.walls, self.outward, strict=True)
        rectangles = [_rectangle(*wall, n) for wall, n in walls]
        return self._mesh(rectangles + [_rectangle(*sheet) for sheet in self.sheets])

    def _mesh(self, bodies):
        starts = np.cumsum([0, *(len(points) for points, _ in bodies)])
        faces = [rows + k for (_, rows), k in zip(bodies, starts, strict=False)]
        points = self.placed(np.vstack([points for points, _ in bodies]))
        return Mesh(vertices=points, faces=np.vstack(faces))

    @property
    def corners(self):
        """(n, 3): all corners in B, of sheets as well."""
        return np.vstack([_corners(*box) for box in [*self.boxes, *self.sheets]])

    @property
    def error(self):
        """The promise of a distance, 1e-12 of the size, and the rounding of the coordinates."""
        return self.size * (1e-11 + 2e-15 * np.abs(self.origin).max())

    @property
    def reach(self):
        """(2, 3): the box around all of it, in B."""
        both = np.concatenate([self.boxes, self.sheets])
        return np.array([both[:, 0].min(axis=0), both[:, 1].max(axis=0)])

    def placed(self, points):
        """Return points (n, 3) of B in the mesh's frame."""
        return self.size * (np.asarray(points, dtype=float) @ self.R.T + self.origin)

    def pose(self, p_B=(0.0, 0.0, 0.0)):
        """Return X_MB, with the axes of B at a point of B."""
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = self.R, self.placed(p_B)
        return X

    def inside(self, points):
        """Tell of points (n, 3) in B whether they are in the solid."""
        return self._count(np.asarray(points, dtype=float)) >= 1

    def distances(self, points):
        """Return signed distances in metres of points (n, 3) in B; a sheet has no inside."""
        points = np.asarray(points, dtype=float)
        to_walls = _distances(points, self.walls)
        found = np.where(self.inside(points), -to_walls, to_walls)
        if len(self.sheets):
            to_sheets = _distances(points, self.sheets)
            found = np.where(found > 0.0, np.minimum(found, to_sheets), found)
        return self.size * found

    def area(self, lower=-np.inf, upper=np.inf):
        """Return the area of the surface and the sheets in a box of B, in square metres."""
        walls = np.concatenate([self.walls, self.sheets])
        lengths = np.minimum(walls[:, 1], upper) - np.maximum(walls[:, 0], lower)
        flat = walls[:, 1] == walls[:, 0]
        lengths = np.where(flat, lengths >= 0.0, np.maximum(lengths, 0.0))
        return self.size**2 * float(lengths.prod(axis=1).sum())

    @property
    def faces_of_file(self):
        """(n, 2, 3): the rectangles in B that are in the mesh, hidden ones too."""
        found = [self.sheets]
        for axis in range(3):
            for side in range(2):
                faces = self.boxes.copy()
                faces[:, 1 - side, axis] = faces[:, side, axis]
                found.append(faces)
        return np.concatenate(found)

    def first_hit(self, eye, ahead):
        """Return how many metres along a unit vector of B the mesh's first rectangle is."""
        lower, upper = self.faces_of_file[:, 0], self.faces_of_file[:, 1]
        axis, rows = np.argmin(upper - lower, axis=1), np.arange(len(lower))
        t = (lower[rows, axis] - eye[axis]) / ahead[axis]
        at = eye + t[:, None] * ahead
        at[rows, axis] = lower[rows, axis]
        return self.size * t[(t > 0) & ((at >= lower) & (at <= upper)).all(axis=1)].min()

    @property
    def volume(self):
        """In cubic metres."""
        a, b, c = (np.diff(cuts) for cuts in self._cuts)
        return self.size**3 * float(np.einsum("ijk,i,j,k->", self._is_solid, a, b, c))

    def _count(self, points):
        total = np.zeros(len(points), dtype=int)
        for k, (lower, upper) in enumerate(self.boxes):
            within = ((points > lower) & (points < upper)).all(axis=1)
            total += within * (-1 if k in self.hollow else 1)
        return total

    def _walls(self):
        """Return the surface as rectangles (w, 2, 3) in B, and their directions outwards."""
        walls, outward = [], []
        for axis in range(3):
            padding = [(1, 1) if k == axis else (0, 0) for k in range(3)]
            step = np.diff(np.pad(self._is_solid, padding).astype(int), axis=axis)
            for at in np.argwhere(step):
                upper = at + 1
                upper[axis] = at[axis]
                walls.append(
                    [[self._cuts[k][corner[k]] for k in range(3)] for corner in (at, upper)]
                )
                outward.append(-step[tuple(at)] * np.eye(3)[axis])
        return np.array(walls), np.array(outward)


def _corners(lower, upper):
    """Return the corners (8, 3) of a box, z fastest."""
    axes = np.stack([lower, upper], axis=1)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _rectangle(lower, upper, outward=None):
    """Return the corners (4, 3) and triangles (2, 3) of a flat box."""
    flat = int(np.argmin(upper - lower))
    u, v = (flat + 1) % 3, (flat + 2) % 3
    corners = np.array([lower] * 4)
    corners[1:3, u], corners[2:, v] = upper[u], upper[v]
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    is_turned = outward is not None and outward[flat] < 0.0
    return corners, faces[:, ::-1] if is_turned else faces


def _distances(points, rectangles):
    """Return the distance of each of (n, 3) points from the nearest of (w, 2, 3) rectangles."""
    beyond = np.maximum(rectangles[:, 0] - points[:, None], points[:, None] - rectangles[:, 1])
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=2).min(axis=1)

"""What is true of every contact surface, whatever its bodies."""

import itertools

import numpy as np
import pytest


def faces_of(patches):
    """Yield (vertices (k, 3), pressures (k,), face index) of all faces of ``Patches``."""
    for s in range(len(patches.rows)):
        first, last = patches.vertex_start[s], patches.vertex_start[s + 1]
        vertices, pressure = patches.vertices_W[first:last], patches.pressure[first:last]
        begin, end = patches.face_start[s], patches.face_start[s + 1]
        corners = patches.corners[begin:end]
        if corners.shape[1] == 3:
            rows = list(corners)
        else:
            starts = [*corners[:, 0].tolist(), len(vertices)]
            rows = [np.arange(a, b) for a, b in itertools.pairwise(starts)]
        for f, row in enumerate(rows):
            yield vertices[row], pressure[row], begin + f


def check_patches(patches, has_margin=False):
    """Check that all numbers are finite and that faces are neither empty nor inverted."""
    for name in ("totals", "vertices_W", "pressure", "normals_W", "areas", "centroids_W"):
        assert np.isfinite(getattr(patches, name)).all(), name
    assert (np.diff(patches.face_start) > 0).all()
    assert (patches.areas > 0.0).all()
    assert np.linalg.norm(patches.normals_W, axis=1) == pytest.approx(1.0, abs=1e-12)
    if not has_margin:
        assert (patches.pressure >= 0.0).all()
    for vertices, pressure, f in faces_of(patches):
        edges = np.roll(vertices, -1, axis=0) - vertices
        assert np.linalg.norm(edges, axis=1).min() > 0.0
        # Twice the area, as a vector about the normal: the same area, the same side.
        x = vertices - vertices[0]
        doubled = np.cross(x[1:-1], x[2:]).sum(axis=0)
        n = patches.normals_W[f]
        rounding = 1e-14 * (1.0 + np.abs(vertices).max()) * np.abs(edges).max()
        assert doubled @ n > 0.0
        assert 0.5 * doubled @ n == pytest.approx(patches.areas[f], rel=1e-6, abs=rounding)
        if len(vertices) == 3:
            assert patches.face_pressure[f] == pytest.approx(pressure.mean(), rel=1e-9, abs=1e-9)
    for s in range(len(patches.rows)):
        part = slice(patches.face_start[s], patches.face_start[s + 1])
        areas = patches.areas[part]
        total = patches.totals[s]
        assert areas.sum() == pytest.approx(total[0], rel=1e-12)
        centre = areas @ patches.centroids_W[part] / areas.sum()
        assert centre == pytest.approx(total[1:4], rel=1e-9, abs=1e-9 * (1 + abs(centre).max()))
        if not has_margin:
            # The pressure at a centroid is the mean over a face, as pressure is linear on it.
            force = (areas * patches.face_pressure[part]) @ patches.normals_W[part]
            size = areas @ patches.face_pressure[part]
            # A pressure is good to the rounding of its gradient times coordinates: about 1e-9 Pa.
            assert force == pytest.approx(total[4:7], rel=1e-9, abs=1e-9 * (size + total[0]))

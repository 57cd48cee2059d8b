"""The page on the narrow phase says who decides: counted anew, and nothing else has taken over."""

from __future__ import annotations

from pathlib import Path
import re

from convex_bodies import answer_convex, pose
import numpy as np
from overlapping_pairs import Pair
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.lift import FOUND
from scene_graph_ros.geometry.query.distance import closed_forms

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "narrowphase.md").read_text()
COUNT = 50
"""Random pairs of each row."""

ROUNDED = 10
"""Percent: bodies that are put to touch are apart or deep by rounding, which machines may do
differently; of others that may be one in fifty."""


def shape(kind, rng):
    """Return a random shape, its half sizes between 5 and 20 cm."""
    a, b, c = rng.uniform(0.05, 0.2, 3)
    if kind == "capsule":
        return Capsule(0.5 * a, 2.0 * b)
    if kind == "box":
        return Box(2.0 * a, 2.0 * b, 2.0 * c)
    if kind == "cylinder":
        return Cylinder(a, 2.0 * b)
    if kind == "ellipsoid":
        return Ellipsoid(a, b, c)
    points = rng.normal(size=(16 if kind == "hull" else 100, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return Convex(vertices=points * np.array([a, b, c]))


def is_decided_in_short(shape_A, shape_B, X_AB):
    """Tell whether the contact is found and proven before GJK and EPA are asked."""
    return Pair(shape_A, shape_B, X_AB).lift()[0] == FOUND


def shares(kind_A, kind_B):
    """Return the percentages that are decided in short: apart, touching, 2 mm deep, deep.

    The first three are one pose, moved along the normal of its contact.
    """
    rng = np.random.default_rng(5)
    found = np.zeros(4)
    for _ in range(COUNT):
        A, B = shape(kind_A, rng), shape(kind_B, rng)
        direction = rng.normal(size=3)
        X_AB = pose(
            Rotation.random(random_state=rng),
            rng.uniform(0.3, 0.5) * direction / np.linalg.norm(direction),
        )
        contact = answer_convex(A, B, X_AB)
        for k, distance in enumerate((0.01, 0.0, -0.002)):
            moved = X_AB.copy()
            moved[:3, 3] += (contact.distance - distance) * contact.nhat_BA_A
            found[k] += is_decided_in_short(A, B, moved)
        inside = pose(Rotation.random(random_state=rng), rng.uniform(-0.02, 0.02, 3))
        assert answer_convex(A, B, inside).distance < 0.0
        found[3] += is_decided_in_short(A, B, inside)
    return 100.0 * found / COUNT


ROWS = {
    tuple(names.split(" - ")): [float(cell) for cell in cells.split("|")]
    for names, cells in re.findall(r"^\| ([a-z ]+ - [a-z ]+) \|([\d |]+)\|$", PAGE, re.M)
}


def test_all_pairs_without_a_closed_form_are_counted():
    """Of the kinds that have cores, in their order; a hull stands for a mesh's as well."""
    kinds = ["capsule", "box", "cylinder", "ellipsoid", "hull"]
    pairs = {(a, b) for i, a in enumerate(kinds) for b in kinds[i:]}
    closed = {("capsule", "capsule"), ("capsule", "box"), ("box", "box")}
    for a, b in closed:
        assert hasattr(closed_forms, f"distance_{a}_{b}")
    assert set(ROWS) == pairs - closed | {("box", "large hull")}


@pytest.mark.parametrize("pair", ROWS, ids=" - ".join)
def test_who_decides_is_what_the_page_says(pair):
    """Both ways: a mechanism that decides more than it says is news, too."""
    assert shares(*pair) == pytest.approx(ROWS[pair], abs=ROUNDED)


def test_every_file_of_the_narrow_phase_is_named():
    """And no file that is not there."""
    folder = ROOT / "scene_graph_ros" / "geometry" / "narrowphase"
    files = {path.name for path in folder.glob("*.py")} - {"__init__.py"}
    named = set(re.findall(r"`(?:\w+/)*(\w+\.py)`", PAGE))
    assert files - named == set()
    others = {path.name for path in (ROOT / "scene_graph_ros").rglob("*.py")}
    assert named - others == {Path(__file__).name}

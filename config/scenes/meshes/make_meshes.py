"""Write the meshes of the example scenes: solids of revolution about z, in metres.

    python config/scenes/meshes/make_meshes.py

Both are closed and not convex: a bowl with a wall of finite thickness, and a ring.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path

SEGMENTS = 32

# (radius, height) counter-clockwise in the half plane: from the axis at the bottom outside, over
# the rim, down the inside, and back to the axis.
BOWL = [
    (0.0, 0.0),
    (0.06, 0.0),
    (0.1, 0.02),
    (0.13, 0.06),
    (0.14, 0.1),
    (0.13, 0.1),
    (0.12, 0.064),
    (0.093, 0.03),
    (0.055, 0.012),
    (0.0, 0.012),
]

RING = [
    (
        0.06 + 0.018 * math.cos(2.0 * math.pi * i / 12),
        0.018 * math.sin(2.0 * math.pi * i / 12),
    )
    for i in range(12)
]

Point = tuple[float, float, float]
Triangle = tuple[int, int, int]


def revolve(
    profile: list[tuple[float, float]], *, closed: bool
) -> tuple[list[Point], list[Triangle]]:
    """Turn a profile about z; a closed one is joined end to start, an open one ends on the axis.

    Triangles are counter-clockwise seen from outside.
    """
    vertices: list[Point] = []
    rings: list[list[int]] = []
    for radius, height in profile:
        start = len(vertices)
        if radius == 0.0:
            vertices.append((0.0, 0.0, height))
            rings.append([start] * SEGMENTS)
            continue
        for k in range(SEGMENTS):
            angle = 2.0 * math.pi * k / SEGMENTS
            vertices.append((radius * math.cos(angle), radius * math.sin(angle), height))
        rings.append(list(range(start, start + SEGMENTS)))
    triangles: list[Triangle] = []
    joined = [*rings, rings[0]] if closed else rings
    for lower, upper in itertools.pairwise(joined):
        for k in range(SEGMENTS):
            n = (k + 1) % SEGMENTS
            if lower[k] != lower[n]:
                triangles.append((lower[k], lower[n], upper[n]))
            if upper[k] != upper[n]:
                triangles.append((lower[k], upper[n], upper[k]))
    return vertices, triangles


def obj_text(title: str, vertices: list[Point], triangles: list[Triangle]) -> str:
    """Return a mesh as the text of an OBJ file."""
    lines = [f"# {title}; written by make_meshes.py"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    return "\n".join(lines) + "\n"


def meshes() -> dict[str, str]:
    """Return the content of each file by its name."""
    return {
        "bowl.obj": obj_text("A bowl", *revolve(BOWL, closed=False)),
        "ring.obj": obj_text("A ring", *revolve(RING, closed=True)),
    }


if __name__ == "__main__":
    for name, text in meshes().items():
        (Path(__file__).parent / name).write_text(text)

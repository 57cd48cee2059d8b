"""Draw a walk: what the feet, the zero-moment point and the centre of mass do, and the robot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

if TYPE_CHECKING:
    from walk import Body, Walk

SHOWN = (0.0, 0.36, 0.63, 1.0)
"""Parts of the walk at which the robot is drawn."""
WIDE, TALL = 10.0, 8.4
FOOT, COM, WANTED, FOUND = "0.75", "#1f6fb4", "black", "#d1495b"


def draw(
    path: Path,
    body: Body,
    walk: Walk,
    motion: tuple[np.ndarray, np.ndarray],
    curves: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Write a picture of both views."""
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    times, q = motion
    com, pendulum, whole = curves
    figure = plt.figure(figsize=(WIDE, TALL), layout="constrained")
    grid = figure.add_gridspec(2, 1, height_ratios=(1.5, 1.0))
    space = figure.add_subplot(grid[0], projection="3d")
    above = figure.add_subplot(grid[1])
    _robots(space, body, walk, times, q, com)
    _plan(above, walk, com, pendulum, whole)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _robots(space, body: Body, walk: Walk, times, q, com) -> None:  # type: ignore[no-untyped-def]
    """Draw the robot as bones between its joints, at some moments, with its shadows' feet."""
    from walk import FOOT as SIZE

    tree = body.tree
    row_of = {name: row for row, name in enumerate(tree.link_names)}
    shades = np.linspace(0.25, 1.0, len(SHOWN))
    for part, shade in zip(SHOWN, shades, strict=True):
        row = int(part * (len(times) - 1))
        X = tree.link_poses(q[row])
        for chain in CHAINS:
            points = np.array([X[row_of[name], :3, 3] for name in chain])
            space.plot(*points.T, color="#2f4858", lw=3.0, alpha=shade, solid_capstyle="round")
        space.plot(*com[row], body.inertias.centre_of_mass(q[row])[2], "o", color=COM, ms=7)
    for x, y in walk.placed:
        corners = 0.5 * SIZE * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]])
        space.plot(*(corners + np.array([x, y])).T, 0.0, color="0.45", lw=1.0)
    height = body.inertias.centre_of_mass(q[0])[2]
    space.plot(*com.T, np.full(len(com), height), color=COM, lw=1.6)
    space.plot(*com.T, np.zeros(len(com)), color=COM, lw=1.0, ls=":")
    low, high = com[:, 0].min() - 0.25, com[:, 0].max() + 0.3
    space.set(xlim=(low, high), ylim=(-0.4, 0.4), zlim=(0.0, 1.6))
    space.set_box_aspect((high - low, 0.8, 1.6), zoom=1.22)
    space.view_init(elev=6, azim=-68)
    space.set_axis_off()


def _side(side: str) -> tuple[str, ...]:
    leg = tuple(f"leg_{side}_{k}_link" for k in (1, 3, 4, 5))
    return ("base_link", *leg, f"{side}_sole_link")


def _arm(side: str) -> tuple[str, ...]:
    return ("torso_2_link", *(f"arm_{side}_{k}_link" for k in (1, 3, 4, 5, 7)))


CHAINS = (
    ("base_link", "torso_2_link", "head_1_link", "head_2_link"),
    *(chain(side) for side in ("left", "right") for chain in (_side, _arm)),
)


def _plan(axis, walk: Walk, com, pendulum, whole) -> None:  # type: ignore[no-untyped-def]
    """Draw all from above."""
    from matplotlib.patches import Rectangle
    from walk import FOOT as SIZE

    for x, y in walk.placed:
        corner = np.array([x, y]) - 0.5 * SIZE
        axis.add_patch(Rectangle(corner, *SIZE, facecolor=FOOT, edgecolor="0.4", lw=0.8))
    wanted = walk.zmp.value(np.linspace(0.0, walk.zmp.end_time, 800))
    axis.plot(*wanted.T, color=WANTED, lw=3.0, alpha=0.35, label="zero-moment point: desired")
    axis.plot(*pendulum.T, color=FOUND, lw=1.4, label="of the pendulum")
    axis.plot(*whole.T, color="#e9a23b", lw=1.0, label="of all links")
    axis.plot(*com.T, color=COM, lw=2.0, label="centre of mass")
    axis.set_aspect("equal")
    axis.set(xlabel="x, m", ylabel="y, m")
    axis.margins(0.03)
    axis.legend(loc="upper center", ncols=4, bbox_to_anchor=(0.5, 1.22), frameon=False)

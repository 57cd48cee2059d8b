"""What a cloud's resolution costs: ``python -m benchmarks.cloud_resolution --picture file.png``.

A Panda among boxes, whose faces are seen as points on grids of several spacings. Balls of half a
cell's diagonal cover the faces between the points; smaller ones leave gaps, and larger ones keep
the robot away from free space. Answers about random configurations are compared with those of the
boxes themselves: false collisions among the free ones, and collisions that are missed. Times are
of the processor, the least of some calls, of configurations in a batch.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks import clouds
from benchmarks.machine import machine

__all__ = ["main"]

_SPACINGS = (0.005, 0.01, 0.02, 0.04, 0.08)
"""m between neighbours."""
_COVERING = np.sqrt(0.5)
"""Of the spacing: half the diagonal of a cell."""
_SHARES = (0.5, 1.0, 2.0)
"""Of the covering radius."""
_CONFIGURATIONS = 20_000


class _Row(NamedTuple):
    """Spacing and radius, m; points; shares of false and missed collisions; us."""

    spacing: float
    radius: float
    points: int
    false: float
    missed: float
    time: float


def grids_on_faces(spacing: float) -> NDArray[np.float64]:
    """Return points ``(n, 3)`` on the boxes' faces, in grids of cells of that edge at most, m."""
    points = []
    for center, size in clouds.BOXES:
        counts = np.ceil(np.array(size) / spacing).astype(int) + 1
        for axis in range(3):
            others = [k for k in range(3) if k != axis]
            u, v = np.meshgrid(*(np.linspace(-0.5, 0.5, counts[k]) for k in others))
            for side in (-0.5, 0.5):
                face = np.full((u.size, 3), side)
                face[:, others[0]], face[:, others[1]] = u.ravel(), v.ravel()
                points.append(center + face * size)
    return np.concatenate(points)


def _rows() -> list[_Row]:
    truth = clouds.checker_of(None, boxes=True)
    tree = truth.plan.tree
    q = tree.sample(np.random.default_rng(1), _CONFIGURATIONS)
    is_free = truth.check_configs_collision_free(q)
    rows = []
    for spacing in _SPACINGS:
        points = grids_on_faces(spacing)
        for share in _SHARES:
            radius = float(share * _COVERING * spacing)
            checker = clouds.checker_of(points, radius)
            found = checker.check_configs_collision_free(q)
            time = clouds.least(lambda c=checker: c.check_configs_collision_free(q), 2)
            rows.append(
                _Row(
                    spacing,
                    radius,
                    len(points),
                    float((~found & is_free).sum() / is_free.sum()),
                    float((found & ~is_free).sum() / (~is_free).sum()),
                    1e6 * time / len(q),
                )
            )
    return rows


def _draw(rows: Sequence[_Row], path: Path) -> None:
    """Draw false and missed collisions and times. Raises ImportError without matplotlib."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for share in _SHARES:
        chosen = [r for r in rows if np.isclose(r.radius, share * _COVERING * r.spacing)]
        label = f"{share:g} of the covering radius"
        spacings = [1e3 * r.spacing for r in chosen]
        left.plot(spacings, [1e2 * r.false for r in chosen], "o-", label=f"false, {label}")
        left.plot(spacings, [1e2 * r.missed for r in chosen], "x:", label=f"missed, {label}")
        right.plot(spacings, [r.time for r in chosen], "o-", label=label)
    for axes, name in ((left, "share of configurations, %"), (right, "a configuration, µs")):
        axes.set(xscale="log", xlabel="spacing of points, mm", ylabel=name)
        axes.set_xticks([1e3 * each for each in _SPACINGS], [f"{1e3 * s:g}" for s in _SPACINGS])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    left.legend(fontsize=7)
    right.legend(fontsize=7)
    figure.savefig(path, dpi=110)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, help="a file for the picture (PNG)")
    chosen = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    print("| spacing mm | radius mm | points | false collisions % | missed % | us |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: |")
    rows = _rows()
    for row in rows:
        print(
            f"| {1e3 * row.spacing:.0f} | {1e3 * row.radius:.1f} | {row.points} |"
            f" {1e2 * row.false:.2f} | {1e2 * row.missed:.2f} | {row.time:.2f} |",
            flush=True,
        )
    if chosen.picture is not None:
        _draw(rows, chosen.picture)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

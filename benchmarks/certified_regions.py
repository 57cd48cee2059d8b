"""What it costs to certify regions: ``python -m benchmarks.certified_regions``.

Arms of two, three and four joints stand between a ball and a box. Boxes of tangents of half angles
about the stretched arm, wider and wider, are certified by planes and by distances: the same
regions, in one process. Each time is the least of some runs, in seconds of the processor, with
the check of the certificate beside it. ``--grow`` adds polytopes that grow by bilinear
alternation, and proves these by distances, too; ``--panda`` certifies boxes of a Panda in its
cell; ``--picture`` draws times against volumes. Without pydrake only ours is measured, and that
is said.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import importlib.util
import math
import os
from pathlib import Path
import tempfile
import time
from typing import NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.timing import least_time  # noqa: E402
from scene_graph_ros.geometry import SceneGraph  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    BilinearAlternationOptions,
    CspaceFreeBox,
    CspaceFreePolytope,
    DistanceCertificate,
    load_robot_diagram,
    RobotDiagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.scene_files import load_scene_text  # noqa: E402

__all__ = ["main"]

_PICTURE = Path(__file__).parents[1] / "docs" / "certified_regions.png"
_GROWTH = _PICTURE.with_name("certified_growth.png")
_AXES = {2: "zz", 3: "zyy", 4: "zyyz"}
_VECTORS = {"y": "0 1 0", "z": "0 0 1"}
_WIDTHS = (0.02, 0.05, 0.1, 0.14, 0.17, 0.2, 0.22)
"""Half of the boxes' widths, in s."""

_PANDA = np.array([-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.02])
"""Joints and a finger of a Panda that reaches down beside its table."""

_AROUND = """
geometries:
  - {name: ball, source: around, pose: {xyz: [1.2, 0.9, 0]}, shape: {type: sphere, radius: 0.2}}
  - name: box
    source: around
    pose: {xyz: [-0.9, -0.9, 0]}
    shape: {type: box, size: [0.4, 0.4, 0.4]}
"""


class Row(NamedTuple):
    """A box, and what both ways say of it; seconds are NaN where it was not certified."""

    joints: int
    pairs: int
    width: float
    planes: float
    planes_check: float
    distance: float
    boxes: int
    distances: float
    distances_check: float
    status: str
    drake: float
    """Seconds; NaN without Drake, and where it does not certify the box."""

    @property
    def volume(self) -> float:
        """Of the box, in s."""
        return (2.0 * self.width) ** self.joints


def urdf(joints: int) -> str:
    """Return an arm with links of 2 m in all."""
    length, parts = 2.0 / joints, ['<link name="link0"/>']
    for k in range(1, joints + 1):
        axis = _VECTORS[_AXES[joints][k - 1]]
        parts += [
            f'<link name="link{k}"><collision><origin xyz="{length / 2} 0 0"/><geometry>'
            f'<box size="{0.8 * length} 0.1 0.1"/></geometry></collision></link>',
            f'<joint name="joint{k}" type="revolute"><parent link="link{k - 1}"/>'
            f'<child link="link{k}"/><origin xyz="{length if k > 1 else 0} 0 0"/>'
            f'<axis xyz="{axis}"/>'
            '<limit lower="-2.8" upper="2.8" effort="1" velocity="1"/></joint>',
        ]
    return f'<robot name="arm">{"".join(parts)}</robot>'


def arm(joints: int) -> SceneGraphCollisionChecker:
    """Return an arm between a ball and a box; links next to each other are no pair."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(urdf(joints))
        text = f"version: 1\nsources: [{{name: around}}]\nrobots: [{{name: arm, urdf: {path}}}]"
        graph = SceneGraph()
        scene = load_scene_text(text + _AROUND).apply(graph)
    checker = SceneGraphCollisionChecker(RobotDiagram.of_scene(graph, scene))
    for k in range(1, joints):
        checker.set_collision_filtered_between(f"link{k}", f"link{k + 1}", True)
    return checker


def _has_drake() -> bool:
    return importlib.util.find_spec("pydrake") is not None


def compare(joints: int, widths: Sequence[float], runs: int, max_boxes: int) -> list[Row]:
    """Certify boxes of some widths in both ways, and by Drake where it is installed."""
    checker, peer = arm(joints), None
    if _has_drake():
        from benchmarks.certified_regions_drake import DrakeSearch

        peer = DrakeSearch(urdf(joints))
    search, rows = CspaceFreePolytope(checker), []
    C = np.concatenate([np.eye(joints), -np.eye(joints)])
    # Kernels are loaded, and the solver is imported, before anything is timed.
    for width in widths:
        search.certify_by_distances(C, np.full(2 * joints, width)).verify()
    search.find_separation_certificate_given_polytope(C, np.full(2 * joints, widths[0]))
    for width in widths:
        d = np.full(2 * joints, width)
        planes, found = least_time(
            lambda d=d: search.find_separation_certificate_given_polytope(C, d), runs
        )
        distances, boxes = least_time(
            lambda d=d: search.certify_by_distances(C, d, max_boxes=max_boxes), runs
        )
        drake, is_certified = math.nan, False
        if peer is not None:
            drake, is_certified = least_time(lambda w=width: peer.certify(w), runs)
        checks = [math.nan, math.nan]
        for k, each in enumerate((found, boxes)):
            if each.is_success:
                checks[k], is_right = least_time(each.verify, 1)
                assert is_right
        rows.append(
            Row(
                joints,
                checker.num_pairs,
                width,
                planes if found.is_success else math.nan,
                checks[0],
                found.distance if found.is_success else math.nan,
                boxes.num_boxes,
                distances if boxes.is_success else math.nan,
                checks[1],
                boxes.status,
                drake if is_certified else math.nan,
            )
        )
    return rows


class Growth(NamedTuple):
    """A polytope that grew: processor seconds until then, its volume in s, metres kept."""

    seconds: float
    volume: float
    distance: float
    boxes: int
    by_distances: float
    """Seconds; NaN where the boxes did not suffice."""
    by_planes: float
    """Seconds for a proof of the last polytope alone."""
    found: DistanceCertificate


def grow(joints: int, width: float, rounds: int, max_boxes: int) -> list[Growth]:
    """Grow a polytope round by round, and prove each by distances, too."""
    search = CspaceFreePolytope(arm(joints))
    C, d = np.concatenate([np.eye(joints), -np.eye(joints)]), np.full(2 * joints, width)
    result: list[Growth] = []
    spent = 0.0
    for count in range(rounds + 1):
        options = BilinearAlternationOptions(max_iter=min(count, 1))
        begin = time.process_time()
        found = search.search_with_bilinear_alternation(C, d, options=options)
        spent += time.process_time() - begin
        if len(found) != 1 + min(count, 1):
            break
        polytope = found[-1].certified_polytope
        C, d = polytope.A, polytope.b
        begin = time.process_time()
        boxes = search.certify_by_distances(C, d, max_boxes=max_boxes)
        seconds = time.process_time() - begin if boxes.is_success else math.nan
        begin = time.process_time()
        again = search.find_separation_certificate_given_polytope(C, d)
        alone = time.process_time() - begin if again.is_success else math.nan
        volume, kept = polytope.calc_volume(), found[-1].distance
        result.append(Growth(spent, volume, kept, boxes.num_boxes, seconds, alone, boxes))
    return result


def panda(half_widths: Sequence[float], every: int = 1) -> None:
    """Print what it costs to certify boxes about one configuration of a Panda in its cell.

    Of ``every`` so many pairs one is looked at, by planes alone if that is not all of them.
    """
    checker = SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))
    search = CspaceFreeBox(checker)
    others = [pair for k, pair in enumerate(search.geometry_pairs) if k % every]
    print("Panda, half-width pairs  planes s  check s | most clearance s  kept mm | distances s")
    for width in half_widths:
        half = np.array([*[width] * 7, min(width, 0.01)])
        ends = _PANDA - half, _PANDA + half
        seconds, checks = [], math.nan
        for most_clearance in (False, True):
            taken, found = least_time(
                lambda ends=ends, most=most_clearance: (
                    search.find_separation_certificate_given_box(
                        *ends, others, most_clearance=most
                    )
                ),
                1,
            )
            seconds.append(taken if found.is_success else math.nan)
            if found.is_success and not most_clearance:
                checks, is_right = least_time(found.verify, 1)
                assert is_right
        distances = math.nan
        if every == 1:
            distances, _ = least_time(lambda ends=ends: search.certify_by_distances(*ends), 1)
        print(
            f"{width:17.3f} {len(found.certificates):5} {seconds[0]:9.2f} {checks:8.2f}"
            f" | {seconds[1]:16.2f} {1e3 * found.distance:8.2f} | {distances:11.4f}"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--joints", type=int, nargs="+", default=[2, 3, 4], choices=sorted(_AXES))
    parser.add_argument("--widths", type=float, nargs="+", default=list(_WIDTHS))
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--max-boxes", type=int, default=1_000_000)
    parser.add_argument("--grow", type=int, default=0, metavar="ROUNDS")
    parser.add_argument(
        "--picture", action="store_true", help=f"write {_PICTURE.name} and {_GROWTH.name}"
    )
    parser.add_argument("--panda", type=float, nargs="+", default=[], metavar="HALF_WIDTH")
    chosen = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    if not _has_drake():
        print("pydrake is not installed: only ours is measured")
    print(
        "joints pairs  width  volume | planes s  check s  kept mm  Drake s  ratio | distances s"
        "  check s  ratio  boxes"
    )
    rows: list[Row] = []
    for joints in chosen.joints:
        for row in compare(joints, chosen.widths, chosen.runs, chosen.max_boxes):
            rows.append(row)
            print(
                f"{row.joints:6} {row.pairs:5} {row.width:6.3f} {row.volume:7.1e}"
                f" | {row.planes:8.3f} {row.planes_check:8.3f} {1e3 * row.distance:8.2f}"
                f" {row.drake:8.3f} {row.drake / row.planes:6.1f} | {row.distances:11.5f}"
                f" {row.distances_check:8.4f} {row.drake / row.distances:6.1f} {row.boxes:6}"
                f" {row.status}"
            )
    grown = {}
    for joints in chosen.joints if chosen.grow else ():
        grown[joints] = grow(joints, 0.1, chosen.grow, chosen.max_boxes)
        print(f"\n{joints} joints, grown in s   volume  kept mm  planes s | distances s  boxes")
        for count, each in enumerate(grown[joints]):
            print(
                f"{count:15} {each.seconds:9.2f} {each.volume:8.4g} {1e3 * each.distance:8.2f}"
                f" {each.by_planes:9.3f} | {each.by_distances:11.4f} {each.boxes:6}"
            )
    if chosen.panda:
        panda(chosen.panda)
    if chosen.picture:
        draw(rows, grown)
        if 2 in grown:
            draw_growth(grown[2])


def draw(rows: Sequence[Row], grown: dict[int, list[Growth]]) -> None:
    """Draw times against volumes. Raises ImportError without matplotlib."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for k, joints in enumerate(sorted({row.joints for row in rows})):
        own, later = [row for row in rows if row.joints == joints], grown.get(joints, [])
        volumes = [row.volume for row in own]
        series = {
            ("planes", "o-"): (
                volumes + [each.volume for each in later],
                [row.planes for row in own] + [each.by_planes for each in later],
            ),
            ("distances", "s--"): (
                volumes + [each.volume for each in later],
                [row.distances for row in own] + [each.by_distances for each in later],
            ),
            ("grown by planes", "^:"): (
                [each.volume for each in later],
                [each.seconds for each in later],
            ),
        }
        for (name, style), (x, y) in series.items():
            order = np.argsort(x)
            axes.loglog(
                np.take(x, order),
                np.take(y, order),
                style,
                color=f"C{k}",
                label=f"{joints} joints, {name}",
            )
    axes.set_xlabel("volume of the certified region, in s = tan(q / 2)")
    axes.set_ylabel("time, s")
    axes.grid(visible=True, which="major", alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), fontsize=8, loc="outside right upper")
    figure.savefig(_PICTURE, dpi=110)


def draw_growth(grown: Sequence[Growth]) -> None:
    """Draw the polytopes of two joints that grew, in q, and the boxes of the last one."""
    from matplotlib.collections import PatchCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    q = np.linspace(-2.8, 2.8, 400)
    grid = np.stack(np.meshgrid(q, q), axis=-1).reshape(-1, 2)
    figure = Figure(figsize=(6.0, 5.2), layout="constrained")
    axes = figure.subplots()
    is_free = arm(2).check_configs_collision_free(grid).reshape(len(q), -1)
    axes.contourf(q, q, ~is_free, levels=[0.5, 1.5], colors=["0.55"])
    for k, each in enumerate(grown):
        inside = each.found.grid.contains(grid).reshape(len(q), -1)
        axes.contour(q, q, inside, levels=[0.5], colors=[f"C{k}"])
    boxes = [
        Rectangle(tuple(center - half), *(2.0 * half), fill=False)
        for center, half in zip(*grown[-1].found.boxes, strict=True)
    ]
    axes.add_collection(PatchCollection(boxes, match_original=True, linewidth=0.4))
    axes.set_xlabel("shoulder, rad")
    axes.set_ylabel("elbow, rad")
    axes.set(xlim=(-2.8, 2.8), ylim=(-2.8, 2.8), aspect="equal")
    figure.savefig(_GROWTH, dpi=100)


if __name__ == "__main__":
    main()

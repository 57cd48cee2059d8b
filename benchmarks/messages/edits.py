"""How long changes of the scene hold contacts up while poses come at full rate."""

from __future__ import annotations

from pathlib import Path
import subprocess
import time

import numpy as np
from tqdm import tqdm

from benchmarks.messages.editor import COUNT
from benchmarks.messages.processes import Isolation
from benchmarks.messages.report import Edited
from benchmarks.messages.scene import scene_text
from benchmarks.messages.sustained import Rig, rig

__all__ = ["edits"]

FULL = (1000, 150, 5000)
SMALL = (100, 3, 100)
"""Frames that move, pairs of small changes, and frames of a large one."""

_RATE = 200.0
_PAUSE = (0.1, 0.2)
"""Seconds between changes, at no fixed phase."""

_AFTERWARDS = 0.08
"""Seconds after an answer in which contacts may still be held up by the change: two markers."""

_STOP = 3600.0
"""Seconds that the sender is told to send: longer than any run, it is ended before."""

_SEED = 22


class _Editor:
    """The process that changes the scene; see ``benchmarks.messages.editor``."""

    def __init__(self, isolation: Isolation) -> None:
        self._isolation = isolation
        self._process = isolation.start(
            "benchmarks.messages.editor", stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def change(self, what: str, argument: str = "") -> tuple[int, int]:
        """Change the scene; return when the request was sent and answered, nanoseconds."""
        self._isolation.ask(self._process, **{"what": what, "with": argument})
        times = self._isolation.answer(self._process)
        return times["begin"], times["end"]


def _longest_gap(one: Rig, begin: int, end: int) -> float:
    """Return the longest time between contacts in a time of the system's clock, milliseconds."""
    arrivals = np.array([arrival for _, arrival in list(one.listener.arrivals)])
    first = max(int(np.searchsorted(arrivals, begin)) - 1, 0)
    last = int(np.searchsorted(arrivals, end)) + 1
    return float(np.diff(arrivals[first:last]).max(initial=0.0)) * 1e-6


def _held_up(one: Rig, begin: int, end: int) -> float:
    """Return the longest gap in the time of a change, less the time between poses."""
    return _longest_gap(one, begin, end + int(_AFTERWARDS * 1e9)) - 1e3 / _RATE


def _small(one: Rig, editor: _Editor, count: int) -> list[Edited]:
    """Register and remove a few geometries again and again; beside it nothing at all."""
    rng = np.random.default_rng(_SEED)
    rows: dict[str, list[tuple[float, float]]] = {"register": [], "remove": [], "nothing": []}
    for _ in tqdm(range(count), desc="edits", leave=False):
        for what, measured in rows.items():
            time.sleep(rng.uniform(*_PAUSE))
            if what == "nothing":
                begin = time.time_ns()
                end = begin + int(np.mean(rows["remove"], axis=0)[0] * 1e6)
                time.sleep((end - begin) * 1e-9)
            else:
                begin, end = editor.change(what)
            time.sleep(_AFTERWARDS)
            measured.append(((end - begin) * 1e-6, _held_up(one, begin, end)))
    names = {
        "register": f"register {COUNT} geometries",
        "remove": f"remove {COUNT} geometries",
        "nothing": "nothing, for as long",
    }
    return [Edited(names[what], *np.array(values).T) for what, values in rows.items()]


def _large(one: Rig, editor: _Editor, size: int) -> list[Edited]:
    """Change a lot at once."""
    folder = one.isolation.folder
    mesh, scene = folder / "torus.obj", folder / "frames.yaml"
    triangles = _write_torus(mesh, 36 * size)
    scene.write_text(scene_text(size).replace("objects", "others"))
    changes = {
        f"a mesh of {triangles} triangles": ("mesh", str(mesh)),
        f"a scene of {size} frames and geometries": ("load", str(scene)),
        "the first compliant geometry": ("soft", ""),
    }
    rows = []
    for name, (what, argument) in tqdm(changes.items(), desc="loads", leave=False):
        begin, end = editor.change(what, argument)
        time.sleep(1.0)
        milliseconds = np.array([(end - begin) * 1e-6]), np.array([_held_up(one, begin, end)])
        rows.append(Edited(name, *milliseconds))
    return rows


def _write_torus(path: Path, triangles: int) -> int:
    """Write a ring of some ``triangles`` to a file, and return how many they are."""
    columns, rows = triangles // 72, 36
    u, v = np.meshgrid(np.arange(columns) / columns, np.arange(rows) / rows, indexing="ij")
    radius = 1.0 + 0.3 * np.cos(2 * np.pi * v)
    points = np.stack(
        [
            radius * np.cos(2 * np.pi * u),
            radius * np.sin(2 * np.pi * u),
            0.3 * np.sin(2 * np.pi * v),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = (index.ravel() for index in np.mgrid[0:columns, 0:rows])
    a, b = i * rows + j, (i + 1) % columns * rows + j
    c, d = (i + 1) % columns * rows + (j + 1) % rows, i * rows + (j + 1) % rows
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]) + 1
    with path.open("w") as file:
        np.savetxt(file, points, "v %.9g %.9g %.9g")
        np.savetxt(file, faces, "f %d %d %d")
    return len(faces)


def edits(is_quick: bool) -> list[Edited]:
    """Print how long contacts were held up by small and by large changes of the scene."""
    frames, count, size = SMALL if is_quick else FULL
    print(f"contacts held up while {frames} poses come at {_RATE:g} Hz, milliseconds")
    with rig(frames, is_ordinary=False) as one:
        one.sender.begin(_RATE, _STOP)
        editor = _Editor(one.isolation)
        editor.change("register")
        editor.change("remove")
        rows = [*_small(one, editor, count), *_large(one, editor, size)]
    print(f"{'change':42} {'times':>5} {'answer':>9} {'held up':>8} {'99 %':>8} {'worst':>8}")
    for name, answers, held_up in rows:
        median, high, worst = np.percentile(held_up, (50, 99, 100))
        figures = f"{np.median(answers):9.1f} {median:8.1f} {high:8.1f} {worst:8.1f}"
        print(f"{name:42} {len(held_up):5} {figures}", flush=True)
    return rows

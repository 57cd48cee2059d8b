"""The renderers of the comparison, a file each; ENGINES is the list."""

from benchmarks.cameras.engines.drake import DrakeGl, DrakeVtk
from benchmarks.cameras.engines.embree import Embree
from benchmarks.cameras.engines.engine import Engine, KINDS
from benchmarks.cameras.engines.mujoco import MuJoCo
from benchmarks.cameras.engines.ours import Ours

__all__ = ["ENGINES", "KINDS", "Engine", "Ours"]

ENGINES: tuple[type[Engine], ...] = (Ours, DrakeVtk, DrakeGl, MuJoCo, Embree)

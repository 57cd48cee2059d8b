"""Voxels as earlier images showed them, each of them for as long as its sensor says."""

from __future__ import annotations

from dataclasses import dataclass
import functools
from typing import NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.shapes.voxel_grid import Voxel
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.sensing.voxel_map import voxels_after

if TYPE_CHECKING:
    from scene_graph_ros.sensing.cloud_view import CloudView
    from scene_graph_ros.sensing.depth_view import DepthView
    from scene_graph_ros.sensing.self_filter import SelfFilter

__all__ = ["FOREVER", "SeenVoxels", "VoxelsSeen"]

FOREVER = np.iinfo(np.int64).max
"""The end, ns, of a state that does not expire."""


@one_line()
class VoxelsSeen(NamedTuple):
    """How many voxels a view changed, and how many there are of each state after it."""

    freed: int
    hit: int
    free: int
    occupied: int
    unknown: int


@one_line()
@dataclass(frozen=True, eq=False)
class SeenVoxels:
    """States ``(nx, ny, nz)`` of a grid at ``X_WG``, with voxels of edge ``voxel``, m.

    ``until`` ``(nx, ny, nz)`` int64 has when each state expires, ns, FOREVER for those that do
    not; None where none does. ``sensors`` ``(nx, ny, nz)`` int16 has the number of the sensor that
    told each state last, -1 for no sensor; None where nobody asks for that. Nothing changes the
    voxels; `after`, `at`, `numbered` and `without` return others.
    """

    states: NDArray[np.uint8]
    voxel: float
    X_WG: NDArray[np.float64]
    until: NDArray[np.int64] | None = None
    sensors: NDArray[np.int16] | None = None

    def after(
        self, view: DepthView | CloudView, until: int = FOREVER, sensor: int = 0
    ) -> tuple[SeenVoxels, VoxelsSeen]:
        """Return the voxels after a view, as `voxels_after` says, and what it changed.

        The states that the view tells, changed or not, expire at ``until``, ns, and are those of
        the sensor of that number.
        """
        if until == FOREVER and self.until is None and self.sensors is None:
            states, changed = voxels_after(self.states, self.voxel, self.X_WG, view)
            return self._with(states, None, None), _counted(*changed, states)
        unseen = np.full(self.states.shape, Voxel.UNKNOWN, np.uint8)
        shown, _ = voxels_after(unseen, self.voxel, self.X_WG, view)
        tells = shown != Voxel.UNKNOWN
        states = np.where(tells, shown, self.states)
        ends, sensors = self.until, self.sensors
        if ends is None and until != FOREVER:
            ends = np.full(states.shape, FOREVER)
        if ends is not None:
            ends = np.where(tells, np.int64(until), ends)
        if sensors is not None:
            sensors = np.where(tells, np.int16(sensor), sensors)
        after = self._with(states, ends, sensors)
        after.first_end  # noqa: B018 - made here, beside the updates
        differs = states != self.states
        freed = int(np.count_nonzero(differs & (states == Voxel.FREE)))
        return after, _counted(freed, int(np.count_nonzero(differs)) - freed, states)

    def without(self, load: SelfFilter, padding: float) -> SeenVoxels:
        """Return the voxels with those free that a robot's load was seen in.

        They are the occupied ones whose centre is nearer to it than ``padding``, m, or than half
        a voxel's diagonal: each voxel in which a point of the load lies is one of them.
        """
        found = np.argwhere(self.states == Voxel.OCCUPIED)
        if not len(found):
            return self
        p_GPs = self.voxel * (found.astype(np.float64) + 0.5)
        p_WPs = moved(p_GPs, self.X_WG)
        found = found[load.near(p_WPs, max(padding, 0.5 * np.sqrt(3.0) * self.voxel))]
        if not len(found):
            return self
        states = self.states.copy()
        states[tuple(found.T)] = Voxel.FREE
        return self._with(states, self.until, self.sensors)

    def numbered(self, numbers: NDArray[np.int16]) -> SeenVoxels:
        """Return the voxels with other numbers of the sensors, -1 where one is gone.

        The states that it told are unknown; the object is the same where there are none.
        """
        if self.sensors is None or np.array_equal(numbers, np.arange(len(numbers))):
            return self
        is_told = self.sensors >= 0
        sensors = np.where(is_told, numbers[self.sensors], np.int16(-1))
        return self._unknown(is_told & (sensors < 0), sensors)

    def _unknown(self, chosen: NDArray[np.bool_], sensors: NDArray[np.int16] | None) -> SeenVoxels:
        """Return the voxels with some of them unknown."""
        states = np.where(chosen, np.uint8(Voxel.UNKNOWN), self.states)
        ends = None if self.until is None else np.where(chosen, np.int64(FOREVER), self.until)
        return self._with(states, ends, sensors)

    @functools.cached_property
    def first_end(self) -> int:
        """When the first state expires, ns."""
        return FOREVER if self.until is None else int(self.until.min(initial=FOREVER))

    def at(self, now: int) -> SeenVoxels:
        """Return the voxels with those unknown that have expired, the same object for none."""
        if self.until is None or now <= self.first_end:
            return self
        return self._unknown(self.until < now, self.sensors)

    def ended_by(self, time: int) -> SeenVoxels:
        """Return the same voxels, of which all that expire at all have expired after a time."""
        if self.until is None:
            return self
        ends = np.where(self.until == FOREVER, self.until, np.minimum(self.until, time))
        return self._with(self.states, ends, self.sensors)

    def _with(
        self,
        states: NDArray[np.uint8],
        until: NDArray[np.int64] | None,
        sensors: NDArray[np.int16] | None,
    ) -> SeenVoxels:
        return SeenVoxels(states, self.voxel, self.X_WG, until, sensors)


def _counted(freed: int, hit: int, states: NDArray[np.uint8]) -> VoxelsSeen:
    free, occupied, unknown = np.bincount(states.reshape(-1), minlength=3).tolist()
    return VoxelsSeen(freed, hit, free, occupied, unknown)

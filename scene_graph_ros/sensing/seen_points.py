"""Points of earlier images that no later one has seen through."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.sensing.depth_kernels import CLEARED, KEPT, SEEN_AGAIN
from scene_graph_ros.sensing.depth_view import NewPoints

if TYPE_CHECKING:
    from scene_graph_ros.sensing.self_filter import SelfFilter

__all__ = ["Counts", "SeenPoints", "View"]


class View(Protocol):
    """An image or a cloud of a sensor at a pose."""

    def judge(self, p_WPs: NDArray[np.float64], radii: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the verdicts on earlier points: KEPT, CLEARED or SEEN_AGAIN, ``(n,)``."""


@one_line()
class Counts(NamedTuple):
    """How many points an image brought and took."""

    new: int
    cleared: int
    """Those that its rays go on behind."""
    seen_again: int
    """Those in whose place it has others."""
    let_go: int
    """The oldest of more than there may be."""


@one_line()
@dataclass(frozen=True, eq=False)
class SeenPoints:
    """Points ``(n, 3)`` of W, their radii ``(n,)``, m, and when each was seen ``(n,)``, ns.

    ``sensors`` ``(n,)`` has the number of the sensor that saw each. Nothing changes the points;
    `after`, `replaced` and `since` return others.
    """

    p_WPs: NDArray[np.float64]
    radii: NDArray[np.float64]
    stamps: NDArray[np.int64]
    sensors: NDArray[np.int64]

    @classmethod
    def none(cls) -> SeenPoints:
        """Return no points."""
        return cls(np.empty((0, 3)), np.empty(0), np.empty(0, np.int64), np.empty(0, np.int64))

    def __len__(self) -> int:
        return len(self.p_WPs)

    def after(
        self, view: View, new: NewPoints, stamp: int, most: int, sensor: int = 0
    ) -> tuple[SeenPoints, Counts]:
        """Return the points there are after an image, or cloud, that was taken at a time, ns.

        Those that it sees through are gone, and those that it sees again are its own by now; it
        knows nothing of points that another sensor saw later. There are ``most`` at most, the
        newest.
        """
        verdicts = view.judge(self.p_WPs, self.radii)
        verdicts[self.stamps > stamp] = KEPT
        return self._with(verdicts, new, stamp, most, sensor)

    def replaced(
        self, new: NewPoints, stamp: int, most: int, sensor: int = 0
    ) -> tuple[SeenPoints, Counts]:
        """Return the points after a sensor's message that has all that there is, as `after`."""
        verdicts = np.where(self.sensors == sensor, SEEN_AGAIN, KEPT).astype(np.uint8)
        return self._with(verdicts, new, stamp, most, sensor)

    def _with(
        self, verdicts: NDArray[np.uint8], new: NewPoints, stamp: int, most: int, sensor: int
    ) -> tuple[SeenPoints, Counts]:
        """Return the points that are kept, and new ones."""
        kept = np.flatnonzero(verdicts == KEPT)
        let_go = max(0, len(kept) + len(new.radii) - most)
        if let_go:
            # Stable, so that the answer is the same everywhere.
            oldest = np.argsort(self.stamps[kept], kind="stable")
            kept = np.sort(kept[oldest[let_go:]])
        first = max(0, len(new.radii) - most)
        count = len(new.radii) - first
        counts = Counts(
            count,
            int(np.count_nonzero(verdicts == CLEARED)),
            int(np.count_nonzero(verdicts == SEEN_AGAIN)),
            let_go,
        )
        return (
            SeenPoints(
                np.concatenate([self.p_WPs[kept], new.p_WPs[first:]]),
                np.concatenate([self.radii[kept], new.radii[first:]]),
                np.concatenate([self.stamps[kept], np.full(count, stamp, np.int64)]),
                np.concatenate([self.sensors[kept], np.full(count, sensor, np.int64)]),
            ),
            counts,
        )

    def stamped_at_most(self, stamp: int) -> SeenPoints:
        """Return the same points, none of them seen later than at a time, ns."""
        stamps = np.minimum(self.stamps, stamp)
        return SeenPoints(self.p_WPs, self.radii, stamps, self.sensors)

    def numbered(self, numbers: NDArray[np.int64]) -> SeenPoints:
        """Return the points with other numbers of the sensors, -1 where one is gone with them."""
        sensors = numbers[self.sensors]
        return SeenPoints(self.p_WPs, self.radii, self.stamps, sensors).only(sensors >= 0)

    def since(self, stamp: int, sensor: int = 0) -> SeenPoints:
        """Return the points that a sensor saw at a time, ns, or later, and all of the others."""
        return self.only((self.stamps >= stamp) | (self.sensors != sensor))

    def without(self, load: SelfFilter, padding: float) -> SeenPoints:
        """Return the points that are farther than ``padding``, m, from a robot's load."""
        return self.only(~load.near(self.p_WPs, padding))

    def only(self, kept: NDArray[np.bool_]) -> SeenPoints:
        """Return the points that are marked ``(n,)``, the same object for all."""
        if kept.all():
            return self
        return SeenPoints(
            self.p_WPs[kept], self.radii[kept], self.stamps[kept], self.sensors[kept]
        )

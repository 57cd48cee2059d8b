"""Points of earlier images that no later one has seen through."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.sensing.depth_kernels import CLEARED, KEPT, SEEN_AGAIN
from scene_graph_ros.sensing.depth_view import DepthView, NewPoints

__all__ = ["Counts", "SeenPoints"]


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

    Nothing changes it; `after` and `since` return others.
    """

    p_WPs: NDArray[np.float64]
    radii: NDArray[np.float64]
    stamps: NDArray[np.int64]

    @classmethod
    def none(cls) -> SeenPoints:
        """Return no points."""
        return cls(np.empty((0, 3)), np.empty(0), np.empty(0, np.int64))

    def __len__(self) -> int:
        return len(self.p_WPs)

    def after(
        self, view: DepthView, new: NewPoints, stamp: int, most: int
    ) -> tuple[SeenPoints, Counts]:
        """Return the points there are after an image that was taken at a time, ns.

        Those that it sees through are gone, and those that it sees again are its own by now; there
        are ``most`` at most, the newest.
        """
        verdicts = view.judge(self.p_WPs, self.radii)
        kept = np.flatnonzero(verdicts == KEPT)
        let_go = max(0, len(kept) + len(new.radii) - most)
        if let_go:
            # Stable, so that the answer is the same everywhere.
            oldest = np.argsort(self.stamps[kept], kind="stable")
            kept = np.sort(kept[oldest[let_go:]])
        first = max(0, len(new.radii) - most)
        stamps = np.full(len(new.radii) - first, stamp, np.int64)
        counts = Counts(
            len(new.radii) - first,
            int(np.count_nonzero(verdicts == CLEARED)),
            int(np.count_nonzero(verdicts == SEEN_AGAIN)),
            let_go,
        )
        return (
            SeenPoints(
                np.concatenate([self.p_WPs[kept], new.p_WPs[first:]]),
                np.concatenate([self.radii[kept], new.radii[first:]]),
                np.concatenate([self.stamps[kept], stamps]),
            ),
            counts,
        )

    def stamped_at_most(self, stamp: int) -> SeenPoints:
        """Return the same points, none of them seen later than at a time, ns."""
        return SeenPoints(self.p_WPs, self.radii, np.minimum(self.stamps, stamp))

    def since(self, stamp: int) -> SeenPoints:
        """Return the points that were seen at a time, ns, or later."""
        return self.only(self.stamps >= stamp)

    def only(self, kept: NDArray[np.bool_]) -> SeenPoints:
        """Return the points that are marked ``(n,)``, the same object for all."""
        if kept.all():
            return self
        return SeenPoints(self.p_WPs[kept], self.radii[kept], self.stamps[kept])

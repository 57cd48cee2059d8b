"""One image of depth, at a pose: its pixels as points, and its verdicts on earlier points."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.poses import inverse
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.sensing.depth_kernels import (
    judge_points,
    Lens,
    mark_in_box,
    OPEN,
    place_points,
    ROBOT,
    take_nearest,
    widen,
)

if TYPE_CHECKING:
    from scene_graph_ros.geometry.perception.camera import CameraIntrinsics
    from scene_graph_ros.sensing.self_filter import SelfFilter

__all__ = ["DepthRules", "DepthView", "NewPoints"]

FloatArray = NDArray[np.float64]
_EVERYWHERE = (math.inf, math.inf, math.inf)
_CORNERS = np.array([[a, b, c] for a in (-1.0, 1.0) for b in (-1.0, 1.0) for c in (-1.0, 1.0)])
_EDGES = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])
"""Of a box: rows of its corners."""


@one_line()
class DepthRules(NamedTuple):
    """Which pixels are points, and how large; lengths in m."""

    step: int = 2
    """Of each block of so many pixels squared the nearest is the point."""
    near: float = 0.05
    far: float = 10.0
    """Depths between which the camera sees."""
    error: float = 0.0
    """Of a depth; it is added to each radius."""
    padding: float = 0.02
    """Points so near to a body of the robot are taken for it."""
    shadow: int = 2
    """Pixels around the robot's in which a camera mixes it with what is behind it."""
    margin: float = 0.02
    """A ray clears a point that it goes on behind by more than this."""
    lower: tuple[float, float, float] = (-math.inf, -math.inf, -math.inf)
    upper: tuple[float, float, float] = _EVERYWHERE
    """Corners of the region of interest in W: what lies outside is no point."""


@one_line()
class NewPoints(NamedTuple):
    """The points of one image: in W ``(n, 3)`` m, with radii ``(n,)`` m."""

    p_WPs: FloatArray
    radii: FloatArray


@one_line()
@dataclass(frozen=True, eq=False)
class DepthView:
    """Depths ``(h, w)`` float32, in m along z of C, seen through a lens at ``X_WC``.

    NaN and 0 are no depth, positive infinity is one beyond ``far`` (REP-117), negative infinity
    one nearer than ``near``. ``p_CPs`` ``(rows, columns, 3)`` has the nearest point of each block
    of pixels, z 0 where there is none; ``mask`` ``(rows, columns)`` uint8 says which of them are
    the robot's.
    """

    depth: NDArray[np.float32]
    lens: CameraIntrinsics
    X_WC: FloatArray
    rules: DepthRules
    p_CPs: FloatArray
    mask: NDArray[np.uint8]

    @classmethod
    def of(
        cls,
        depth: NDArray[np.float32],
        lens: CameraIntrinsics,
        X_WC: FloatArray,
        rules: DepthRules,
        own: SelfFilter | None = None,
    ) -> DepthView:
        """Look at an image; without ``own`` no pixel shows a robot.

        Raises ValueError for depths that are not of the lens's size.
        """
        if depth.shape != (lens.height, lens.width):
            raise ValueError(
                f"depths must be ({lens.height}, {lens.width}) as the lens, not {depth.shape}"
            )
        depth = np.ascontiguousarray(depth, np.float32)
        step = rules.step
        p_CPs = np.empty((-(-lens.height // step), -(-lens.width // step), 3))
        numbers = Lens(lens.fx, lens.fy, lens.cx, lens.cy)
        take_nearest(depth, numbers, step, float(rules.near), float(rules.far), p_CPs)
        mask = np.zeros(p_CPs.shape[:2], np.uint8)
        view = cls(depth, lens, np.array(X_WC, np.float64), rules, p_CPs, mask)
        if own is not None:
            view._mark(own)
        return view

    @property
    def _numbers(self) -> Lens:
        lens = self.lens
        return Lens(lens.fx, lens.fy, lens.cx, lens.cy)

    def _mark(self, own: SelfFilter) -> None:
        """Mark the blocks of the robot, and those beside them."""
        mask, count = self.mask, 0
        for center, half, X_BC in own.boxes(self.X_WC, self.rules.padding):
            window = self._window(center, half, inverse(X_BC))
            count += mark_in_box(self.p_CPs, X_BC, center, half, window, mask)
        if not count:
            return
        blocks = np.nonzero(mask)
        is_own = own.has(moved(self.p_CPs[blocks], self.X_WC), self.rules.padding)
        mask[blocks] = np.where(is_own, ROBOT, OPEN)
        if self.rules.shadow:
            widen(mask, -(-self.rules.shadow // self.rules.step))

    def _window(self, center: FloatArray, half: FloatArray, X_CB: FloatArray) -> NDArray[np.int64]:
        """Return first and last rows and columns ``(4,)`` of the blocks that may show a box."""
        corners = (center + _CORNERS * half) @ X_CB[:3, :3].T + X_CB[:3, 3]
        corners = _in_front(corners, 0.5 * self.rules.near)
        if not len(corners):
            return np.zeros(4, np.int64)
        lens = self._numbers
        u = lens.fx * corners[:, 0] / corners[:, 2] + lens.cx
        v = lens.fy * corners[:, 1] / corners[:, 2] + lens.cy
        low, high = np.array([v.min(), u.min()]), np.array([v.max(), u.max()])
        step, size = self.rules.step, self.mask.shape
        first = np.clip(np.floor(low / step) - 1.0, 0.0, size).astype(np.int64)
        last = np.clip(np.ceil(high / step) + 2.0, 0.0, size).astype(np.int64)
        return np.array([first[0], last[0], first[1], last[1]], np.int64)

    def own_points(self) -> FloatArray:
        """Return the points ``(n, 3)`` of W that are the robot's, m."""
        return moved(self.p_CPs[self.mask == ROBOT], self.X_WC)

    def points(self) -> NewPoints:
        """Return the points that are not the robot's, with radii: half the resolution there.

        The balls of neighbours cover the surface between them where it is seen at more than ten
        degrees and is nearly flat; of each block of pixels the nearest counts.
        """
        rules, most = self.rules, self.mask.size
        p_WPs, radii = np.empty((most + 1, 3)), np.empty(most + 1)
        lower, upper = (np.array(corner, np.float64) for corner in (rules.lower, rules.upper))
        count = place_points(
            *(self.p_CPs, self.mask, self._numbers, rules.step, self.X_WC, lower, upper),
            *(float(rules.error), p_WPs, radii),
        )
        return NewPoints(p_WPs[:count], radii[:count])

    def judge(self, p_WPs: FloatArray, radii: FloatArray) -> NDArray[np.uint8]:
        """Return the verdicts on earlier points: KEPT, CLEARED or SEEN_AGAIN, ``(n,)``."""
        verdicts = np.empty(len(p_WPs), np.uint8)
        rules = self.rules
        judge_points(
            *(p_WPs, radii, self.depth, self.mask, self._numbers, rules.step),
            *(inverse(self.X_WC), float(rules.near), float(rules.far), float(rules.margin)),
            verdicts,
        )
        return verdicts


def _in_front(corners: FloatArray, z: float) -> FloatArray:
    """Return corners ``(n, 3)`` of the part of a box, by its eight corners, that is beyond z."""
    first, last = corners[_EDGES[:, 0]], corners[_EDGES[:, 1]]
    crosses = (first[:, 2] < z) != (last[:, 2] < z)
    first, last = first[crosses], last[crosses]
    ratio = (z - first[:, 2:]) / (last[:, 2:] - first[:, 2:])
    return np.concatenate([corners[corners[:, 2] >= z], first + ratio * (last - first)])

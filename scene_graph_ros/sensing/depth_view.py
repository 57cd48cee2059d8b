"""One image of depth, at a pose: its pixels as points, and its verdicts on earlier points."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.loans import RoomLender
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.poses import inverse
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.sensing.depth_kernels import (
    judge_points,
    Lens,
    place_points,
    take_nearest,
    widen,
)
from scene_graph_ros.sensing.near_cells import mark_image, ROBOT

if TYPE_CHECKING:
    from scene_graph_ros.geometry.perception.camera import CameraIntrinsics
    from scene_graph_ros.sensing.self_filter import SelfFilter

__all__ = ["DepthRules", "DepthView", "NewPoints", "new_points_memory"]

FloatArray = NDArray[np.float64]
_EVERYWHERE = (math.inf, math.inf, math.inf)

_KEPT_BLOCKS = 1 << 12, 1 << 20
"""Of images whose memory is kept for the next one: that of less is not cleared by the system each
time, and that of more is given back to it."""

_images = RoomLender(lambda count, memory: (memory((3 * count,)),), *_KEPT_BLOCKS)
new_points_memory = RoomLender(
    lambda count, memory: (memory((count, 3)), memory((count,))), *_KEPT_BLOCKS
)


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
    one nearer than ``near``. ``planes`` ``(3, rows, columns)`` has x, y and z of the nearest point
    of each block of pixels, m, z 0 where there is none; ``mask`` ``(rows, columns)`` uint8 says
    which of them are the robot's.
    """

    depth: NDArray[np.float32]
    lens: CameraIntrinsics
    X_WC: FloatArray
    rules: DepthRules
    planes: FloatArray
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
        rows, columns = -(-lens.height // step), -(-lens.width // step)
        (room,) = _images.take(rows * columns)
        planes = room[: 3 * rows * columns].reshape(3, rows, columns)
        numbers = Lens(lens.fx, lens.fy, lens.cx, lens.cy)
        take_nearest(depth, numbers, step, float(rules.near), float(rules.far), planes)
        mask = np.zeros((rows, columns), np.uint8)
        view = cls(depth, lens, np.array(X_WC, np.float64), rules, planes, mask)
        if own is not None:
            view._mark(own)
        return view

    @property
    def p_CPs(self) -> FloatArray:
        """The points ``(rows, columns, 3)`` of C of the blocks, m; z is 0 where there is none."""
        return self.planes.transpose(1, 2, 0)

    @property
    def _numbers(self) -> Lens:
        lens = self.lens
        return Lens(lens.fx, lens.fy, lens.cx, lens.cy)

    def _mark(self, own: SelfFilter) -> None:
        """Mark the blocks of the robot, and those beside them."""
        rules, mask = self.rules, self.mask
        boxes = own.boxes(self.X_WC, rules.padding)
        marked = own.decide(
            lambda cells: mark_image(
                *(self.planes, self._numbers, rules.step, 0.5 * rules.near, boxes, cells, mask)
            ),
            rules.padding,
            mask,
            lambda unsure: moved(self.p_CPs[unsure], self.X_WC),
        )
        if marked and rules.shadow:
            widen(mask, -(-rules.shadow // rules.step))

    def own_points(self) -> FloatArray:
        """Return the points ``(n, 3)`` of W that are the robot's, m."""
        return moved(self.p_CPs[self.mask == ROBOT], self.X_WC)

    def points(self) -> NewPoints:
        """Return the points that are not the robot's, with radii: half the resolution there.

        The balls of neighbours cover the surface between them where it is seen at more than ten
        degrees and is nearly flat; of each block of pixels the nearest counts.
        """
        rules, most = self.rules, self.mask.size
        p_WPs, radii = new_points_memory.take(most + 1)
        lower, upper = (np.array(corner, np.float64) for corner in (rules.lower, rules.upper))
        count = place_points(
            *(self.planes, self.mask, self._numbers, rules.step, self.X_WC, lower, upper),
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

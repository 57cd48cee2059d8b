"""The work on a page's requests about robots; for the page's own thread.

Imported when a page first holds a link.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError, UnavailableError
from msg_adapters.poses import poses_from_components
from msg_adapters.stamps import duration_from_msg, duration_to_msg, stamp_from_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import MotionLimits, RobotConfigurations, Status
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.page_ghost import Ghost, Reached
from scene_graph_ros.node.effects.page_jobs import Found, NOTHING_HELD
from scene_graph_ros.node.effects.page_plan import NO_PLAN, PagePlan
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.browser.blocks import motion_block
from scene_graph_ros.views.browser.motion_requests import (
    Cancel,
    Drag,
    Execute,
    Hold,
    LetGo,
    MotionRequest,
    PlanWay,
)
from scene_graph_ros.views.browser.motions import MotionTold

if TYPE_CHECKING:
    from trajectory_msgs.msg import JointTrajectory

    from scene_graph_ros.node.effects.page_execution import PageExecution

__all__ = ["PageWork"]

_REPLACE_AFTER = 3_000_000_000
"""ns from a request to replace a motion to where the new one begins: it is found and played by
then."""

_SENDING = 0.2
"""s before that: when a page has to ask for it at the latest."""

_TOLD = PlanPath.Feedback
_STATES = {
    _TOLD.WAITING: "waiting for its turn",
    _TOLD.CHECKING: "looking at start and goal",
    _TOLD.SEARCHING: "searching",
    _TOLD.SHORTENING: "shortening",
    _TOLD.PROVING: "proving",
    _TOLD.TIMING: "timing",
}


class _Search(NamedTuple):
    """A motion that is looked for."""

    cancel: Callable[[], None]
    replaced: JointTrajectory | None


def _switch(of: Any) -> int:
    """Return when a motion goes on from the one that it replaces, ns."""
    trajectory = of.trajectory
    first = trajectory.points[of.replaces_from].time_from_start
    return stamp_from_msg(trajectory.header.stamp) + duration_from_msg(first)


class PageWork:
    """Does one page's requests, and tells it."""

    def __init__(
        self,
        host: Host,
        execution: PageExecution | None,
        found: Callable[[Any, PlannedPath | None], None],
        wake: Callable[[], None],
        tell: Callable[[MotionTold], None],
    ) -> None:
        """``found`` is called with the end of a search, ``wake`` when there is other news."""
        self._host, self._execution, self._tell = host, execution, tell
        self._found, self._wake = found, wake
        self._ghost: Ghost | None = None
        self._late: tuple[Hold, str] | None = None
        self._held: Hold | None = None
        self._reached: Reached | None = None
        self._number = 0
        self._search: _Search | None = None
        self._feedback: Any = None
        self._plan: PagePlan | None = None
        self._plans = 0
        self._reason = ""
        self._said: tuple[Any, ...] = ()
        self._told = MotionTold()

    @property
    def is_holding(self) -> bool:
        """Whether a link is held."""
        return self._ghost is not None

    @property
    def is_late(self) -> bool:
        """Whether a link will be held when kernels are ready."""
        return self._late is not None

    def do(self, job: MotionRequest | Found | None, snapshot: WorldSnapshot) -> None:
        """Do a job, None to look at the world. Raises SceneGraphError with the reason if not."""
        if job is not None:
            self._reason = ""
        elif self._late is not None:
            job = self._late[0]
        self._follow(snapshot)
        if isinstance(job, Hold):
            self._hold(job, snapshot)
        elif isinstance(job, Drag):
            self._drag(job)
        elif isinstance(job, PlanWay):
            self._begin_plan(job)
        elif isinstance(job, Found):
            self._take(job, snapshot)
        elif isinstance(job, Execute):
            self._execute(job, snapshot)
        elif isinstance(job, Cancel):
            self._cancel()
        elif isinstance(job, LetGo):
            self.let_go()
        self.say()

    def refuse(self, reason: str) -> None:
        """Tell the page why a request was not done."""
        self._reason = reason
        self.say()

    def let_go(self) -> None:
        """Hold nothing, look for nothing."""
        self._cancel()
        self._ghost = self._late = self._held = self._reached = self._plan = None

    def close(self) -> None:
        """End a search that goes on."""
        self._cancel()

    # The requests.

    def _follow(self, snapshot: WorldSnapshot) -> None:
        ghost = self._ghost
        if ghost is not None and ghost.snapshot is not snapshot:
            try:
                ghost.follow(snapshot)
            except Exception:
                self.let_go()
                raise
            self._reached = ghost.reached()

    def _hold(self, request: Hold, snapshot: WorldSnapshot) -> None:
        self.let_go()
        lack = self._host.lack_of_kernels("planning")
        if lack:
            self._late = request, f"not yet: {lack}"
            return
        self._ghost = Ghost(snapshot, request.robot, request.link, request.group)
        self._held, self._reached, self._number = request, self._ghost.reached(), 0

    def _drag(self, request: Drag) -> None:
        ghost = self._some_ghost()
        self._number, self._plan = request.number, None
        ghost.drag(_pose_of(request))
        self._reached = ghost.reached()

    def _some_ghost(self) -> Ghost:
        if self._ghost is None:
            raise MessageError(NOTHING_HELD)
        return self._ghost

    def _begin_plan(self, request: PlanWay) -> None:
        ghost, reached = self._some_ghost(), self._reached
        assert reached is not None
        if self._search is not None:
            raise MessageError("a motion is looked for already: one at a time for each page")
        if not ghost.has_moved:
            raise MessageError("the robot is there already: drag the link first")
        if reached.collisions:
            one, other, depth = reached.collisions[0]
            raise MessageError(f"there {one} and {other} would overlap by {1e3 * depth:.4g} mm")
        goal = self._goal(ghost, request)
        replaced = None
        if request.replaces:
            replaced = self._some_execution().executing(self._now())
            if replaced is None:
                raise MessageError("no motion is executed that could be replaced")
            goal.executing, goal.replace_after = replaced, duration_to_msg(_REPLACE_AFTER)
        self._plan, self._feedback = None, None
        # It may end at once.
        self._search = _Search(lambda: None, replaced)
        cancel = self._host.begin_plan(goal, self._hear, self._found)
        self._search = _Search(cancel, replaced)

    def _goal(self, ghost: Ghost, request: PlanWay) -> Any:
        names = [ghost.names[row] for row in ghost.moving]
        return PlanPath.Goal(
            goals=RobotConfigurations(names=names, positions=ghost.q[ghost.moving].tolist()),
            group=ghost.group,
            planner="fastest",
            with_trajectory=True,
            limits=MotionLimits(
                max_acceleration=float(self._host.parameter("browser_acceleration")),
                max_jerk=float(self._host.parameter("browser_jerk")),
                velocity_scaling=request.scaling,
                acceleration_scaling=request.scaling,
            ),
        )

    def _hear(self, feedback: Any) -> None:
        # In the thread of goals.
        self._feedback = feedback
        self._wake()

    def _take(self, found: Found, snapshot: WorldSnapshot) -> None:
        search, self._search = self._search, None
        result, path = found
        if result.status.code != Status.OK:
            raise UnavailableError(result.status.message)
        if path is None or search is None:
            raise UnavailableError(result.reason or "the search was ended")
        if self._ghost is not None:
            self._plans += 1
            within = 0.0
            if search.replaced is not None:
                within = 1e-9 * (_switch(result) - self._now()) - _SENDING
                if within <= 0.0:
                    raise UnavailableError("the new motion was found too late to be played first")
            link, replaced = self._ghost.link, search.replaced
            self._plan = PagePlan(self._plans, result, path, snapshot, link, replaced, within)

    def _execute(self, request: Execute, snapshot: WorldSnapshot) -> None:
        execution, plan, ghost = self._some_execution(), self._plan, self._some_ghost()
        if plan is None or plan.number != request.plan:
            raise MessageError(f"there is no plan {request.plan} any more")
        if plan.replaced is not None:
            late = 1e-9 * (self._now() - _switch(plan))
            if late > 0.0:
                raise UnavailableError(
                    f"the motion should have begun {late:.3g} s ago: plan again"
                )
            plan.require_free(snapshot)
            execution.replace(plan.trajectory, plan.replaced)
            self._plan = None
            return
        execution.require_rest(self._now())
        plan.require_executable(snapshot, self._host, ghost.group, self._now())
        execution.begin(plan.trajectory, self._now())

    def _some_execution(self) -> PageExecution:
        if self._execution is None:
            raise UnavailableError("pages may not execute motions: browser_execute is false")
        return self._execution

    def _cancel(self) -> None:
        if self._search is not None:
            self._search.cancel()
        if self._plan is not None and self._plan.replaced is not None:
            self._plan = None

    def _now(self) -> int:
        return int(self._host.node.get_clock().now().nanoseconds)

    # What the page is told.

    def say(self) -> None:
        """Tell the page how it is, where that is new."""
        content = self._content()
        ghost = self._ghost
        about = None if ghost is None else (ghost.q.tobytes(), ghost.snapshot.scene_version)
        said = (content, about)
        planned = NO_PLAN if self._plan is None else self._plan.block
        if said == self._said and planned is self._told.planned:
            return
        held = self._told.held
        if said != self._said:
            ids, X_WG = (np.empty(0, np.int64), np.empty((0, 4, 4)))
            if ghost is not None:
                ids, X_WG = ghost.geometries()
            held = motion_block(content, ids, X_WG)
        self._said, self._told = said, MotionTold(held, planned)
        self._tell(self._told)

    def _content(self) -> dict[str, Any]:
        content: dict[str, Any] = {
            "held": None,
            "late": "" if self._late is None else self._late[1],
            "reason": self._reason,
            "planning": self._planning(),
            "executing": self._execution is not None
            and self._execution.executing(self._now()) is not None,
        }
        ghost, reached = self._ghost, self._reached
        if ghost is None or reached is None or self._held is None:
            return content
        return {
            **content,
            "held": {"robot": self._held.robot, "link": self._held.link},
            "group": ghost.group,
            "groups": ghost.groups,
            "number": self._number,
            "has_moved": ghost.has_moved,
            "position": reached.X_WL[:3, 3].tolist(),
            "rotation": quaternions_from_poses(reached.X_WL[np.newaxis])[0].tolist(),
            "is_reached": reached.is_reached,
            "position_error": reached.position_error,
            "rotation_error": reached.rotation_error,
            "collisions": reached.collisions,
            "colliding": reached.colliding,
        }

    def _planning(self) -> str:
        """Return the state of a search in a word, "" where there is none."""
        if self._search is None:
            return ""
        told = self._feedback
        return _STATES[_TOLD.WAITING if told is None else told.state]


def _pose_of(request: Drag) -> NDArray[np.float64]:
    """Return a pose ``(4, 4)``. Raises MessageError for one that no link can have."""
    q = np.array(request.rotation)
    largest = np.abs(q).max()
    if not largest > 0.0:
        raise MessageError(f"rotation is no quaternion: {quoted(list(request.rotation))}")
    q = q / largest
    components = np.array([[*request.position, *(q / np.linalg.norm(q))]])
    valid, X, refused = poses_from_components(components, ["the link"])
    if not valid.all():
        raise MessageError(refused[0].message)
    return X[0]

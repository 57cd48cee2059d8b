"""Goals of an action: their order, their ends, and that nothing is left of them."""

from __future__ import annotations

import threading

from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Time
import numpy as np
import pytest
from spinning import DEADLINE, wait_until

from scene_graph_msgs.action import PlanPath
from scene_graph_ros.node.runtime import goals as goals_module
from scene_graph_ros.node.runtime.goals import GoalEnd, Goals, Work

PARTS = PlanPath.Impl
NOBODY = bytes(16)


class Bench:
    """Goals whose work lasts until it is let go, or they are cancelled; all that was said of them.

    The group of a goal is what it is called, and the reason of its result.
    """

    def __init__(self, most_waiting: int = 1) -> None:
        self.gates: dict[str, threading.Event] = {}
        self.begun: list[str] = []
        self.feedback: list[tuple[int, int]] = []
        self.statuses: list[dict[int, int]] = []
        self.clock = 0
        work = Work(self._work, self._crowded, self._cancelled, self._waits, lambda: most_waiting)
        self.goals = Goals(
            PlanPath,
            work,
            publish_feedback=lambda m: self.feedback.append((m.goal_id.uuid[0], m.feedback.ahead)),
            publish_status=self._shown,
            now=self._now,
        )

    def _now(self) -> Time:
        self.clock += 1
        return Time(sec=self.clock)

    def _work(self, goal):
        name = goal.request.group
        self.begun.append(name)
        gate = self.gates.setdefault(name, threading.Event())
        while not gate.wait(0.001):
            if goal.is_cancelled:
                return GoalEnd(GoalStatus.STATUS_CANCELED, PlanPath.Result(reason=f"no {name}"))
        return GoalEnd(GoalStatus.STATUS_SUCCEEDED, PlanPath.Result(reason=name))

    def _crowded(self, waiting):
        return PlanPath.Result(reason=f"{waiting} wait")

    def _cancelled(self):
        return PlanPath.Result(reason="never begun")

    def _waits(self, goal, ahead):
        goal.tell(PlanPath.Feedback(ahead=ahead))

    def _shown(self, message):
        self.statuses.append(
            {int(s.goal_info.goal_id.uuid[0]): s.status for s in message.status_list}
        )

    def send(self, number: int) -> bool:
        """Send a goal; tell whether it is accepted."""
        request = PARTS.SendGoalService.Request(goal=PlanPath.Goal(group=str(number)))
        request.goal_id.uuid = key(number)
        answers = []
        self.goals.send(request, answers.append)
        return answers[0].accepted

    def cancel(self, which: bytes = NOBODY, until: int = 0):
        """Cancel goals; return the response."""
        info = GoalInfo(stamp=Time(sec=until))
        info.goal_id.uuid = np.frombuffer(which, np.uint8)
        answers = []
        self.goals.cancel(CancelGoal.Request(goal_info=info), answers.append)
        return answers[0]

    def ask(self, number: int) -> list:
        """Ask for a result; return where it comes to."""
        request = PARTS.GetResultService.Request()
        request.goal_id.uuid = key(number)
        answers = []
        self.goals.get_result(request, answers.append)
        return answers

    def result(self, number: int):
        """Wait for a result; return the status and the reason."""
        answers = self.ask(number)
        wait_until(lambda: answers, f"the result of goal {number}")
        return answers[0].status, answers[0].result.reason

    def let(self, number: int) -> None:
        """Let a goal's work end."""
        self.gates.setdefault(str(number), threading.Event()).set()

    def wait_for_work(self, number: int) -> None:
        """Wait until a goal is worked on."""
        wait_until(lambda: str(number) in self.begun, f"work on goal {number}")


def key(number: int):
    """Return the id of a goal."""
    return np.array([number, *[0] * 15], np.uint8)


@pytest.fixture
def bench():
    """One goal may wait."""
    bench = Bench()
    yield bench
    bench.goals.close()


def threads():
    """Return the threads that work on goals."""
    return [thread for thread in threading.enumerate() if thread.name == "goals"]


def test_a_goal_is_worked_on_and_its_result_is_kept(bench):
    """Whoever asks before or after its end gets it; then nothing runs."""
    assert bench.send(1)
    early = bench.ask(1)
    bench.let(1)
    assert bench.result(1) == (GoalStatus.STATUS_SUCCEEDED, "1")
    assert [answer.result.reason for answer in early] == ["1"]
    wait_until(lambda: not threads(), "the end of the thread")
    ways = [states[1] for states in bench.statuses if 1 in states]
    assert ways == sorted(ways)
    assert ways[0] == GoalStatus.STATUS_ACCEPTED
    assert ways[-1] == GoalStatus.STATUS_SUCCEEDED


def test_goals_wait_for_their_turn_and_one_too_many_is_aborted(bench):
    """The second is told that one is before it; the third why it is not taken."""
    for number in (1, 2, 3):
        assert bench.send(number)
        bench.wait_for_work(1)
    assert bench.feedback == [(2, 1)]
    assert bench.result(3) == (GoalStatus.STATUS_ABORTED, "1 wait")
    bench.let(1)
    bench.wait_for_work(2)
    bench.let(2)
    assert bench.result(2) == (GoalStatus.STATUS_SUCCEEDED, "2")
    assert bench.begun == ["1", "2"]


def test_an_id_is_used_once(bench):
    """The same goal sent again is rejected, and goes on."""
    assert bench.send(1)
    assert not bench.send(1)
    bench.let(1)
    assert bench.result(1) == (GoalStatus.STATUS_SUCCEEDED, "1")
    assert not bench.send(1)


def test_a_cancelled_goal_ends(bench):
    """One that is worked on, with what its work says; one that waits, at once."""
    bench.send(1)
    bench.wait_for_work(1)
    bench.send(2)
    response = bench.cancel(key(2).tobytes())
    assert response.return_code == CancelGoal.Response.ERROR_NONE
    assert [int(info.goal_id.uuid[0]) for info in response.goals_canceling] == [2]
    assert bench.result(2) == (GoalStatus.STATUS_CANCELED, "never begun")
    assert len(bench.cancel(key(1).tobytes()).goals_canceling) == 1
    assert bench.result(1) == (GoalStatus.STATUS_CANCELED, "no 1")
    wait_until(lambda: not threads(), "the end of the thread")


def test_all_goals_or_those_up_to_a_time_are_cancelled():
    """The stamps are 1, 2, 3."""
    bench = Bench(most_waiting=5)
    for number in (1, 2, 3):
        bench.send(number)
    bench.wait_for_work(1)
    assert [int(i.goal_id.uuid[0]) for i in bench.cancel(until=2).goals_canceling] == [1, 2]
    bench.wait_for_work(3)
    assert [int(i.goal_id.uuid[0]) for i in bench.cancel().goals_canceling] == [3]
    assert bench.result(3)[0] == GoalStatus.STATUS_CANCELED
    assert not bench.cancel().goals_canceling


def test_what_can_not_be_cancelled_says_why(bench):
    """A goal that nobody sent, and one that has ended."""
    codes = CancelGoal.Response
    assert bench.cancel(key(9).tobytes()).return_code == codes.ERROR_UNKNOWN_GOAL_ID
    bench.send(1)
    bench.let(1)
    bench.result(1)
    assert bench.cancel(key(1).tobytes()).return_code == codes.ERROR_GOAL_TERMINATED


def test_results_of_unknown_goals_are_unknown(bench):
    """At once."""
    assert bench.result(7) == (GoalStatus.STATUS_UNKNOWN, "")


def test_old_results_are_forgotten(monkeypatch):
    """Of more than are kept the oldest; the status has no more either."""
    monkeypatch.setattr(goals_module, "_KEPT_RESULTS", 2)
    bench = Bench()
    for number in range(1, 5):
        bench.send(number)
        bench.let(number)
        bench.result(number)
    bench.send(5)
    bench.let(5)
    assert bench.result(5)[0] == GoalStatus.STATUS_SUCCEEDED
    assert [bench.result(n)[0] == GoalStatus.STATUS_UNKNOWN for n in (1, 2, 3, 4)] == [
        True,
        True,
        True,
        False,
    ]
    monkeypatch.setattr(goals_module, "_KEPT_SECONDS", -1.0)
    assert bench.result(5)[0] == GoalStatus.STATUS_UNKNOWN
    bench.goals.close()


def test_closing_ends_all_goals(bench):
    """Whoever waits for a result is answered, and no goal is taken after that."""
    bench.send(1)
    bench.wait_for_work(1)
    bench.send(2)
    asked = [bench.ask(1), bench.ask(2)]
    closing = threading.Thread(target=bench.goals.close)
    closing.start()
    closing.join(DEADLINE)
    assert [answers[0].status for answers in asked] == [GoalStatus.STATUS_CANCELED] * 2
    wait_until(lambda: not threads(), "the end of the thread")
    assert not bench.send(3)

"""Compiles groups of kernels in processes of their own, and says how far it is."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
import contextlib
from dataclasses import dataclass, field
import queue
import subprocess
import sys
import threading
from typing import NamedTuple

from scene_graph_ros.geometry.compiled.readiness import is_ready, ready_marker
from scene_graph_ros.warmup.groups import KernelGroup, MAIN
from scene_graph_ros.warmup.task import COMPILED, ENDED

__all__ = ["Compiler", "CompilingError", "Progress"]

_TAIL = 20
"""Lines of a process that failed that are shown."""


class CompilingError(RuntimeError):
    """A process that compiles ended early; the message names it, and has its last words."""


class Progress(NamedTuple):
    """Kernels that were compiled, of about so many, and the share of the work, below 1."""

    done: int
    total: int
    share: float


@dataclass(eq=False)
class _Task:
    """A function, as ``module:name``, that is run for a group; a check finds all compiled.

    It begins when the groups of ``after`` are compiled. Its last kernel takes as long as
    ``long_end`` others. Where it ``is_again`` its group was ready before: all such checks are done
    by one process, which has compiled nothing, since imports are most of a check.
    """

    group: str
    function: str
    is_check: bool
    after: tuple[str, ...] = ()
    long_end: int = 0
    is_again: bool = False
    tail: deque[str] = field(default_factory=lambda: deque(maxlen=_TAIL))


class _Line(NamedTuple):
    task: _Task
    text: str
    exit_code: int | None = None
    """0 where the task has ended, though its process goes on."""


@dataclass(eq=False)
class _Worker:
    """A process that does tasks one after the other, and the one that it does now."""

    process: subprocess.Popen[str]
    task: _Task | None

    def give(self, task: _Task) -> None:
        """Have the process do a task; it may be gone, which its end then tells."""
        self.task = task
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(f"{task.function}\n")
            self.process.stdin.flush()


def _next_of(waiting: list[_Task], running: list[_Task]) -> _Task | None:
    """Return the first of the tasks that may begin now, if one may."""
    unfinished = {task.group for task in (*waiting, *running) if not task.is_check}
    checks_again = any(task.is_again for task in running)
    may_begin = (
        task
        for task in waiting
        if unfinished.isdisjoint(task.after) and not (task.is_again and checks_again)
    )
    return next(may_begin, None)


class Compiler:
    """Compiles missing kernels; `run` in one thread, `stop` in any."""

    def __init__(
        self, groups: Iterable[KernelGroup], *, processes: int = 1, niceness: int = 0
    ) -> None:
        """Use at most so many processes at a time, that much nicer than this one."""
        self._groups = tuple(groups)
        self._processes, self._niceness = processes, niceness
        self._lines: queue.SimpleQueue[_Line] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._workers: list[_Worker] = []
        self._idle: list[_Worker] = []
        """Those that have compiled: a check is to find in the cache what others keep there."""
        self._checker: _Worker | None = None
        """The process that checks again, between two checks."""
        self._is_stopped = False
        self._total = 0
        self._compiled = 0
        self._unfinished: list[_Task] = []
        self._ends_left = self._ends = 0
        self._late: list[str] = []

    def run(self, tell: Callable[[Progress], None] = lambda progress: None) -> list[str]:
        """Compile, and mark the groups as ready; ``tell`` is called on each progress.

        Returns the kernels that were compiled after all should have been there: none when all was
        well. Raises CompilingError.
        """
        try:
            self._run_side_by_side(self._tasks(), tell)
        finally:
            self._end_workers()
        for group in self._groups:
            marker = ready_marker(group.name)
            marker.parent.mkdir(parents=True, exist_ok=True)
            marker.touch()
        return self._late

    def stop(self) -> None:
        """End all processes; `run` raises."""
        with self._lock:
            self._is_stopped = True
            for worker in self._workers:
                worker.process.kill()

    def _tasks(self) -> list[_Task]:
        """Return all tasks, in the order in which they begin where they may.

        The base of all other kernels comes first. Beside its last kernels, which take long, go
        tasks that are not built on them, and may go on beside those that are.
        """
        foundation, apart, rest, last = (list[_Task]() for _ in range(4))
        for group in self._groups:
            name, is_main = group.name, group.name == MAIN
            if is_ready(name):
                again = group.checks or group.tasks
                rest += [_Task(name, each, True, (MAIN,), is_again=True) for each in again]
                continue
            self._total += group.kernels
            after = () if is_main or group.is_apart else (MAIN,)
            ends = group.long_ends
            tasks = [_Task(name, f, False, after, ends.get(f, 0)) for f in group.tasks]
            checks = [_Task(name, each, True, (MAIN, name)) for each in group.checks]
            (foundation if is_main else apart if group.is_apart else rest).extend(tasks)
            (rest if is_main else last).extend(checks)
        return [*foundation, *apart, *rest, *last]

    def _run_side_by_side(self, waiting: list[_Task], tell: Callable[[Progress], None]) -> None:
        running: list[_Task] = []
        self._unfinished = [task for task in waiting if not task.is_check]
        self._ends = self._ends_left = sum(task.long_end for task in self._unfinished)
        while waiting or running:
            while len(running) < self._processes:
                task = _next_of(waiting, running)
                if task is None:
                    break
                self._start(task)
                waiting.remove(task)
                running.append(task)
            line = self._lines.get()
            if line.exit_code is None:
                self._read(line)
                tell(self._progress())
            else:
                running.remove(line.task)
                self._require_success(line)
                if not line.task.is_check:
                    self._unfinished.remove(line.task)
                    self._ends_left -= line.task.long_end
                tell(self._progress())

    def _progress(self) -> Progress:
        # Each task that has not ended has at least one kernel to come; then all are known.
        total = self._compiled + len(self._unfinished)
        if self._unfinished:
            total = max(self._total, total)
        left = total - self._compiled + self._ends_left
        return Progress(self._compiled, total, 1.0 - left / max(total + self._ends, 1))

    def _start(self, task: _Task) -> None:
        """Give a task to a process that has done another, or to a new one."""
        with self._lock:
            if self._is_stopped:
                raise CompilingError("compiling was stopped")
            if self._idle and not task.is_check:
                self._idle.pop().give(task)
                return
            if self._checker is not None and task.is_again:
                self._checker.give(task)
                self._checker = None
                return
            module = "scene_graph_ros.warmup.task"
            process = subprocess.Popen(  # noqa: S603
                [sys.executable, "-m", module, str(self._niceness)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is for whoever started it; its end is theirs
                text=True,
                errors="replace",
            )
            worker = _Worker(process, task)
            self._workers.append(worker)
            worker.give(task)
        threading.Thread(target=self._follow, args=(worker,), daemon=True).start()

    def _follow(self, worker: _Worker) -> None:
        process = worker.process
        assert process.stdout is not None
        for text in process.stdout:
            task = worker.task
            if task is None:
                continue
            if text.rstrip() != ENDED:
                self._lines.put(_Line(task, text.rstrip()))
                continue
            worker.task = None
            with self._lock:
                if task.is_again:
                    self._checker = worker
                elif task.is_check:
                    self._end(worker)
                else:
                    self._idle.append(worker)
            self._lines.put(_Line(task, "", 0))
        process.stdout.close()
        exit_code = process.wait()
        with self._lock:
            self._workers.remove(worker)
            if worker in self._idle:
                self._idle.remove(worker)
            if worker is self._checker:
                self._checker = None
            if worker.task is not None:
                self._lines.put(_Line(worker.task, "", exit_code))

    @staticmethod
    def _end(worker: _Worker) -> None:
        """Have a process end, which it does with its standard input."""
        assert worker.process.stdin is not None
        with contextlib.suppress(OSError):
            worker.process.stdin.close()

    def _end_workers(self) -> None:
        with self._lock:
            workers = list(self._workers)
        for worker in workers:
            self._end(worker)
        for worker in workers:
            worker.process.wait()

    def _read(self, line: _Line) -> None:
        task, text = line.task, line.text
        if text.startswith(COMPILED):
            self._compiled += 1
            if task.is_check:
                self._late.append(text.removeprefix(COMPILED))
        else:
            task.tail.append(text)

    def _require_success(self, line: _Line) -> None:
        if line.exit_code == 0:
            return
        self.stop()
        said = "\n".join(line.task.tail)
        raise CompilingError(
            f"compiling {line.task.group!r} with {line.task.function} ended with exit code "
            f"{line.exit_code}{':' if said else ''}\n{said}".rstrip()
        )

"""Steps of the set-up: what is done already is skipped, what runs shows that it moves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
import hashlib
import os
from pathlib import Path
import subprocess
import sys
import threading
import time

__all__ = ["Setup", "SetupError", "digest"]

QUIET_SECONDS = 10.0  # between two signs of life, unless there is a terminal to write over
TERMINAL_SECONDS = 1.0
TAIL_LINES = 30  # of a failed command's output that are shown


class SetupError(Exception):
    """Something is missing or failed; the message says what, and the remedy."""


def digest(paths: Iterable[Path], *more: str) -> str:
    """Hash the files at ``paths`` (folders are walked), their names, and the strings ``more``."""
    result = hashlib.blake2b(digest_size=16)
    for text in more:
        result.update(text.encode() + b"\0")
    for path in paths:
        if not path.exists():
            raise SetupError(f"{path} is missing from the checkout. Remedy: git checkout {path}")
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in files:
            if "__pycache__" not in file.parts:
                result.update(f"{file.relative_to(path.parent)}\0".encode())
                result.update(file.read_bytes())
    return result.hexdigest()


class _Step:
    """A step that runs: what is said of it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.start = time.monotonic()
        self.last_line = ""

    @property
    def seconds(self) -> float:
        """How long it has been running."""
        return time.monotonic() - self.start


class Setup:
    """Runs steps and remembers in ``state`` which ones are done."""

    def __init__(self, state: Path, count: int) -> None:
        self._state = state
        self._count = count
        self._lock = threading.RLock()
        self._ended = 0
        self._running: list[_Step] = []
        self._processes: set[subprocess.Popen[str]] = set()
        self._mine = threading.local()
        self._is_stopped = False
        self._is_terminal = sys.stdout.isatty()

    def step(
        self, name: str, key: str, products: Sequence[Path], action: Callable[[], None]
    ) -> None:
        """Call ``action``, unless it was done for this ``key`` and its products still exist."""
        step = self._mine.step = _Step(name)
        stamp = self._state / "stamps" / name.replace(" ", "_")
        if stamp.is_file() and stamp.read_text() == key and all(p.exists() for p in products):
            self._print(step, "ready")
            return
        stamp.unlink(missing_ok=True)
        finished = threading.Event()
        watcher = threading.Thread(target=self._watch, args=(step, finished), daemon=True)
        self._running.append(step)
        watcher.start()
        try:
            action()
        finally:
            finished.set()
            watcher.join()
            self._running.remove(step)
        missing = [str(p) for p in products if not p.exists()]
        if missing:
            raise SetupError(f"step '{name}' ended without making {', '.join(missing)}")
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.write_text(key)
        self._print(step, f"done in {step.seconds:.1f} s")

    def side_by_side(self, *chains: Callable[[], None]) -> None:
        """Call functions that make steps at the same time; the first that fails ends the others.

        For steps that do not keep all processors busy.
        """
        with ThreadPoolExecutor(len(chains)) as pool:
            futures = [pool.submit(chain) for chain in chains]
            done, _ = wait(futures, return_when=FIRST_EXCEPTION)
            failed = [future for future in done if future.exception() is not None]
            if failed:
                self._stop()
        for future in failed:
            future.result()

    @property
    def is_stopped(self) -> bool:
        """Whether another step failed, so that no other command begins."""
        return self._is_stopped

    def _stop(self) -> None:
        """End the commands that run; no other begins."""
        with self._lock:
            self._is_stopped = True
            for process in self._processes:
                process.terminate()

    def run(self, command: Sequence[str | Path], env: Mapping[str, str] | None = None) -> None:
        """Run a command of the present step; its output goes to a log, shown if it fails."""
        step: _Step = self._mine.step
        log = self._state / "log" / f"{step.name.replace(' ', '_')}.txt"
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a" if log.exists() and step.last_line else "w") as output:
            process = self._start(command, env)
            assert process.stdout is not None
            for line in process.stdout:
                output.write(line)
                if not line.startswith("WARNING"):  # it is in the log; here one sees what goes on
                    step.last_line = line.strip() or step.last_line
        exit_code = process.wait()
        with self._lock:
            self._processes.discard(process)
        if exit_code != 0:
            tail = "\n".join(log.read_text().splitlines()[-TAIL_LINES:])
            raise SetupError(
                f"step '{step.name}' failed (exit code {exit_code}): "
                f"{' '.join(map(str, command))}\n{tail}\nThe whole output is in {log}"
            )

    def _start(
        self, command: Sequence[str | Path], env: Mapping[str, str] | None
    ) -> subprocess.Popen[str]:
        with self._lock:
            if self._is_stopped:
                raise SetupError("another step failed")
            process = subprocess.Popen(
                [str(part) for part in command],
                env=dict(os.environ if env is None else env),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,  # universal newlines: a progress bar's carriage return ends a line too
                errors="replace",
            )
            self._processes.add(process)
        return process

    def _watch(self, step: _Step, finished: threading.Event) -> None:
        """Tell about a long step, now and then."""
        while not finished.wait(TERMINAL_SECONDS if self._is_terminal else QUIET_SECONDS):
            self._print(step, f"{step.seconds:.0f} s: {step.last_line}", is_last=False)

    def _print(self, step: _Step, text: str, *, is_last: bool = True) -> None:
        line = f"{step.name}: {text}"
        with self._lock:
            if is_last:
                # Steps count as they end: several run at once.
                self._ended += 1
                line = f"[{self._ended}/{self._count}] {line}"
            if not self._is_terminal:
                print(line[:150], flush=True)
                return
            width = max(os.get_terminal_size(sys.stdout.fileno()).columns - 1, 20)
            if not is_last:
                # All that run share the one line that is written over.
                running = list(self._running)
                share = width // max(len(running), 1)
                line = "".join(
                    f"{each.name}: {each.seconds:.0f} s: {each.last_line}"[: share - 1].ljust(
                        share
                    )
                    for each in running
                )
            print(f"\r\033[K{line[:width]}", end="\n" if is_last else "", flush=True)

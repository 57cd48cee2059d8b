"""Steps of the set-up: what is done already is skipped, what runs shows that it moves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
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


class Setup:
    """Runs steps one after the other and remembers in ``state`` which ones are done."""

    def __init__(self, state: Path, count: int) -> None:
        self._state = state
        self._count = count
        self._index = 0
        self._name = ""
        self._start = 0.0
        self._last_line = ""
        self._is_terminal = sys.stdout.isatty()

    def step(
        self, name: str, key: str, products: Sequence[Path], action: Callable[[], None]
    ) -> None:
        """Call ``action``, unless it was done for this ``key`` and its products still exist."""
        self._index += 1
        self._name, self._start, self._last_line = name, time.monotonic(), ""
        stamp = self._state / "stamps" / name.replace(" ", "_")
        if stamp.is_file() and stamp.read_text() == key and all(p.exists() for p in products):
            self._print("ready")
            return
        stamp.unlink(missing_ok=True)
        finished = threading.Event()
        watcher = threading.Thread(target=self._watch, args=(finished,), daemon=True)
        watcher.start()
        try:
            action()
        finally:
            finished.set()
            watcher.join()
        missing = [str(p) for p in products if not p.exists()]
        if missing:
            raise SetupError(f"step '{name}' ended without making {', '.join(missing)}")
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.write_text(key)
        self._print(f"done in {time.monotonic() - self._start:.1f} s")

    def run(self, command: Sequence[str | Path], env: Mapping[str, str] | None = None) -> None:
        """Run a command of the present step; its output goes to a log, shown if it fails."""
        log = self._state / "log" / f"{self._name.replace(' ', '_')}.txt"
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a" if log.exists() and self._last_line else "w") as output:
            process = subprocess.Popen(
                [str(part) for part in command],
                env=dict(os.environ if env is None else env),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,  # universal newlines: a progress bar's carriage return ends a line too
                errors="replace",
            )
            assert process.stdout is not None
            for line in process.stdout:
                output.write(line)
                if not line.startswith("WARNING"):  # it is in the log; here one sees what goes on
                    self._last_line = line.strip() or self._last_line
        if process.wait() != 0:
            tail = "\n".join(log.read_text().splitlines()[-TAIL_LINES:])
            raise SetupError(
                f"step '{self._name}' failed (exit code {process.returncode}): "
                f"{' '.join(map(str, command))}\n{tail}\nThe whole output is in {log}"
            )

    def _watch(self, finished: threading.Event) -> None:
        """Tell about a long step, now and then."""
        while not finished.wait(TERMINAL_SECONDS if self._is_terminal else QUIET_SECONDS):
            self._print(
                f"{time.monotonic() - self._start:.0f} s: {self._last_line}", is_last=False
            )

    def _print(self, text: str, *, is_last: bool = True) -> None:
        line = f"[{self._index}/{self._count}] {self._name}: {text}"
        if self._is_terminal:
            width = os.get_terminal_size(sys.stdout.fileno()).columns
            print(f"\r\033[K{line[: max(width - 1, 20)]}", end="\n" if is_last else "", flush=True)
        else:
            print(line[:150], flush=True)

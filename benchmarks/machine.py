"""What one has to know about the machine that times were taken on."""

from __future__ import annotations

import os
from pathlib import Path
import platform
import time

__all__ = ["machine"]


def machine(load: float) -> str:
    """Return date, processors, Python and the ``load`` when the run began, in one line."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = names[0].partition(":")[2].strip() if names else model
    return (
        f"Measured on {time.strftime('%Y-%m-%d')}: {os.cpu_count()} processors ({model}), load"
        f" {load:.1f} at the start, Python {platform.python_version()}.\n"
    )

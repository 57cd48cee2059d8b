"""Whether there is a folder for the log, without which ROS does not start."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["log_problem"]


def log_problem() -> str:
    """Say why ROS could not write its log, with the remedy; "" where it can.

    The folder is ROS_LOG_DIR, else log in ROS_HOME, by default ~/.ros. It is made.
    """
    remedy = "name a folder that can be written to in ROS_LOG_DIR"
    told, home = os.environ.get("ROS_LOG_DIR"), os.environ.get("ROS_HOME")
    if not told and not home and not os.environ.get("HOME"):
        return f"there is no folder for the log, as HOME is empty: {remedy}"
    folder = Path(told) if told else Path(home or "~/.ros") / "log"
    try:
        folder = folder.expanduser()
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError) as error:
        return f"the folder {str(folder)!r} for the log can't be made: {error}; {remedy}"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"the folder {str(folder)!r} for the log can't be written to: {remedy}"
    return ""

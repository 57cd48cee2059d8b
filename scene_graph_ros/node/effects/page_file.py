"""A file that opens the page with its token, for the user of the node alone.

A token in a log, on a command line or in an answer about parameters is read by others. So it is in
a file, and the log says where that is.
"""

from __future__ import annotations

import html
import os
from pathlib import Path
import secrets
import stat

from rclpy.logging import get_logging_directory

__all__ = ["write_page_file"]

_FOLDER = "scene_graph_ros"

_PAGE = """<!doctype html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<title>The view in a browser</title>
<meta http-equiv="refresh" content="0; url={link}">
<a href="{link}">The view in a browser</a>
"""


def write_page_file(link: str) -> Path:
    """Write a page that leads to ``link``, which nobody else may read; return its path.

    Raises OSError where there is no folder of the node's user for it.
    """
    folder = _folder()
    path = folder / f"page-{os.getpid()}-{secrets.token_hex(4)}.html"
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    with os.fdopen(os.open(path, flags, 0o600), "w", encoding="utf-8") as file:
        file.write(_PAGE.format(link=html.escape(link)))
    return path


def _folder() -> Path:
    """Return a folder that is the user's own: where sessions keep such things, or of logs."""
    told = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(told) / _FOLDER if told else Path(str(get_logging_directory())) / _FOLDER
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = folder.lstat()
    is_own = stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid()
    if not is_own or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise OSError(
            f"folder {str(folder)!r} for the page's token is not the node user's, or others may"
            " write to it: name another one in XDG_RUNTIME_DIR"
        )
    return folder

"""The socket that the view listens on: how fast connections come in, and without file handles."""

from __future__ import annotations

from collections.abc import Callable
import errno
import os
import resource
import socket
import time
from typing import Any

from scene_graph_ros.views.browser.allowance import Allowance

__all__ = ["Listener", "listen"]

_PER_SECOND, _AT_ONCE = 20.0, 200.0
"""Connections of one address. A browser opens about a dozen when it loads the page."""

_REFUSED_AT_ONCE = 64
"""Connections over the rate that are closed before all of them have to wait."""

_PAUSE = 0.9
"""Seconds without connections. asyncio listens again a second after an error of this kind."""

_MOST_ADDRESSES = 1024

_NO_HANDLES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
"""For which asyncio pauses, instead of trying again at once."""

_RESERVED = 16
"""File handles that connections leave to the others in the process, which read files, too."""

_SEND_BUFFER = 1 << 18
"""Bytes that the system keeps for a page: what a slow page is behind."""


class Listener(socket.socket):
    """Accepts connections at a rate for each address, and pauses where there are too many."""

    def __init__(self, *arguments: Any) -> None:
        """Take the arguments of a socket."""
        super().__init__(*arguments)
        self._rates: dict[str, Allowance] = {}
        self._again = float("-inf")
        self.refused = 0
        """Connections that were closed at once, as their address had too many."""
        self.no_handles: Callable[[OSError], None] = lambda error: None
        """Called with the error where too few file handles are left for one more."""

    def accept(self) -> tuple[socket.socket, Any]:
        """Do as a socket; raises BlockingIOError while there is a pause."""
        if time.monotonic() < self._again:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        for _ in range(_REFUSED_AT_ONCE):
            try:
                connection, address = super().accept()
            except OSError as error:
                if error.errno in _NO_HANDLES:
                    self._pause(error)
                raise
            if connection.fileno() >= resource.getrlimit(resource.RLIMIT_NOFILE)[0] - _RESERVED:
                connection.close()
                few = OSError(errno.EMFILE, os.strerror(errno.EMFILE))
                self._pause(few)
                raise few
            if not self._rate_of(address[0]).is_used_up():
                return connection, address
            self.refused += 1
            connection.close()
        self._again = time.monotonic() + _PAUSE
        raise OSError(errno.ENOBUFS, "too many connections")

    def _pause(self, error: OSError) -> None:
        self._again = time.monotonic() + _PAUSE
        self.no_handles(error)

    def _rate_of(self, address: str) -> Allowance:
        rate = self._rates.get(address)
        if rate is None:
            if len(self._rates) >= _MOST_ADDRESSES:
                del self._rates[next(iter(self._rates))]
            rate = self._rates[address] = Allowance(_PER_SECOND, _AT_ONCE)
        return rate


def listen(host: str, port: int) -> Listener:
    """Return a socket that listens; raises OSError where that can't be."""
    family, kind, protocol, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    listener = Listener(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # Accepted connections inherit it.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        listener.bind(address)
        # What connects before the server's thread is there waits for it.
        listener.listen()
    except OSError:
        listener.close()
        raise
    return listener

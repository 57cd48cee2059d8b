"""Access to the page: which requests are answered, and how.

A page of another site must not read the scene in its visitor's browser. Such a page can connect to
this machine, but it can't lie about its ``Origin``. Where it has its own name point here (DNS
rebinding), the ``Host`` is that name. So a host has to be an address, ``localhost`` or the name
that was configured, and an origin the same host and port.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
import hmac
from http import HTTPStatus
from importlib import resources
import ipaddress
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

from scene_graph_ros.views.browser.policy import policy

__all__ = ["SOCKET_PATH", "Answer", "Gate"]

SOCKET_PATH = "/scene"
"""Where a page connects."""

OTHERS_PATH = "/"
"""Where clients connect that are told an address without a path."""

_TYPES = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
}

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": (
        f"{policy('self', 'self', connect='self')}; frame-ancestors 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""The page loads nothing from elsewhere, and is shown and read by nothing from elsewhere."""


class Answer(NamedTuple):
    """The answer to a request."""

    status: HTTPStatus
    type: str
    body: bytes

    def headers(self) -> dict[str, str]:
        """Return the headers that go with it."""
        length = {"Content-Length": str(len(self.body)), "Connection": "close"}
        return {**_HEADERS, "Content-Type": self.type, **length}


def _refusal(status: HTTPStatus, reason: str) -> Answer:
    return Answer(status, "text/plain; charset=utf-8", f"{reason}\n".encode())


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


class Gate:
    """Answers requests by their path and headers."""

    def __init__(
        self,
        host: str,
        token: str,
        origins: Iterable[str] = (),
        refused: Callable[[str], None] = lambda origin: None,
    ) -> None:
        """``host`` is the name or address that was configured; a ``token`` of "" asks for none.

        Pages of ``origins`` may connect, too; ``refused`` is called with another page's.
        """
        self._names = {"localhost", host.lower()}
        self._token = token
        self._origins, self._refused = {origin.lower() for origin in origins}, refused
        page = resources.files(__package__) / "page"
        self._files = {
            f"/{file.name}": Answer(
                HTTPStatus.OK, _TYPES[file.name.rsplit(".")[-1]], file.read_bytes()
            )
            for file in page.iterdir()
        }
        self._files["/"] = self._files["/index.html"]

    def answer(
        self, target: str, host: str, origin: str | None, *, is_other: bool = False
    ) -> Answer | None:
        """Return the answer to a request, None where it may connect.

        ``target`` is the path with its query, ``host`` and ``origin`` are the headers. A
        client that ``is_other`` than the page asks for the address itself.
        """
        nothing = _refusal(HTTPStatus.NOT_FOUND, "There is nothing here.")
        if not self._is_ours(host):
            return _refusal(
                HTTPStatus.MISDIRECTED_REQUEST,
                "Host is neither an address, localhost nor browser_host.",
            )
        try:
            parts = urlsplit(target)
        except ValueError:
            return nothing
        if parts.path not in (SOCKET_PATH, OTHERS_PATH)[: 1 + is_other]:
            return self._files.get(parts.path, nothing)
        if not self._may_read(origin, host):
            return _refusal(HTTPStatus.FORBIDDEN, "Pages from elsewhere may not read this.")
        if not self._has_token(parts.query):
            return _refusal(HTTPStatus.FORBIDDEN, "The address lacks ?token= and browser_token.")
        return None

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname
        except ValueError:
            return False
        return name is not None and (name in self._names or _is_address(name))

    def _may_read(self, origin: str | None, host: str) -> bool:
        if origin is None or _is_same_origin(origin, host) or origin.lower() in self._origins:
            return True
        self._refused(origin)
        return False

    def _has_token(self, query: str) -> bool:
        given = parse_qs(query).get("token", [""])[-1]
        return hmac.compare_digest(given.encode(), self._token.encode()) or not self._token


def _is_same_origin(origin: str, host: str) -> bool:
    """Tell whether a page comes from the host that it asks, also by way of a proxy with TLS."""
    scheme, separator, rest = origin.partition("://")
    return bool(separator) and scheme in ("http", "https") and rest.lower() == host.lower()

"""One question to a render server: a form by POST, and its answer, both within a time."""

from __future__ import annotations

from collections.abc import Mapping
import hashlib
import http.client
import time
import urllib.parse

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["checked_url", "post"]

_PART = 2**16
_BOUNDARY = "scene-graph-ros-"
_MOST_TEXT = 2000
"""Bytes of what a server says of an error."""


def checked_url(base_url: object, render_endpoint: object) -> urllib.parse.SplitResult:
    """Return the checked address. Raises EngineError unless it is that of an HTTP server."""
    try:
        if not isinstance(base_url, str) or not isinstance(render_endpoint, str):
            raise ValueError("must be text")  # noqa: TRY004 - it becomes an EngineError
        parts = urllib.parse.urlsplit(f"{base_url.rstrip('/')}/{render_endpoint.lstrip('/')}")
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError("must begin with http:// or https:// and a host")
        if parts.username or parts.query or parts.fragment:
            raise ValueError("must have no user, query or fragment")
        if not parts.geturl().isascii() or any(c <= " " for c in parts.geturl()):
            raise ValueError("must be of printable ASCII characters")
        _ = parts.port  # raises for one that is none
    except ValueError as error:
        raise EngineError(
            f"GltfClientRenderEngine: base_url and render_endpoint: {error}, not"
            f" {quoted(base_url)} and {quoted(render_endpoint)}"
        ) from error
    return parts


def post(
    url: urllib.parse.SplitResult,
    fields: Mapping[str, str],
    scene: bytes,
    timeout: float,
    limit: int,
) -> bytes:
    """Return a server's answer to a form with a scene, of at most ``limit`` bytes.

    All of it is done within ``timeout`` seconds. Raises EngineError, with the address and the
    server's text, for an answer that tells of an error, is too large or too late, or for none.
    """
    end = time.monotonic() + timeout
    digest = hashlib.sha256(scene).hexdigest()
    boundary = _BOUNDARY + digest[:32]
    body = _form({**fields, "scene_sha256": digest}, scene, boundary)
    kind = http.client.HTTPSConnection if url.scheme == "https" else http.client.HTTPConnection
    connection = kind(str(url.hostname), url.port, timeout=timeout)
    try:
        headers = {"Content-Type": f"multipart/form-data; boundary={boundary}"}
        connection.request("POST", url.path, body, headers)
        _limit_wait(connection, end)
        answer = connection.getresponse()
        parts, size = [], 0
        while size <= limit and (part := answer.read1(_PART)):
            parts.append(part)
            size += len(part)
            _limit_wait(connection, end)
        contents = b"".join(parts)
    except (OSError, http.client.HTTPException) as error:
        raise EngineError(f"render server {url.geturl()}: {_reason(error, timeout)}") from error
    finally:
        connection.close()
    if not 200 <= answer.status < 400:
        text = quoted(contents[:_MOST_TEXT].decode(errors="replace").strip())
        raise EngineError(
            f"render server {url.geturl()}: status {answer.status} {answer.reason}: {text}"
        )
    if size > limit:
        raise EngineError(f"render server {url.geturl()}: its answer has more than {limit} bytes")
    return contents


def _limit_wait(connection: http.client.HTTPConnection, end: float) -> None:
    """Have the next bytes come before the end. Raises TimeoutError if it is over."""
    left = end - time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    if connection.sock is not None:
        connection.sock.settimeout(left)


def _reason(error: Exception, timeout: float) -> str:
    if isinstance(error, TimeoutError):
        return f"no answer within {timeout:g} s"
    return str(error) or type(error).__name__


def _form(fields: Mapping[str, str], scene: bytes, boundary: str) -> bytes:
    """Return a form as multipart/form-data (RFC 7578), with the scene as a file."""
    parts = []
    for name, value in fields.items():
        head = f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n'
        parts.append(f"{head}{value}\r\n".encode())
    head = (
        f'--{boundary}\r\nContent-Disposition: form-data; name="scene"; filename="scene.gltf"\r\n'
        "Content-Type: model/gltf+json\r\n\r\n"
    )
    return b"".join([*parts, head.encode(), scene, f"\r\n--{boundary}--\r\n".encode()])

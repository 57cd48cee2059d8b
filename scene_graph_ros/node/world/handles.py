"""Handles: rights to change a source, and how a handle gets to its owner. No rclpy.

Tokens are in no scene's text, log, diagnostics, parameter or recording: nothing of this shows one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import enum
from pathlib import Path
import secrets

from scene_graph_ros.geometry.files import make_private, read_private
from scene_graph_ros.located import SceneFileError

__all__ = ["Claim", "Handle", "new_token", "token_of_file"]

_MOST_BYTES = 64
"""Of a file with a token, which has 20 digits and the end of a line."""

_LARGEST = 2**64 - 1


class Claim(enum.Enum):
    """Whether a request by name alone gets the handle of a source."""

    CLOSED = "nobody gets it"
    OPEN = "the first who asks gets it"
    TAKEN = "the first who asked has it"


@dataclass(frozen=True)
class Handle:
    """The right to change a source, which requests have to carry."""

    token: int = field(repr=False)
    claim: Claim = Claim.CLOSED

    def taken(self, token: int) -> Handle:
        """Return the handle once it was claimed, with the claimer's token or, for 0, its own."""
        return replace(self, token=token or self.token, claim=Claim.TAKEN)


def new_token() -> int:
    """Return a random non-zero token of 64 bits."""
    return secrets.randbits(64) or 1


def token_of_file(path: Path, folder: Path) -> int:
    """Return the token in a file of the node's user, made where there is none.

    With links followed it lies below ``folder``. Raises SceneFileError, which shows no token.
    """
    try:
        try:
            text = read_private(path, folder, _MOST_BYTES)
        except FileNotFoundError:
            token = new_token()
            try:
                make_private(path, folder, f"{token}\n".encode())
            except FileExistsError:  # another node has made it meanwhile
                text = read_private(path, folder, _MOST_BYTES)
            else:
                return token
    except OSError as error:
        reason = error.strerror or str(error)
        raise SceneFileError(f"token_file {str(path)!r} can't be used: {reason}") from error
    digits = text.strip()
    token = int(digits) if digits.isdigit() else 0
    if not 0 < token <= _LARGEST:
        raise SceneFileError(
            f"token_file {str(path)!r} must hold a number from 1 to {_LARGEST}; without the file"
            " the node makes one"
        )
    return token

"""The content security policies of the live page, and of one in a file."""

from __future__ import annotations

import base64
import hashlib

__all__ = ["hash_of", "policy"]


def policy(script: str, style: str, *, connect: str = "none") -> str:
    """Return a Content-Security-Policy, by the sources of scripts, styles and connections.

    Each is a word as the policy has it in quotation marks: ``self``, ``none``, ``sha256-...``.
    """
    return (
        f"default-src 'none'; script-src '{script}'; style-src '{style}'; "
        f"connect-src '{connect}'; img-src data:; base-uri 'none'; form-action 'none'"
    )


def hash_of(text: str) -> str:
    """Return the word for a script or style that stands in the page, and is exactly this."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"

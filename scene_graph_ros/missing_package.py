"""The sentence about an optional package that is not installed, with its remedy."""

from __future__ import annotations

__all__ = ["not_installed"]


def not_installed(use: str, requirement: str) -> str:
    """Return the sentence: the use, the package that it takes, and the command that installs it.

    ``requirement`` is the package's name, or has its version behind it as pip reads it.
    """
    package = requirement.partition("==")[0]
    return f"{use} takes the package {package}, which is not installed: pip install {requirement}"

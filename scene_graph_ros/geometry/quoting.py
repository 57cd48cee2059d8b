"""How messages quote a value."""

__all__ = ["quoted"]

_LONGEST = 100


def quoted(value: object) -> str:
    """Return a value's ``repr``, cut where it is long: a message is to be read."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no integers of more than 4300 digits
        text = f"<{type(value).__name__} of too many digits>"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."

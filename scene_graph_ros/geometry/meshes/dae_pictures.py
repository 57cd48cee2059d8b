"""How the addresses of a COLLADA file's pictures come through trimesh, which wants to open them.

trimesh asks a resolver for each picture's file and keeps Pillow's image of it. It is given a
picture of one pixel that has the address written into it, so that no file is opened here.
"""

from __future__ import annotations

import io
from typing import Any

__all__ = ["AddressResolver", "address_of"]

_KEY = "address"


class AddressResolver:
    """The resolver that trimesh asks for files by their addresses."""

    def __init__(self) -> None:
        """Begin without having been asked for any."""
        self.was_asked = False

    def get(self, address: str) -> bytes:
        """Return a PNG file of one pixel, with the address."""
        self.was_asked = True
        from PIL import Image
        from PIL.PngImagePlugin import PngInfo

        told = PngInfo()
        told.add_itxt(_KEY, address)
        file = io.BytesIO()
        Image.new("RGB", (1, 1)).save(file, "PNG", pnginfo=told)
        return file.getvalue()


def address_of(picture: Any) -> str | None:
    """Return the address in a picture that an AddressResolver gave, None for any other."""
    return getattr(picture, "info", {}).get(_KEY)

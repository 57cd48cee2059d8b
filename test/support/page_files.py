"""A page with a time line in one file, read in Python."""

from __future__ import annotations

import base64
import json
import re
import zlib

from browser_page import PageClient

__all__ = ["FileReader"]


class FileReader(PageClient):
    """What the page in a file knows at one of its moments."""

    def __init__(self, html):
        text = re.search(r'<script type="application/json" id="recording">(.*?)</script>', html)[1]
        self.content = json.loads(text)
        self.data = zlib.decompress(base64.b64decode(self.content["data"]), 31)

    def message(self, numbers):
        """Return a message, put together again."""
        begins = self.content["begins"]
        return b"".join(self.data[begins[n] : begins[n + 1]] for n in numbers)

    def go(self, index):
        """Begin at the last whole moment before that one."""
        self.forget()
        begin = max(int(k) for k in self.content["wholes"] if int(k) <= index)
        self.learn(self.message(self.content["wholes"][str(begin)]))
        for numbers in self.content["changes"][begin + 1 : index + 1]:
            self.learn(self.message(numbers))

"""Chromium without a window, driven by its own protocol: opens a page and looks at its picture."""

from __future__ import annotations

import base64
from contextlib import ExitStack
import itertools
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import tempfile
import time
from typing import Any
from urllib.request import urlopen

import numpy as np
from numpy.typing import NDArray
from websockets.sync.client import connect

__all__ = ["REMEDY", "Tab", "find_chromium"]

REMEDY = "no Chromium is installed. Remedy: apt-get install chromium"
DEADLINE = 90.0
"""Seconds: it starts in one or two, and draws by software, on a busy machine slowly."""

_FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--no-first-run",
    "--remote-debugging-port=0",
)

_PIXELS = """async (data) => {
  const image = new Image();
  image.src = `data:image/png;base64,${data}`;
  await image.decode();
  const { width, height } = image;
  const context = new OffscreenCanvas(width, height).getContext("2d");
  context.drawImage(image, 0, 0);
  const bytes = context.getImageData(0, 0, width, height).data;
  let text = "";
  for (let k = 0; k < bytes.length; k += 32768) {
    text += String.fromCharCode(...bytes.subarray(k, k + 32768));
  }
  return [height, width, btoa(text)];
}"""


def find_chromium() -> str | None:
    """Return the command that starts it, None where there is none."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next(filter(None, map(shutil.which, names)), None)


class Tab:
    """One page in a browser of its own."""

    def __init__(self, width: int, height: int) -> None:
        command = find_chromium()
        assert command, REMEDY
        self._stack = ExitStack()
        self.problems: list[str] = []
        """What the page complained about: errors, and what it could not load."""
        self._numbers = itertools.count(1)
        # Its helpers may write there for a moment after all have been killed.
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
        size = f"--window-size={width},{height}"
        process = subprocess.Popen(
            [command, *_FLAGS, size, f"--user-data-dir={folder}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._stack.callback(process.wait)
        self._stack.callback(os.killpg, process.pid, signal.SIGKILL)
        port = self._wait_for_port(Path(folder) / "DevToolsActivePort")
        with urlopen(f"http://127.0.0.1:{port}/json") as answer:
            pages = [target for target in json.load(answer) if target["type"] == "page"]
        self._socket = self._stack.enter_context(
            connect(pages[0]["webSocketDebuggerUrl"], max_size=None, max_queue=None, proxy=None)
        )
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._ask(f"{domain}.enable")
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._ask("Emulation.setDeviceMetricsOverride", **metrics)

    @staticmethod
    def _wait_for_port(path: Path) -> str:
        end = time.monotonic() + DEADLINE
        while not path.exists() or not (lines := path.read_text().splitlines()):
            assert time.monotonic() < end, "Chromium does not start"
            time.sleep(0.02)
        return lines[0]

    def close(self) -> None:
        """End the browser."""
        self._stack.close()

    def _ask(self, method: str, **parameters: Any) -> Any:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=DEADLINE))
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        kind, content = message.get("method"), message.get("params", {})
        if kind == "Runtime.exceptionThrown":
            self.problems.append(content["exceptionDetails"]["exception"]["description"])
        elif kind == "Log.entryAdded" and content["entry"]["level"] == "error":
            self.problems.append(f"{content['entry']['text']} {content['entry'].get('url')}")
        elif kind == "Runtime.consoleAPICalled" and content["type"] in ("error", "warning"):
            self.problems.append(str(content["args"]))

    def open(self, address: str) -> None:
        """Go to an address."""
        self._ask("Page.navigate", url=address)

    def value(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        answer = self._ask("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def _value_of_any_page(self, expression: str) -> Any:
        """Return the value, None where the page is left meanwhile."""
        try:
            return self.value(expression)
        except AssertionError as error:
            if "navigated or closed" not in str(error):
                raise
            return None

    def wait_for(self, expression: str) -> Any:
        """Wait until an expression is true in the page, and return what it is."""
        end = time.monotonic() + DEADLINE
        while not (result := self._value_of_any_page(expression)):
            assert time.monotonic() < end, f"not in time: {expression}; {self.problems}"
            time.sleep(0.02)
        return result

    def press(self, x: float, y: float, *, to: tuple[float, float] | None = None) -> None:
        """Click somewhere, or drag from there."""
        button = {"button": "left", "clickCount": 1}
        self._ask("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **button)
        if to is not None:
            x, y = to
            moved = {"button": "left", "buttons": 1}
            self._ask("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, **moved)
        self._ask("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, **button)

    def touch(self, x: float, y: float, *, to: tuple[float, float]) -> None:
        """Drag with a finger."""
        for kind, points in (
            ("touchStart", [{"x": x, "y": y}]),
            ("touchMove", [{"x": to[0], "y": to[1]}]),
            ("touchEnd", []),
        ):
            self._ask("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def key(self, name: str) -> None:
        """Press a key that writes nothing."""
        for kind in ("rawKeyDown", "keyUp"):
            self._ask("Input.dispatchKeyEvent", type=kind, key=name)

    def picture(self) -> NDArray[np.uint8]:
        """Return what is seen: ``(height, width, 4)``."""
        data = self._ask("Page.captureScreenshot", format="png")["data"]
        # The browser reads its own format.
        answer = self._ask(
            "Runtime.evaluate",
            expression=f"({_PIXELS})('{data}')",
            awaitPromise=True,
            returnByValue=True,
        )
        height, width, pixels = answer["result"]["value"]
        return np.frombuffer(base64.b64decode(pixels), np.uint8).reshape(height, width, 4)

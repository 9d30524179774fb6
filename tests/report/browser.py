"""Debian's Chromium without a window, driven by the DevTools protocol over pipes: no driver to install."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from select import select
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PATIENCE_S = 60.0
LOOK_S = 0.05
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--no-first-run",
    # whatever asks for a name gets none
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--remote-debugging-pipe",
)

# where the protocol looks for its pipes
_AT_THREE_AND_FOUR = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.dup2(int(sys.argv[2]), 4)
os.execv(sys.argv[3], sys.argv[3:])
"""


class BrowserError(AssertionError):
    """The browser says no, or does not answer."""


@dataclass
class Page:
    """A page that is open in the browser.

    Attributes
    ----------
    messages : list of str
        Errors and warnings of the console, uncaught exceptions, and what the content policy refused.
    requests : list of str
        Addresses that were asked for, ``data:`` and what the content policy refused left out.
    """

    browser: Browser
    session: str
    messages: list[str] = field(default_factory=list)
    asked: dict[str, str] = field(default_factory=dict)
    loaded: bool = False

    @property
    def requests(self) -> list[str]:
        return list(self.asked.values())

    def open(self, address: str) -> None:
        """Go to an address and wait until it is loaded."""
        self.loaded = False
        self.messages.clear()
        self.asked.clear()
        self.browser.call("Page.navigate", {"url": address}, self.session)
        self._await_load(address)

    def follow(self, link: str) -> None:
        """Click on the link that a selector finds, and wait until its page is loaded."""
        self.loaded = False
        self.evaluate(f"document.querySelector({json.dumps(link)}).click()")
        self._await_load(f"what {link} leads to")

    def _await_load(self, what: str) -> None:
        self.browser.wait(lambda: self.loaded, f"{what} is not loaded")
        # drawing goes on after loading
        self.evaluate("new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r(1))))")

    def evaluate(self, expression: str) -> Any:
        """Value of a JavaScript expression; a promise is waited for."""
        answer = self.browser.call(
            "Runtime.evaluate",
            {"expression": expression, "returnByValue": True, "awaitPromise": True},
            self.session,
        )
        if "exceptionDetails" in answer:
            raise BrowserError(json.dumps(answer["exceptionDetails"])[:800])
        return answer["result"].get("value")

    def resize(self, width: int, height: int, *, phone: bool = False) -> None:
        """Give the page another size."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone}
        self.browser.call("Emulation.setDeviceMetricsOverride", metrics, self.session)

    def print_preview(self, width: int) -> None:
        """Lay the page out as its printer would, on paper of a width in CSS pixels."""
        self.resize(width, 1000)
        self.browser.call("Emulation.setEmulatedMedia", {"media": "print"}, self.session)

    def busy_s(self) -> float:
        """Processor time of the page's main thread so far, which others on the machine lengthen little."""
        metrics = self.browser.call("Performance.getMetrics", {}, self.session)["metrics"]
        return float(next(m["value"] for m in metrics if m["name"] == "TaskDuration"))

    def press(self, key: str) -> None:
        """Press and release a key, such as ``Enter`` or ``ArrowRight``, where the focus is."""
        text = {"Enter": "\r", " ": " "}.get(key)
        codes = {"Enter": 13, " ": 32, "Tab": 9, "ArrowRight": 39, "ArrowLeft": 37}
        event = {"key": key, "code": "Space" if key == " " else key, "windowsVirtualKeyCode": codes[key]}
        down = event | ({"type": "keyDown", "text": text} if text else {"type": "rawKeyDown"})
        self.browser.call("Input.dispatchKeyEvent", down, self.session)
        self.browser.call("Input.dispatchKeyEvent", event | {"type": "keyUp"}, self.session)

    def point(self, x: float, y: float) -> None:
        """Move the pointer to a place of the window, CSS pixels."""
        self.browser.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": x, "y": y}, self.session)

    def screenshot(self, *, whole: bool = True) -> bytes:
        """PNG of the page."""
        asked = {"format": "png", "captureBeyondViewport": whole}
        if whole:
            size = self.browser.call("Page.getLayoutMetrics", {}, self.session)["cssContentSize"]
            asked["clip"] = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        return base64.b64decode(self.browser.call("Page.captureScreenshot", asked, self.session)["data"])

    def hear(self, method: str, about: dict[str, Any]) -> None:
        """Take note of an event."""
        if method == "Page.loadEventFired":
            self.loaded = True
        elif method == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.messages.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning", "assert"):
            said = (str(arg.get("value", arg.get("description"))) for arg in about["args"])
            self.messages.append(f"console.{about['type']}: {' '.join(said)}")
        elif method == "Log.entryAdded" and about["entry"]["level"] in ("error", "warning"):
            self.messages.append(about["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            address = about["request"]["url"]
            if not address.startswith("data:"):
                self.asked[about["requestId"]] = address
        elif method == "Network.loadingFailed" and about.get("blockedReason") == "csp":
            self.asked.pop(about["requestId"], None)


class Browser:
    """A running browser and the two ends of its pipes."""

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self._to, self._from = to_browser, from_browser
        self._buffer = b""
        self._count = 0
        self._answers: dict[int, dict[str, Any]] = {}
        self._pages: dict[str, Page] = {}

    def new_page(self) -> Page:
        """Open an empty page."""
        target = self.call("Target.createTarget", {"url": "about:blank"})["targetId"]
        session = self.call("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        page = self._pages[session] = Page(self, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable", {}, session)
        self.call("Performance.enable", {"timeDomain": "threadTicks"}, session)
        # keys go to the page as if its window were in front
        self.call("Emulation.setFocusEmulationEnabled", {"enabled": True}, session)
        return page

    def call(self, method: str, parameters: dict[str, Any], session: str | None = None) -> dict[str, Any]:
        """Ask for something and wait for the answer."""
        self._count += 1
        number = self._count
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = session
        self._send(message)
        self.wait(lambda: number in self._answers, f"no answer to {method}")
        answer = self._answers.pop(number)
        if "error" in answer:
            raise BrowserError(f"{method}: {answer['error']}")
        return dict(answer["result"])

    def wait(self, come: Any, otherwise: str) -> None:
        """Listen until something has come true."""
        end = time.monotonic() + PATIENCE_S
        while not come():
            if time.monotonic() > end:
                raise BrowserError(f"{otherwise} within {PATIENCE_S:g} s")
            # what is waited for need not be an event that the browser tells of
            if select([self._from], [], [], LOOK_S)[0]:
                self._listen()

    def _send(self, message: dict[str, Any]) -> None:
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._to, data) :]

    def _listen(self) -> None:
        arrived = os.read(self._from, 1 << 20)
        if not arrived:
            raise BrowserError("the browser has ended")
        *whole, self._buffer = (self._buffer + arrived).split(b"\0")
        for text in whole:
            message = json.loads(text)
            if "id" in message:
                self._answers[message["id"]] = message
            elif message.get("sessionId") in self._pages:
                self._pages[message["sessionId"]].hear(message["method"], message["params"])


@contextmanager
def running_browser(profile: Path) -> Iterator[Browser]:
    """Start Chromium with a profile folder of its own, and end it afterwards."""
    if CHROMIUM is None:
        raise BrowserError("there is no chromium")
    its_in, to_browser = os.pipe()
    from_browser, its_out = os.pipe()
    process = subprocess.Popen(
        [
            *(sys.executable, "-c", _AT_THREE_AND_FOUR, str(its_in), str(its_out)),
            *(CHROMIUM, *_FLAGS, f"--user-data-dir={profile}"),
        ],
        pass_fds=(its_in, its_out),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(its_in)
    os.close(its_out)
    try:
        yield Browser(to_browser, from_browser)
    finally:
        # Chromium ends when its pipe does
        os.close(to_browser)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        os.close(from_browser)

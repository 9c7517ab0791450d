"""Headless Chromium in front of a real server: what the page's tests and its measurement share."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

ROOT = Path(__file__).parent.parent
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
PLACES = ("/usr/bin", "/usr/lib/chromium", "/snap/bin", "/opt/google/chrome", "/Applications/Google Chrome.app/Contents/MacOS")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
WIDE, NARROW = {"width": 1280, "height": 800}, {"width": 400, "height": 800}
PATIENCE = 30.0  # s; a busy machine may need it, a quick one never does


def find_chromium():
    """Path of an installed Chromium or Chrome, or None; BIRTHSIM_CHROMIUM names another."""
    if chosen := os.environ.get("BIRTHSIM_CHROMIUM"):
        return chosen
    search = os.pathsep.join([os.environ.get("PATH", ""), *PLACES])
    return next((path for name in NAMES if (path := shutil.which(name, path=search))), None)


def missing():
    """What these tests lack, in words, or an empty string."""
    lacks = []
    try:
        import playwright  # noqa: F401
        import uvicorn  # noqa: F401
    except ImportError as error:
        lacks.append(f"{error.name} (pip install 'birthsim[live,dev]')")
    if find_chromium() is None:
        lacks.append("Chromium (apt-get install chromium, or BIRTHSIM_CHROMIUM=path)")
    return f"the page's tests need {' and '.join(lacks)}" if lacks else ""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Server:
    """``birthsim-live`` or ``birthsim-replay`` as a process of its own; ``arguments`` are those of the command."""

    def __init__(self, command, *arguments, port=None):
        self.port = port or free_port()
        self.url = f"http://127.0.0.1:{self.port}/"
        line = [sys.executable, "-m", f"birthsim_live.commands.{command}", *map(str, arguments), "--port", str(self.port)]
        self.process = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def __enter__(self):
        end = time.monotonic() + 2 * PATIENCE
        while time.monotonic() < end and self.process.poll() is None:
            with contextlib.suppress(OSError), urllib.request.urlopen(self.url, timeout=2):
                return self
            time.sleep(0.1)
        self.process.kill()
        raise AssertionError(f"no page at {self.url}: {self.process.communicate()[1]}")

    def __exit__(self, *_):
        """Ctrl-C, as a person would; whoever does not listen is killed."""
        self.process.terminate()
        try:
            self.process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()


def launch(playwright):
    """A headless browser with a profile of its own."""
    return playwright.chromium.launch(executable_path=find_chromium(), headless=True, args=ARGUMENTS)


class Window:
    """One tab with the page; ``complaints`` collects console errors, ``foreign`` requests that left this machine."""

    def __init__(self, browser, url, size=WIDE, touch=False):
        self.context = browser.new_context(viewport=size, accept_downloads=True, has_touch=touch)
        self.page = self.context.new_page()
        self.complaints, self.foreign = [], []
        self.page.on("console", lambda message: message.type in ("error", "warning") and self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", self._asked)
        self.page.goto(url)
        self.wait("birthsim.connected && birthsim.frame !== null && birthsim.state !== null")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.context.close()

    def _asked(self, request):
        if not re.match(r"(https?|wss?)://127\.0\.0\.1[:/]|data:|blob:", request.url):
            self.foreign.append(request.url)

    def value(self, expression):
        """Value of an expression in the page, where ``birthsim`` is what main.js shows of itself."""
        return self.page.evaluate(f"() => {{ const birthsim = window.birthsim; return birthsim && ({expression}); }}")

    def wait(self, expression, seconds=PATIENCE):
        """Wait until an expression holds (the page's policy forbids the eval of playwright's own waiting)."""
        end = time.monotonic() + seconds
        while not (found := self.value(expression)):
            if time.monotonic() > end:
                raise AssertionError(f"never within {seconds} s: {expression}; last seen {found!r}; {self.value('birthsim')}")
            self.page.wait_for_timeout(30)
        return found

    def frame(self):
        return self.value("birthsim.frame")

    def end_effector(self):
        """Where the end effector is in the window, px."""
        return self.value("birthsim.pixel(birthsim.frame.position)")

    def hold(self, across=0.0, up=0.0):
        """Press the mouse on the end effector and pull it by (across, up) px."""
        x, y = self.end_effector()
        mouse = self.page.mouse
        mouse.move(x, y)
        mouse.down()
        mouse.move(x + across, y - up, steps=6)
        self.wait("birthsim.frame.pointer !== null")

    def settle(self, least=0.0):
        """Wait until the end effector rests and at least ``least`` N pull at it; return that frame."""
        rests = f"Math.hypot(...birthsim.frame.velocity) < 1e-3 && Math.hypot(...birthsim.frame.force) >= {least}"
        # Rest counts only if it lasts: a turning point is none.
        since = self.wait(f"{rests} && birthsim.frame.time")
        while True:
            self.page.wait_for_timeout(30)
            if not self.value(rests):
                since = self.wait(f"{rests} && birthsim.frame.time")
            elif self.value("birthsim.frame.time") - since > 0.4:
                return self.frame()


def displacement(frame):
    """(x, y) from the target to the end effector, m."""
    return tuple(p - t for p, t in zip(frame["position"], frame["target"], strict=True))


def rendered(frame):
    """(x, y) that the force should give: force over stiffness setpoint, m."""
    return tuple(f / k for f, k in zip(frame["force"], frame["stiffness"], strict=True))

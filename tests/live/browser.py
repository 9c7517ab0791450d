"""Headless Chromium in front of a real server: what the page's tests and its measurement share."""

import os
import re
import shutil
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

from tests.console import ROOT

NAMES = (
    *("chromium", "chromium-browser", "chromium-headless-shell", "headless_shell", "chrome-headless-shell"),
    *("google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge", "brave-browser"),
)
"""Programs that are looked for; Playwright knows its own browser, and BIRTHSIM_CHROMIUM says where another one is."""
OF_PLAYWRIGHT = """
from playwright.sync_api import sync_playwright
with sync_playwright() as playwright:
    print(playwright.chromium.executable_path)
"""
INSTALLATION = "apt-get install chromium-headless-shell, or .venv/bin/playwright install chromium"
FONT = "Liberation Sans"
ARGUMENTS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)
WIDE, NARROW = {"width": 1280, "height": 800}, {"width": 400, "height": 800}
CALM = "?controller=admittance-backstepping"
"""What a page's address asks for so that the end effector comes to rest; the paper's law hunts."""
PATIENCE = 120.0  # s; only a state that never comes takes so long


def find_chromium():
    """Path of an installed Chromium or a relative of it, or None; BIRTHSIM_CHROMIUM names another, which must exist."""
    if chosen := os.environ.get("BIRTHSIM_CHROMIUM"):
        if found := shutil.which(chosen):
            return found
        raise ValueError(f"BIRTHSIM_CHROMIUM = {chosen!r} is no program; allowed: the path of a Chromium, or not set")
    return next(filter(None, map(shutil.which, NAMES)), None) or _of_playwright()


def _of_playwright():
    """The Chromium that Playwright downloads, or None without one; a process says where, for Playwright may run in this one."""
    said = subprocess.run([sys.executable, "-c", OF_PLAYWRIGHT], capture_output=True, text=True).stdout.strip()
    return shutil.which(said) if said else None


def has_font():
    """Whether text is as wide as the page was laid out for; where nothing tells, it is believed to be."""
    matcher = shutil.which("fc-match")
    found = subprocess.run([matcher, FONT], capture_output=True, text=True).stdout if matcher else FONT
    return any(name in found for name in (FONT, "Arial", "Helvetica"))


def missing():
    """What these tests lack and how to install it, in words, or an empty string."""
    lacks = []
    try:
        import playwright  # noqa: F401
        import uvicorn  # noqa: F401
    except ImportError as error:
        lacks.append(f"{error.name} (pip install -e '.[live,dev]')")
    if find_chromium() is None:
        lacks.append(f"Chromium ({INSTALLATION})")
    if not has_font():
        lacks.append(f"a font as wide as {FONT} (apt-get install fonts-liberation)")
    return f"the page's tests need {' and '.join(lacks)}" if lacks else ""


class Server:
    """``birthsim live`` or ``birthsim live --replay`` as a process of its own; ``arguments`` are those of the command."""

    def __init__(self, command, *arguments, port=0):
        line = [sys.executable, "-m", "birthsim", *command.split(), *map(str, arguments), "--port", str(port)]
        self.process = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = []
        # It names its address once it listens; a process that fails closes the pipe.
        for text in self.process.stdout:
            said.append(text)
            if found := re.search(r"http://[^/\s]+:(\d+)", text):
                self.url, self.port = f"{found[0]}/", int(found[1])
                return
        self.__exit__()
        raise AssertionError(f"{command} serves no page: {''.join(said)}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Ends by the signal that service managers send; whoever does not listen is killed."""
        with self.process as process:
            process.terminate()
            try:
                process.communicate(timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()


@contextmanager
def served(folder):
    """The address of a server of the files in a folder."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=str(folder))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def launch(playwright):
    return playwright.chromium.launch(executable_path=find_chromium(), headless=True, args=ARGUMENTS)


class Window:
    """One tab with the page, and with its ``lab`` open unless told otherwise; at its end there must have been no
    ``complaints``, which are console errors, and no ``foreign`` requests, which left this machine."""

    def __init__(self, browser, url, size=WIDE, touch=False, lab=True):
        self.context = browser.new_context(viewport=size, accept_downloads=True, has_touch=touch)
        self.context.set_default_timeout(1000 * PATIENCE)
        self.page = self.context.new_page()
        self.complaints, self.foreign = [], []
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", self._asked)
        self.page.goto(f"{url}#lab" if lab else url)
        self.wait("birthsim.connected && birthsim.frame !== null && birthsim.state !== null")

    def __enter__(self):
        return self

    def __exit__(self, failed, *_):
        said = list(self.complaints), list(self.foreign)  # a window that closes may leave requests without an answer
        self.context.close()
        assert failed or said == ([], []), said

    def _said(self, message):
        # A test that looks at the colours of a canvas is told that it looks often.
        if message.type in ("error", "warning") and not message.text.startswith("Canvas2D: Multiple readback"):
            self.complaints.append(message.text)

    def _asked(self, request):
        if not re.match(r"(https?|wss?)://127\.0\.0\.1[:/]|data:|blob:", request.url):
            self.foreign.append(request.url)

    def value(self, expression):
        """Value of an expression in the page, where ``birthsim`` is what main.js shows of itself."""
        return self.page.evaluate(f"() => {{ const birthsim = window.birthsim; return birthsim && ({expression}); }}")

    def wait(self, expression, seconds=PATIENCE):
        """Wait until an expression holds (the page's policy forbids the eval of playwright's own waiting)."""
        end = time.monotonic() + seconds
        while not (found := self._value_by_now(expression)):
            if time.monotonic() > end:
                seen = self.value("[birthsim.frame, birthsim.settings, birthsim.state]")
                raise AssertionError(f"never within {seconds} s: {expression}; last seen {found!r}; {seen}")
            self.page.wait_for_timeout(30)
        return found

    def _value_by_now(self, expression):
        from playwright.sync_api import Error

        try:
            return self.value(expression)
        except Error as error:
            if "properties of null" not in str(error):
                raise
            return None

    def frame(self):
        return self.value("birthsim.frame")

    def choose(self, **choices):
        """Choose in lists, one after the other, and wait until the rig has each."""
        for name, choice in choices.items():
            self.page.locator(f"select[name={name}]").select_option(choice)
            self.wait(f"birthsim.settings.{name} === '{choice}'")

    def pause(self, paused=True):
        self.page.evaluate(f"birthsim.send({{ type: 'pause', paused: {str(paused).lower()} }})")
        self.wait(f"birthsim.state.paused === {str(paused).lower()}")

    def play(self, recording):
        self.page.locator("#choose").set_input_files(recording)
        self.wait("birthsim.hello.mode === 'replay'")

    def back(self):
        self.page.locator("#back").click()
        self.wait("birthsim.hello.mode === 'live'")

    def end_effector(self, rig=0):
        """Where the end effector of the first or the second rig is in the window, px."""
        return self.value(f"birthsim.pixel(birthsim.frame{'.second' * rig}.position, {rig})")

    def live(self, seconds):
        """Wait until the rig has lived through so many seconds of its own time."""
        self.wait(f"birthsim.frame.time > {self.frame()['time'] + seconds}")

    def hold(self, across=0.0, up=0.0, rig=0):
        """Press the mouse on the end effector and pull it by (across, up) px."""
        x, y = self.end_effector(rig)
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

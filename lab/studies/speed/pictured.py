"""Pictures of the page: ``python -m lab.studies.speed.pictured`` writes docs/live.png, docs/pull.webp, a film of a pull whose
controller changes, and card.png, which a shared link shows."""

import io
from pathlib import Path
from typing import Any

from PIL import Image

from birthsim_live.rig.folder import PAGE
from tests.live import browser
from tests.live.browser import ROOT, WIDE, Server, Window

CARD = {"width": 1200, "height": 630}
FILM = {"width": 760, "height": 430}
RATE = 12.0  # pictures per second of the rig's time
SLOW = 0.1  # of real time: a screenshot takes some 50 ms
PULL, SWITCH, END = 0.5, 3.0, 5.5  # s


def pull(window: Any, path: Path) -> None:
    """A screenshot of a pull that has lasted for some seconds."""
    window.wait("birthsim.frame.time > 2.5")
    window.hold(across=70, up=15)
    window.live(3.0)
    taken = Image.open(io.BytesIO(window.page.screenshot())).convert("RGB")
    # A third of the bytes; the median cut would give small things, as the diamond, another colour.
    taken.quantize(method=Image.Quantize.MAXCOVERAGE).save(path, optimize=True)
    window.page.mouse.up()


def film(window: Any, path: Path) -> None:
    """A pull under the paper's controller, which the one with a force sensor replaces."""
    window.page.evaluate(f"birthsim.send({{ type: 'speed', speed: {SLOW} }})")
    window.page.locator("body").press("r")
    window.wait("birthsim.frame.time < 0.1")
    taken = []
    for k in range(round(END * RATE)):
        now = k / RATE
        if now - 1 / RATE < PULL <= now:
            window.hold(across=90, up=15)
        if now - 1 / RATE < SWITCH <= now:  # the mouse holds the head
            window.page.locator("[name=under]").nth(1).dispatch_event("click")
        window.wait(f"birthsim.frame.time >= {now}")
        taken.append(Image.open(io.BytesIO(window.page.screenshot())).convert("RGB"))
    window.page.mouse.up()
    lengths = [round(1000 / RATE)] * (len(taken) - 1) + [1500]
    taken[0].save(path, save_all=True, append_images=taken[1:], duration=lengths, loop=0, quality=60, method=6)


def main() -> None:
    """Entry point."""
    if lack := browser.missing():
        raise SystemExit(lack)
    from playwright.sync_api import sync_playwright

    with Server("live") as server, sync_playwright() as playwright:
        chromium = browser.launch(playwright)
        with Window(chromium, f"{server.url}?embed=1", CARD, lab=False) as window:
            pull(window, PAGE / "card.png")
        with Window(chromium, f"{server.url}?embed=1", FILM, lab=False) as window:
            film(window, ROOT / "docs" / "pull.webp")
        two = "?controller=admittance-backstepping&compare=backstepping"
        with Window(chromium, f"{server.url}{two}", WIDE, lab=False) as window:
            pull(window, ROOT / "docs" / "live.png")
        chromium.close()


if __name__ == "__main__":
    main()

"""Pictures of the page: ``python -m studies.speed.pictured`` writes docs/live.png, and card.png, which a shared link shows."""

from typing import Any

from birthsim_live.rig.folder import PAGE
from tests.live import browser
from tests.live.browser import ROOT, WIDE, Server, Window

CARD = {"width": 1200, "height": 630}


def pull(window: Any, path: Any) -> None:
    """A screenshot of a pull that has lasted for some seconds."""
    window.wait("birthsim.frame.time > 2.5")
    window.hold(across=70, up=15)
    window.live(3.0)
    window.page.screenshot(path=path)
    window.page.mouse.up()


def main() -> None:
    """Entry point."""
    if lack := browser.missing():
        raise SystemExit(lack)
    from playwright.sync_api import sync_playwright

    with Server("live") as server, sync_playwright() as playwright:
        chromium = browser.launch(playwright)
        with Window(chromium, f"{server.url}?embed=1", CARD, lab=False) as window:
            pull(window, PAGE / "card.png")
        two = "?controller=admittance-backstepping&compare=backstepping"
        with Window(chromium, f"{server.url}{two}", WIDE, lab=False) as window:
            pull(window, ROOT / "docs" / "live.png")
        chromium.close()


if __name__ == "__main__":
    main()

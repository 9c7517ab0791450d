"""Frame rate, real-time factor and latency of the live page while somebody drags, in headless Chromium.

``python -m lab.studies.speed.dragged`` starts a server, drags the end effector around for some seconds, several times, and
prints a table; ``--controller NAME`` does so with a controller that runs in Python, ``--compare NAME`` with two rigs.
"""

import argparse
import math
import statistics
import time
from typing import Any

from tests.live import browser
from tests.live.browser import Server, Window

ROUND = 2.0  # s per circle of the mouse
RADIUS = 45.0  # px
HEADINGS = ("run", "drawn (1/s)", "real-time factor, least", "behind (s)", "latency (ms): median", "95 %", "most", "moves")


def drag(window: Any, seconds: float) -> dict[str, Any]:
    """Drag in circles like a mouse that reports 60 times a second; the page's report, with real-time factors on the way."""
    window.page.locator("#speed").select_option("1")  # chosen, it stays where the machine is slow
    window.page.locator("body").press("r")
    window.wait("birthsim.frame.real_time !== null && birthsim.frame.pointer === null")
    window.hold()
    x, y = window.end_effector()
    factors = []
    window.page.wait_for_timeout(1200)  # the factor is that of the last second: let it be one of dragging
    window.value("birthsim.monitor.restart()")
    behind = window.value("birthsim.frame.behind")
    begun = now = time.monotonic()
    sampled = begun
    while (now := time.monotonic()) - begun < seconds:
        angle = 2 * math.pi * (now - begun) / ROUND
        window.page.mouse.move(x + RADIUS * math.cos(angle), y + RADIUS * math.sin(angle))
        if now - sampled > 0.5:
            sampled = now
            factors.append(window.value("birthsim.frame.real_time"))
        time.sleep(max(0.0, 1 / 60 - (time.monotonic() - now)))
    report: dict[str, Any] = window.value("birthsim.monitor.report()")
    report["behind"] = window.value("birthsim.frame.behind") - behind
    report["factors"] = factors
    window.page.mouse.up()
    return report


def row(run: int, report: dict[str, Any]) -> tuple[str, ...]:
    """One line of the table."""
    latencies = sorted(report["latencies"])
    late = latencies[min(math.ceil(0.95 * len(latencies)), len(latencies)) - 1]
    figures = (
        f"{report['drawn'] / report['seconds']:.1f}",
        f"{statistics.mean(report['factors']):.3f}, {min(report['factors']):.3f}",
        f"{report['behind']:.2f}",
        f"{statistics.median(latencies):.1f}",
        f"{late:.1f}",
        f"{latencies[-1]:.1f}",
        str(len(latencies)),
    )
    return (str(run), *figures)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=15.0, help="length of a run (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=3, help="how many (default: %(default)s)")
    parser.add_argument("--controller", metavar="NAME", default="admittance-backstepping", help="what drives the rig")
    parser.add_argument("--compare", metavar="NAME", default="nothing", help="with a second rig beside the first")
    arguments = parser.parse_args()
    if lack := browser.missing():
        raise SystemExit(lack)
    from playwright.sync_api import sync_playwright

    with Server("live", "--controller", arguments.controller) as server, sync_playwright() as playwright:
        chromium = browser.launch(playwright)
        with Window(chromium, f"{server.url}?compare={arguments.compare}") as window:
            window.wait(f"birthsim.settings.compare === '{arguments.compare}'")
            first = window.wait("birthsim.monitor.first")
            rows = [row(k + 1, drag(window, arguments.seconds)) for k in range(arguments.runs)]
        chromium.close()
    print(f"first frame drawn {first / 1e3:.2f} s after the address was opened\n")
    print("| " + " | ".join(HEADINGS) + " |")
    print("|" + "---|" * len(HEADINGS))
    for figures in rows:
        print("| " + " | ".join(figures) + " |")


if __name__ == "__main__":
    main()

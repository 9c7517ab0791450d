"""axe-core in a page: what keeps people from using it, as far as a program can tell."""

import os

import pytest

from tests.live.browser import ROOT

AXE = ROOT / "out" / "npm" / "node_modules" / "axe-core" / "axe.min.js"
NEEDED = pytest.mark.skipif(not AXE.exists() and os.environ.get("CI") != "true", reason="make npm installs axe-core")

RUN = """async (without) => {
    const { violations } = await axe.run({ exclude: without }, { resultTypes: ["violations"] });
    return violations.flatMap(({ id, help, nodes }) => nodes.map(({ html }) => `${id}: ${help}: ${html}`));
}"""


def violations(page, *without):
    """What axe-core finds in a page of playwright but for the selectors in ``without``, one line for each element."""
    page.evaluate(AXE.read_text(encoding="utf-8"))
    return page.evaluate(RUN, list(without))

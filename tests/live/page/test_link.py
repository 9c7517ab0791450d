"""Settings in the page's address: what is unreadable is refused by name."""

from __future__ import annotations

import json
import subprocess
from typing import Any

import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import PAGE, packed_page
from tests.build.targets import need_program

SCRIPT = """
import { readFileSync } from "node:fs";
const [link, worker, cases, pack] = process.argv.slice(2);
const { settingsIn } = await import(link), { checked } = await import(worker);
const about = JSON.parse(readFileSync(pack));
const outcome = (search) => {
  const read = settingsIn(search, about.defaults);
  try {
    return [read, checked(read, about) && ""];
  } catch (error) {
    return [read, error.message];
  }
};
console.log(JSON.stringify(JSON.parse(cases).map(outcome)));
"""
CASES = {
    "": {},
    "?friction=0&scenario_force=true&controller=pid": {"friction": 0, "scenario_force": True, "controller": "pid"},
    "?Kclx=3e3&scenario_force=false": {"Kclx": 3000, "scenario_force": False},
    "?friction=": ("friction", "0 to 2"),
    "?friction=%20": ("friction", "0 to 2"),
    "?friction=much": ("friction", "0 to 2"),
    "?mass=1e999": ("mass", "1.5 to 6 kg"),
    "?scenario_force=yes": ("scenario_force", "true, false"),
    "?scenario_force=": ("scenario_force", "true, false"),
    "?scenario_force=constructor": ("scenario_force", "true, false"),
}


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Address -> what the page reads in it, and how the worker refuses that."""
    need_program("node", "nodejs")
    folder = tmp_path_factory.mktemp("link")
    # Node takes modules by this ending, or by a package.json, which the page has no use for.
    for name, place in (("link", "link.js"), ("settings", "worker/settings.js")):
        (folder / f"{name}.mjs").write_text((PAGE / place).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "try.mjs").write_text(SCRIPT)
    (folder / "pack.json").write_text(json.dumps(packed_page(Parameters()).content["hello"]))
    line = ["node", "try.mjs", "./link.mjs", "./settings.mjs", json.dumps(list(CASES)), "pack.json"]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=True)
    return dict(zip(CASES, json.loads(done.stdout), strict=True))


@pytest.mark.parametrize("search", CASES)
def test_an_address_is_read_or_refused_by_name(search: str, outcomes: dict[str, Any]) -> None:
    (read, refusal), wanted = outcomes[search], CASES[search]
    if isinstance(wanted, dict):
        assert read == wanted
        assert refusal == ""
        return
    name, allowed = wanted
    assert name in refusal
    assert allowed in refusal.partition("allowed")[2]

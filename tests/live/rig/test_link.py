"""Settings in the page's address: what is unreadable is refused by name."""

import pytest

from tests.live.rig.worker import node

SCRIPT = """
import { settingsIn } from "./link.js";
import { checked } from "./worker/settings.js";

const { hello } = pack;
const outcome = (search) => {
  const read = settingsIn(search, hello.defaults);
  try {
    return [read, checked(read, hello) && ""];
  } catch (error) {
    return [read, error.message];
  }
};
console.log(JSON.stringify(given.map(outcome)));
"""
CASES = {
    "": {},
    "?friction=0&scenario_force=true&controller=pid": {"friction": 0, "scenario_force": True, "controller": "pid"},
    "?Kclx=3e3&scenario_force=false": {"Kclx": 3000, "scenario_force": False},
    "?friction=": ("friction", "0 to 2"),
    "?friction=%20": ("friction", "0 to 2"),
    "?friction=much": ("friction", "0 to 2"),
    "?mass=1e999": ("mass", "1.5 to 6 kg"),
    "?foo=1": ("foo", "scenario"),
    "?scenario_force=yes": ("scenario_force", "true, false"),
    "?scenario_force=": ("scenario_force", "true, false"),
    "?scenario_force=constructor": ("scenario_force", "true, false"),
}


@pytest.fixture(scope="module")
def outcomes(page):
    """Address -> what the page reads in it, and how the worker refuses that."""
    return dict(zip(CASES, node(page, SCRIPT, list(CASES)), strict=True))


@pytest.mark.parametrize("search", CASES)
def test_an_address_is_read_or_refused_by_name(search, outcomes):
    (read, refusal), wanted = outcomes[search], CASES[search]
    if isinstance(wanted, dict):
        assert (read, refusal) == (wanted, "")
    else:
        said, _, allowed = refusal.partition("allowed")
        assert wanted[0] in said
        assert wanted[1] in allowed

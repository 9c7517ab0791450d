"""Settings in the page's address: what is unreadable is refused by name."""

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


def test_an_address_is_read_or_refused_by_name(page):
    for (search, wanted), (read, refusal) in zip(CASES.items(), node(page, SCRIPT, list(CASES)), strict=True):
        if isinstance(wanted, dict):
            assert (read, refusal) == (wanted, ""), search
        else:
            said, _, allowed = refusal.partition("allowed")
            assert wanted[0] in said, search
            assert wanted[1] in allowed, search

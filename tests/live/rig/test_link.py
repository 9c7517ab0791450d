"""Settings in the page's address: what is unreadable is refused by name."""

from tests.live.rig.worker import node

SCRIPT = """
import { settingsIn } from "./link.js";
import { checked, sifted } from "./worker/settings.js";

const { hello } = pack;
const outcome = (search) => {
  const read = settingsIn(search, hello.defaults);
  try {
    return [read, checked(read, hello) && ""];
  } catch (error) {
    return [read, error.message, sifted(read, hello)];
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
    "?seed=5": ("seed", "scenario"),
    "?rig=other": ("rig", "scenario"),
    "?__proto__=1": ("__proto__", "scenario"),
    "?constructor=1": ("constructor", "scenario"),
    "?hasOwnProperty=1": ("hasOwnProperty", "scenario"),
    "?sensors=": ("sensors", "ideal, lab, honest"),
    "?sensors=ideal%00": ("sensors", "ideal, lab, honest"),
    "?valves=2": ("valves", "two_valves, one_valve"),
    "?friction=-1e-9": ("friction", "0 to 2"),
    "?friction=NaN": ("friction", "0 to 2"),
    "?friction=1,5": ("friction", "0 to 2"),
    "?friction=0&friction=9": ("friction", "0 to 2"),
    "?compare=shut-valves": ("compare", "nothing"),
    "?stiffness_source=sliders&scenario=moon": ("scenario", "circle"),
    f"?controller={'a' * 5000}": ("controller", "backstepping"),
    f"?{'b' * 5000}=1": ("bbb", "scenario"),
}
MEANT = {
    "?controller=backsteping": "backstepping",
    "?controller=Backstepping": "backstepping",
    "?controller=admittance_backstepping": "admittance-backstepping",
    "?controller=admittance-adaptiv": "admittance-adaptive",
    "?controler=pid": "controller",
    "?Friction=0": "friction",
    "?kclx=3000": "Kclx",
    "?sensors=Lab": "lab",
    "?valves=two-valves": "two_valves",
    "?compare=residual:circel": "residual:circle",
    "?stiffness_source=slider": "sliders",
}


def test_an_address_is_read_or_refused_by_name(page):
    for (search, wanted), (read, refusal, *_) in zip(CASES.items(), node(page, SCRIPT, list(CASES)), strict=True):
        if isinstance(wanted, dict):
            assert (read, refusal) == (wanted, ""), search
        else:
            said, _, allowed = refusal.partition("allowed")
            assert wanted[0] in said, search
            assert wanted[1] in allowed, search
            assert len(refusal) < 420, search


def test_what_is_like_a_name_is_asked_for(page):
    for (search, name), (_, refusal, _) in zip(MEANT.items(), node(page, SCRIPT, list(MEANT)), strict=True):
        assert f'(did you mean "{name}"?); allowed: ' in refusal, search


PARTS = {
    "?controller=backsteping&friction=0": ({"friction": 0}, 1),
    "?foo=1&mass=900&sensors=lab": ({"sensors": "lab"}, 2),
    "?stiffness_source=scenario&Kclx=3000&bar=": ({"Kclx": 3000}, 2),
}


def test_what_is_right_beside_what_is_refused_holds(page):
    for (search, (good, bad)), (*_, sifted) in zip(PARTS.items(), node(page, SCRIPT, list(PARTS)), strict=True):
        assert (sifted["allowed"], len(sifted["refusals"])) == (good, bad), search


EMBEDDED = """
import { embedded } from "./link.js";

console.log(JSON.stringify(given.map((search) => {
  globalThis.location = { search };
  return embedded();
})));
"""


def test_a_page_is_embedded_unless_its_address_says_no(page):
    asked = {"?embed=1": True, "?embed": True, "?embed=true": True, "": False, "?embed=0": False, "?embed=False": False}
    assert node(page, EMBEDDED, list(asked)) == list(asked.values())

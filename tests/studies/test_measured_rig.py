"""The study of the measured rig: its rigs differ by what was exchanged alone, up to the default rig."""

import dataclasses
from types import SimpleNamespace

import pytest

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies import measured_rig
from lab.studies.measured_rig import ASSUMED, EXCHANGED, rig_of

OPTIONS = SimpleNamespace(
    **{**measured_rig.STUDY.options, "controller": ("admittance-adaptive",), "sensors": ("ideal",), "episodes": 1}
)


def values(rig):
    return {f"{section}.{name}": value for section, own in rig.to_dict().items() for name, value in own.items()}


def test_all_parts_together_are_the_default_rig():
    assert rig_of(EXCHANGED["measured"]) == Parameters()


@pytest.mark.parametrize("part", ASSUMED)
def test_a_part_alone_differs_from_the_default_rig_in_the_other_parts(part):
    rig, default = rig_of(EXCHANGED[part]), Parameters()
    others = {name for other, rows in ASSUMED.items() if other != part for name in rows}
    of_rig, of_default = values(dataclasses.replace(rig, ranges=())), values(default)
    assert {name for name in of_default if of_rig[name] != of_default[name]} <= others
    drawn, known = documented_ranges(rig), documented_ranges(default)
    assert {name for name in known if drawn[name] != known[name]} == others & set(known)


def test_the_tables_have_both_rigs_and_every_part():
    tasks = measured_rig.STUDY.tasks(OPTIONS)
    assert [rig for rig, _, _ in tasks] == list(EXCHANGED)
    figures = measured_rig.STUDY.keep(OPTIONS, {key: {name: [1.5, 2.5] for name in measured_rig.COLUMNS} for key in tasks})
    text = measured_rig.STUDY.show({"figures": figures, "settings": vars(OPTIONS)})["measured-rig.md"]
    row = "| `admittance-adaptive` | default | no | yes | ideal |"
    assert f"{row}{4 * ' 1.50 | 2.50 |'}\n" in text, "assumed and measured, of two metrics"
    assert [line.split(" | ")[1] for line in text.splitlines() if line.startswith("| ideal")] == ["nothing", *ASSUMED, "all"]


def test_controllers_believe_the_rig_of_their_row():
    """With ideal sensors a controller that knows its valves hardly notices them."""
    found = {rig: measured_rig.measure(rig, "admittance-adaptive", "ideal", 2, 5) for rig in ("assumed", "valves")}
    assert found["valves"]["settled"][0] < 2.0 * found["assumed"]["settled"][0]

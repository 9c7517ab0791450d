"""The study of the crossing: what it makes of its pieces, and that a softer crossing turns valves less."""

from types import SimpleNamespace

import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import MPYE_5_M5
from lab.engine.worlds import SEED
from lab.studies import valve_crossing

OPTIONS = SimpleNamespace(**{**valve_crossing.STUDY.options, "crossing": (0.01, 0.03), "sensors": ("ideal",), "episodes": 2})


def test_the_crossing_is_judged_on_worlds_that_it_was_not_chosen_on():
    tasks = valve_crossing.STUDY.tasks(OPTIONS)
    assert {key[2:] for key in tasks} == {(kind, one) for kind in ("chosen", "judged") for one in (None, 0.01, 0.03)}
    seeds = {kind: {task.settings["seed"] for key, task in tasks.items() if key[2] == kind} for kind in ("chosen", "judged")}
    assert seeds == {"chosen": {valve_crossing.CHOSEN}, "judged": {SEED}}
    curves = {key[3]: task.settings["curve"] for key, task in tasks.items()}
    assert curves == {None: [0.0, 0.0], 0.01: list(MPYE_5_M5), 0.03: list(MPYE_5_M5)}


def test_table_and_picture_have_a_place_for_every_crossing(tmp_path):
    tasks, values = valve_crossing.STUDY.tasks(OPTIONS), {name: [1.5, 2.5] for name in valve_crossing.COLUMNS}
    figures = valve_crossing.STUDY.keep(OPTIONS, dict.fromkeys(tasks, values))
    content = {"figures": figures, "settings": vars(OPTIONS)}
    text = valve_crossing.STUDY.show(content)["valve-crossing.md"]
    assert "| `admittance-adaptive` | default | no | yes | ideal | 3 % | 1.50 | 2.50 |" in text
    assert text.split("\n\n")[1].count("valves without overlap") == 1, "of the worlds that judge"
    assert all(path.stat().st_size > 10_000 for path in valve_crossing.STUDY.draw(content, tmp_path))


@pytest.mark.slow
def test_a_softer_crossing_turns_valves_less():
    shared = {"controller": "admittance-adaptive", "sensors": "ideal", "curve": list(MPYE_5_M5), "episodes": 8, "seed": 5}
    hard, soft = (valve_crossing.measure(crossing=crossing, **shared) for crossing in (0.003, Parameters().valves.crossing))
    assert soft["held_turns"][0] < hard["held_turns"][0]
    assert soft["settled"][0] < 1.1 * hard["settled"][0]

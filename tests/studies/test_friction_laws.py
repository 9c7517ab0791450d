"""The study of frictions: its worlds, what each controller is told there, and what its tables say of the worst."""

from types import SimpleNamespace

from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names
from lab.engine import information
from lab.engine.worlds import COUNT, SEED
from lab.studies.friction_laws.study import ASSUMED, METRICS, ROWS, SENSORS, STUDY

OPTIONS = SimpleNamespace(**{**STUDY.options, "friction": ("lugre", "coulomb", "gms"), "episodes": 2})


def test_plants_have_the_frictions_of_the_sweep_while_controllers_believe_the_default_one():
    tasks = STUDY.tasks(OPTIONS)
    assert len(tasks) == 3 * len(ROWS) * 2
    assert len({task.name for task in tasks.values()}) == len(tasks)
    for (friction, row, _), task in tasks.items():
        rig = Parameters.from_dict(task.settings["rig"])
        assert rig.friction == Parameters().friction
        law = documented_ranges(rig)["friction.law"]
        assert law == documented_ranges(with_friction(Parameters(), friction))["friction.law"] == (friction,)
        assert task.settings["told"] == (row.rig == information.TOLD)
        assert (rig.electronics.acceleration_bandwidth > 0) == bool(row.file)
    assert set(STUDY.options["friction"]) == set(names("friction")) - {"drawn-smooth"}
    seeds = {task.settings["seed"] for task in tasks.values()}
    assert seeds == {61_000_000}
    assert not SEED <= min(seeds) < SEED + COUNT


def test_the_paper_is_beside_rivals_and_both_kinds_of_force():
    assert {"backstepping", "pid", "time-delay", "disturbance-observer"} < {row.controller for row in ROWS}
    assert {(row.rig, row.facts(SENSORS)[-1]) for row in ROWS if row.controller.startswith("admittance")} == {
        (information.DEFAULT, "yes"), (information.TOLD, "no"),
    }  # fmt: skip


def test_tables_name_the_worst_friction_and_have_all():
    tasks = STUDY.tasks(OPTIONS)
    sizes = {"lugre": 1.0, "coulomb": 3.0, "gms": 2.0}

    def result(friction):
        metrics = {metric: [sizes[friction]] * 2 for metric in (*METRICS, "hunting_x", "hunting_y")}
        return {"metrics": metrics, "lost": [False, friction == "gms"], "cost": 1.0}

    figures = STUDY.keep(OPTIONS, {key: result(key[0]) for key in tasks})
    texts = STUDY.show({"figures": figures, "settings": vars(OPTIONS)})
    head, _, first, *_ = texts["friction-laws.md"].split("\n\n")[1].splitlines()
    assert head.startswith("| controller | rig | mass learned | force sensed | hunting as expected, mm: median |")
    assert first.startswith("| `admittance-adaptive` | default | yes | yes | 1.00 | 1.00 | lost | lost | `gms` |")
    each = texts["friction-laws-each.md"]
    assert each.count("| `coulomb` | 3.00 | 3.00 |") == len(METRICS)
    assert ASSUMED in OPTIONS.friction

"""The study of rails: its worlds, what a known spring and damper is found to be, and what its table says."""

from types import SimpleNamespace

import numpy as np

from baselines.named import controlling_names
from birthsim_env.physics.rig.parameters import Parameters
from lab.engine import information
from lab.engine.information import Row
from lab.engine.worlds import COUNT, SEED
from lab.studies.rail_impedance import OTHER, STUDY, damping_felt, direction, measure, rail, rows, stiffness_felt

OPTIONS = SimpleNamespace(**{**STUDY.options, "episodes": 3})


class Carriage:
    """N masses of 2 kg with springs and dampers along the rail, in steps of exact exponentials of a held push."""

    period = 1e-3

    def __init__(self, stiffness, damping):
        self.lanes, self.now, self.state = len(stiffness), 0.0, np.zeros((2, len(stiffness)))
        rates = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]])
        self.steps = []
        for k, b in zip(stiffness, damping, strict=True):
            rates[1, :2] = -k / 2.0, -b / 2.0
            values, vectors = np.linalg.eig(rates)
            self.steps.append((vectors @ np.diag(np.exp(values * self.period)) @ np.linalg.inv(vectors)).real)

    def motion(self):
        return np.concatenate([direction() * self.state[0] + 0.3, direction() * self.state[1]])

    def advance(self, hand):
        force = (direction() * hand(self.now, None, None)).sum(axis=0)
        for lane, step in enumerate(self.steps):
            self.state[:, lane] = (step @ [*self.state[:, lane], force[lane]])[:2]
        self.now += self.period


def test_a_known_spring_and_damper_is_found():
    springs, dampers = np.array([1000.0, 4000.0]), np.array([60.0, 250.0])
    np.testing.assert_allclose(stiffness_felt(Carriage(springs, dampers)), springs, rtol=1e-3)
    np.testing.assert_allclose(damping_felt(Carriage(springs, dampers)), dampers, rtol=0.02)


def test_every_controller_is_measured_on_worlds_of_its_own():
    tasks = STUDY.tasks(OPTIONS)
    assert len({task.name for task in tasks.values()}) == len(tasks) == len(rows())
    assert {row.controller for row in tasks} >= {*controlling_names(), OTHER}
    for row, task in tasks.items():
        assert task.settings["told"] == (row.rig == information.TOLD)
        assert Parameters.from_dict(task.settings["rig"]) == rail()
        assert not SEED <= task.settings["seed"] < SEED + COUNT


def test_a_lost_bench_counts_as_the_worst_and_what_is_not_declared_is_no_figure():
    found = {
        row: {"stiffness": [1.0, 2.0, 3.0], "damping": [5.0] * 3, "lost": [False] * 3}
        for row in (Row("abry"), Row("pid"), Row("backstepping-integral"))
    }
    found[Row("pid")]["lost"] = [False, True, True]
    found[Row("backstepping-integral")]["damping"] = [np.nan] * 3
    figures = STUDY.keep(OPTIONS, found)
    said = STUDY.show({"figures": figures, "settings": vars(OPTIONS)})["rail-impedance.md"].splitlines()
    cells = {line.split(" | ")[0].strip("|` "): line.split(" | ")[1:] for line in said if line.startswith("| `")}
    assert cells["abry"][:7] == ["default", "no", "no", "2.00", "2.90", "5.00", "5.00"]
    assert cells["pid"][3:5] == ["lost", "lost"]
    assert cells["backstepping-integral"][5:7] == ["-", "-"]


def test_benches_that_are_told_find_a_stiffness_within_a_fifth():
    """The law of Abry et al. as the study measures it; median of six drawn benches."""
    settings = STUDY.tasks(OPTIONS)[Row("abry", information.TOLD)].settings
    result = measure(**{**settings, "seed": 50, "lanes": 6})
    assert result["lost"] == [False] * 6
    assert np.median(result["stiffness"]) < 20.0

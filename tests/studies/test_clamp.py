"""The study of stiff hands: its worlds, what each controller is told there, and what its tables say."""

from types import SimpleNamespace

import numpy as np
import pytest

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters
from lab.engine import information
from lab.engine.worlds import COUNT, SEED
from lab.studies.clamp import BEST, DRAWN, HANDS, KEPT, ROWS, STUDY
from lab.studies.held import CLAMP, DAMPING, hold

OPTIONS = SimpleNamespace(**{**STUDY.options, "friction": ("lugre-soft", "coulomb"), "episodes": 3})


def test_every_controller_is_held_by_every_hand_and_the_best_on_every_friction():
    tasks = STUDY.tasks(OPTIONS)
    assert len(tasks) == len(ROWS) * len(HANDS) + len(BEST) * 2
    assert len({task.name for task in tasks.values()}) == len(tasks)
    for (row, hand, friction, first), task in tasks.items():
        rig = Parameters.from_dict(task.settings["rig"])
        assert rig.friction == Parameters().friction
        assert documented_ranges(rig)["friction.law"] == (("coulomb",) if friction == "coulomb" else ("lugre",))
        assert (task.settings["stiffness"], task.settings["damping"]) == hand
        assert task.settings["told"] == (row.rig == information.TOLD)
        assert not SEED <= first < SEED + COUNT
    assert {hand for hand in HANDS if hand[0] == CLAMP} > {(CLAMP, DAMPING)}


def test_a_lost_rig_counts_as_the_worst_and_each_hand_has_its_column():
    tasks = STUDY.tasks(OPTIONS)

    def result(row, hand, friction):
        size = hand[0] / 1e3 if friction == DRAWN else 77.0
        return {**{name: [size] * 3 for name in KEPT}, "lost": [False, False, row.controller == "pid"]}

    figures = STUDY.keep(OPTIONS, {key: result(*key[:3]) for key in tasks})
    (held, frictions) = STUDY.show({"figures": figures, "settings": vars(OPTIONS)})["clamp.md"].split("In the hand of")
    first = next(line for line in held.splitlines() if line.startswith("| `admittance-adaptive` | default"))
    assert first.startswith("| `admittance-adaptive` | default | yes | yes | 5.00 | 5.00 | 10.0 | 10.0 | 20.0 | 20.0 |")
    assert "lost" in next(line for line in held.splitlines() if line.startswith("| `pid`"))
    assert frictions.count("77.0 | 77.0") == 2 * len(BEST)


def test_a_hand_feels_its_own_stiffness_of_a_port_that_moves_as_told():
    """A head that moves by a sine of 5 mm and 10 Hz presses with its amplitude times |k + i w d|."""
    omega, stiffness, damping = 2 * np.pi * 10.0, 4000.0, 30.0

    class Port:
        lanes, period, air, now = 1, 1e-3, np.zeros(1), 0.0
        force, openings = np.zeros((2, 1)), np.zeros((4, 1))

        def motion(self):
            place, speed = 5e-3 * np.sin(omega * self.now), 5e-3 * omega * np.cos(omega * self.now)
            return np.array([[0.5 + place], [0.0], [speed], [0.0]])

        def advance(self, hand):
            motion = self.motion()
            self.force = hand(self.now, motion[:2], motion[2:])
            self.now += self.period

    felt = hold(Port(), SimpleNamespace(position=np.array([[0.5], [0.0]])), stiffness, damping)
    assert felt["force"][0] == pytest.approx(2 * 5e-3 * abs(stiffness + 1j * omega * damping), rel=0.01)
    assert felt["motion"][0] == pytest.approx(0.01, rel=0.01)
    assert felt["press"][0] < 0.05

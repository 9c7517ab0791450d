"""The six experiments, as a table: what the end effector should do, what the hand does, what stiffness is asked for.

``nominal`` is the fixed experiment, ``varied`` the one that ``randomize`` draws around it. All figures are assumed unless a
source stands beside them; (0.5, 0) m is the centre of the workspace. ``docs/obstetrics.md`` lists every figure with its source.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from birthsim_env.parts.hands.contractions import Contractions
from birthsim_env.parts.hands.user_forces import AlternatingSteps, Pulls, Ramp, UserForce
from birthsim_env.parts.hands.vacuum import VacuumPulls
from birthsim_env.parts.references import Circle, FixedTarget, Path, Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule

Parts = tuple[Trajectory, UserForce, StiffnessSchedule]


@dataclass(frozen=True)
class Scenario:
    """One experiment: its duration in s, the makers of its parts, the version in its id, and what one meets in it."""

    title: str
    duration: float
    nominal: Callable[[], Parts]
    varied: Callable[[], Parts]
    version: int = 1
    about: str = ""


def _degrees(low: float, high: float) -> tuple[float, float]:
    return math.radians(low), math.radians(high)


def _circle() -> Parts:
    # Fig. 4: the stiffness doubles while the pneumatic stiffness falls. 2000 and 4000 N/m are the paper's.
    stiffness = StiffnessSchedule((0.0, 8.0), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0))
    return Circle(), AlternatingSteps(), stiffness


def _circle_varied() -> Parts:
    setpoints = (1000.0, 5000.0)
    stiffness = StiffnessSchedule((0.0, 8.0), (setpoints, setpoints), ((3000.0, 4800.0),) * 2, ((1500.0, 2400.0),) * 2)
    return Circle(radius=(0.03, 0.1), period=(3.0, 6.0)), AlternatingSteps(amplitude=(10.0, 40.0)), stiffness


PROBE_REST = 3.0
"""s before the push: with honest sensors the best law takes that long to bring the head to rest (docs/honest.md)."""


def _probe() -> Parts:
    return FixedTarget(), Ramp(begins=PROBE_REST), StiffnessSchedule()


def _probe_varied() -> Parts:
    reference = FixedTarget(((0.4, 0.6), (-0.1, 0.06)))
    stiffness = StiffnessSchedule((0.0,), ((1000.0, 4000.0),), ((3000.0, 4800.0),), ((1500.0, 2400.0),))
    return reference, Ramp(amplitude=(5.0, 40.0), angle="axes", begins=PROBE_REST), stiffness


def _descent() -> Parts:
    # Station -5 to +5 cm is 100 mm of straight descent; the arc stands for the curve of Carus, its radius and angle are
    # assumed. Compressed in time: a contraction of 60 to 90 s lasts 12 s, and five pushes share its middle 6 s; at a birth
    # three or four of 10 s do.
    reference = Path((0.42, -0.04), 0.0, 0.10, 0.07, math.radians(80), begins=1.0, ends=23.0)
    stiffness = StiffnessSchedule((0.0, 8.0, 16.0), (2000.0, 4000.0, 3000.0), (4200.0,) * 3, (2100.0,) * 3)
    return reference, Contractions(pushes=(5, 5)), stiffness


def _descent_varied() -> Parts:
    reference = Path(((0.41, 0.43), (-0.05, -0.02)), 0.0, 0.10, (0.06, 0.08), _degrees(70, 90), begins=1.0, ends=23.0)
    setpoints = (2000.0, 4000.0)
    stiffness = StiffnessSchedule((0.0, 8.0, 16.0), (setpoints,) * 3, ((3800.0, 4400.0),) * 3, ((1800.0, 2200.0),) * 3)
    return reference, Contractions(amplitude=(40.0, 125.0), push=(0.15, 0.35)), stiffness


def _forceps() -> Parts:
    # 30-45 lb, 133-200 N, are recommended (Leslie et al., Obstet Gynecol 105:377, 2005). Ramps of 45-100 N/s are assumed; in
    # simulated dystocia the steepest had 45 N/s, 2-249 (Crofts et al., AJOG 197:156, 2007). 4000 N/m is assumed. Compressed in
    # time: a traction lasts as long as a contraction, here 2 s.
    stiffness = StiffnessSchedule((0.0,), (4000.0,), (4200.0,), (2000.0,))
    return FixedTarget((0.45, 0.0)), Pulls((175.0, 175.0), rate=70.0, angle=math.radians(-10)), stiffness


def _forceps_varied() -> Parts:
    stiffness = StiffnessSchedule((0.0,), (4000.0,), ((3800.0, 4400.0),), ((1800.0, 2200.0),))
    pulls = Pulls(((150.0, 200.0), (150.0, 200.0)), rate=(45.0, 100.0), angle=_degrees(-20, 20))
    return FixedTarget(((0.43, 0.47), (-0.03, 0.03))), pulls, stiffness


def _dystocia() -> Parts:
    # Clinicians pulled 84, 122 and 163 N in *simulated* routine, difficult and dystocia deliveries (Allen et al., AJOG
    # 171:1621, 1994, doi 10.1016/0002-9378(94)90413-8). At births the peaks were 47, 69 and 100 N (Allen, Sorab, Gonik, Obstet
    # Gynecol 77:352, 1991). A trainee pulls as in the simulation, so the scenario keeps those. The head draws back at once.
    reference = Path((0.5, 0.0), math.pi, 0.012, begins=1.0, ends=1.5)
    stiffness = StiffnessSchedule((0.0, 1.0), (2000.0, 4000.0), (4200.0,) * 2, (2000.0,) * 2)
    return reference, Pulls((84.0, 122.0, 163.0), 100.0, math.radians(-5), begins=2.5, hold=1.5), stiffness


def _dystocia_varied() -> Parts:
    reference = Path(((0.48, 0.52), (-0.03, 0.03)), math.pi, (0.010, 0.015), begins=1.0, ends=1.5)
    stiffness = StiffnessSchedule((0.0, 1.0), (2000.0, 4000.0), ((3800.0, 4400.0),) * 2, ((1800.0, 2200.0),) * 2)
    pulls = Pulls(((75.0, 163.0),) * 3, (80.0, 120.0), _degrees(-15, 15), begins=2.5, hold=1.5)
    return reference, pulls, stiffness


def _vacuum() -> Parts:
    # Medians of the peak force of easy, average and hard extractions (Pettersson et al., BJOG 122:1809, 2015, 200 women). 241 N
    # is 98 % of what cylinder 2 can bear. Compressed in time: a pull lasts as long as a contraction, here 2 s. Pettersson et
    # al., PLOS ONE 12(3):e0171938 (2017), sum force over time as well, over 277 extractions; 2 s cannot render such sums.
    reference = Path((0.43, 0.0), 0.0, 0.04, begins=1.0, ends=22.0)
    stiffness = StiffnessSchedule((0.0,), (4000.0,), (4200.0,), (2000.0,))
    return reference, Pulls((176.0, 225.0, 241.0), rate=70.0), stiffness


def _vacuum_varied() -> Parts:
    reference = Path(((0.42, 0.44), (-0.03, 0.03)), 0.0, (0.03, 0.05), begins=1.0, ends=22.0)
    stiffness = StiffnessSchedule((0.0,), (4000.0,), ((3800.0, 4400.0),), ((1800.0, 2200.0),))
    return reference, VacuumPulls(((0.0, 1.0),) * 3, rate=(60.0, 100.0), angle=_degrees(-10, 10)), stiffness


SCENARIOS = {
    "circle": Scenario(
        "Circle under pushes (Fig. 4)", 16.0, _circle, _circle_varied,
        about="The head runs round a circle under pushes; after 8 s the stiffness doubles.",
    ),
    "probe": Scenario(
        "Stiffness test: hold and be pushed", 7.0, _probe, _probe_varied, version=2,
        about="The head stands still and gives way to whoever pulls it.",
    ),
    "descent": Scenario(
        "Fetal descent under contractions", 24.0, _descent, _descent_varied,
        about="The head descends through the birth canal while contractions push it.",
    ),
    "forceps": Scenario(
        "Forceps traction", 15.0, _forceps, _forceps_varied,
        about="Two pulls of 175 N, as with forceps, at a head held with 4000 N/m.",
    ),
    "dystocia": Scenario(
        "Dystocia: the head draws back and stiffens", 16.0, _dystocia, _dystocia_varied,
        about="The head draws back and stiffens; three pulls follow, up to 163 N.",
    ),
    "vacuum": Scenario(
        "Vacuum extraction", 24.0, _vacuum, _vacuum_varied, version=0,
        about="A vacuum cup pulls three times, up to 241 N, while the head comes forward.",
    ),
}  # fmt: skip


def environment_id(scenario: str, kind: str = "") -> str:
    """Gymnasium's id of a scenario; ``kind`` "Residual" is the one with a law inside."""
    return f"BirthSIM/{scenario.capitalize()}{kind}-v{SCENARIOS[scenario].version}"

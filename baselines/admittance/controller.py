"""Admittance outside, stiff backstepping inside, with disturbance observer, valve lead and gains that yield to oscillation.

The gains are what this command found (with lab, then with ideal) on linear valves, with gain and bandwidth a tenth lower: then
the rig as believed hunts less with lab sensors, and rigs of 1.5 kg with slow valves are stable with ideal ones, where
oscillation was halved as well. Repeated on the measured rig it finds, a tenth lower, the same within 8 % with ideal sensors.
With lab ones it halves what the worst rigs lose, but those in the middle hunt four times as much, so that the gains stayed.
    birthsim tune --controller admittance-backstepping --trials 45 --seed 1 --sensors lab --start gains.json --out out/tune/lab
"""

import math
from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.admittance import estimator, law
from baselines.admittance.rows import Constants, Gains, Memory
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.controller import check_flags, checked_gains, require_stiffness
from baselines.estimation import friction_observer, inertial
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.estimation.hand import friction_candidates
from baselines.impedance import Impedance, mass_spring_damper
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import INTERMEDIATE, POSITION
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register

LEAST_FRACTION = 0.35
"""Lower bound of the gain reduction. With less gain friction holds the piston."""

SAMPLED_LEAST, MOST_FALLS = 0.5, 3.0
"""With sampled positions and a force sensor, where it learns: the least fraction of the gain, and how many times a large half
wave lowers it at once. A late tracker makes light rigs swing at 10 Hz until the gain has fallen; with less gain than this a
noisy one makes them swing at 1 Hz. Found by trial, in randomised worlds with data-sheet sensors; without a force sensor
friction then hunts more."""

HEAVY = 5.0
"""kg; assumed: the gains were found on rigs up to this mass. The noise of samples moves a head by the more, the more mass times
gain answers it. With sampled positions and a force sensor, where it learns, a heavier head therefore rests with a gain lower
by sqrt(HEAVY/mass). At 9 kg it then hunts by 0.6 instead of 1.7 mm. The root was found by trial."""

SWING = 0.015
"""m/s of the speed error, beyond which a loop that knows the hand by friction alone is calmed at rest; found by trial."""

MOST_BIAS = 2.0
"""assumed: a force sensor's bias is at most so many times that believed."""

IDEAL = {
    **{"gain": 90.0, "rest_gain": 90.0, "rest_push": 1.0, "bandwidth": 108.0, "friction_fraction": 1.0, "friction_rate": 4.0},
    **{"dead_zone": 0.0, "lead_time": 0.0011, "oscillation": 0.1, "yielding": 0.94},
}
LAB = {
    **{"gain": 68.0, "rest_gain": 35.6, "rest_push": 2.0, "bandwidth": 110.0, "pressure_bandwidth": 30.0},
    **{"friction_fraction": 0.943, "friction_rate": 4.0, "dead_zone": 6.2e-6, "lead_time": 0.0005, "oscillation": 0.092},
    "yielding": 0.93,
}


@register(
    controller="admittance",
    about="Another name of admittance-adaptive, to which options are given.",
    needs={"force sensor"},
    listed=False,
    order=20,
)
@register(
    controller="admittance-backstepping",
    about="Measures the hand's force, and moves the rig to where the spring would be.",
    needs={"force sensor"},
    options={"learn": False},
    order=21,
)
@register(
    controller="admittance-adaptive",
    about="The admittance law, which also learns friction, light masses, noise and its force sensor's bias.",
    needs={"force sensor"},
    order=22,
)
@register(
    controller="admittance-sensorless",
    about="The admittance law, with the hand's force estimated from pressures and motion.",
    options={"force_sensor": False},
    order=23,
)
class AdmittanceController(StagedController):
    """Renders any stiffness matrix through friction.

    The law turns the hand's force into the motion that the hand should find, estimates what is not known of the rig, friction
    above all, and follows the motion with a stiff loop (``law``). Without a force sensor it finds the hand's force from
    pressures and motion, and never reads ``Measurement.user_force``: by an acceleration sensor (``inertial_force``) where the
    rig as believed has one, else by positions (``force_observer``).

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        force_sensor: whether the hand's force is measured.
        learn: whether it learns the tracker's noise and, with a force sensor, that sensor's bias and the friction of sliding
            pistons, which nothing else separates from the hand, and yields faster to large oscillations. From samples and a
            force it also learns that the rig is lighter than believed (``inertia``) and weighs ten frictions
            (``friction_observer``), which it goes by while the target rests. Only then does it read an acceleration
            sensor, where positions are samples and the rig as believed has one; such a loop needs no mass.
        identified: without a force sensor: whether the friction believed is the rig's to 5 %, as after ``birthsim identify``.
            Then a resting hand is found by the bristles and the head rests quietly; with half that friction it wanders by
            10 mm. With an acceleration sensor LuGre alone is then believed, so that small slow pushes are found sooner;
            without this option other laws of friction are weighed too, and one that explains more takes its place.
        gains: those of ``TUNABLE``, SI units. Where one is not given, ``TUNED`` has its value for the sensors in use.
            gain: c, 1/s, while the reference moves. rest_gain: c, 1/s, once it rests; less for a rig above ``HEAVY``.
            rest_push: by how much the position error of a resting piston is multiplied.
            bandwidth: 1/s, of the observer of disturbances.
            pressure_bandwidth: 1/s, of the observer of pressures, where their cells are noisy (``lab`` sensors).
            friction_fraction: fraction of the believed friction that is fed forward along the reference.
            friction_rate: 1/s, at which friction is learned; 0 learns none.
            dead_zone: m, of a resting piston's error. lead_time: s, in which a spool follows.
            oscillation: m/s. Where the speed error swings beyond it, each sustained half wave multiplies the gain by yielding.

    ``gain_fraction`` (2, N) is the gain that is left across and along cylinder 2. Where an acceleration sensor tells the hand's
    force, ``friction_trust`` (2, N) says how probable the friction believed is, and ``remarks()`` where it is not. Raises
    ``ValueError`` for unknown gains and values out of range.
    """

    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {
        "gain": (30.0, 100.0),
        "rest_gain": (25.0, 100.0),
        "rest_push": (1.0, 8.0),
        "bandwidth": (30.0, 120.0),
        "pressure_bandwidth": (30.0, 1000.0),
        "friction_fraction": (0.0, 1.0),
        "dead_zone": (0.0, 5e-5),
        "lead_time": (5e-4, 5e-3),
        "oscillation": (0.02, 0.2),
        "yielding": (0.8, 1.0),
        "friction_rate": (0.0, 20.0),
    }
    TUNED: ClassVar[dict[str, dict[str, float]]] = {
        "ideal": IDEAL,
        "lab": LAB,
        "lab, learning": {**LAB, "rest_gain": 45.0},
        "lab, weighing": {**LAB, "rest_gain": 36.0, "rest_push": 1.0, "dead_zone": 0.0},
        "inertial": {**IDEAL, "rest_gain": 45.0, "pressure_bandwidth": 30.0},
    }

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        force_sensor: bool = True,
        learn: bool = True,
        identified: bool = False,
        **gains: float,
    ) -> None:
        gains = checked_gains(self, gains)
        check_flags({"force_sensor": force_sensor, "learn": learn, "identified": identified})
        if identified and force_sensor:
            raise ValueError(f"identified = {identified!r} with a force sensor; allowed: only where force_sensor is False")
        if gains.get("yielding", 1.0) > 1:
            raise ValueError(f"yielding = {gains['yielding']!r}; allowed: at most 1, where oscillations cost no gain")
        super().__init__(parameters)
        self.reads_force = self._force_sensor = bool(force_sensor)
        self._learn, self._identified = bool(learn), bool(identified)
        self._own, self._candidates, self._rows_of_bank = gains, 0, 0

    @property
    def gain_fraction(self) -> Array:
        """What oscillations across and along cylinder 2 have left of the gain, (2, N): 1 where there were none."""
        follower = Memory(self._memories[-1]).follower
        return np.stack([follower.across.fraction, follower.along.fraction])

    @property
    def friction_trust(self) -> Array:
        """Probability, (2, N), that pistons 1 and 2 have the friction believed rather than another law of the same level.

        1 where it is ``identified``, or where nothing weighs it: that takes an acceleration sensor, a controller that learns
        without a force sensor, and positions that are samples."""
        memory = self._memories[-1]
        if not self._candidates:
            return np.ones((2, memory.shape[1]))
        found: Array = friction_candidates.chances(memory[-self._rows_of_bank :])[friction_candidates.LUGRE]
        return found

    def remarks(self) -> list[str]:
        """What is to be said of the control so far: that the friction believed is wrong, where it is."""
        doubted = friction_candidates.DOUBTED
        if not self._lanes or (self.friction_trust >= doubted).all():
            return []
        return [
            f"another law of friction than the one believed explains how a piston moves (friction_trust below {doubted:g}), "
            "and the hand's force follows that one: birthsim identify finds friction anew"
        ]

    def declared_impedance(self, reference: Reference) -> Impedance:
        """The mass, damper and spring of the admittance, over N lanes."""
        return mass_spring_damper(reference, self.parameters.mechanics.mass, DAMPING_RATIO)

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        rig, noisy = self.parameters, sampled
        board, learns_force = rig.electronics, self._learn and self._force_sensor
        fixed = self._force_sensor and not self._learn
        inert = sampled and self._learn and board.acceleration_bandwidth > 0
        sampled, weighed = sampled and not inert, inert and not self._force_sensor
        weighs, learning = sampled and learns_force, "lab, weighing" if learns_force else "lab, learning"
        kind = "inertial" if inert else "ideal" if not sampled else learning if self._learn else "lab"
        tuned, least, falls = self.TUNED[kind], LEAST_FRACTION, 1.0
        if weighs:
            lighter = math.sqrt(min(1.0, HEAVY / rig.mechanics.mass))
            tuned, least, falls = {**tuned, "rest_gain": lighter * tuned["rest_gain"]}, SAMPLED_LEAST, MOST_FALLS
        g = {**tuned, **self._own}
        quickness = 1.0 - exact.number("exp", -board.control_period / g["lead_time"])
        calmed = {"swing": SWING if self._identified and not inert else 0.0, "least_fraction": least, "most_falls": falls}
        follow = {"pneumatic_gain": PNEUMATIC_GAIN, "quickness": quickness, **calmed, **g}
        self._candidates = (1 if self._identified else friction_candidates.CANDIDATES) if weighed else 0
        candidates = len(friction_observer.BRISTLES) if weighs else self._candidates
        self._rows_of_bank = len(friction_candidates.fresh_bank(candidates))
        fresh = estimator.fresh_memory(rig, sampled, candidates)
        parameters = estimator.estimator_parameters(
            rig,
            sampled,
            noisy,
            g,
            force_sensor=self._force_sensor,
            learns_noise=(sampled and self._learn) or weighed,
            place=INTERMEDIATE if inert else POSITION,
            friction_rate=g["friction_rate"] if learns_force else 0.0,
            identified=self._identified,
            learns_mass=weighs,
            weighs_friction=weighs,
            feels_stiff_hand=learns_force,
            weighed=weighed,
            rows_of_memory=len(fresh),
            rows_of_bank=self._rows_of_bank,
            believed_limit=estimator.BELIEVED_LIMIT if inert or fixed else estimator.BELIEVED_HAND,
            most_bias=MOST_BIAS * board.force_bias if noisy and learns_force else 0.0,
        )
        constants = Constants.numbers(**parameters, gains=Gains.numbers(**{name: follow[name] for name in Gains.groups}))
        own = ControllerStage(law.control, constants, fresh)
        return [inertial.controller_stage(rig), own] if inert else [own]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        require_stiffness(reference, 0.0)

"""Admittance outside, stiff backstepping inside, with disturbance observer, valve lead and gains that yield to oscillation.

The gains are what this command found (with lab, then with ideal) on linear valves, with gain and bandwidth a tenth lower: then
the rig as believed hunts less with lab sensors, and rigs of 1.5 kg with slow valves are stable with ideal ones, where
oscillation was halved as well. Repeated on the measured rig it finds, a tenth lower, the same within 8 % with ideal sensors.
With lab ones it halves what the worst rigs lose, but those in the middle hunt four times as much, so that the gains stayed.
    birthsim tune --controller admittance-backstepping --trials 45 --seed 1 --sensors lab --start gains.json --out out/tune/lab
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.admittance import belief, estimator, law
from baselines.admittance.belief import Belief
from baselines.admittance.believable import require_believable
from baselines.admittance.rows import Constants, Gains, Memory
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.controller import check_flags, checked_gains, require_stiffness
from baselines.estimation import friction_observer, inertial, rig_filter, rig_reader
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.estimation.hand import friction_candidates
from baselines.estimation.readers import reader_of
from baselines.estimation.rig_filter import RigFilter
from baselines.estimation.rig_reader import RigReader
from baselines.impedance import Impedance, mass_spring_damper
from baselines.network import PolicyNetwork
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import INTERMEDIATE, POSITION
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, PARAMETERS, Array, parameter_array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import near, shown
from birthsim_env.registry import register

LEAST_FRACTION = 0.35
"""Lower bound of the gain reduction. With less gain friction holds the piston."""

SAMPLED_LEAST, MOST_FALLS = 0.5, 3.0
"""With sampled positions and a force sensor, where it learns: the least fraction of the gain, and how many times a large half
wave lowers it at once. A late tracker makes light rigs swing at 10 Hz until the gain has fallen; with less gain than this a
noisy one makes them swing at 1 Hz. Found by trial, in randomised worlds with data-sheet sensors; without a force sensor
friction then hunts more."""

HEAVY, ANY_MASS = 5.0, 1e9
"""kg. The second stands for none. The first is assumed: the gains were found on rigs up to this mass. The noise of samples
moves a head by the more, the more mass times gain answers it. With sampled positions and a force sensor, where it learns, a
heavier head therefore rests with a gain lower by sqrt(HEAVY/mass). At 9 kg it then hunts by 0.6 instead of 1.7 mm. The root
was found by trial."""

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
        own_beliefs: whether lanes may believe in different rigs, which ``believe`` tells them.
        finds_rig: with a force sensor: whether each lane finds ten parameters of its rig while it runs, ``found_rig``, and
            believes in them: mass, supply, bores, friction, lag of the valves and dead volume (``rig_filter``).
        reader: with a force sensor: the name or the file of a network that corrects what is found (``rig_reader``), by which it
            ``finds_rig`` too; "" for none.
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
        own_beliefs: bool = False,
        finds_rig: bool = False,
        reader: str | Path | PolicyNetwork = "",
        **gains: float,
    ) -> None:
        gains = checked_gains(self, gains)
        flags = {"force_sensor": force_sensor, "learn": learn, "identified": identified, "own_beliefs": own_beliefs}
        check_flags({**flags, "finds_rig": finds_rig})
        if identified and force_sensor:
            raise ValueError(f"identified = {identified!r} with a force sensor; allowed: only where force_sensor is False")
        self._reader = reader_of(reader)
        finds_rig = bool(finds_rig) or self._reader is not None
        if finds_rig and not force_sensor:
            raise ValueError(f"finds_rig = {finds_rig!r} without a force sensor; allowed: only where force_sensor is True")
        if gains.get("yielding", 1.0) > 1:
            raise ValueError(f"yielding = {gains['yielding']!r}; allowed: at most 1, where oscillations cost no gain")
        super().__init__(parameters)
        if finds_rig and self.parameters.linkage.is_rail:
            raise ValueError(f"finds_rig = {finds_rig!r} on a rail; allowed: only for a rig of two cylinders")
        if finds_rig:
            rig_filter.spread_of(self.parameters)
        self.reads_force = self._force_sensor = bool(force_sensor)
        self._learn, self._identified = bool(learn), bool(identified)
        self._own, self._candidates, self._rows_of_bank, self._rows = gains, 0, 0, 0
        self._finds_rig = bool(finds_rig)
        self._own_beliefs, self._told = bool(own_beliefs or finds_rig), np.zeros((PARAMETERS, 0))

    def believe(self, rig: Parameters | Sequence[Parameters], lanes: Mask | None = None) -> None:
        """Tell lanes another rig, at any time, which ``reset`` does not take back.

        A lane that runs goes over to it without a jump (``belief``); one that begins anew begins with it.

        Parameters
        ----------
        rig : Parameters or sequence of Parameters
            One rig, or one for each lane that is told. It may differ from the controller's in what the plant computes with,
            not in its sensors.
        lanes : array of bool, (N,), or None
            Which lanes are told; None stands for all. Before the first period there are as many as the mask has, or as there
            are rigs.

        Raises
        ------
        ValueError
            Without the option ``own_beliefs``, with ``finds_rig``, for another number of rigs or lanes, and for a rig that
            differs in anything that its lane cannot believe, which is named.

        Examples
        --------
        >>> import birthsim
        >>> law = birthsim.make_controller("admittance[own_beliefs=true]")
        >>> light, heavy = (birthsim.Parameters().replace({"mechanics.mass": mass}) for mass in (2.0, 4.0))
        >>> law.believe([light, heavy])
        >>> law.believed("mass").tolist()
        [2.0, 4.0]
        """
        if self._finds_rig or not self._own_beliefs:
            said = f"own_beliefs = {self._own_beliefs!r}, finds_rig = {self._finds_rig!r}"
            raise ValueError(f"{said}; allowed: own_beliefs = True alone, where lanes are told rigs of their own")
        rigs = [rig] if isinstance(rig, Parameters) else list(rig) if isinstance(rig, Sequence) else []
        if not rigs or not all(isinstance(one, Parameters) for one in rigs):
            raise ValueError(f"rig = {shown(rig)}; allowed: a Parameters, or a sequence with one for each lane that is told")
        for one in rigs:
            require_believable(one, self.parameters)
        known = self._told.shape[1] or self._lanes
        if lanes is None:
            lanes = np.ones(known or len(rigs), dtype=np.bool_)
        among = known or np.size(lanes)
        if np.shape(lanes) != (among,) or np.asarray(lanes).dtype != np.bool_:
            raise ValueError(f"lanes = {shown(lanes)}; allowed: an array of {among} times True or False")
        if len(rigs) not in (1, int(np.sum(lanes))):
            raise ValueError(f"rig has {len(rigs)} entries; allowed: one, or one for each of {int(np.sum(lanes))} lanes")
        told = parameter_array(rigs[0] if len(rigs) == 1 else rigs, int(np.sum(lanes)))
        if not self._told.shape[1]:
            self._told = np.repeat(self._p[:, None], among, axis=1)
        self._told[:, lanes] = told
        if self._lanes:
            now = self._beliefs()
            now.told[:, lanes], now.news[lanes] = told, 1.0

    def believed(self, name: str) -> Array:
        """What lanes believe in now.

        Parameters
        ----------
        name : str
            Of what plants compute with, ``physics.compiled.lanes.PARAMETER_NAMES``: ``"mass"``, ``"fc1"``, ``"area_p2"``.

        Returns
        -------
        array, (N,)
            SI units. Before the first period it is what lanes will begin with.

        Raises
        ------
        ValueError
            For an unknown name.
        """
        if name not in PARAMETER_NAMES:
            raise ValueError(f"name = {shown(name)}{near(str(name), PARAMETER_NAMES)}; allowed: {', '.join(PARAMETER_NAMES)}")
        place = PARAMETER_NAMES.index(name)
        if self._own_beliefs and self._lanes:
            now: Array = self._beliefs().rig[place].copy()
            return now
        return self._told[place].copy() if self._told.shape[1] else np.repeat(self._p[place], max(1, self._lanes))

    @property
    def found_rig(self) -> dict[str, tuple[Array, Array]]:
        """Parameter -> what each lane has found of it, (N,), SI units, and the standard deviation of its logarithm, (N,).

        Empty where it finds none, and before the first period."""
        if not (self._finds_rig and self._lanes):
            return {}
        filtered = self.rows_of_law()
        if self._reader is not None:
            return rig_reader.found(RigReader(self._memories[-1][filtered + RigFilter.size :]), self.parameters)
        return rig_filter.found(RigFilter(self._memories[-1][filtered:]), self.parameters)

    def rows_of_law(self) -> int:
        """What the law remembers of a lane with its belief: so many rows stand before what finds the rig."""
        return self._rows + Belief.size

    def _beliefs(self) -> Belief:
        return Belief(self._memories[-1][self._rows :][: Belief.size])

    def _remembered(self) -> Array:
        """What lanes remember besides: ``Memory`` and the bank of candidates."""
        return self._memories[-1][: self._rows]

    def begin(self, lanes: Mask) -> None:
        """Lanes that begin anew begin with the rig that they were told."""
        if not self._told.shape[1]:
            return
        if self._told.shape[1] != self._lanes:
            raise ValueError(f"{self._lanes} lanes, and rigs told to {self._told.shape[1]}; allowed: as many")
        begun = self._beliefs()
        begun.told[:, lanes], begun.rig[:, lanes] = self._told[:, lanes], self._told[:, lanes]
        Memory(self._remembered()).inertia.mass[lanes] = self._told[at.MASS, lanes]

    @property
    def gain_fraction(self) -> Array:
        """What oscillations across and along cylinder 2 have left of the gain, (2, N): 1 where there were none."""
        follower = Memory(self._remembered()).follower
        return np.stack([follower.across.fraction, follower.along.fraction])

    @property
    def friction_trust(self) -> Array:
        """Probability, (2, N), that pistons 1 and 2 have the friction believed rather than another law of the same level.

        1 where it is ``identified``, or where nothing weighs it: that takes an acceleration sensor, a controller that learns
        without a force sensor, and positions that are samples."""
        memory = self._remembered()
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
        mass = self.believed("mass") if self._own_beliefs else self.parameters.mechanics.mass
        return mass_spring_damper(reference, mass, DAMPING_RATIO)

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
            least, falls = SAMPLED_LEAST, MOST_FALLS
        g = {**tuned, **self._own}
        quickness = 1.0 - exact.number("exp", -board.control_period / g["lead_time"])
        calmed = {"swing": SWING if self._identified and not inert else 0.0, "least_fraction": least, "most_falls": falls}
        heavy = HEAVY if weighs and "rest_gain" not in self._own else ANY_MASS
        follow = {"pneumatic_gain": PNEUMATIC_GAIN, "quickness": quickness, "heavy": heavy, **calmed, **g}
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
            feels_stiff_hand=learns_force or weighed,
            weighed=weighed,
            rows_of_memory=len(fresh),
            rows_of_bank=self._rows_of_bank,
            believed_limit=estimator.BELIEVED_LIMIT if inert or fixed else estimator.BELIEVED_HAND,
            most_bias=MOST_BIAS * board.force_bias if noisy and learns_force else 0.0,
        )
        self._rows = len(fresh)
        function, remembered = law.control, fresh
        if self._own_beliefs:
            function, remembered = law.control_each, np.concatenate([fresh, belief.fresh(self._p)])
        if self._finds_rig:
            remembered = np.concatenate([remembered, rig_filter.fresh(rig)])
        read = np.zeros(0) if self._reader is None else rig_reader.fresh(rig, self._reader)
        constants = Constants.numbers(
            **parameters,
            gains=Gains.numbers(**{name: follow[name] for name in Gains.groups}),
            rows_of_finder=RigFilter.size if self._finds_rig else 0,
            rows_of_reader=len(read),
            cell_noise=board.pressure_noise,
            spread=rig_filter.spread_of(rig) if self._finds_rig else np.zeros(rig_filter.SIZE),
        )
        tables = None if self._reader is None else partial(rig_reader.tables, self._reader)
        own = ControllerStage(function, constants, np.concatenate([remembered, read]), tables=tables)
        return [inertial.controller_stage(rig), own] if inert else [own]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        require_stiffness(reference, 0.0)

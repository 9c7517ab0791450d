"""Rigs that rest on their targets under a controller: what the stiffness test, haptics and the laboratory share."""

from collections.abc import Sequence

import numpy as np

from baselines.controller import Controller
from baselines.driving import driving
from birthsim_env.loop.loop import MixedLoop, available_threads
from birthsim_env.loop.rows import ASKED, REFERENCE, TIME
from birthsim_env.loop.signals import Reference
from birthsim_env.loop.stage import Part
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.hands.user_forces import UserForce
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.lanes import Array, parameter_array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.simulation import Simulation


class RestingRigs(Simulation):
    """N ``rigs``, one a lane, at rest on the targets of a ``reference``, which stays, under a controller; no episodes.

    ``sensors`` is the name of a sensor model; lane i seeds it with ``seed`` + i. With ``force_sensor`` False the controller
    sees a force of zero. ``moved`` are the rigs that move, where they are others than those that are balanced. With a ``name``
    a controller's openings are checked; ``options`` are what its ``command`` takes besides the signals. Raises ``ValueError``
    for a target outside the workspace. ``asked`` (15, N), ``pushed`` (2, N), N, and ``opened`` (4, N) may be written while the
    loop runs: what is asked for, the hand's force, and the openings.
    """

    def __init__(
        self,
        rigs: Sequence[Parameters],
        reference: Reference,
        controller: Controller,
        sensors: str = "ideal",
        seed: int = 0,
        force_sensor: bool = True,
        moved: Sequence[Parameters] | None = None,
        name: str | None = None,
        options: dict[str, Array] | None = None,
    ) -> None:
        lanes, still = len(rigs), (Trajectory(), UserForce(), StiffnessSchedule())
        law = driving(controller, name, options)
        super().__init__(lanes, rigs[0], {}, *still, sensors, law, 1, available_threads(), force_sensor)
        self.plant = Plant(moved or rigs, lanes)
        piston = inverse_geometry(reference.position, rigs[0])
        balance = parameter_array(list(rigs), lanes), piston, np.zeros((2, lanes)), reference.pneumatic_stiffness
        self.plant.state = balanced_state(*balance)
        for lane in range(lanes):
            self.sensors.begin(lane, stream(seed + lane, 0, "sensors"))
        self.asked, self.pushed, self.opened = self._seen[REFERENCE:ASKED], self._force, self._openings
        self.asked[:], self._motion[:] = reference.rows, self.plant.end_effector()
        law.begin(np.ones(lanes, dtype=np.bool_))

    def close(self, hand: Sequence[Part], commanded: Sequence[Part] = (), carry: Sequence[Part] | None = None) -> None:
        """Close the loop: ``hand``, sensors, controller, ``commanded``, board, and the plant, or what ``carry`` makes of it."""
        group = self.pipeline.group
        order = [*hand, *group("sensors"), *group("actuation"), *commanded, *group("board"), *(carry or group("plant"))]
        self._loop = MixedLoop(self.plant.num_envs, *self.places(), order)
        self.actuation.check(self.measurement)

    def path(self, periods: int) -> Array:
        """Go on by some control periods; returns where the end effector was at the beginning of each, m, (T, 2, N)."""
        places = np.empty((periods, 2, self.plant.num_envs))
        for place in places:
            place[:] = self._motion[:2]
            self.run(1)
        return places

    def moves(self, _: int = 0) -> None:
        """The clock goes on by a period; the end effector is where the plant has it."""
        self._tick += 1
        self._seen[TIME], self._motion[:] = self._tick[0] * self.period, self.plant.end_effector()

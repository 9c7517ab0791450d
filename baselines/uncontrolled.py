"""What any controller should beat: shut valves, slammed valves, random openings. They look at nothing."""

from typing import ClassVar

import numpy as np

from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import checked_count
from birthsim_env.registry import LAST, register
from birthsim_env.restored import Declared, Kept

HELD = 0.01
"""s that a random opening is held: the default policy period."""


class Uncontrolled:
    """The base of what looks at nothing, so that comparisons know what any controller should beat."""


@register(controller="shut-valves", about="All valves stay shut: the rig is a spring of air.", order=LAST + 1)
class ShutValves(Uncontrolled):
    """Spools in the middle: what leaks apart, the chambers are air springs."""

    opening = (0.0, 0.0, 0.0, 0.0)

    def __init__(self, parameters: Parameters) -> None:
        self._opening = np.array(self.opening)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """The same openings (4, N), or (4,) for one rig, at all times."""
        lanes = measurement.time.shape
        return np.broadcast_to(self._opening.reshape(4, *[1] * len(lanes)), (4, *lanes)).copy()

    def reset(self, lanes: Mask | None = None) -> None:
        """Nothing is remembered."""


@register(controller="slammed-valves", about="Fully open valves drive both pistons out.", order=LAST + 2)
class SlammedValves(ShutValves):
    """Both pistons driven out with fully open valves."""

    opening = (1.0, -1.0, 1.0, -1.0)


@register(controller="random-valves", about="Valves open at random.", order=LAST + 3)
class RandomValves(Uncontrolled):
    """Uniform openings, drawn anew every ``HELD`` s from a generator that begins with ``seed``."""

    in_state: ClassVar[Declared] = {"_count": Kept(0, 2**62, whole=True), "_openings": Kept(-1.0, 1.0)}

    def __init__(self, parameters: Parameters, seed: int = 0) -> None:
        self._openings: Array | None = None
        self._periods = max(1, round(HELD / parameters.electronics.control_period))
        self._seed = checked_count("seed", seed, 0, 2**63)
        self.reset()

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Openings (4, N), or (4,) for one rig."""
        if self._count % self._periods == 0:
            self._openings = self._rng.uniform(-1.0, 1.0, (4, *measurement.time.shape))
        self._count += 1
        assert self._openings is not None, "drawn in the first period"
        return self._openings

    def reset(self, lanes: Mask | None = None) -> None:
        """All lanes: begin the generator anew; some lanes: their draws go on."""
        if lanes is None:
            self._rng, self._count = np.random.default_rng(self._seed), 0

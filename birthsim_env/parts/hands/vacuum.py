"""Tractions of a vacuum extraction, with the peak forces that were measured at births."""

from typing import Any

import numpy as np

from birthsim_env.parts.drawn.seeding import Range, draw
from birthsim_env.parts.hands.pulls import Pulls

LEAST, USUAL, MOST, BELOW = 5.0, 216.0, 452.0, 0.66
"""N: peak forces of extractions; 66 % of them stay below ``USUAL``.

Pettersson et al., BJOG 122:1809 (2015), 200 women, doi 10.1111/1471-0528.13222; straight lines between the three are assumed.
"""

HELD = 225.0
"""N: the largest pull that is drawn, 91 % of what cylinder 2 can bear; the rest is for friction, motion and oblique pulls."""


class VacuumPulls(Pulls):
    """``Pulls`` whose ``sizes`` are fractions of the extractions, (0, 1) for all of them, instead of N.

    A fraction becomes the peak force that so many stay below, clipped at ``HELD``, as a third of them are.
    """

    def __init__(self, sizes: tuple[Range, ...], rate: Range, angle: Range = 0.0) -> None:
        super().__init__(sizes, rate, angle)

    def peak(self, size: Range, rng: np.random.Generator) -> Any:
        part = draw(size, rng)
        low, high = LEAST + (USUAL - LEAST) / BELOW * part, USUAL + (MOST - USUAL) / (1 - BELOW) * (part - BELOW)
        return np.minimum(HELD, np.where(np.less(part, BELOW), low, high))

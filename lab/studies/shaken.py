"""What a hand that shakes rigs at rest feels: just noticeable differences at 1 Hz, and energy that it is given."""

from collections.abc import Sequence

import numpy as np

from baselines.controller import Controller
from baselines.impedance import declared_by, stiffness_matrix
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.haptics.impedance import noticeable_differences
from lab.studies.haptics.multisine import FREQUENCIES, SECONDS, impedance_felt, multisine_hand
from lab.studies.haptics.recording import record
from lab.studies.haptics.worlds import DIRECTIONS, POSES, lost_lanes, resting
from lab.studies.stability.rig_port import RigPort

STIFFNESS = 2000.0
"""N/m, while a hand holds or shakes the head."""

PEAK, PHASES = 10.0, 11
"""N, of the multisine, and the seed of its phases."""

LINE = int(np.argmin(np.abs(FREQUENCIES - 1.0)))
"""Of 1 Hz among ``FREQUENCIES``."""


def at_rest(lanes: int, places: Sequence[Sequence[float]] = POSES, stiffness: float = STIFFNESS) -> Reference:
    """Resting targets at ``places`` (m) in turn, with the same stiffness (N/m)."""
    return resting([places[k % len(places)] for k in range(lanes)], [stiffness] * lanes)


def shaken(law: Controller, rigs: Sequence[Parameters], sensors: str, seed: int, force_sensor: bool = True) -> dict[str, Array]:
    """Of a rig per lane, which multisines of ``PEAK`` shake at ``POSES`` along x or y, (N,) each.

    ``noticed``: just noticeable differences of the compliance at 1 Hz from that of the impedance that the law declares, or of
    the stiffness asked for where it declares none; ``energy``, J: the most that the port had given to the hand; ``lost``: 1
    for a lane that ran into an end stop or left the range of numbers.
    """
    lanes = len(rigs)
    reference, direction = at_rest(lanes), np.transpose([DIRECTIONS[k // len(POSES) % 2] for k in range(lanes)])
    port, declared = RigPort(rigs, reference, law, sensors, seed, force_sensor=force_sensor), declared_by(law, reference)
    recording = record(port, multisine_hand(direction, np.full(lanes, PEAK), PHASES), SECONDS)
    if declared is None:
        compliance = np.linalg.inv(stiffness_matrix(reference).T)
        wanted = np.broadcast_to(1.0 / np.einsum("in,nij,jn->n", direction, compliance, direction), (len(FREQUENCIES), lanes))
    else:
        wanted = declared.along(FREQUENCIES, direction)
    noticed = noticeable_differences(impedance_felt(recording, direction), wanted)[LINE]
    lost = np.asarray(lost_lanes(port, rigs), dtype=np.float64)
    return {"noticed": noticed, "energy": recording.energy.max(axis=0), "lost": lost}

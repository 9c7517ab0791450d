"""Backdrivability: the force beyond ``K x`` that a hand needs to move the end effector slowly to and fro."""

import itertools
from typing import Any

import numpy as np

from baselines.work.tasks import Result
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.haptics.recording import Recording, record
from lab.studies.haptics.worlds import DIRECTIONS, POSES, condition_of, lost_lanes, resting
from lab.studies.stability.rig_port import Hand

STIFFNESSES = (500.0, 200.0, 100.0, 50.0, 0.0)
"""N/m."""

TRAVEL, SPEED = 0.015, 0.010
"""m to both sides and m/s; assumed: slower than any damping counts for, fast enough for sliding friction."""

GUIDE, GUIDE_DAMPING = 4000.0, 60.0
"""N/m and N s/m of the hand, assumed: a stiff arm that leads the end effector along."""

TURN = 0.4
"""s after a turn of the hand that do not count; assumed."""

LEG = 2 * TRAVEL / SPEED
"""s from one end to the other."""

SECONDS = 2.5 * LEG
"""From the middle to one end, to the other and back twice: two whole legs are measured."""


def guiding_hand(target: Array, direction: Array) -> Hand:
    """A hand that leads the end effector from ``target`` (2, N), m, to and fro along unit vectors ``direction`` (2, N)."""

    def hand(now: float, position: Array, velocity: Array) -> Array:
        turned = (now + LEG / 2) % (2 * LEG)
        way = min(turned, 2 * LEG - turned) * SPEED - TRAVEL
        rate = SPEED if turned < LEG else -SPEED
        return GUIDE * (target + way * direction - position) + GUIDE_DAMPING * (rate * direction - velocity)

    return hand


def beyond_spring(recording: Recording, target: Array, direction: Array, stiffness: float) -> tuple[Array, Array]:
    """Mean and largest size, N, (N,) each, of the force along ``direction`` less ``stiffness`` times the displacement.

    Counted while the hand moves steadily: two legs, less ``TURN`` s after each turn.
    """
    along = np.einsum("tin,in->tn", recording.force - stiffness * (recording.position - target), direction)
    turned = (recording.time - LEG / 2) % LEG
    size = np.abs(along[(recording.time > LEG / 2) & (turned > TURN)])
    return size.mean(axis=0), size.max(axis=0)


def measure_backdriving(stiffness: float, **settings: Any) -> Result:
    """Per lane, which are poses, directions and rigs; ``refused`` says why a law does not take the setpoint."""
    condition = condition_of(**settings)
    if (why := condition.refusal(stiffness)) is not None:
        return {"stiffness": stiffness, "refused": why}
    cases = list(itertools.product(POSES, DIRECTIONS, condition.drawn()))
    poses, directions, rigs = (list(side) for side in zip(*cases, strict=True))
    reference, direction = resting(poses, [stiffness] * len(cases)), np.transpose(directions)
    port = condition.port(condition.law(), rigs, reference)
    recording = record(port, guiding_hand(reference.position, direction), SECONDS)
    mean, most = beyond_spring(recording, reference.position, direction, stiffness)
    lost = lost_lanes(port, rigs)
    return {"stiffness": stiffness, "refused": None, "mean": mean.tolist(), "most": most.tolist(), "lost": lost.tolist()}

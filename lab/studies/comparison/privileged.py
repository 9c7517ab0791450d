"""Controllers that are told each rig that is drawn, where others believe the described one."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from baselines.bench.evaluation import Evaluation, batches, evaluate, merged
from baselines.named import make_controller
from baselines.staged import StagedController
from birthsim_env.assembly import Arguments
from birthsim_env.parts.drawn.randomization import Ranges, documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.sensorless.privileged import Privileged

TOLD = "told:"
"""Before the name of such a controller."""


def can_be_privileged(controller: str, rig: Parameters) -> bool:
    """Whether a controller is stages alone, whose constants can differ from lane to lane."""
    made = make_controller(controller, rig)
    if not isinstance(made, StagedController) or made.asks or not made.is_compiled():
        return False
    return type(made).policy_stages is StagedController.policy_stages


def drawn_rigs(rig: Parameters, ranges: Ranges, seeds: Sequence[int]) -> list[Parameters]:
    """The rigs that worlds of ``seeds`` draw from ``ranges`` about ``rig``."""
    return [draw_parameters(rig, ranges, stream(seed, 0, "parameters")) for seed in seeds]


def privileged_controller(controller: str, rig: Parameters, seeds: Sequence[int]) -> Privileged:
    """``controller`` in as many lanes as ``seeds``, each told the plant that its world draws about ``rig``.

    Of the sensors it believes what ``rig`` says.
    """
    drawn = drawn_rigs(rig, documented_ranges(rig), seeds)
    return Privileged([cast(StagedController, make_controller(controller, one)) for one in drawn])


def evaluate_privileged(
    environment: str, controller: str, rig: Parameters, seeds: Sequence[int], setting: Arguments
) -> Evaluation:
    """``evaluate`` in the worlds of ``seeds``, where ``setting`` randomises the rig, under a controller that is told each.

    A law that knows a light rig or slow valves may refuse a world's stiffness setpoint: that world counts as lost.
    """
    return merged(
        [part for own in batches(len(seeds)) for part in _parts(environment, controller, rig, seeds[own], setting)], controller
    )


def _parts(environment: str, controller: str, rig: Parameters, seeds: Sequence[int], setting: Arguments) -> list[Evaluation]:
    try:
        controllers = privileged_controller(controller, rig, seeds)
        return [evaluate(environment, controllers, controller, len(seeds), seeds[0], progress=False, **setting)]
    except ValueError as error:
        if "reference.stiffness" not in str(error):
            raise
    if len(seeds) == 1:
        return [_refused(controller, seeds[0])]
    half = len(seeds) // 2
    return [
        part
        for some in (seeds[:half], seeds[half:])
        for own in batches(len(some))
        for part in _parts(environment, controller, rig, some[own], setting)
    ]


def _refused(controller: str, seed: int) -> Evaluation:
    """A world of which nothing is known but that it was lost."""
    found = Evaluation(controller, [seed], lost=[True], required_strength_ratio=[np.nan], success=[False])
    for values in (*found.metrics.values(), *found.returns.values()):
        values.append(np.nan)
    return found

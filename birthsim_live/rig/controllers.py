"""Controllers of the bench as the page uses them: by the names of its choice, and with a damping where they have one."""

from __future__ import annotations

import numpy as np

from baselines.admittance.controller import AdmittanceController
from baselines.backstepping.controller import BacksteppingController
from baselines.controller import Controller
from baselines.registry import make_controller
from baselines.rivals.tracking import TrackingController
from baselines.staged import Driving
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.settings import RESIDUAL

DAMPED = (BacksteppingController, AdmittanceController, TrackingController)
"""Laws that can be told to damp more."""


def build_controller(name: str, rig: Parameters) -> Controller:
    """The controller of a choice such as ``pid`` or ``residual:circle``, that believes in ``rig``."""
    kind, _, policy = name.partition(":")
    return make_controller(RESIDUAL, rig, policy=policy) if kind == RESIDUAL else make_controller(name, rig)


def has_damping(controller: Controller) -> bool:
    """Whether the law can be told to damp more."""
    return isinstance(controller, DAMPED)


def openings(controller: Controller, plant: Plant, measurement: Measurement, reference: Reference, damping: float) -> Array:
    """Spool openings (4, 1) of one control period, ``damping`` times the least damped where the law has one."""
    told = {"damping_factor": np.array([damping])} if has_damping(controller) else {}
    return Driving(controller, None, told).openings(plant, measurement, reference)

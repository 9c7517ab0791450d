"""Controllers of the rig and their evaluation; they know measurements and references, never an environment."""

from baselines.backstepping import BacksteppingController
from baselines.controller import Controller

__all__ = ["BacksteppingController", "Controller"]

"""BirthSIM: a pneumatic haptic interface as Gymnasium environments.

Importing this package registers an id for every scenario, as ``BirthSIM/Circle-v2``; ``import agents`` registers those with a
controller inside, as ``BirthSIM/CircleResidual-v2``.
"""

from birthsim_env.gradients.linear.linearize import balanced_pressures, linearize, linearize_lanes
from birthsim_env.gradients.linear.model import LinearModel
from birthsim_env.ids import register_ids
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.parts.hands.user_forces import ForceProfile, UserForce
from birthsim_env.parts.references import Circle, FixedTarget, Path, Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.scores import normalized_return, reference_returns

__all__ = [
    "Circle", "FixedTarget", "ForceProfile", "LinearModel", "Measurement", "Parameters", "Path", "Plant", "Reference",
    "StiffnessSchedule", "Trajectory", "UserForce", "balanced_pressures", "linearize", "linearize_lanes",
    "normalized_return", "reference_returns",
]  # fmt: skip

__version__ = "0.1.0"

register_ids("", "birthsim_env.env:BirthSIMEnv", "birthsim_env.vector_env:BirthSIMVectorEnv")

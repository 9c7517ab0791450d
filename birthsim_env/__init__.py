"""BirthSIM: a pneumatic haptic interface as Gymnasium environments.

Importing this package registers ``BirthSIM/Circle-v1``, ``Probe-v2``, ``Descent-v1``, ``Forceps-v1``, ``Dystocia-v1`` and
``Vacuum-v0``, and their siblings with a law inside, ``BirthSIM/CircleResidual-v1`` and so on.
"""

from gymnasium.envs import registration

from birthsim_env.gradients.linear.linearize import balanced_pressures, linearize, linearize_lanes
from birthsim_env.gradients.linear.model import LinearModel
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.parts.hands.user_forces import ForceProfile, UserForce
from birthsim_env.parts.references import Circle, FixedTarget, Path, Trajectory
from birthsim_env.parts.scenarios import SCENARIOS, environment_id
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.scores import normalized_score, reference_scores

__all__ = [
    "Circle", "FixedTarget", "ForceProfile", "LinearModel", "Measurement", "Parameters", "Path", "Plant", "Reference",
    "StiffnessSchedule", "Trajectory", "UserForce", "balanced_pressures", "linearize", "linearize_lanes",
    "normalized_score", "reference_scores",
]  # fmt: skip

__version__ = "0.1.0"

_KINDS = {
    "": ("birthsim_env.env:BirthSIMEnv", "birthsim_env.vector_env:BirthSIMVectorEnv"),
    # The package above is imported when such an environment is made.
    "Residual": ("birthsim_env.learned:residual_env", "birthsim_env.learned:residual_vector_env"),
}
for _scenario in SCENARIOS:
    for _kind, (_single, _vector) in _KINDS.items():
        _id = environment_id(_scenario, _kind)
        if _id not in registration.registry:
            registration.register(_id, entry_point=_single, vector_entry_point=_vector, kwargs={"scenario": _scenario})

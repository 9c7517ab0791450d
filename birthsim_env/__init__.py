"""BirthSIM: a pneumatic haptic interface as Gymnasium environments.

Importing this package registers an id for every scenario, as ``BirthSIM/Circle-v1``, and one for its sibling with a law
inside, as ``BirthSIM/CircleResidual-v1``.
"""

from gymnasium.envs import registration

from birthsim_env.gradients.linear.linearize import balanced_pressures, linearize, linearize_lanes
from birthsim_env.gradients.linear.model import LinearModel
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.parts.hands.user_forces import ForceProfile, UserForce
from birthsim_env.parts.references import Circle, FixedTarget, Path, Trajectory
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import Entry, follow
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


def _register_ids(scenario: Entry) -> None:
    """Gymnasium's ids of a scenario."""
    for kind, (single, vector) in _KINDS.items():
        name = environment_id(scenario.name, kind)
        if name not in registration.registry:
            registration.register(name, entry_point=single, vector_entry_point=vector, kwargs={"scenario": scenario.name})


follow("scenario", _register_ids)

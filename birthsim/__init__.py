"""BirthSIM: a pneumatic haptic interface, its controllers, their evaluation, and residual learning.

    import birthsim

    env = birthsim.make("BirthSIM/Circle-v2", sensors="lab", randomize=True)

What is below is all that most programs need. A name is imported when it is first used, so that ``import birthsim`` is quick.
The packages behind it, ``birthsim_env``, ``baselines``, ``agents`` and ``birthsim_build``, may be imported by themselves.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from agents.policy.files import Policy as Policy
    from agents.policy.seeds import load_policy as load_policy
    from baselines.bench.evaluation import Evaluation as Evaluation
    from baselines.bench.evaluation import evaluate as evaluate
    from baselines.controller import Controller as Controller
    from baselines.identification.comparing.compared import Comparison as Comparison
    from baselines.identification.identified import Identified as Identified
    from baselines.named import make_controller as make_controller
    from baselines.staged import ControllerStage as ControllerStage
    from baselines.staged import StagedController as StagedController
    from birthsim.benchmark.scoring import Scored as Scored
    from birthsim.benchmark.scoring import score as score
    from birthsim.envs import environments as environments
    from birthsim.envs import make as make
    from birthsim.envs import make_vec as make_vec
    from birthsim.exporting import export as export
    from birthsim.identification import compare as compare
    from birthsim.identification import identify as identify
    from birthsim.names import controllers as controllers
    from birthsim.names import policies as policies
    from birthsim.training import Trained as Trained
    from birthsim.training import train as train
    from birthsim_env.gradients.linear.linearize import balanced_pressures as balanced_pressures
    from birthsim_env.gradients.linear.linearize import linearize as linearize
    from birthsim_env.gradients.linear.linearize import linearize_lanes as linearize_lanes
    from birthsim_env.gradients.linear.model import LinearModel as LinearModel
    from birthsim_env.loop.signals import Measurement as Measurement
    from birthsim_env.loop.signals import Reference as Reference
    from birthsim_env.parts.hands.user_forces import ForceProfile as ForceProfile
    from birthsim_env.parts.hands.user_forces import UserForce as UserForce
    from birthsim_env.parts.references import Circle as Circle
    from birthsim_env.parts.references import FixedTarget as FixedTarget
    from birthsim_env.parts.references import Path as Path
    from birthsim_env.parts.references import Trajectory as Trajectory
    from birthsim_env.parts.stiffness_schedules import StiffnessSchedule as StiffnessSchedule
    from birthsim_env.physics.plant import Plant as Plant
    from birthsim_env.physics.rig.parameters import Parameters as Parameters
    from birthsim_env.physics.rig.parameters import load_parameters as load_parameters
    from birthsim_env.registry import register as register
    from birthsim_env.scores import normalized_return as normalized_return
    from birthsim_env.scores import reference_returns as reference_returns

_PLACES = {
    "Circle": "birthsim_env.parts.references",
    "Comparison": "baselines.identification.comparing.compared",
    "Controller": "baselines.controller",
    "ControllerStage": "baselines.staged",
    "Evaluation": "baselines.bench.evaluation",
    "FixedTarget": "birthsim_env.parts.references",
    "ForceProfile": "birthsim_env.parts.hands.user_forces",
    "Identified": "baselines.identification.identified",
    "LinearModel": "birthsim_env.gradients.linear.model",
    "Measurement": "birthsim_env.loop.signals",
    "Parameters": "birthsim_env.physics.rig.parameters",
    "Path": "birthsim_env.parts.references",
    "Plant": "birthsim_env.physics.plant",
    "Policy": "agents.policy.files",
    "Reference": "birthsim_env.loop.signals",
    "Scored": "birthsim.benchmark.scoring",
    "StagedController": "baselines.staged",
    "StiffnessSchedule": "birthsim_env.parts.stiffness_schedules",
    "Trained": "birthsim.training",
    "Trajectory": "birthsim_env.parts.references",
    "UserForce": "birthsim_env.parts.hands.user_forces",
    "balanced_pressures": "birthsim_env.gradients.linear.linearize",
    "compare": "birthsim.identification",
    "controllers": "birthsim.names",
    "environments": "birthsim.envs",
    "evaluate": "baselines.bench.evaluation",
    "export": "birthsim.exporting",
    "identify": "birthsim.identification",
    "linearize": "birthsim_env.gradients.linear.linearize",
    "linearize_lanes": "birthsim_env.gradients.linear.linearize",
    "load_parameters": "birthsim_env.physics.rig.parameters",
    "load_policy": "agents.policy.seeds",
    "make": "birthsim.envs",
    "make_controller": "baselines.named",
    "make_vec": "birthsim.envs",
    "normalized_return": "birthsim_env.scores",
    "policies": "birthsim.names",
    "reference_returns": "birthsim_env.scores",
    "register": "birthsim_env.registry",
    "score": "birthsim.benchmark.scoring",
    "train": "birthsim.training",
}
"""Public name -> where it lives; it is imported when it is first used."""

LEARNED = ("Policy", "Trained", "load_policy", "train")
"""What needs the extra ``agents``."""

__all__ = sorted(_PLACES)


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from birthsim.shadows import check_shadows

    check_shadows()
    try:
        found = getattr(import_module(_PLACES[name]), name)
    except ImportError as error:
        if name not in LEARNED:
            raise
        from birthsim_env.extras import installation

        raise ImportError(f"{error}; birthsim.{name} needs {installation('agents')}") from error
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return [*globals(), *__all__]

"""Controllers of the rig and their evaluation; laws know measurements and references, never an environment."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from baselines.admittance.controller import AdmittanceController
    from baselines.backstepping.cartesian_controller import CartesianBackstepping
    from baselines.backstepping.controller import BacksteppingController
    from baselines.bench.evaluation import Evaluation, evaluate
    from baselines.controller import Controller
    from baselines.named import make_controller

BELONGS_TO_BIRTHSIM = True
"""Tells this package from others of its name: see ``birthsim.shadows``."""

_PLACES = {
    "AdmittanceController": "admittance.controller",
    "BacksteppingController": "backstepping.controller",
    "CartesianBackstepping": "backstepping.cartesian_controller",
    "Controller": "controller",
    "Evaluation": "bench.evaluation",
    "evaluate": "bench.evaluation",
    "make_controller": "named",
}
"""Public name -> where it lives; it is imported when it is first used."""

__all__ = [
    "AdmittanceController", "BacksteppingController", "CartesianBackstepping", "Controller", "Evaluation",
    "evaluate", "make_controller",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)

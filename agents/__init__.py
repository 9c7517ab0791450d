"""Learned residuals on top of a controller.

Importing this package registers environments with a controller inside, ``BirthSIM/CircleResidual-v2`` and so on.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from birthsim_env.ids import register_ids

if TYPE_CHECKING:
    from agents.policy.controller import ResidualController
    from agents.policy.files import Policy, save_policy
    from agents.policy.onnx_export import export_onnx
    from agents.policy.seeds import load_policy
    from agents.residual.settings import ResidualSettings
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3.adapter import SB3VecEnv
    from agents.training.trainer import train

BELONGS_TO_BIRTHSIM = True
"""Tells this package from others of its name: see ``birthsim.shadows``."""

_PLACES = {
    "Policy": "policy.files",
    "ResidualController": "policy.controller",
    "ResidualSettings": "residual.settings",
    "SB3VecEnv": "training.sb3.adapter",
    "TrainingSettings": "training.configuration",
    "export_onnx": "policy.onnx_export",
    "load_policy": "policy.seeds",
    "save_policy": "policy.files",
    "train": "training.trainer",
}
"""Public name -> where it lives; it is imported, and PyTorch with it where that is needed, when it is first used."""

__all__ = [
    "Policy", "ResidualController", "ResidualSettings", "SB3VecEnv", "TrainingSettings", "export_onnx",
    "load_policy", "save_policy", "train",
]  # fmt: skip


register_ids("Residual", "agents.residual.env:ResidualEnv", "agents.residual.env:ResidualVectorEnv")


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    except ImportError as error:
        from birthsim_env.extras import installation

        extras = ("agents", "onnx") if name == "export_onnx" else ("agents",)
        raise ImportError(f"{error}; {name} needs {installation(*extras)}") from error

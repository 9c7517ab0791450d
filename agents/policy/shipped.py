"""What is registered of trained policies: those that come with the package, and the controller that one of them makes.

Nothing here needs the extra that policies need, so that lists are the same without it.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from baselines.staged import StagedController
from birthsim_env.parts.scenarios import environment_id, scenarios_for
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import LAST, entries, names, register

SHIPPED = Path(__file__).resolve().parent.parent / "policies"
"""Trained policies that come with the package, a folder per configuration and in it one per seed."""

AGENTS = "extra agents"


def loadable_names() -> list[str]:
    """Registered policies; none where the extra is missing that reads them."""
    return names("policy") if find_spec("safetensors") else []


def loadable_for(rig: Parameters) -> list[str]:
    """``loadable_names`` of policies whose scenario can be done with a rig."""
    known = {environment_id(scenario, "Residual") for scenario in scenarios_for(rig)}
    loadable = loadable_names()
    return [one.name for one in entries("policy") if one.name in loadable and _settings(one.made)["environment"] in known]


@register(
    controller="residual",
    about="A law with a trained policy that corrects it; residual:circle names the policy.",
    needs={"force sensor", AGENTS},
    listed=False,
    order=LAST + 10,
)
def residual(parameters: Parameters, policy: Any = "circle", settings: Any = None) -> StagedController:
    """``ResidualController``, which is imported here, late."""
    from agents.policy.controller import ResidualController

    return ResidualController(parameters, policy, settings)


def _settings(folder: Path) -> dict[str, Any]:
    """What the training of a folder of seeds was asked for."""
    settings: dict[str, Any] = read_json("policy", next(folder.glob("seed_*/training.json")), {"settings": dict})["settings"]
    return settings


def _register(folder: Path) -> None:
    """The policies of a folder of seeds, by what their training says."""
    training = _settings(folder)
    needs = {AGENTS, "force sensor"} if training.get("force_sensor", True) else {AGENTS}
    about = f"A controller and a trained policy that corrects it: {folder.name}."
    register(policy=folder.name, about=about, needs=needs)(folder)


for _folder in sorted(SHIPPED.glob("*/")):
    _register(_folder)

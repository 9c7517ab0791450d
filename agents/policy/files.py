"""A policy is one file in a folder: ``policy.safetensors``, arrays with JSON about them. Nothing is unpickled.

The arrays are mean, variance, of layer k k.weight and k.bias, and of a memory enters.weight, enters.bias, own.weight and
own.bias; the JSON has format, environment, residual settings, training configuration and a checksum of the file.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.policy.sealed import Arrays, sealed, unsealed
from agents.residual.settings import ResidualSettings
from baselines.network import PolicyNetwork
from birthsim_env.files import finite, whole_file
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import problem

FORMAT = "birthsim-residual-3"
WEIGHTS = "policy.safetensors"
MEMORY = ("enters", "own")
"""Names of a memory's layers."""


@dataclass(frozen=True)
class Policy:
    """A trained residual.

    Parameters
    ----------
    network : PolicyNetwork
        Observations (N, D) to actions (N, ``settings.size``), float32.
    environment : str
        The id that it was trained on.
    settings : ResidualSettings
        The controller below, the bound of its forces, N, and what else it may do.
    training : dict
        How it was made, as JSON.

    Examples
    --------
    >>> import birthsim
    >>> policy = birthsim.load_policy("circle")
    >>> policy.settings.authority, policy.network.outputs == policy.settings.size
    (100.0, True)
    """

    network: PolicyNetwork
    environment: str
    settings: ResidualSettings
    training: dict[str, Any]


def policy_content(policy: Policy) -> bytes:
    """The content of a policy's file."""
    arrays: Arrays = {"mean": policy.network.mean, "variance": policy.network.variance}
    for name, (weight, bias) in (*enumerate(policy.network.layers), *zip(MEMORY, policy.network.memory, strict=False)):
        arrays[f"{name}.weight"], arrays[f"{name}.bias"] = weight, bias
    about = {
        "format": FORMAT,
        "environment": policy.environment,
        "settings": policy.settings.to_dict(),
        "squashed": policy.network.squashed,
        "training": policy.training,
    }
    return sealed(arrays, finite(about))


def save_policy(policy: Policy | bytes, folder: Path) -> None:
    """Write the file of a policy, or of its content; it appears whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / WEIGHTS) as file:
        file.write(policy if isinstance(policy, bytes) else policy_content(policy))


def read_policy(folder: str | Path) -> Policy:
    """Read a policy folder; raises ``ValueError`` that says what is missing, damaged or foreign."""
    folder = Path(folder)
    allowed = f"allowed: a folder that birthsim train wrote, with {WEIGHTS}"
    if not os.path.isfile(folder / WEIGHTS):
        raise ValueError(f"policy = {named(folder)} has no {WEIGHTS}; {allowed}")
    try:
        arrays, about = unsealed((folder / WEIGHTS).read_bytes(), FORMAT)
    except ValueError as error:
        raise ValueError(f"policy = {str(folder)!r}: {WEIGHTS} is {error}; {allowed}") from error
    try:
        memory = MEMORY if f"{MEMORY[0]}.weight" in arrays else ()
        count = sum(name.endswith(".weight") for name in arrays) - len(memory)
        layers, remembers = (
            tuple((arrays[f"{name}.weight"], arrays[f"{name}.bias"]) for name in names) for names in (range(count), memory)
        )
        network = PolicyNetwork(arrays["mean"], arrays["variance"], layers, _truth(about["squashed"]), remembers)
        settings = ResidualSettings(**about["settings"])
        return Policy(network, str(about["environment"]), settings, dict(about["training"]))
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"policy = {str(folder)!r} is damaged ({problem(error)}); {allowed}") from error


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"squashed = {value!r}; allowed: true or false")
    return value

"""A policy folder: weights and normalisation as safetensors, configuration as JSON. Nothing is unpickled.

policy.safetensors   mean, variance, layer k: k.weight, k.bias
policy.json          format, environment, residual settings, training configuration, SHA-256 of the weights
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from agents.policy.network import PolicyNetwork
from agents.residual.settings import ResidualSettings
from baselines.files import whole_file, write_json

FORMAT = "birthsim-residual-2"
WEIGHTS, CONFIGURATION = "policy.safetensors", "policy.json"


@dataclass(frozen=True)
class Policy:
    """A trained residual: the network, the environment it was trained on, what it may do, and how it was made."""

    network: PolicyNetwork
    environment: str
    settings: ResidualSettings
    training: dict[str, Any]


def save_policy(policy: Policy, folder: Path) -> None:
    """Write both files; each appears whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, NDArray[Any]] = {"mean": policy.network.mean, "variance": policy.network.variance}
    for k, (weight, bias) in enumerate(policy.network.layers):
        arrays[f"{k}.weight"], arrays[f"{k}.bias"] = weight, bias
    content = save(arrays)
    configuration = {
        "format": FORMAT,
        "environment": policy.environment,
        "settings": policy.settings.to_dict(),
        "squashed": policy.network.squashed,
        "training": policy.training,
        "sha256": hashlib.sha256(content).hexdigest(),
    }
    # The configuration names the weights by their hash and is written last: a pair that does not belong together is refused.
    with whole_file(folder / WEIGHTS) as file:
        file.write(content)
    write_json(folder / CONFIGURATION, configuration)


def load_policy(folder: str | Path) -> Policy:
    """Read a policy folder; raises ``ValueError`` that says what is missing, damaged or foreign."""
    folder = Path(folder)
    allowed = f"allowed: a folder that birthsim-train wrote, with {CONFIGURATION} and {WEIGHTS}"
    for name in (CONFIGURATION, WEIGHTS):
        if not (folder / name).is_file():
            raise ValueError(f"policy = {str(folder)!r} has no {name}; {allowed}")
    try:
        configuration = json.loads((folder / CONFIGURATION).read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"policy = {str(folder)!r}: {CONFIGURATION} is damaged ({error}); {allowed}") from error
    if not isinstance(configuration, dict) or configuration.get("format") != FORMAT:
        found = configuration.get("format") if isinstance(configuration, dict) else configuration
        raise ValueError(f"policy = {str(folder)!r}: format {found!r} is foreign; allowed: {FORMAT!r}")
    content = (folder / WEIGHTS).read_bytes()
    if hashlib.sha256(content).hexdigest() != configuration.get("sha256"):
        raise ValueError(
            f"policy = {str(folder)!r}: {WEIGHTS} is not the file that {CONFIGURATION} was written with; {allowed}"
        )
    try:
        arrays = load(content)
        count = sum(name.endswith(".weight") for name in arrays)
        layers = tuple((arrays[f"{k}.weight"], arrays[f"{k}.bias"]) for k in range(count))
        network = PolicyNetwork(arrays["mean"], arrays["variance"], layers, _truth(configuration["squashed"]))
        settings = ResidualSettings(**configuration["settings"])
        return Policy(network, str(configuration["environment"]), settings, dict(configuration["training"]))
    except (KeyError, TypeError, ValueError, SafetensorError) as error:
        raise ValueError(f"policy = {str(folder)!r} is damaged ({error}); {allowed}") from error


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"squashed = {value!r}; allowed: true or false")
    return value

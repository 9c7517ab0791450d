"""A model of Stable-Baselines3 as an ONNX file: its deterministic actions, with its normalisation and its memory.

The file holds data alone, so that others can run it without trusting whoever made it, as the leaderboard asks.
"""

import json
import tempfile
import warnings
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from numpy.typing import NDArray

from agents.foreign.onnx_file import OnnxPolicy
from agents.foreign.stable_baselines import ModelPolicy, algorithm_in, one_thread, read_archive
from agents.policy.onnx_export import INPUT, OPSET, OUTPUT
from birthsim_env.files import whole_file, write_text
from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.physics.rig.reading import named

TOLERANCE = 2.0**-14
"""Largest difference of an action in [-1, 1] from Stable-Baselines3's: both add some hundred singles of size 1 a layer, in an
order of their own, and a rounding of such a sum is 2^-24 of it; a memory carries what differs over ``STEPS``."""

LANES, STEPS = 256, 16
"""Random observations of each step, and steps, that an exported policy is compared on."""

HYPERPARAMETERS = (
    *("seed", "n_envs", "learning_rate", "gamma", "batch_size", "n_steps", "n_epochs", "gae_lambda", "ent_coef", "vf_coef"),
    *("max_grad_norm", "buffer_size", "learning_starts", "tau", "gradient_steps", "top_quantiles_to_drop_per_net"),
)
"""Settings of an archive that say how it was trained."""


@dataclass(frozen=True)
class Exported:
    """What was written: bytes of the file, lengths of observation and action, and the largest difference of an action from
    Stable-Baselines3's, over ``compared`` observations."""

    size: int
    inputs: int
    outputs: int
    compared: int
    difference: float


class _Acting(torch.nn.Module):
    """Actions (N, n) for observations (N, D), both float32, and the next memories (N, cells) for those before."""

    mean: torch.Tensor
    deviation: torch.Tensor

    def __init__(self, own: ModelPolicy) -> None:
        super().__init__()
        self.policy, self.squashes = own.model.policy, hasattr(own.model.policy, "actor")
        self.clip = None if own.statistics is None else float(own.statistics.clip_obs)
        if self.clip is not None:
            seen = own.statistics.obs_rms
            self.register_buffer("mean", torch.as_tensor(seen.mean, dtype=torch.float64))
            deviation = np.sqrt(seen.var + own.statistics.epsilon)
            self.register_buffer("deviation", torch.as_tensor(deviation, dtype=torch.float64))

    @property
    def memory(self) -> Any:
        """The LSTM of a policy that remembers, else None."""
        return getattr(self.policy, "lstm_actor", None)

    def forward(self, observation: torch.Tensor, *memories: torch.Tensor) -> tuple[torch.Tensor, ...]:
        x = observation
        if self.clip is not None:
            x = ((x.double() - self.mean) / self.deviation).clamp(-self.clip, self.clip).float()
        if self.squashes:
            actor = self.policy.actor
            return (torch.tanh(actor.mu(actor.latent_pi(actor.extract_features(x, actor.features_extractor)))),)
        x = self.policy.pi_features_extractor(x)
        if self.memory is not None:
            lstm = self.memory
            held = tuple(one.reshape(-1, lstm.num_layers, lstm.hidden_size).transpose(0, 1) for one in memories)
            x, after = lstm(x.unsqueeze(0), held)
            x = x.squeeze(0)
            memories = tuple(one.transpose(0, 1).flatten(1) for one in after)
        actions = self.policy.action_net(self.policy.mlp_extractor.forward_actor(x))
        return actions.clamp(-1.0, 1.0), *memories


def export_archive(path: Path, out: Path, statistics: Path | None = None) -> Exported:
    """Write the policy of the archive ``path`` to ``out``, with the ``statistics`` that ``VecNormalize.save`` wrote, and beside
    it in ``out`` with the suffix .json how it was trained.

    The archive is read by Stable-Baselines3's own loader, which unpickles parts of it. Raises ``ValueError`` for what is no
    archive, and where the file, run by onnxruntime, differs from Stable-Baselines3 by more than ``TOLERANCE``; nothing is
    written then.
    """
    own = read_archive(path, statistics=statistics)
    (inputs,), (outputs,) = own.model.observation_space.shape, own.model.action_space.shape
    with one_thread():
        content = _traced(_Acting(own).eval(), inputs)
        difference = _difference(content, own, inputs)
    # What is not a number is not within the tolerance either.
    if not difference <= TOLERANCE:
        raise ValueError(f"policy = {named(path)}: actions differ in ONNX by {difference:.2g}; allowed: {TOLERANCE:.1g}")
    out.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(out) as file:
        file.write(content)
    write_text(out.with_suffix(".json"), json.dumps(_trained(path), indent=1) + "\n")
    return Exported(len(content), inputs, outputs, LANES * STEPS, difference)


def _traced(module: _Acting, inputs: int) -> bytes:
    names, nexts = ([], []) if module.memory is None else (["hidden", "cell"], ["next_hidden", "next_cell"])
    zeros = [torch.zeros(1, inputs)]
    if module.memory is not None:
        zeros += [torch.zeros(1, module.memory.num_layers * module.memory.hidden_size)] * 2
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        place = Path(folder) / "policy.onnx"
        # As in agents.policy.onnx_export. PyTorch warns of lengths that it fixes: of the network's layers, which are;
        # and of an LSTM's batch, which is free here since memories are inputs.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.filterwarnings("ignore", "Exporting a model to ONNX with a batch_size")
        warnings.simplefilter("ignore", torch.jit.TracerWarning)  # type: ignore[attr-defined]
        torch.onnx.export(
            module,
            tuple(zeros),
            place,
            dynamo=False,
            opset_version=OPSET,
            input_names=[INPUT, *names],
            output_names=[OUTPUT, *nexts],
            dynamic_axes={name: {0: "batch"} for name in (INPUT, *names, OUTPUT, *nexts)},
        )
        onnx.checker.check_model(model := onnx.load(place), full_check=True)
        return bytes(model.SerializeToString())


def _difference(content: bytes, own: ModelPolicy, inputs: int) -> float:
    """The largest one of an action, over steps in which some lanes begin anew."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "policy.onnx"
        file.write_bytes(content)
        written = OnnxPolicy(file)
    rng = np.random.default_rng(0)
    own.reset()
    found = 0.0
    for _ in range(STEPS):
        seen: NDArray[np.float32] = (rng.normal(size=(LANES, inputs)) * 10.0 ** rng.uniform(-2, 1, (LANES, 1))).astype(
            np.float32
        )
        found = max(found, float(np.abs(own(seen) - written(seen)).max()))
        begins = rng.random(LANES) < 0.1
        own.reset(begins)
        written.reset(begins)
    own.reset()
    return found


def _trained(path: Path) -> dict[str, Any]:
    """How the policy of an archive was trained, as its settings say."""
    with zipfile.ZipFile(path) as archive, archive.open("data") as data:
        said = parse_json("data", data.read(), dict, finite=False)
    plain = {name: said[name] for name in HYPERPARAMETERS if isinstance(said.get(name), (int, float, str))}
    return {"settings": {"algorithm": algorithm_in(path), **plain}, "steps": int(said["num_timesteps"])}

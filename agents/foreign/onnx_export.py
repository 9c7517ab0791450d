"""A model of Stable-Baselines3 as an ONNX file: its deterministic actions, with its normalisation and its memory.

The file holds data alone, so that others can run it without trusting whoever made it, as the leaderboard asks.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from agents.foreign.onnx_file import SUFFIX, OnnxPolicy
from agents.foreign.stable_baselines import ModelPolicy, algorithm_in, one_thread, read_archive, settings_in
from agents.policy.onnx_export import INPUT, OUTPUT, traced
from birthsim_env.files import make_folder, whole_results, write_json
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import shown

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
    """The network of a policy of Stable-Baselines3 between what it observes and its deterministic actions.

    It takes observations (N, D) and memories (N, cells), and gives actions (N, n) in [-1, 1] and the next memories. All are
    float32.
    """

    mean: torch.Tensor
    deviation: torch.Tensor

    def __init__(self, own: ModelPolicy) -> None:
        super().__init__()
        self.policy = own.model.policy
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

    @property
    def cells(self) -> int:
        """Length of each of its two memories."""
        return int(self.memory.num_layers * self.memory.hidden_size)

    def forward(self, observation: torch.Tensor, *memories: torch.Tensor) -> tuple[torch.Tensor, ...]:
        x = observation
        if self.clip is not None:
            x = ((x.double() - self.mean) / self.deviation).clamp(-self.clip, self.clip).float()
        if (actor := getattr(self.policy, "actor", None)) is not None:  # of SAC and TQC
            return (torch.tanh(actor.mu(actor.latent_pi(actor.extract_features(x, actor.features_extractor)))),)
        x = self.policy.pi_features_extractor(x)
        if self.memory is not None:
            lstm = self.memory
            held = tuple(one.reshape(-1, lstm.num_layers, lstm.hidden_size).transpose(0, 1) for one in memories)
            x, after = lstm(x.unsqueeze(0), held)
            x = x.squeeze(0)
            memories = tuple(one.transpose(0, 1).flatten(1) for one in after)
        actions = self.policy.action_net(self.policy.mlp_extractor.forward_actor(x))
        return torch.tanh(actions) if self.policy.squash_output else actions.clamp(-1.0, 1.0), *memories


def export_archive(path: Path, out: Path, statistics: Path | None = None) -> Exported:
    """Write the policy of an archive as an ONNX file, and beside it how it was trained, as far as the archive says.

    The archive is read by Stable-Baselines3's own loader, which unpickles parts of it.

    Parameters
    ----------
    path : Path
        The archive, FILE.zip.
    out : Path
        FILE.onnx, whose FILE.json is written too. Observations (N, D), actions (N, n) and memories (N, cells) are float32.
    statistics : Path, optional
        What ``VecNormalize.save`` wrote, where the policy was trained on normalised observations.

    Raises
    ------
    ValueError
        For what is no archive, for spaces other than lists of numbers, and where the file, run by onnxruntime, differs from
        Stable-Baselines3 by more than ``TOLERANCE``; nothing is written then.
    """
    if out.suffix != SUFFIX or out.is_dir():
        raise ValueError(f"out = {named(out)}; allowed: FILE{SUFFIX}")
    trained = _trained(path)
    own = read_archive(path, statistics=statistics)
    spaces = own.model.observation_space, own.model.action_space
    shapes: list[Any] = [getattr(space, "shape", None) for space in spaces]
    if any(shape is None or len(shape) != 1 for shape in shapes):
        raise ValueError(
            f"policy = {named(path)} observes {shapes[0]} and gives {shapes[1]}; allowed: lists of numbers, as (24,)"
        )
    (inputs,), (outputs,) = shapes
    module = _Acting(own).eval()
    memory = {} if module.memory is None else dict.fromkeys(("hidden", "cell"), torch.zeros(1, module.cells))
    with one_thread():
        given = {INPUT: torch.zeros(1, inputs), **memory}
        content = traced(module, given, [OUTPUT, *(f"next_{name}" for name in memory)]).SerializeToString()
        difference = _difference(content, own, inputs)
    # What is not a number is not within the tolerance either.
    if not difference <= TOLERANCE:
        raise ValueError(f"policy = {named(path)}: actions differ in ONNX by {difference:.2g}; allowed: {TOLERANCE:.1g}")
    with whole_results(make_folder(out.parent)) as place:
        (place / out.name).write_bytes(content)
        write_json(place / out.with_suffix(".json").name, trained)
    return Exported(len(content), inputs, outputs, LANES * STEPS, difference)


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
    """How the policy of an archive was trained, as its settings say; ``ValueError`` where they say no number of steps."""
    said = settings_in(path)
    steps = said.get("num_timesteps")
    if type(steps) is not int:
        raise ValueError(
            f"policy = {named(path)}: num_timesteps = {shown(steps)}; allowed: a whole number, as save() writes it"
        )
    plain = {name: said[name] for name in HYPERPARAMETERS if isinstance(said.get(name), str | int | float)}
    return {"settings": {"algorithm": algorithm_in(path), **plain}, "steps": steps}

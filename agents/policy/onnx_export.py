"""A trained policy with its normalisation as one ONNX file that says what goes in and what comes out.

The file's metadata (``metadata_props``): ``format``; ``environment``, on which the policy was trained; ``settings``, those of
``ResidualSettings`` as JSON; ``observations`` and ``actions``, the names of the entries as JSON lists. A policy that remembers
has "memory" (N, cells) as a further input, zeros where an episode begins, and "next_memory" as a further output, both float64.
"""

import json
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime  # type: ignore[import-untyped]
import torch
from numpy.typing import NDArray

from agents.policy.files import Policy
from agents.residual.corrected import action_names, observation_names
from baselines.network import CLIP, EPSILON, PolicyNetwork, Weights
from birthsim_env.files import whole_file
from birthsim_env.ids import rig_for
from birthsim_env.observation import LIMIT

FORMAT = "birthsim-residual-onnx-1"

INPUT, OUTPUT = "observation", "action"
MEMORY, NEXT = "memory", "next_memory"

OPSET = 17
"""Old enough for the runtimes of embedded computers."""

TOLERANCE = 2.0**-23
"""Largest difference that an exported policy may have, of an action or the memory, in [-1, 1]: one unit in the last place of a
single at 1. Everything inside is in double precision, where the order of a sum shows only in the rounding of the last step."""

CHECKS = 1000
"""Random observations of each kind that an exported policy is checked on."""

Observations = NDArray[np.float32]


class PolicyModule(torch.nn.Module):
    """``PolicyNetwork`` in PyTorch, in doubles throughout: actions (N, outputs) for observations (N, inputs), both float32.

    A network that remembers takes its memory (N, cells), float64, too, and gives the next one.
    """

    mean: torch.Tensor
    deviation: torch.Tensor

    def __init__(self, network: PolicyNetwork) -> None:
        super().__init__()
        self.register_buffer("mean", torch.as_tensor(network.mean, dtype=torch.float64))
        self.register_buffer("deviation", torch.as_tensor(np.sqrt(network.variance + EPSILON), dtype=torch.float64))
        *hidden, last = (_linear(*layer) for layer in network.layers)
        self.hidden = torch.nn.Sequential(*(part for one in hidden for part in (one, torch.nn.Tanh())))
        self.memory = torch.nn.ModuleList(_linear(*layer) for layer in network.memory)
        self.last = torch.nn.Sequential(last, torch.nn.Tanh() if network.squashed else torch.nn.Hardtanh(-1.0, 1.0))

    def forward(self, observations: torch.Tensor, *memory: torch.Tensor) -> tuple[torch.Tensor, ...]:
        x: torch.Tensor = self.hidden(((observations.double() - self.mean) / self.deviation).clamp(-CLIP, CLIP))
        after = [self._next(x, held) for held in memory]
        return self.last(torch.cat([x, *after], 1)).float(), *after

    def _next(self, x: torch.Tensor, held: torch.Tensor) -> torch.Tensor:
        (reset, kept, new), own = (layer(y).chunk(3, 1) for layer, y in zip(self.memory, (x, held), strict=True))
        kept = torch.sigmoid(kept + own[1])
        return (1.0 - kept) * torch.tanh(new + torch.sigmoid(reset + own[0]) * own[2]) + kept * held


def _linear(weight: Weights, bias: Weights) -> torch.nn.Linear:
    linear = torch.nn.Linear(weight.shape[1], weight.shape[0], dtype=torch.float64)
    linear.load_state_dict({"weight": torch.as_tensor(weight), "bias": torch.as_tensor(bias)})
    return linear


@dataclass(frozen=True)
class Exported:
    """What was written: bytes of the file, and the largest difference of an action or the memory from PyTorch's and from
    NumPy's, over ``observations`` observations."""

    size: int
    observations: int
    from_torch: float
    from_numpy: float


def export_onnx(policy: Policy, path: Path) -> Exported:
    """Write ``policy`` to ``path``, whole or not at all: input "observation" (N, D), output "action" (N, size), both float32,
    and the memory where there is one.

    Raises ``ValueError`` for a network that does not fit the settings, and where the file, run by onnxruntime, differs from
    PyTorch or from ``PolicyNetwork`` by more than ``TOLERANCE``; nothing is written then.
    """
    network, rig = policy.network, rig_for(policy.environment, None)
    names, actions = observation_names(policy.settings, rig), action_names(policy.settings, rig)
    if (network.inputs, network.outputs) != (len(names), len(actions)):
        raise ValueError(f"policy maps {network.inputs} to {network.outputs} numbers; allowed: {len(names)} to {len(actions)}")
    if path.is_dir():
        raise ValueError(f"{str(path)!r} is a folder; allowed: the name of a file")
    module = PolicyModule(network).eval()
    memory = {MEMORY: torch.zeros(1, network.cells, dtype=torch.float64)} if network.cells else {}
    model = traced(module, {INPUT: torch.zeros(1, network.inputs), **memory}, [OUTPUT, *([NEXT] if network.cells else [])])
    onnx.helper.set_model_props(
        model,
        {
            "format": FORMAT,
            "environment": policy.environment,
            "settings": json.dumps(policy.settings.to_dict()),
            "observations": json.dumps(names),
            "actions": json.dumps(actions),
        },
    )
    content = model.SerializeToString()
    exported = _checked(content, module, network)
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        file.write(content)
    return exported


def traced(module: torch.nn.Module, inputs: Mapping[str, torch.Tensor], outputs: Sequence[str]) -> Any:
    """A module as a valid ONNX model whose named ``inputs``, of one lane (1, n) here, and ``outputs`` take any number of lanes.

    Parameters
    ----------
    module : torch.nn.Module
        It is called with the inputs in their order, and returns the outputs in theirs.
    inputs : mapping
        Name -> an example (1, n) of the type that the input has.
    outputs : sequence of str
        Names.

    Raises
    ------
    onnx.checker.ValidationError
        Where the model is none by ONNX's own rules.
    """
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        path = Path(folder) / "policy.onnx"
        # PyTorch calls this exporter deprecated; the one that takes its place needs onnxscript, which nothing else here does.
        warnings.simplefilter("ignore", DeprecationWarning)
        # It warns of what it fixes, the lengths of layers, and of an LSTM's lanes, which are free where memories are inputs.
        warnings.simplefilter("ignore", torch.jit.TracerWarning)  # type: ignore[attr-defined]
        warnings.filterwarnings("ignore", "Exporting a model to ONNX with a batch_size")
        torch.onnx.export(
            module,
            tuple(inputs.values()),
            path,
            dynamo=False,
            opset_version=OPSET,
            input_names=list(inputs),
            output_names=list(outputs),
            dynamic_axes={name: {0: "batch"} for name in (*inputs, *outputs)},
        )
        model = onnx.load(path)
    onnx.checker.check_model(model, full_check=True)
    return model


def _checked(content: bytes, module: PolicyModule, network: PolicyNetwork) -> Exported:
    """Runs the file as its user will, on many observations at once and on one."""
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    seen = _observations(network)
    feeds: dict[str, NDArray[Any]] = {INPUT: seen}
    if network.cells:
        feeds[MEMORY] = np.random.default_rng(1).uniform(-1.0, 1.0, (len(seen), network.cells))
    with torch.no_grad():
        by_torch = [one.numpy() for one in module(*map(torch.from_numpy, feeds.values()))]
    after = [feeds[MEMORY].copy()] if network.cells else []
    by_numpy = [network.actions(seen, *after), *after]
    many = session.run(None, feeds)
    one = session.run(None, {name: values[:1] for name, values in feeds.items()})
    from_torch, from_numpy = (
        float(max(np.abs(own - its[: len(own)]).max() for runs in (many, one) for own, its in zip(runs, other, strict=True)))
        for other in (by_torch, by_numpy)
    )
    for name, difference in (("PyTorch", from_torch), ("NumPy", from_numpy)):
        # What is not a number is not within the tolerance either.
        if not difference <= TOLERANCE:
            raise ValueError(f"exported policy: actions differ from {name}'s by {difference:.2g}; allowed: {TOLERANCE:g}")
    return Exported(len(content), len(seen), from_torch, from_numpy)


def _observations(network: PolicyNetwork) -> Observations:
    """(3 ``CHECKS``, inputs): like those of training, anywhere within the bounds of the environments, and far beyond them."""
    rng = np.random.default_rng(0)
    size = (CHECKS, network.inputs)
    usual = network.mean + np.sqrt(network.variance) * rng.normal(size=size)
    extreme = rng.choice([-1e9, -LIMIT, 0.0, LIMIT, 1e9], size)
    return np.concatenate([usual, rng.uniform(-LIMIT, LIMIT, size), extreme]).astype(np.float32)

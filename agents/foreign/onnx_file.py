"""Policies in ONNX files: one input of observations, one output of actions, and memories that go in and come out.

A file that ``birthsim export --to onnx`` wrote says which controller its actions correct; another one drives the valves.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.residual.settings import ResidualSettings
from birthsim_env.extras import installation
from birthsim_env.loop.signals import Mask
from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import problem

SUFFIX = ".onnx"

ALLOWED = "allowed: observations (N, D), float32, as the first input, actions (N, n) as the first output, memories after them"

_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}


class OnnxPolicy:
    """Observations (N, D) -> actions (N, n) of a file; ``ValueError`` for what is none, and where onnxruntime is missing.

    ``settings`` say what the actions correct; None where they are openings. Further inputs are memories, zeros where an episode
    begins, and further outputs what they are next.
    """

    def __init__(self, path: Path) -> None:
        try:
            import onnxruntime  # type: ignore[import-untyped]
        except ImportError as error:
            raise ValueError(f"{error}; policy = {named(path)} needs {installation('onnx')}") from error
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1  # the network is too small to share out
        try:
            content = path.read_bytes()
        except OSError as error:
            raise ValueError(f"policy = {named(path)} cannot be read ({error.strerror}); allowed: an ONNX file") from error
        try:
            self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
            about = self._session.get_modelmeta().custom_metadata_map
            self.settings = ResidualSettings(**parse_json("settings", about["settings"], dict)) if "settings" in about else None
        except Exception as error:  # of the library's own kinds, and of what a file says
            raise ValueError(f"policy = {named(path)} is no policy ({problem(error)}); allowed: an ONNX file") from error
        (self._input, *memory), outputs = self._session.get_inputs(), self._session.get_outputs()
        if any(one.type not in _TYPES or len(one.shape) != 2 for one in (self._input, *memory)) or len(outputs) != 1 + len(
            memory
        ):
            shapes = [(one.name, one.type, one.shape) for one in (self._input, *memory, *outputs)]
            raise ValueError(f"policy = {named(path)} has {shapes}; {ALLOWED}")
        self.lengths = self._input.shape[1], outputs[0].shape[-1]
        self._remembers = {one.name: (one.shape[1], _TYPES[one.type]) for one in memory}
        self._memory: dict[str, NDArray[Any]] = {}
        self._lanes = -1

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[Any]:
        if len(observation) != self._lanes:
            self._lanes = len(observation)
            self._memory = {name: np.zeros((self._lanes, cells), kind) for name, (cells, kind) in self._remembers.items()}
        given = {self._input.name: observation.astype(_TYPES[self._input.type]), **self._memory}
        actions, *after = self._session.run(None, given)
        self._memory = dict(zip(self._memory, after, strict=True))
        return np.asarray(actions)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where the mask (N,) is True."""
        if lanes is None:
            self._lanes = -1
        else:
            for values in self._memory.values():
                values[lanes] = 0.0

    def check(self, path: Path, spaces: tuple[int, int]) -> None:
        """``ValueError`` where it has other lengths than an environment; a length that a file leaves open is any."""
        if any(isinstance(own, int) and own != wanted for own, wanted in zip(self.lengths, spaces, strict=True)):
            said = f"observes {self.lengths[0]} and gives {self.lengths[1]} numbers"
            allowed = f"allowed: {spaces[0]} and {spaces[1]}, as the environment has"
            raise ValueError(f"policy = {named(path)} {said}; {allowed}")

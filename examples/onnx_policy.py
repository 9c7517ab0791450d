"""An exported policy as a controller: the law at 1 kHz, the policy through onnxruntime every 10 ms. It needs no PyTorch.

birthsim export --to onnx circle --out policy.onnx
python examples/onnx_policy.py policy.onnx
"""

import json
import sys

import numpy as np
import onnxruntime

from agents import ResidualController, ResidualSettings
from baselines.bench.evaluation import evaluate, table


class OnnxPolicy:
    """Observations (N, D) -> actions (N, size). What a policy with a memory remembers of each lane goes in and comes out."""

    def __init__(self, session):
        self.session = session
        self.remembers = {one.name: one.shape[1] for one in session.get_inputs()[1:]}
        self.reset()

    def __call__(self, observation):
        if len(observation) != self.lanes:
            self.lanes = len(observation)
            self.memory = {name: np.zeros((self.lanes, cells)) for name, cells in self.remembers.items()}
        action, *after = self.session.run(None, {"observation": observation, **self.memory})
        self.memory = dict(zip(self.memory, after, strict=True))
        return action

    def reset(self, lanes=None):
        """Forget all lanes, or those where the mask ``lanes`` (N,) is True."""
        if lanes is None:
            self.lanes, self.memory = None, {}
        for values in self.memory.values():
            values[lanes] = 0.0


def onnx_controller(path, parameters=None):
    """The controller, and the environment that its policy was trained for."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1  # the network is too small to share out
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    about = session.get_modelmeta().custom_metadata_map
    settings = ResidualSettings(**json.loads(about["settings"]))
    return ResidualController(parameters, OnnxPolicy(session), settings), about["environment"].replace("Residual", "")


if __name__ == "__main__":
    controller, environment = onnx_controller(sys.argv[1])
    print(table([evaluate(environment, controller, "with the policy", 8, 0, randomize=True)]))

"""An exported policy as a controller: the law at 1 kHz, the policy through onnxruntime every 10 ms. It needs no PyTorch.

    birthsim-export circle --out policy.onnx
    python examples/onnx_policy.py policy.onnx
"""

import json
import sys

import onnxruntime

from agents import ResidualController, ResidualSettings
from baselines.bench.evaluation import evaluate, table


def onnx_controller(path, parameters=None):
    """The controller, and the environment that its policy was trained for."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1  # the network is too small to share out
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    about = session.get_modelmeta().custom_metadata_map
    settings = ResidualSettings(**json.loads(about["settings"]))

    def policy(observation):
        return session.run(["action"], {"observation": observation})[0]

    return ResidualController(parameters, policy, settings), about["environment"].replace("Residual", "")


if __name__ == "__main__":
    controller, environment = onnx_controller(sys.argv[1])
    print(table([evaluate(environment, controller, "with the policy", 8, 0, randomize=True)]))

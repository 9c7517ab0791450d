"""An exported policy at 1 kHz: the law at every control period, the policy through onnxruntime every 10 ms.

birthsim-export out/circle/seed_0 --out policy.onnx
python examples/onnx_policy.py policy.onnx
"""

import argparse
import gc
import json
import time

import gymnasium
import numpy as np
import onnxruntime

from agents.residual.law import ResidualLaw
from agents.residual.settings import NO_LAW, ResidualSettings
from baselines.registry import make_controller
from birthsim_env.assembly import policy_periods
from birthsim_env.observation import observe
from birthsim_env.parts.signals import one_lane
from birthsim_env.physics.lanes import parameter_column
from birthsim_env.physics.parameters import Parameters
from birthsim_env.success import SETTLED

# As in agents.policy.onnx_export, which needs PyTorch; running a policy does not.
FORMAT = "birthsim-residual-onnx-1"
WARM_UP = 300


class OnnxPolicy:
    """One rig's law with an exported policy on top; does what agents.policy.controller does with a policy folder."""

    def __init__(self, parameters, policy="policy.onnx"):
        options = onnxruntime.SessionOptions()
        # The network is too small to share out, and threads that wait for each other are late now and then.
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(policy, options, providers=["CPUExecutionProvider"])
        about = self.session.get_modelmeta().custom_metadata_map
        if about.get("format") != FORMAT:
            raise ValueError(f"policy = {policy!r}: format {about.get('format')!r} is foreign; allowed: {FORMAT!r}")
        self.environment, self.settings = about["environment"], ResidualSettings(**json.loads(about["settings"]))
        self.periods = policy_periods(self.settings.policy_period, parameters)
        self.nominal = parameter_column(parameters)
        self.law = ResidualLaw(parameters, self.settings)
        self.reset()

    def reset(self, lanes=None):
        self.calls, self.action = 0, np.zeros((self.settings.size, 1))
        self.law.reset(np.ones(1, dtype=bool))

    def command(self, measurement, reference):
        """Spool openings (4,) of one control period."""
        measurement, reference = one_lane(measurement, reference)
        if self.calls % self.periods == 0:
            seen = observe(measurement, reference, np.concatenate([self.action, self.law.memory()]), self.nominal)
            self.action = np.ascontiguousarray(self.session.run(["action"], {"observation": seen})[0].T, dtype=np.float64)
            self.law.accept(self.action)
        self.calls += 1
        return self.law.command(measurement, reference)[:, 0]


def run(env, controller, seed):
    """Settled RMS error of an episode, mm; what each control step took by the clock and of the processor, us; lost or not."""
    env.reset(seed=seed)
    rig = env.unwrapped
    # Compiles and loads what the first calls need.
    for _ in range(WARM_UP):
        controller.command(rig.measurement, rig.reference)
    controller.reset()
    errors, times, over = [], [], False
    # As in any loop with a deadline: no collection of garbage in between.
    gc.collect()
    gc.disable()
    while not over:
        started = time.perf_counter_ns(), time.thread_time_ns()
        openings = controller.command(rig.measurement, rig.reference)
        times.append(np.subtract((time.perf_counter_ns(), time.thread_time_ns()), started) / 1e3)
        _, _, terminated, truncated, info = env.step(openings)
        if info["since_jump"] >= SETTLED:
            errors.append(info["tracking_error"])
        over = terminated or truncated
    gc.enable()
    return 1e3 * np.sqrt(np.mean(np.sum(np.square(errors), axis=1))), np.array(times), terminated


def show(name, times, budget):
    clock, processor = times.T
    print(
        f"{name:28}{clock.mean():10.1f}{np.quantile(clock, 0.999):10.1f}{clock.max():10.1f}{np.sum(clock > budget):8d} of "
        f"{clock.size:5d}{processor.max():12.1f}"
    )


def main():
    parser = argparse.ArgumentParser(description="Run an exported policy with the law at 1 kHz and time it.")
    parser.add_argument("file", help="what birthsim-export wrote")
    parser.add_argument("--seconds", type=float, default=16.0, help="how long (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="which rig and experiment (default: %(default)s)")
    arguments = parser.parse_args()
    rig = Parameters()
    period = rig.electronics.control_period
    try:
        policy = OnnxPolicy(rig, arguments.file)
    except Exception as error:  # onnxruntime's have no other base
        parser.error(str(error))
    environment = policy.environment.replace("Residual", "")
    env = gymnasium.make(environment, policy_period=period, duration=arguments.seconds, randomize=True)
    print(f"{environment}, {arguments.seconds:g} s, rig and experiment of seed {arguments.seed}; settled RMS error:")
    if policy.settings.law != NO_LAW:
        error, _, lost = run(env, make_controller(policy.settings.law, rig), arguments.seed)
        print(f"{policy.settings.law:28}{error:10.2f} mm{', lost' * lost}")
    error, times, lost = run(env, policy, arguments.seed)
    print(f"{'with the policy':28}{error:10.2f} mm{', lost' * lost}\n")
    late = f"over {1e6 * period:g}"
    print(f"{'time per control step, us':28}{'mean':>10}{'99.9 %':>10}{'worst':>10}{late:>17}{'worst, CPU':>12}")
    show("all", times, 1e6 * period)
    show("when the policy is asked", times[:: policy.periods], 1e6 * period)
    print("CPU: without the time that the operating system gave to others")
    env.close()


if __name__ == "__main__":
    main()

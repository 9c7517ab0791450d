"""The library for aarch64 gives the bits of the one for this processor, which stored hashes pin: under qemu, loop by loop."""

import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines.driving import driving
from baselines.named import controlling_names, make_controller
from birthsim_build.code.tools import run_tool
from birthsim_build.kernels.libraries import SHIPPED
from birthsim_env import Parameters
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled import prebuilt
from birthsim_env.registry import names
from tests.build.kernels.recorded import recorded
from tests.build.targets import need_linker, need_program

WORN = {"valves.supply_overlap": 0.05, "valves.hysteresis": 0.04, "valves.opening_limit": 0.7}
OPTIONS = {"air.supply_conductance": 1e-8, "mechanics.mode_frequency": 20.0, "chambers.tube_length": 1.0}
LANES = 33
"""A block, which is vectorised, and a lane of another."""


@pytest.fixture(scope="module")
def replay(tmp_path_factory):
    need_linker()
    need_program("qemu-aarch64", "qemu-user")
    place = tmp_path_factory.mktemp("replay") / "replay"
    line = [sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-musl", "-static", "-O1"]
    run_tool(*line, str(Path(__file__).with_name("replay.c")), "-o", str(place)).check_returncode()
    line = ["qemu-aarch64", str(place), str(prebuilt.FOLDER / "aarch64.so")]
    return lambda run: subprocess.run(line, input=run.record(), capture_output=True, check=True).stdout


@pytest.fixture
def looked_for(monkeypatch):
    """Prebuilt code is looked for, whatever the environment says."""
    monkeypatch.setattr(prebuilt, "USED", True)
    prebuilt._opened.cache_clear()
    yield
    prebuilt._opened.cache_clear()


def step(name, **how):
    env = gymnasium.make_vec(environment_id(name), num_envs=LANES, randomize=True, **how)
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(5):
        env.step(env.action_space.sample())
    env.close()


def environments():
    for scenario in names("scenario"):
        for sensors in names("sensors"):
            step(scenario, sensors=sensors)


def hands_and_rigs():
    for hand in names("hand"):
        step("circle", user_force=hand)
    for options in (WORN, {**WORN, **OPTIONS}):
        step("circle", parameters=Parameters().replace(options))


def controllers():
    for name in (*controlling_names(), "limited:pid", "residual:circle", "residual:circle_honest_student"):
        law = driving(make_controller(name, Parameters()), name)
        step("circle", sensors="lab", policy_period=1e-3, actuation=law)


def is_fresh(run):
    return all(prebuilt.found(stage.function, ["i"] * 7)[0] is not None for stage in run.stages)


@pytest.mark.slow
@pytest.mark.usefixtures("looked_for")
@pytest.mark.parametrize(("walk", "least"), [(environments, 10), (hands_and_rigs, 5), (controllers, 10)])
def test_loops_have_the_same_bits(replay, monkeypatch, walk, least):
    runs = recorded(monkeypatch, walk)
    assert "aarch64.so" in SHIPPED
    assert len(runs) >= least
    fresh = [run for run in runs if is_fresh(run)]
    if not fresh:
        pytest.skip("all kernels are newer than the library; make kernels renews it")
    assert any(np.frombuffer(one, np.uint8).any() for run in fresh for one in run.after)
    assert {names_of(run): run.differences(replay(run)) for run in fresh} == {names_of(run): [] for run in fresh}


def names_of(run):
    return ", ".join(stage.function.__qualname__ for stage in run.stages)

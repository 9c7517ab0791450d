"""A policy's file: what is written is what is read, for others too, and nothing is unpickled."""

import ast
import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load

from agents.policy.files import FORMAT, WEIGHTS, read_policy, save_policy
from birthsim_env.physics.compiled.sources import files_of
from tests.console import ROOT
from tests.residual.policies import ENVIRONMENT, POLICIES, network, policy

KINDS = {**POLICIES, "squashed": policy(squashed=True), "eleven layers": policy(hidden=(5,) * 10)}
"""Sorted as text, layer 10 comes before layer 2."""


@pytest.mark.parametrize("written", KINDS.values(), ids=KINDS)
def test_a_round_trip_is_exact(tmp_path, written):
    save_policy(written, tmp_path)
    read = read_policy(str(tmp_path))
    assert sorted(path.name for path in tmp_path.iterdir()) == [WEIGHTS]
    assert replace(read, network=None) == replace(written, network=None)
    assert (len(read.network.memory), read.network.squashed) == (len(written.network.memory), written.network.squashed)
    for mine, its in (
        ((read.network.mean, read.network.variance), (written.network.mean, written.network.variance)),
        *zip((*read.network.layers, *read.network.memory), (*written.network.layers, *written.network.memory), strict=True),
    ):
        for one, other in zip(mine, its, strict=True):
            np.testing.assert_array_equal(one, other, strict=True)


def test_others_read_arrays_and_json(tmp_path):
    """Some figures say nothing, hunting where the reference never rests; JSON has no word for NaN but null."""
    save_policy(replace(policy(), training={"reached": {"hunting_mm": float("nan")}}), tmp_path)
    with safe_open(tmp_path / WEIGHTS, framework="numpy") as file:
        about = json.loads(file.metadata()["birthsim"], parse_constant=pytest.fail)
    assert about["training"]["reached"]["hunting_mm"] is None
    assert (about["format"], about["environment"], len(about["sha256"])) == (FORMAT, ENVIRONMENT, 64)
    np.testing.assert_array_equal(load((tmp_path / WEIGHTS).read_bytes())["mean"], network().mean)


def test_the_same_policy_is_the_same_bytes_in_another_process(folder):
    program = (
        "import sys; from pathlib import Path; from agents.policy.files import read_policy, save_policy\n"
        "save_policy(read_policy(sys.argv[1]), Path(sys.argv[2]))"
    )
    again = folder.parent / "again"
    subprocess.run([sys.executable, "-c", program, str(folder), str(again)], cwd=ROOT, check=True)
    assert (again / WEIGHTS).read_bytes() == (folder / WEIGHTS).read_bytes()


def test_no_module_of_the_project_unpickles():
    forbidden = {"pickle", "cloudpickle", "dill", "joblib", "shelve", "marshal"}
    files = set(files_of("birthsim_env", "baselines", "agents"))
    # The kernels' own cache holds machine code, which runs anyway, and a script's kernel goes to other processes by value;
    # joblib starts processes there and reads no file.
    compiled = {ROOT / f"birthsim_env/physics/compiled/{name}.py" for name in ("compilation", "with_numba")}
    for path in files - compiled - {ROOT / "baselines/work/side_by_side.py"}:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, (ast.Import, ast.ImportFrom)) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            assert not {name.split(".")[0] for name in names} & forbidden, path
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "load":
                assert ast.unparse(node.func) != "torch.load", path
                # An archive of Stable-Baselines3 is read by its own loader, which unpickles: docs and help say so.
                assert not node.keywords or path == ROOT / "agents/foreign/stable_baselines.py", path
            if isinstance(node, ast.keyword):
                assert node.arg != "allow_pickle", path


def test_running_a_policy_needs_neither_torch_nor_stable_baselines(folder):
    program = (
        "import sys\n"
        "sys.modules['torch'] = sys.modules['stable_baselines3'] = sys.modules['sb3_contrib'] = None\n"
        "from baselines.named import make_controller\n"
        "from birthsim_env import Parameters\n"
        "import gymnasium, sys\n"
        f"law = make_controller('residual', Parameters(), policy={str(folder)!r})\n"
        "env = gymnasium.make_vec('BirthSIM/Circle-v2', num_envs=2)\n"
        "env.reset(seed=0)\n"
        "print(law.command(env.measurement, env.reference).shape)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "(4, 2)", done.stderr


WITHOUT_EXTRAS = """
import sys
sys.modules["safetensors"] = sys.modules["stable_baselines3"] = None
import agents
for name in ("SB3VecEnv", "load_policy", "export_onnx"):
    try:
        getattr(agents, name)
    except ImportError as error:
        print(str(error).rpartition("; ")[2])
"""


def test_a_name_that_needs_an_extra_says_which():
    done = subprocess.run([sys.executable, "-c", WITHOUT_EXTRAS], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "SB3VecEnv needs pip install -e '.[agents]' in a clone",
        "load_policy needs pip install -e '.[agents]' in a clone",
        "export_onnx needs pip install -e '.[agents,onnx]' in a clone",
    ]

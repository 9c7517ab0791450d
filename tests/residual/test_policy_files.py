"""A policy's file: what is written is what is read, for others too, and nothing is unpickled."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load

from agents.policy.controller import ResidualController
from agents.policy.files import FORMAT, WEIGHTS, Policy, load_policy, save_policy
from agents.residual.law import observation_names
from agents.residual.settings import ResidualSettings
from tests.residual.policies import ENVIRONMENT, INPUTS, POLICY, REMEMBERS, SETTINGS, network

ROOT = Path(__file__).parent.parent.parent


@pytest.fixture
def folder(tmp_path):
    save_policy(POLICY, tmp_path / "policy")
    return tmp_path / "policy"


@pytest.mark.parametrize("policy", [POLICY, REMEMBERS], ids=["forward", "with a memory"])
def test_a_round_trip_is_exact(tmp_path, policy):
    save_policy(policy, tmp_path)
    read, written = load_policy(tmp_path), policy.network
    assert sorted(path.name for path in tmp_path.iterdir()) == [WEIGHTS]
    assert (read.environment, read.settings, read.training) == (ENVIRONMENT, SETTINGS, policy.training)
    assert (len(read.network.layers), len(read.network.memory), read.network.squashed) == (3, len(written.memory), False)
    for mine, its in (
        ((read.network.mean, read.network.variance), (written.mean, written.variance)),
        *zip((*read.network.layers, *read.network.memory), (*written.layers, *written.memory), strict=True),
    ):
        for one, other in zip(mine, its, strict=True):
            np.testing.assert_array_equal(one, other, strict=True)
    seen = np.random.default_rng(1).normal(size=(3, 50, INPUTS)).astype(np.float32)
    acts = read.network.acting(), written.acting()
    np.testing.assert_array_equal(*(np.stack([act(rows) for rows in seen]) for act in acts))
    assert load_policy(str(tmp_path)).settings == SETTINGS


def test_a_squashed_network_comes_back_squashed(tmp_path):
    squashed = network(squashed=True)
    save_policy(Policy(squashed, ENVIRONMENT, SETTINGS, {}), tmp_path)
    read = load_policy(tmp_path).network
    assert read.squashed is True
    seen = np.random.default_rng(1).normal(size=(50, INPUTS)).astype(np.float32)
    np.testing.assert_array_equal(read.actions(seen), squashed.actions(seen))
    assert not np.array_equal(read.actions(seen), network().actions(seen))


@pytest.mark.parametrize(
    "settings",
    [
        ResidualSettings(impedance="variable_kp"),
        ResidualSettings("backstepping-frozen", "variable", 500, 1, 0.001),
        ResidualSettings("admittance-backstepping"),
        ResidualSettings("none"),
    ],
)
def test_whatever_a_residual_may_do_comes_back(tmp_path, settings):
    inputs = len(observation_names(settings))
    save_policy(Policy(network(inputs, settings.size), ENVIRONMENT, settings, {}), tmp_path)
    assert load_policy(tmp_path).settings == settings
    ResidualController(policy=tmp_path)


def about_as_others_read_it(path):
    """The JSON in the header, as any reader of safetensors finds it."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    with safe_open(path, framework="numpy") as file:
        return json.loads(file.metadata()["birthsim"], parse_constant=refuse)


def test_others_read_arrays_and_json(tmp_path):
    """Some figures say nothing, hunting where the reference never rests; JSON has no word for NaN but null."""
    save_policy(Policy(network(), ENVIRONMENT, SETTINGS, {"reached": {"hunting_mm": float("nan")}}), tmp_path)
    about = about_as_others_read_it(tmp_path / WEIGHTS)
    assert about["training"]["reached"]["hunting_mm"] is None
    assert (about["format"], about["environment"], len(about["sha256"])) == (FORMAT, ENVIRONMENT, 64)
    np.testing.assert_array_equal(load((tmp_path / WEIGHTS).read_bytes())["mean"], network().mean)


def test_the_same_policy_is_the_same_bytes_in_another_process(folder):
    program = (
        "import sys; from pathlib import Path; from agents.policy.files import load_policy, save_policy\n"
        "save_policy(load_policy(sys.argv[1]), Path(sys.argv[2]))"
    )
    again = folder.parent / "again"
    subprocess.run([sys.executable, "-c", program, str(folder), str(again)], cwd=ROOT, check=True)
    assert (again / WEIGHTS).read_bytes() == (folder / WEIGHTS).read_bytes()


def test_eleven_layers_come_back_in_order(tmp_path):
    # Sorted as text, layer 10 would come before layer 2.
    deep = network(hidden=(5,) * 10)
    save_policy(Policy(deep, ENVIRONMENT, SETTINGS, {}), tmp_path)
    seen = np.random.default_rng(1).normal(size=(9, INPUTS)).astype(np.float32)
    np.testing.assert_array_equal(load_policy(tmp_path).network.actions(seen), deep.actions(seen))


def test_writing_again_replaces_the_policy_whole(folder):
    other = Policy(network(hidden=(4,), seed=5), "BirthSIM/ProbeResidual-v2", ResidualSettings(), {"steps": 9})
    save_policy(other, folder)
    read = load_policy(folder)
    assert (read.environment, read.training) == ("BirthSIM/ProbeResidual-v2", {"steps": 9})
    assert len(read.network.layers) == 2
    assert sorted(path.name for path in folder.iterdir()) == [WEIGHTS]


def test_a_write_that_is_cut_off_leaves_the_old_file(folder, monkeypatch):
    def cut(self, target):
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", cut)
    with pytest.raises(KeyboardInterrupt):
        save_policy(Policy(network(hidden=(4,), seed=5), ENVIRONMENT, ResidualSettings(), {}), folder)
    assert load_policy(folder).settings == SETTINGS
    assert [path.name for path in folder.iterdir()] == [WEIGHTS]


def test_no_module_of_the_project_unpickles():
    forbidden = {"pickle", "cloudpickle", "dill", "joblib", "shelve", "marshal"}
    files = {file for package in ("birthsim_env", "baselines", "agents") for file in (ROOT / package).rglob("*.py")}
    # The kernels' own cache holds machine code, which runs anyway; joblib starts processes there and reads no file.
    for path in files - {ROOT / "birthsim_env/physics/compiled/compilation.py", ROOT / "baselines/work/side_by_side.py"}:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, (ast.Import, ast.ImportFrom)) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            assert not {name.split(".")[0] for name in names} & forbidden, path
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "load":
                assert ast.unparse(node.func) != "torch.load", path
                assert not node.keywords, path
            if isinstance(node, ast.keyword):
                assert node.arg != "allow_pickle", path


def test_running_a_policy_needs_neither_torch_nor_stable_baselines(folder):
    program = (
        "import sys\n"
        "sys.modules['torch'] = sys.modules['stable_baselines3'] = sys.modules['sb3_contrib'] = None\n"
        "from baselines.registry import make_controller\n"
        "from birthsim_env import Parameters\n"
        "import gymnasium, sys\n"
        f"law = make_controller('residual', Parameters(), policy={str(folder)!r})\n"
        "env = gymnasium.make_vec('BirthSIM/Circle-v1', num_envs=2)\n"
        "env.reset(seed=0)\n"
        "print(law.command(env.measurement, env.reference).shape)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "(4, 2)", done.stderr

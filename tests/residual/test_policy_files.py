"""A policy's file: what is written is what is read, what is damaged or foreign is refused by name, nothing is unpickled."""

from __future__ import annotations

import ast
import json
import pickle
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load, save

from agents.policy.controller import ResidualController, observation_size
from agents.policy.files import FORMAT, WEIGHTS, Policy, load_policy, save_policy
from agents.policy.network import PolicyNetwork
from agents.policy.sealed import sealed, unsealed
from agents.residual.settings import ResidualSettings

ROOT = Path(__file__).parent.parent.parent
ENVIRONMENT = "BirthSIM/CircleResidual-v1"
SETTINGS = ResidualSettings("backstepping-weight", authority=33.0, time_constant=0.04, policy_period=0.02)
INPUTS = observation_size(SETTINGS)


def network(inputs=INPUTS, outputs=2, hidden=(16, 8), seed=0, squashed=False) -> PolicyNetwork:
    rng = np.random.default_rng(seed)
    widths = (inputs, *hidden, outputs)
    layers = tuple(
        (rng.normal(size=(n, m), scale=0.4).astype(np.float32), rng.normal(size=n, scale=0.1).astype(np.float32))
        for m, n in pairwise(widths)
    )
    mean, variance = rng.normal(size=inputs), rng.uniform(0.1, 2, inputs)
    return PolicyNetwork(mean, variance, layers, squashed)


POLICY = Policy(network(), ENVIRONMENT, SETTINGS, {"steps": 7, "seed": 3, "curve": [{"steps": 0, "pooled_mm": 1.5}]})


@pytest.fixture
def folder(tmp_path):
    save_policy(POLICY, tmp_path / "policy")
    return tmp_path / "policy"


def rewrite(folder, **changes):
    """Change what is said about the arrays, and vouch for the result; None removes an entry."""
    arrays, about = unsealed((folder / WEIGHTS).read_bytes(), FORMAT)
    about = {name: value for name, value in {**about, **changes}.items() if value is not None}
    (folder / WEIGHTS).write_bytes(sealed(arrays, about))


def replace_arrays(folder, **changes):
    """Change arrays (``_`` in a name stands for a dot; None removes one) and vouch for the result."""
    arrays, about = unsealed((folder / WEIGHTS).read_bytes(), FORMAT)
    arrays = {**arrays, **{name.replace("_", "."): value for name, value in changes.items()}}
    (folder / WEIGHTS).write_bytes(sealed({name: value for name, value in arrays.items() if value is not None}, about))


def assert_refused(folder, message):
    with pytest.raises(ValueError, match=message) as caught:
        load_policy(folder)
    assert repr(str(folder)) in str(caught.value)
    assert "allowed: " in str(caught.value)
    assert "\n" not in str(caught.value)
    # The controller refuses in the same words.
    with pytest.raises(ValueError, match=message) as again:
        ResidualController(policy=folder)
    assert str(again.value) == str(caught.value)


def test_a_round_trip_is_exact(folder):
    read = load_policy(folder)
    assert sorted(path.name for path in folder.iterdir()) == [WEIGHTS]
    assert (read.environment, read.settings, read.training) == (ENVIRONMENT, SETTINGS, POLICY.training)
    for name in ("mean", "variance"):
        np.testing.assert_array_equal(getattr(read.network, name), getattr(POLICY.network, name), strict=True)
    assert len(read.network.layers) == 3
    for mine, its in zip(read.network.layers, POLICY.network.layers, strict=True):
        for one, other in zip(mine, its, strict=True):
            np.testing.assert_array_equal(one, other, strict=True)
    seen = np.random.default_rng(1).normal(size=(50, INPUTS)).astype(np.float32)
    np.testing.assert_array_equal(read.network.actions(seen), POLICY.network.actions(seen))
    assert load_policy(str(folder)).settings == SETTINGS
    assert read.network.squashed is False


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
    inputs = observation_size(settings)
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


def test_a_folder_without_a_policy_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "empty").mkdir()
    for name in ("file", "empty", "nowhere"):
        assert_refused(tmp_path / name, rf"has no {WEIGHTS}; allowed: a folder that birthsim-train wrote, with {WEIGHTS}")


def test_every_flipped_bit_is_noticed(folder):
    content = (folder / WEIGHTS).read_bytes()
    # All of the header's bytes, and some of the arrays'.
    header = 8 + int.from_bytes(content[:8], "little")
    rng = np.random.default_rng(0)
    for place in [*range(header), *rng.integers(header, len(content), 200), len(content) - 1]:
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        with pytest.raises(ValueError, match=r"^(no birthsim-residual-3 or )?damaged"):
            unsealed(bytes(flipped), FORMAT)
    (folder / WEIGHTS).write_bytes(flipped)
    assert_refused(
        folder, f"{WEIGHTS} is damaged: its checksum is of another content; allowed: a folder that birthsim-train wrote"
    )


def test_a_file_that_is_cut_off_or_longer_is_noticed(folder):
    content = (folder / WEIGHTS).read_bytes()
    for part in (content[:-4], content[:20], b"", content + b"0", content[:200]):
        (folder / WEIGHTS).write_bytes(part)
        assert_refused(folder, "damaged")


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "3", "null", '{"format": 3}', "\xff", '{"a": ' * 5000])
def test_what_is_said_about_other_arrays_is_refused(folder, text):
    for metadata in (None, {"other": text}, {"birthsim": text}):
        (folder / WEIGHTS).write_bytes(save({"mean": np.zeros(3)}, metadata))
        assert_refused(folder, f"{WEIGHTS} is no {FORMAT} or damaged; allowed: a folder that birthsim-train wrote")


@pytest.mark.parametrize("form", ["other-1", "birthsim-residual-4", "birthsim-checkpoint-1", 3, None, ["birthsim"]])
def test_another_format_is_called_foreign(folder, form):
    arrays, about = unsealed((folder / WEIGHTS).read_bytes(), FORMAT)
    (folder / WEIGHTS).write_bytes(sealed(arrays, {**about, "format": form}))
    assert_refused(folder, rf"of the foreign format .*, not '{FORMAT}'")


@pytest.mark.parametrize(
    "changes",
    [
        {"settings": None},
        {"training": None},
        {"environment": None},
        {"settings": {**SETTINGS.to_dict(), "authority": -1.0}},
        {"settings": {**SETTINGS.to_dict(), "authority": "forty"}},
        {"settings": {**SETTINGS.to_dict(), "time_constant": 0}},
        {"settings": {**SETTINGS.to_dict(), "law": "pid"}},
        {"settings": {**SETTINGS.to_dict(), "impedance": 3}},
        {"settings": {**SETTINGS.to_dict(), "law": "none", "impedance": "variable"}},
        {"settings": {"authority": 40.0, "smoothing": 0.3, "policy_period": 0.01, "weight_compensation": False}},
        {"squashed": None},
        {"settings": {**SETTINGS.to_dict(), "unknown": 1}},
        {"settings": [1, 2]},
        {"settings": 3},
        {"training": 3},
        {"training": "text"},
    ],
)
def test_a_configuration_with_a_wrong_or_missing_entry_is_refused(folder, changes):
    rewrite(folder, **changes)
    assert_refused(folder, r"is damaged \(.+\); allowed: a folder that birthsim-train wrote")


@pytest.mark.parametrize("squashed", ["false", 3, []])
def test_a_squashing_that_is_neither_true_nor_false_is_refused(folder, squashed):
    rewrite(folder, squashed=squashed)
    assert_refused(folder, "is damaged")


def shape(*sizes, fill=0.1, dtype=np.float32):
    return np.full(sizes, fill, dtype)


@pytest.mark.parametrize(
    "changes",
    [
        {"mean": None},
        {"variance": None},
        {"1_weight": None},
        {"2_bias": None},
        {"mean": shape(INPUTS - 1)},
        {"variance": shape(INPUTS + 1)},
        {"mean": shape(1, INPUTS), "variance": shape(1, INPUTS)},
        {"mean": shape(0), "variance": shape(0), "0_weight": shape(16, 0)},
        {"0_weight": shape(16, INPUTS - 1)},
        {"0_weight": shape(INPUTS, 16)},
        {"0_weight": shape(16 * INPUTS)},
        {"0_bias": shape(15)},
        {"0_bias": shape(16, 1)},
        {"1_weight": shape(8, 17)},
        {"3_weight": shape(2, 3), "3_bias": shape(2)},
        {"extra_weight": shape(2, 2)},
        {"variance": shape(INPUTS, fill=-0.1)},
    ]
    + [{name: None for name in ("0_weight", "1_weight", "2_weight")}]
    + [{"mean": shape(INPUTS, fill=bad)} for bad in (np.nan, np.inf)]
    + [{"variance": shape(INPUTS, fill=bad)} for bad in (np.nan, np.inf)]
    + [{"1_weight": shape(8, 16, fill=bad)} for bad in (np.nan, np.inf, -np.inf)]
    + [{"2_bias": shape(2, fill=np.nan)}],
)
def test_arrays_that_are_no_network_are_refused(folder, changes):
    replace_arrays(folder, **changes)
    assert_refused(folder, r"is damaged \(.+\); allowed: a folder that birthsim-train wrote")


@pytest.mark.parametrize(("inputs", "outputs"), [(22, 2), (INPUTS, 4), (INPUTS - 1, 3)])
def test_a_network_of_another_task_is_refused_by_the_controller(tmp_path, inputs, outputs):
    save_policy(Policy(network(inputs, outputs), ENVIRONMENT, SETTINGS, {}), tmp_path)
    assert load_policy(tmp_path).network.inputs == inputs
    with pytest.raises(ValueError, match=rf"maps {inputs} to {outputs} numbers; allowed: {INPUTS} to 2") as caught:
        ResidualController(policy=tmp_path)
    assert repr(str(tmp_path)) in str(caught.value)


@pytest.mark.parametrize("period", [0.0105, 0.0004])
def test_a_policy_period_that_the_rig_cannot_keep_is_refused(tmp_path, period):
    save_policy(Policy(network(), ENVIRONMENT, ResidualSettings(policy_period=period), {}), tmp_path)
    with pytest.raises(ValueError, match=rf"policy_period = {period}; allowed: a multiple of the control period 0\.001 s"):
        ResidualController(policy=tmp_path)


class Trap:
    """Unpickling one writes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (Path.touch, (self.path,))


def test_a_pickle_under_another_name_is_refused_and_not_opened(folder, tmp_path):
    trap = tmp_path / "sprung"
    (folder / WEIGHTS).write_bytes(pickle.dumps(Trap(trap)))
    assert_refused(folder, f"is no {FORMAT} or damaged")
    assert not trap.exists()
    # The trap is a real one.
    pickle.loads(pickle.dumps(Trap(trap)))
    assert trap.exists()


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


def test_a_network_is_normalization_tanh_layers_and_a_clip():
    hand = PolicyNetwork(
        np.array([1.0, 0.0]),
        np.array([4.0, 0.25]),
        (
            (np.array([[1.0, 0.0], [0.0, 2.0]], np.float32), np.array([0.0, 0.5], np.float32)),
            (np.array([[1.0, 1.0], [0.0, 3.0]], np.float32), np.array([0.1, 0.0], np.float32)),
        ),
    )
    assert (hand.inputs, hand.outputs) == (2, 2)
    # Actions are singles, rounded by 6e-8 of their size; EPSILON of the variance counts 1.3e-9 to 2e-8.
    one, other = np.tanh((2 - 1) / 2), np.tanh(2 * -0.5 / 0.5 + 0.5)
    seen = np.array([[2.0, -0.5], [1e9, 1e9]], np.float32)
    actions = hand.actions(seen)
    np.testing.assert_allclose(actions[0], [one + other + 0.1, max(3 * other, -1)], rtol=1e-6)
    # Far inputs are clipped at ten standard deviations, actions at one.
    np.testing.assert_array_equal(actions[1], [1, 1])
    weak = PolicyNetwork(hand.mean, hand.variance, ((np.array([[0.05, 0.0]], np.float32), np.zeros(1, np.float32)),))
    np.testing.assert_allclose(weak.actions(seen)[:, 0], [0.025, 0.5], rtol=1e-6)
    assert actions.dtype == np.float32


def test_a_squashed_network_ends_with_another_tanh():
    weight, bias = np.array([[0.5, -2.0]], np.float32), np.array([0.25], np.float32)
    hand = PolicyNetwork(np.zeros(2), np.ones(2), ((weight, bias),), squashed=True)
    actions = hand.actions(np.array([[1.0, 0.5], [100.0, -100.0]], np.float32))
    np.testing.assert_allclose(actions[:, 0], np.tanh([0.5 - 1 + 0.25, 5 + 20 + 0.25]), rtol=1e-6)

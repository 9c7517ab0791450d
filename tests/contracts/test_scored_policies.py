"""Policies of other libraries: as controllers they do what they do in the environment, and a wrong one is refused by name."""

import json
import sys
import zipfile

import gymnasium as gym
import numpy as np
import onnxruntime
import pytest
import torch
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

import birthsim
from agents import SB3VecEnv
from agents.foreign.onnx_export import TOLERANCE, export_archive
from agents.foreign.policies import read_policy_file
from agents.foreign.stable_baselines import algorithm_in
from agents.policy.onnx_export import export_onnx, traced
from agents.policy.seeds import load_policy
from baselines.bench.evaluation import evaluate
from birthsim_env.ids import rig_for
from tests.console import call

PROBE, RAIL = "BirthSIM/Probe-v3", "BirthSIM/Rail-v0"
SEED, LANES = 80_000, 3
SHORT = {"duration": 0.3}
MLP, BUFFERED = {"policy": "MlpPolicy"}, {"policy": "MlpPolicy", "buffer_size": 10}
RECURRENT = {"policy": "MlpLstmPolicy", "policy_kwargs": {"lstm_hidden_size": 8}}
SMALL = {PPO: MLP, A2C: MLP, SAC: BUFFERED, TQC: BUFFERED, RecurrentPPO: RECURRENT}


@pytest.fixture(autouse=True, scope="module")
def _one_thread():
    torch.set_num_threads(1)


def made(kind, environment=PROBE):
    """An untrained model whose openings are large enough to be told apart."""
    model = kind(env=gym.make(environment), seed=1, device="cpu", **SMALL[kind])
    with torch.no_grad():
        for name, weight in model.policy.named_parameters():
            if name.startswith("action_net.weight"):
                weight.mul_(20.0)
            if name in ("action_net.bias", "actor.mu.bias"):
                weight.add_(0.25)  # more than the overlap of the valves
    return model


def stepped(model, environment, **arguments):
    """Tracking errors (T, N, 2) before each policy step, and returns (N,), in Gymnasium's own loop."""
    worlds = gym.make_vec(environment, num_envs=LANES, autoreset_mode="Disabled", **arguments)
    seen, info = worlds.reset(seed=SEED)
    errors, paid, state, begins = [], np.zeros(LANES), None, np.ones(LANES, dtype=bool)
    for _ in range(worlds.steps):
        errors.append(info["tracking_error"])
        actions, state = model.predict(seen, state=state, episode_start=begins, deterministic=True)
        seen, rewards, terminated, _, info = worlds.step(actions)
        begins, paid = np.zeros(LANES, dtype=bool), paid + rewards
        assert not terminated.any()
    return np.array(errors), paid


@pytest.mark.parametrize(
    ("kind", "environment", "arguments"),
    [
        (PPO, PROBE, {"sensors": "honest", "randomize": True}),
        (SAC, PROBE, {"sensors": "lab", "randomize": True, "force_sensor": False}),
        (TQC, PROBE, {"sensors": "ideal", "randomize": True}),
        (RecurrentPPO, PROBE, {"sensors": "honest", "randomize": True}),
        (PPO, RAIL, {"sensors": "lab", "randomize": True}),
    ],
)
def test_an_archive_moves_the_rig_as_in_the_environment(kind, environment, arguments, tmp_path):
    model = made(kind, environment)
    model.save(tmp_path / "model.zip")
    assert algorithm_in(tmp_path / "model.zip") == kind.__name__
    law = read_policy_file(str(tmp_path / "model.zip"), rig_for(environment, None), 0.01)
    errors, paid = stepped(model, environment, **arguments, **SHORT)
    shut = evaluate(environment, "shut-valves", None, LANES, SEED, progress=False, **arguments, **SHORT)
    # Across a rail the two round differently.
    axes = slice(0, 1 if environment == RAIL else 2)
    assert np.abs(shut.traces[0] - errors)[..., axes].max() > 1e-5, "it does something"
    for _ in range(2):  # again, after a reset
        found = evaluate(environment, law, "model", LANES, SEED, progress=False, **arguments, **SHORT)
        np.testing.assert_array_equal(found.traces[0][..., axes], errors[..., axes])
        # An evaluation pays every period of 1 ms, an environment every 10 ms.
        np.testing.assert_allclose(found.returns[1.0], paid, rtol=0.02)


def test_a_policy_that_is_called_every_period_holds_its_openings(tmp_path):
    """As real rigs are driven: the same openings as where the loop asks once a policy step."""
    made(PPO).save(tmp_path / "model.zip")
    law = read_policy_file(str(tmp_path / "model.zip"), rig_for(PROBE, None), 0.01)
    asked = evaluate(PROBE, law, "model", LANES, SEED, progress=False, duration=0.1)

    class Every:
        def command(self, measurement, reference):
            return law.command(measurement, reference)

        def reset(self, lanes=None):
            law.reset(lanes)

    every = evaluate(PROBE, Every(), "model", LANES, SEED, progress=False, duration=0.1)
    np.testing.assert_array_equal(every.traces[0], asked.traces[0])


def test_a_model_has_its_statistics_with_it_and_an_archive_takes_them_from_their_file(tmp_path):
    worlds = VecNormalize(SB3VecEnv(gym.make_vec(PROBE, num_envs=LANES, randomize=True, autoreset_mode="SameStep", **SHORT)))
    model = PPO("MlpPolicy", worlds, n_steps=8, batch_size=8, seed=2, device="cpu")
    model.learn(48)
    model.save(tmp_path / "model.zip")
    worlds.save(str(tmp_path / "statistics.pkl"))
    given = {"episodes": 2, "progress": False}
    whole = birthsim.score(model, PROBE, **given).row
    by_file = birthsim.score(tmp_path / "model.zip", PROBE, normalize=tmp_path / "statistics.pkl", **given).row
    bare = birthsim.score(tmp_path / "model.zip", PROBE, **given).row
    assert whole["tasks"][0]["error_mm"] == by_file["tasks"][0]["error_mm"]
    assert whole["tasks"][0]["error_mm"] != bare["tasks"][0]["error_mm"]


@pytest.mark.parametrize("name", ["circle_pure", "circle_honest_student"])
def test_onnx_does_what_the_policy_does(name, tmp_path):
    policy, path = load_policy(name), tmp_path / "policy.onnx"
    export_onnx(policy, path)
    rig = rig_for("BirthSIM/Circle-v2", None)
    world = {"sensors": "honest", "force_sensor": policy.settings.force_sensor, **SHORT}
    laws = read_policy_file(str(path), rig, 0.01), birthsim.make_controller(f"residual:{name}", rig)
    one, other = (evaluate("BirthSIM/Circle-v2", law, "", LANES, SEED, progress=False, **world).traces[0] for law in laws)
    np.testing.assert_allclose(one, other, atol=1e-6)


@pytest.mark.parametrize("kind", [PPO, SAC, TQC, RecurrentPPO])
def test_an_archive_becomes_data_that_acts_as_it_does(kind, tmp_path):
    model, path = made(kind), tmp_path / "model.onnx"
    model.save(tmp_path / "model.zip")
    exported = export_archive(tmp_path / "model.zip", path)
    assert 0 <= exported.difference <= TOLERANCE
    assert exported.size == path.stat().st_size
    said = json.loads(path.with_suffix(".json").read_text())
    assert said["settings"] | {"algorithm": kind.__name__, "seed": 1, "gamma": model.gamma} == said["settings"]
    assert said["steps"] == 0
    session, rng = onnxruntime.InferenceSession(path.read_bytes()), np.random.default_rng(3)
    held = {one.name: np.zeros((LANES, one.shape[1]), np.float32) for one in session.get_inputs()[1:]}
    assert bool(held) == (kind is RecurrentPPO)
    state, begins = None, np.ones(LANES, dtype=bool)
    for _ in range(5):
        seen = rng.normal(size=(LANES, 24)).astype(np.float32)
        expected, state = model.predict(seen, state=state, episode_start=begins, deterministic=True)
        actions, *after = session.run(None, {session.get_inputs()[0].name: seen, **held})
        held, begins = dict(zip(held, after, strict=True)), np.zeros(LANES, dtype=bool)
        np.testing.assert_allclose(actions, expected, atol=TOLERANCE)
    laws = [read_policy_file(str(one), rig_for(PROBE, None), 0.01) for one in (tmp_path / "model.zip", path)]
    one, other = (evaluate(PROBE, law, "", LANES, SEED, progress=False, **SHORT).traces[0] for law in laws)
    np.testing.assert_allclose(one, other, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (PPO, {"use_sde": True, "policy_kwargs": {"squash_output": True}}),
        (SAC, {"use_sde": True, "buffer_size": 10}),
        (RecurrentPPO, {"policy": "MlpLstmPolicy", "policy_kwargs": {"lstm_hidden_size": 8, "n_lstm_layers": 2}}),
    ],
)
def test_an_archive_of_unusual_settings_becomes_data_too(kind, options, tmp_path):
    kind(env=gym.make(PROBE), device="cpu", **{"policy": "MlpPolicy", **options}).save(tmp_path / "model.zip")
    assert export_archive(tmp_path / "model.zip", tmp_path / "model.onnx").difference <= TOLERANCE


class Named(gym.Env):
    """Its observations have a name."""

    observation_space = gym.spaces.Dict({"position": gym.spaces.Box(-1.0, 1.0, (2,))})
    action_space = gym.spaces.Box(-1.0, 1.0, (4,))


def test_an_archive_that_no_file_can_hold_is_refused_and_nothing_is_written(tmp_path):
    PPO("MultiInputPolicy", Named(), device="cpu").save(tmp_path / "named.zip")
    made(PPO).save(tmp_path / "model.zip")
    with zipfile.ZipFile(tmp_path / "model.zip") as whole, zipfile.ZipFile(tmp_path / "untold.zip", "w") as untold:
        for name in whole.namelist():
            content = whole.read(name)
            untold.writestr(name, content.replace(b"num_timesteps", b"other_number") if name == "data" else content)
    for name, out, said in (
        ("named.zip", "model.onnx", r"named\.zip' observes None .*allowed: lists of numbers"),
        ("untold.zip", "model.onnx", r"untold\.zip': num_timesteps = None; allowed: a whole number"),
        ("model.zip", "model.json", r"out = .*model\.json'; allowed: FILE\.onnx"),
        ("model.zip", "", r"out = .*; allowed: FILE\.onnx"),
    ):
        with pytest.raises(ValueError, match=said):
            export_archive(tmp_path / name, tmp_path / "made" / out)
    assert not (tmp_path / "made").exists()


def test_a_file_that_does_not_act_as_its_archive_is_not_written(tmp_path, monkeypatch):
    def tampered(module, *given):
        with torch.no_grad():
            module.policy.action_net.bias.add_(1e-3)
            model = traced(module, *given)
            module.policy.action_net.bias.sub_(1e-3)
        return model

    made(PPO).save(tmp_path / "model.zip")
    monkeypatch.setattr("agents.foreign.onnx_export.traced", tampered)
    with pytest.raises(ValueError, match=r"model\.zip': actions differ in ONNX by 0\.001; allowed: 6e-05"):
        export_archive(tmp_path / "model.zip", tmp_path / "deeper" / "model.onnx")
    assert not (tmp_path / "deeper").exists()


def test_data_of_an_archive_holds_its_normalisation(tmp_path, monkeypatch, capsys):
    worlds = VecNormalize(SB3VecEnv(gym.make_vec(PROBE, num_envs=LANES, randomize=True, autoreset_mode="SameStep", **SHORT)))
    model = PPO("MlpPolicy", worlds, n_steps=8, batch_size=8, seed=2, device="cpu").learn(48)
    model.save(tmp_path / "model.zip")
    worlds.save(str(tmp_path / "statistics.pkl"))
    given = ("export", monkeypatch, capsys, "--to", "onnx", tmp_path / "model.zip")
    status, printed, complained = call(*given, "--normalize", tmp_path / "statistics.pkl")
    assert status == 0, complained
    assert "model.onnx" in printed
    seen = 3.0 * np.random.default_rng(4).normal(size=(8, 24)).astype(np.float32)
    (actions,) = onnxruntime.InferenceSession((tmp_path / "model.onnx").read_bytes()).run(None, {"observation": seen})
    normalised, bare = (model.predict(one, deterministic=True)[0] for one in (worlds.normalize_obs(seen), seen))
    np.testing.assert_allclose(actions, normalised, atol=TOLERANCE)
    assert np.abs(actions - bare).max() > 100 * TOLERANCE


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--to", "onnx", "circle", "--normalize", "x.pkl"), ("normalize = 'x.pkl'", "allowed: with FILE.zip")),
        (("--to", "hub", "model.zip"), ("policy = 'model.zip'", "allowed: with --to onnx")),
        (("--to", "onnx", "missing.zip"), ("missing.zip", "PPO, SAC, TQC")),
    ],
)
def test_an_export_of_what_is_no_archive_is_refused(given, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    status, _, complained = call("export", monkeypatch, capsys, *given)
    assert status
    assert all(part in complained for part in said), complained


WRONG = {
    "missing.zip": (None, "missing.zip", "does not exist", "PPO, SAC, TQC"),
    "text.zip": (lambda path: path.write_text("no archive"), "text.zip", "PPO, SAC, TQC"),
    "empty.zip": (lambda path: zipfile.ZipFile(path, "w").close(), "empty.zip", "PPO, SAC, TQC"),
    "a2c.zip": (lambda path: made(A2C).save(path), "a2c.zip", "PPO, SAC, TQC"),
    "rail.zip": (lambda path: made(PPO, RAIL).save(path), "rail.zip", "(12,)", "allowed: (24,) and (4,)"),
    "text.onnx": (lambda path: path.write_text("no graph"), "text.onnx", "allowed: an ONNX file"),
    "missing.py:act": (None, "missing.py", "does not exist"),
    "none.py:VALUE": (lambda path: path.with_name("none.py").write_text("VALUE = 3"), "none.py", "allowed: "),
    "ppo2": (None, "policy = 'ppo2'", "allowed: ", "FILE.zip"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_policy_is_refused_by_name(name, tmp_path, monkeypatch):
    make, *said = WRONG[name]
    monkeypatch.chdir(tmp_path)
    if make is not None:
        make(tmp_path / name)
    with pytest.raises(ValueError, match="allowed") as refused:
        birthsim.score(name, PROBE, episodes=1, progress=False)
    assert [part for part in said if part not in str(refused.value)] == []
    assert "\n" not in str(refused.value)


def test_a_damaged_archive_is_refused_in_one_line(tmp_path):
    made(PPO).save(tmp_path / "model.zip")
    with zipfile.ZipFile(tmp_path / "model.zip") as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    settings = json.loads(parts["data"])
    settings["policy_class"][":serialized:"] = "bm8gcGlja2xl"
    for name, content in (("data", json.dumps(settings)), ("policy.pth", b"no weights")):
        with zipfile.ZipFile(tmp_path / "damaged.zip", "w") as archive:
            for part, kept in parts.items():
                archive.writestr(part, content if part == name else kept)
        with pytest.raises(ValueError, match=r"damaged\.zip' cannot be loaded .*; allowed: an archive") as refused:
            birthsim.score(tmp_path / "damaged.zip", PROBE, episodes=1, progress=False)
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "module", "extra"), [("model.zip", "stable_baselines3", "agents"), ("p.onnx", "onnxruntime", "onnx")]
)
def test_a_missing_package_is_named_with_its_extra(name, module, extra, tmp_path, monkeypatch):
    made(PPO).save(tmp_path / "model.zip")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ValueError, match=rf"{module}.*{name}.*pip install.*{extra}"):
        birthsim.score(tmp_path / name, PROBE, episodes=1, progress=False)


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda seen: np.zeros((len(seen), 3)), r"gives actions \(1, 3\); allowed: .*\(1, 4\)"),
        (lambda seen: np.full((len(seen), 4), 1.5), r"gives the action 1.5; allowed: numbers in \[-1, 1\]"),
        (lambda seen: np.full((len(seen), 4), np.nan), r"gives the action nan; allowed: numbers in \[-1, 1\]"),
        (lambda seen: seen / "x", r"fails .*; allowed: numbers in \[-1, 1\]"),
        (3.0, r"policy = 3.0; allowed: "),
        ([], r"policy = \[\]; allowed: one or more"),
    ],
)
def test_what_a_function_gives_is_looked_at(act, said):
    with pytest.raises(ValueError, match=said):
        birthsim.score(act, PROBE, episodes=1, progress=False)

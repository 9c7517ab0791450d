"""Residual training: it starts as the law, repeats itself bit for bit, gets better than the law, and keeps what was best."""

import errno
import os
import threading
from dataclasses import replace
from itertools import pairwise

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from agents.policy.files import WEIGHTS, read_policy
from agents.residual.privileged import TRUE_PARAMETERS
from agents.residual.settings import ResidualSettings
from agents.training import reached as reached_module
from agents.training import trainer as training
from agents.training import validation
from agents.training.configuration import TrainingSettings, load_configuration
from agents.training.margin import widened
from agents.training.sb3 import learner
from agents.training.trainer import train
from agents.training.validation import VALIDATION_SEED, Score, validate
from baselines.backstepping.controller import BacksteppingController
from baselines.bench.evaluation import evaluate
from birthsim_env import Parameters
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.simulation import Simulation
from tests.training.brief import TINY, steady

PROBE = "BirthSIM/ProbeResidual-v3"
RESIDUAL = ResidualSettings()
SMALL = TrainingSettings(
    PROBE,
    steps=45_000,
    lanes=32,
    rollout=32,
    batch=256,
    epochs=4,
    hidden=(32, 32),
    learning_rate=1e-3,
    validation_lanes=8,
    validations=2,
)
"""On 4.5 s of the stiffness test, some seconds are enough to take a third off the law's error. With the overlap of valves two
seeds of three were worse than the law after 15,000 steps at a rate of 2e-3."""
BRIEF = replace(SMALL, steps=2048, lanes=16, validation_lanes=4, validations=2)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Folder and figures of one small training."""
    folder, make_vec = tmp_path_factory.mktemp("trained"), gymnasium.make_vec
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training.gymnasium, "make_vec", lambda *args, **kwargs: make_vec(*args, **{"duration": 4.5, **kwargs}))
        return folder, train(SMALL, RESIDUAL, folder)


def test_training_gets_better_than_the_law_and_keeps_what_was_best(trained):
    _, reached = trained
    law, policy, curve = reached["law"], reached["policy"], reached["curve"]
    # Seeds 0 to 2 reached 0.40 to 0.72 of the law's error, and 0.29 to 0.63 of its tail.
    assert policy["pooled_mm"] < 0.85 * law["pooled_mm"]
    assert policy["tail_mm"] < 0.85 * law["tail_mm"]
    assert policy["lost"] == law["lost"] == 0
    best = min(curve, key=lambda point: point["pooled_mm"] + point["tail_mm"])
    assert steady([{name: best[name] for name in policy}]) == steady([policy])
    # Validations at the start, at equal intervals (the nearest ends of rollouts), and at the end.
    rollouts = 32 * 32
    assert [point["steps"] for point in curve] == [0, *(rollouts * np.ceil(np.array([22.5e3, 45e3]) / rollouts)).astype(int)]
    assert all(later["seconds"] > sooner["seconds"] for sooner, later in pairwise(curve))
    assert all(0 < point["environment_fraction"] < 1 for point in curve[1:])
    assert reached["settings"] == {**SMALL.to_dict(), **RESIDUAL.to_dict(), "rig": Parameters().to_dict()}


@pytest.mark.slow
@pytest.mark.weekly
@pytest.mark.parametrize(
    "changes",
    [
        # Seed 0 reached 0.68 of the law's error; a batch is 8 sequences.
        {"algorithm": "recurrent-ppo", "hidden": (32,), "memory": 16},
        # 0.79, after 3,000 updates, which take minutes.
        {"algorithm": "sac", "steps": 24_000, "lanes": 32, "gradient_steps": 4, "validations": 4},
    ],
)
def test_the_other_algorithms_get_better_than_the_law(tmp_path, monkeypatch, changes):
    make_vec = gymnasium.make_vec
    monkeypatch.setattr(training.gymnasium, "make_vec", lambda *args, **kwargs: make_vec(*args, **{"duration": 4.5, **kwargs}))
    reached = train(replace(SMALL, **changes), RESIDUAL, tmp_path)
    assert reached["policy"]["pooled_mm"] < 0.9 * reached["law"]["pooled_mm"]
    assert reached["policy"]["lost"] == 0


@pytest.mark.slow
def test_from_scratch_it_soon_holds_a_head(tmp_path):
    """Shut valves err by 0.1 m. Where a beginner's runaway heads stayed in statistics of observations or rewards, 200,000 steps
    did not change that; now 100,000 leave 5 to 9 mm with seeds 0 to 3."""
    own = {"lanes": 64, "rollout": 64, "batch": 512, "epochs": 5, "learning_rate": 1e-3, "log_std": 0.0}
    settings = TrainingSettings(steps=100_000, validations=1, validation_lanes=16, **own)
    reached = train(settings, ResidualSettings("none"), tmp_path)
    assert reached["law"]["pooled_mm"] > 80
    assert reached["policy"]["pooled_mm"] < 20
    network = read_policy(tmp_path).network
    np.testing.assert_array_equal((network.mean, network.variance), (np.zeros(network.inputs), np.ones(network.inputs)))


def test_what_is_kept_is_the_best_in_error_and_tail_together_and_not_the_last(tmp_path, monkeypatch, short_probe):
    """Four lanes: three at one error and the fourth, on which the tail depends, at another; the third validation is best."""
    networks, take = [], learner.network_of
    monkeypatch.setattr(learner, "network_of", lambda *args: (networks.append(take(*args)), networks[-1])[1])
    errors, nothing = iter([(3.0, 3.0), (1.0, 9.0), (2.0, 2.5), (1.9, 4.0), (2.1, 2.5)]), np.full(4, np.nan)

    def scored(env, act, **options):
        most, one = next(errors)
        return Score(np.array([most, most, one, most]), nothing, nothing, nothing, np.zeros(4), 0)

    monkeypatch.setattr(reached_module, "validate", scored)
    reached = train(replace(BRIEF, validations=4), RESIDUAL, tmp_path)
    assert [point["max_mm"] for point in reached["curve"]] == [3.0, 9.0, 2.5, 4.0, 2.5]
    assert reached["policy"]["max_mm"] == 2.5
    kept = read_policy(tmp_path)
    assert kept.training["reached"]["pooled_mm"] == reached["curve"][2]["pooled_mm"]
    np.testing.assert_array_equal(kept.network.layers[-1][0], networks[2].layers[-1][0])
    assert len(networks) == 5


def test_events_are_there_for_tensorboard_each_at_its_own_step(trained):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    folder, reached = trained
    (run,) = (folder / "tensorboard").iterdir()
    accumulator = EventAccumulator(str(run))
    accumulator.Reload()
    events = {tag: {one.step: one.value for one in accumulator.Scalars(tag)} for tag in accumulator.Tags()["scalars"]}
    assert {"rollout/ep_rew_mean", "train/value_loss", "validation/pooled_mm", "validation/tail_mm_law"} <= set(events)
    shown = list(events["validation/pooled_mm"].values())
    np.testing.assert_allclose(shown[:2], [point["pooled_mm"] for point in reached["curve"][:2]], rtol=1e-5)
    np.testing.assert_allclose(events["validation/pooled_mm_law"][min(events["validation/pooled_mm_law"])], shown[0], rtol=1e-5)
    assert set(events["validation/pooled_mm"]) == {point["steps"] for point in reached["curve"]}


@pytest.mark.parametrize(
    "algorithm", ["ppo", *(pytest.param(name, marks=pytest.mark.slow) for name in ("recurrent-ppo", "sac", "tqc"))]
)
def test_the_same_seed_twice_gives_the_same_files_and_another_seed_others(tmp_path, short_probe, algorithm):
    results = []
    settings = replace(TINY, algorithm=algorithm, memory=4 * (algorithm == "recurrent-ppo"), steps=512)
    for name, seed in (("one", 0), ("again", 0), ("other", 1)):
        reached = train(replace(settings, seed=seed), RESIDUAL, tmp_path / name)
        results.append((reached["curve"], (tmp_path / name / WEIGHTS).read_bytes()))
    (one, file), (again, twin), (other, stranger) = results
    assert steady(one) == steady(again)
    assert file == twin
    # The untrained policies are the same, the law; the trained ones are not.
    assert steady(one[:1]) == steady(other[:1])
    assert steady(one[-1:]) != steady(other[-1:])
    assert file != stranger


def test_training_and_validation_run_what_was_asked_for(tmp_path, monkeypatch):
    made, make_vec = [], gymnasium.make_vec

    def spied(name, **arguments):
        env = make_vec(name, **arguments, duration=0.8)
        seeds, reset = [], env.reset
        env.reset = lambda seed=None, **options: (seeds.append(seed), reset(seed=seed, **options))[1]
        made.append((name, arguments, seeds))
        return env

    monkeypatch.setattr(training.gymnasium, "make_vec", spied)
    rig = Parameters().replace({"mechanics.mass": 4.0})
    residual = ResidualSettings("backstepping-weight", "variable_kp", 22.0, 0.05, 0.02)
    brief = replace(BRIEF, seed=30, lanes=4, steps=256, batch=64)
    settings = replace(brief, environment="BirthSIM/ForcepsResidual-v2", sensors="lab", randomize="plant", margin=0.25)
    train(settings, residual, tmp_path, rig)
    expected = {"sensors": "lab", "randomize": "plant", **residual.to_dict()}
    expected["autoreset_mode"] = gymnasium.vector.AutoresetMode.SAME_STEP
    # Only training meets the margin.
    for (name, arguments, _), own in zip(made, (widened(rig, 0.25), rig), strict=True):
        assert name == "BirthSIM/ForcepsResidual-v2"
        assert arguments == {**expected, "parameters": own, "num_envs": 4}
    # Seed 30 starts from worlds of its own; all validations take the same ones, which training never meets.
    (_, _, trains), (_, _, checks) = made
    assert [seed for seed in trains if seed is not None] == [[2_300_000 + lane for lane in range(4)]]
    assert len(checks) >= 3
    assert set(checks) == {VALIDATION_SEED}
    assert read_policy(tmp_path).settings == residual


def test_a_training_that_could_not_tell_policies_apart_does_not_begin(tmp_path, monkeypatch, short_probe):
    monkeypatch.setattr(validation, "required_strength_ratio", lambda env: np.full(env.num_envs, 1.5))
    with pytest.raises(
        ValueError, match=r"all 4 validation worlds ask for more than the rig's strength.*; allowed: a stronger rig"
    ):
        train(BRIEF, RESIDUAL, tmp_path)
    assert not (tmp_path / WEIGHTS).exists()


def test_the_evaluation_of_the_controller_and_the_validation_of_the_policy_agree(trained):
    folder, _ = trained
    arguments = {"randomize": True, "duration": 4.5}
    inside = gymnasium.make_vec(PROBE, num_envs=5, **arguments)
    score = validate(inside, read_policy(folder).network.acting(), 40)
    result = evaluate("BirthSIM/Probe-v3", ResidualController(policy=folder), "residual", 5, 40, progress=False, **arguments)
    law = evaluate("BirthSIM/Probe-v3", BacksteppingController(), "law", 5, 40, progress=False, **arguments)
    # The one averages every 10 ms, the other every millisecond of the same trajectory.
    np.testing.assert_allclose(result.metrics["settled_rms"], score.error, rtol=0.02)
    np.testing.assert_array_equal(result.required_strength_ratio, score.required_strength_ratio)
    assert np.mean(result.metrics["settled_rms"]) < 0.9 * np.mean(law.metrics["settled_rms"])


@pytest.mark.slow
@pytest.mark.weekly
def test_the_default_training_improves_on_the_law_on_the_circle(tmp_path):
    """A part of the default budget."""
    reached = train(TrainingSettings(steps=200_000, validations=2), ResidualSettings(), tmp_path)
    assert reached["policy"]["lost"] == 0
    assert reached["policy"]["pooled_mm"] < 0.8 * reached["law"]["pooled_mm"]
    assert reached["policy"]["tail_mm"] < 0.8 * reached["law"]["tail_mm"]


def test_a_training_ends_once_it_is_far_enough_below_the_papers_law(tmp_path, short_probe):
    """The law underneath is better than the paper's from the first validation on; a stricter one than can be is not reached."""
    easy, residual = replace(BRIEF, until=0.01, steps=2 * BRIEF.steps), ResidualSettings("backstepping-force-first")
    for settings, enough in ((easy, True), (replace(easy, until=99.9), False)):
        reached = train(settings, residual, tmp_path / str(enough), Parameters().replace({"mechanics.mass": 3.0}))
        below = reached["policy"]["pooled_mm"] <= (1 - settings.until / 100) * reached["paper"]["pooled_mm"]
        assert below == enough
        assert (reached["curve"][-1]["steps"] < settings.steps) == enough
    again = train(easy, residual, tmp_path / "True", Parameters().replace({"mechanics.mass": 3.0}))
    assert again["curve"][-1]["steps"] < easy.steps, "once more, it is still good enough"


@pytest.mark.parametrize("writes", [0, 1, 5, 30])
def test_a_full_disk_is_said_once_with_the_place_and_without_a_traceback(tmp_path, monkeypatch, capsys, short_probe, writes):
    """TensorBoard writes in a thread of its own."""
    from tensorboard.summary.writer.record_writer import RecordWriter

    done, write = [], RecordWriter.write

    def full(self, data):
        done.append(data)
        if len(done) > writes:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(self, data)

    hook = threading.excepthook
    with monkeypatch.context() as patch:
        patch.setattr(RecordWriter, "write", full)
        with pytest.raises(OSError, match="No space left on device") as caught:
            train(BRIEF, RESIDUAL, tmp_path)
    assert caught.value.filename == str(tmp_path / "tensorboard")
    assert "Traceback" not in capsys.readouterr().err
    assert threading.excepthook is hook
    # With room again, the same command goes on.
    assert train(BRIEF, RESIDUAL, tmp_path)["curve"][-1]["steps"] == BRIEF.steps


@pytest.mark.parametrize("algorithm", ["ppo", "apg"])
def test_a_privileged_policy_is_trained_and_refused_by_the_controller(tmp_path, algorithm):
    few = {"steps": 64, "lanes": 4, "rollout": 8, "batch": 32, "validation_lanes": 4, "validations": 1}
    settings = TrainingSettings("BirthSIM/ProbeResidual-v3", algorithm=algorithm, privileged=True, **few)
    train(settings, ResidualSettings(), tmp_path)
    policy = read_policy(tmp_path)
    assert policy.training["privileged"] is True
    with pytest.raises(
        ValueError, match=rf"maps {policy.network.inputs} to 2 numbers; allowed: {policy.network.inputs - TRUE_PARAMETERS}"
    ):
        ResidualController(policy=tmp_path)


@pytest.mark.parametrize(
    ("algorithm", "friction", "laws"),
    [("ppo", "drawn", 4), pytest.param("apg", "drawn-smooth", 3, marks=pytest.mark.slow)],
)
def test_a_line_of_a_configuration_draws_frictions_in_training_and_validation(tmp_path, monkeypatch, algorithm, friction, laws):
    """The plants' laws, when lanes have begun, while their controllers go on believing LuGre."""
    (tmp_path / "own.toml").write_text(f'[training]\nfriction = "{friction}"\n')
    settings = replace(load_configuration(tmp_path / "own.toml")[0], algorithm=algorithm, steps=256, lanes=64, rollout=2)
    settings = replace(settings, batch=64, epochs=1, hidden=(8,), validation_lanes=32, validations=1)
    begin, seen = Simulation.begin, {}

    def watched(simulation, *given):
        begin(simulation, *given)
        p = simulation.plant.lane_parameters
        seen[simulation.plant.num_envs] = {tuple(lane) for lane in p[[at.LUGRE, at.GMS, at.BRISTLED]].T}, simulation.parameters

    monkeypatch.setattr(Simulation, "begin", watched)
    reached = train(settings, ResidualSettings(), tmp_path / "out")
    assert seen.keys() == {64, 32}
    for drawn, believed in seen.values():
        assert len(drawn) == laws
        assert ((0.0, 1.0, 1.0) in drawn) == (friction == "drawn"), "generalised Maxwell slip"
        assert believed.friction.law == "lugre"
    assert reached["settings"]["friction"] == friction

"""Teaching of a network that reads rigs: what the truth is, the loss, and that an interrupted one ends as any other."""

import json

import numpy as np
import pytest
import torch

from agents.reader import teaching
from agents.reader.rounds import ROWS, collect, truth_of
from agents.reader.settings import ReaderSettings, is_reader, load_reader_settings, reader_configurations
from agents.reader.teaching import READER, ROUNDS, teach
from baselines.estimation.readers import load_reader
from baselines.estimation.rig_filter import TOLD, spread_of
from baselines.estimation.rig_reader import INPUTS, READ
from birthsim import train
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.physics.rig.parameters import Parameters, value_of

BRIEF = {"rounds": 2, "lanes": 4, "updates": 3, "batch": 3, "hidden": 3}


def test_the_truth_is_the_logarithm_of_a_parameter_over_that_described():
    rng, rig = np.random.default_rng(5), Parameters()
    values = {name: float(np.exp(rng.uniform(*np.log(ends)))) for name, ends in TOLD.items()}
    columns = parameter_column(rig.replace(values))[:, None]
    found = dict(zip(TOLD, truth_of(columns, rig)[:, 0], strict=True))
    assert list(ROWS) == list(TOLD)
    for name, value in values.items():
        assert found[name] == pytest.approx(np.log(value / value_of(rig, name)), abs=1e-12)


@pytest.fixture(scope="module")
def taught(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reader")
    return folder, teach(ReaderSettings(**BRIEF), Parameters(), folder)


def test_a_round_has_rigs_that_are_known(taught):
    settings = ReaderSettings(**BRIEF)
    first, again = (collect(settings, Parameters(), 1, 77) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)
    assert first.seen.shape == (len(first.alive), 4, INPUTS)
    logarithms, ends = first.truth * spread_of(Parameters())[:READ], np.log([*TOLD.values()])
    described = np.log([value_of(Parameters(), name) for name in TOLD])
    assert (logarithms + described > ends[:, 0] - 1e-6).all()
    assert (logarithms + described < ends[:, 1] + 1e-6).all()


def test_the_loss_is_that_of_a_normal_distribution():
    """Its gradient with respect to what is said, against differences of SciPy's density."""
    from scipy.stats import norm

    truth, said, unsure = torch.tensor(0.3), torch.tensor(0.1, requires_grad=True), torch.tensor(-0.5, requires_grad=True)
    teaching.surprise(truth, said, unsure).backward()
    step = 1e-5

    def density(mean: float, logarithm: float) -> float:
        return float(-norm.logpdf(0.3, mean, np.exp(logarithm)))

    assert float(said.grad) == pytest.approx((density(0.1 + step, -0.5) - density(0.1 - step, -0.5)) / (2 * step), rel=1e-5)
    assert float(unsure.grad) == pytest.approx((density(0.1, -0.5 + step) - density(0.1, -0.5 - step)) / (2 * step), rel=1e-5)


def test_an_untaught_reader_says_what_the_filter_finds():
    seen, one = np.random.default_rng(0).normal(size=(2, 3, INPUTS)).astype(np.float32), np.ones(INPUTS)
    said, unsure = teaching.said_of(teaching.untaught(3), seen, 0.0 * one, one)
    np.testing.assert_array_equal(said.detach(), seen[:, :, teaching.MEANS])
    np.testing.assert_array_equal(unsure.detach(), seen[:, :, teaching.DEVIATIONS].clip(teaching.LEAST, teaching.MOST))


def test_a_teaching_that_was_interrupted_ends_with_the_same_reader(taught, tmp_path, monkeypatch):
    whole, reached = taught
    monkeypatch.setattr(teaching, "EVERY_UPDATES", 2)
    own = teaching._update

    def interrupted(settings, update, *others):
        if update == 2:
            raise KeyboardInterrupt
        own(settings, update, *others)

    monkeypatch.setattr(teaching, "_update", interrupted)
    with pytest.raises(KeyboardInterrupt):
        teach(ReaderSettings(**BRIEF), Parameters(), tmp_path)
    assert not (tmp_path / READER).exists()
    begun = []
    monkeypatch.setattr(
        teaching, "_update", lambda settings, update, *others: (begun.append(update), own(settings, update, *others))
    )
    again = teach(ReaderSettings(**BRIEF), Parameters(), tmp_path)
    assert begun == [2]
    assert again["reached"] == reached["reached"]
    assert (tmp_path / READER).read_bytes() == (whole / READER).read_bytes()


def test_a_checkpoint_of_other_settings_and_damaged_rounds_are_refused(taught, tmp_path):
    folder, _ = taught
    with pytest.raises(ValueError, match=r"other hidden; allowed: the same settings"):
        teach(ReaderSettings(**{**BRIEF, "hidden": 4}), Parameters(), folder)
    (tmp_path / ROUNDS).mkdir()
    (tmp_path / ROUNDS / "0.npz").write_bytes(b"PK damaged")
    with pytest.raises(ValueError, match=r"0\.npz.* is damaged .*allowed: "):
        teach(ReaderSettings(**BRIEF), Parameters(), tmp_path)


def test_a_configuration_with_a_table_reader_teaches_one(tmp_path):
    (tmp_path / "own.toml").write_text("[reader]\nhidden = 5\n")
    (tmp_path / "other.toml").write_text("[training]\nsteps = 5\n")
    assert [is_reader(name) for name in (*reader_configurations(), tmp_path / "own.toml")] == [True, True]
    assert [is_reader(name) for name in ("circle", tmp_path / "other.toml", tmp_path / "none.toml")] == [False] * 3
    assert load_reader_settings(tmp_path / "own.toml", lanes=70).to_dict() == {**ReaderSettings(hidden=5, lanes=70).to_dict()}
    trained = train(tmp_path / "own.toml", out=tmp_path / "out", seeds=1, **BRIEF)
    folder = tmp_path / "out" / "seed_0"
    assert load_reader(folder / READER).cells == BRIEF["hidden"]
    assert json.loads((folder / "training.json").read_text()) == json.loads(json.dumps(trained.reached[0]))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"updates": 0}, "updates = 0; allowed: a whole number >= 1 and <= "),
        ({"hidden": 4000}, "hidden = 4000; allowed: a whole number >= 1 and <= 512"),
        ({"batch": 5, "lanes": 4}, "batch = 5; allowed: at most lanes = 4"),
        ({"scenarios": ()}, r"scenarios = \(\); allowed: a list of "),
        ({"frictions": ("stribeck",)}, "frictions = .stribeck.*allowed: .*drawn"),
        ({"authority": 3.0}, "authority = 3.0.*allowed: seed, sensors, scenarios"),
    ],
)
def test_what_cannot_be_is_refused_by_name(changes, said, tmp_path):
    with pytest.raises(ValueError, match=said):
        train("rig_reader", out=tmp_path, **changes)

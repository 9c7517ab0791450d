"""Several training seeds: interquartile means, intervals, the table, the shipped policies, the evaluation of all of them."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from agents.policy.files import FORMAT, WEIGHTS, policy_content, read_policy, save_policy
from agents.policy.sealed import sealed, unsealed
from agents.policy.seeds import as_table, best_policy, policy_folders, pooled, seed_metrics
from agents.reports import inspection
from agents.reports.card import compared
from agents.reports.inspection import friction_along_circle, weight_over_workspace
from agents.reports.learning_curves import learning_curves, over_seeds
from agents.residual.corrected import observation_names
from baselines.bench.evaluation import Evaluation, merged
from baselines.bench.metrics import UNITS
from baselines.bench.pieces import evaluate_piece
from baselines.bench.statistics import crossed_interval, interquartile_mean
from birthsim import evaluation as command
from birthsim_env.ids import rig_for
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names
from lab.studies.scores.study import _contestants


def evaluation(name, error, lost=(), beyond=()):
    one = Evaluation(name, seeds=list(range(len(error))), cost=1.0)
    one.lost = [k in lost for k in range(len(error))]
    one.required_strength_ratio = [1.2 if k in beyond else 0.5 for k in range(len(error))]
    for metric in UNITS:
        one.metrics[metric] = [float(value) for value in error]
    return one


@pytest.mark.parametrize("size", [4, 20, 256])
def test_the_interquartile_mean_is_scipys_trimmed_mean(size):
    values = np.random.default_rng(size).gamma(2, size=size)
    assert interquartile_mean(values) == pytest.approx(stats.trim_mean(values, 0.25), rel=1e-12)


def test_values_at_the_edge_of_the_middle_half_count_by_their_fraction():
    # Of five the middle half is 2.5 wide: three quarters of the second, the third, three quarters of the fourth.
    assert interquartile_mean([1.0, 2.0, 4.0, 5.0, 100.0]) == pytest.approx((0.75 * 2 + 4 + 0.75 * 5) / 2.5)
    assert interquartile_mean([1.0, 2.0, 3.0, np.inf]) == 2.5
    assert interquartile_mean([1.0, np.inf, np.inf, np.inf]) == np.inf
    assert np.isnan(interquartile_mean([np.nan]))


def test_the_crossed_interval_knows_that_seeds_are_a_sample_too():
    rng = np.random.default_rng(0)
    level = np.repeat([[1.0], [2.0], [3.0], [4.0]], 100, axis=1) + 0.01 * rng.normal(size=(4, 100))
    low, high = crossed_interval(lambda values: float(values.mean()), level)
    assert 1.0 < low < 1.7
    assert 3.3 < high < 4.0
    # One seed: what is left is the episodes, as the normal theory has it.
    one = rng.normal(size=(1, 400))
    low, high = crossed_interval(lambda values: float(values.mean()), one)
    np.testing.assert_allclose([low, high], one.mean() + np.array([-1, 1]) * 1.96 * one.std() / 20, atol=0.02)


@pytest.fixture
def coarse(monkeypatch):
    """Intervals by so few draws that they take no time, where a test says nothing of them."""
    monkeypatch.setattr(crossed_interval, "__defaults__", (40,))


@pytest.mark.usefixtures("coarse")
def test_the_table_leaves_out_what_is_beyond_the_rig_and_counts_what_is_lost():
    law = evaluation("law", [2.0, 2.0, 2.0, 50.0], beyond=(3,))
    residuals = [evaluation("a", [1.0, 1.0, 1.0, 50.0], beyond=(3,)), evaluation("b", [1.0, 1.0, 7.0, 50.0], (2,), (3,))]
    text = as_table(seed_metrics(law, residuals))
    assert "3 of 4 episodes are within the rig's strength; 2 training seeds" in text
    assert f"| pooled RMS of each seed | | 1, {np.sqrt((1 + 1 + 100**2) / 3):.3g} | |" in text
    assert "| lost | | episodes; 100 mm in a pooled RMS | 0 | 0, 1 | |" in text
    assert "| settled_rms | mm | median | 2 | 1 |" in text
    assert "| settled_rms | mm | max | 2 | lost |" in text
    assert pooled(np.array([3.0, 4.0])) == pytest.approx(np.sqrt(12.5))
    assert merged(residuals, "both").lost == [False] * 6 + [True, False]


@pytest.mark.usefixtures("coarse")
def test_where_most_episodes_are_lost_the_table_says_so():
    law = evaluation("law", [1.0, 2.0, 3.0, 4.0])
    text = as_table(seed_metrics(law, [evaluation("seed", [1.0, 2.0, 3.0, 4.0], lost=(0, 1, 2))] * 2))
    assert "less, interquartile mean | | most episodes are lost |" in text
    assert "inf" not in text


def test_a_learning_curve_over_seeds_ends_with_the_shortest():
    trainings = [{"curve": [{"steps": 10 * t, "x": level - t} for t in range(4 - k)]} for k, level in enumerate((8.0, 9.0))]
    steps, (middle, low, high) = over_seeds(trainings, "x")
    np.testing.assert_array_equal(steps, [0, 10, 20])
    np.testing.assert_allclose(middle, [8.5, 7.5, 6.5])
    np.testing.assert_allclose([low, high], [[8, 7, 6], [9, 8, 7]])


@pytest.mark.parametrize(
    "text",
    [
        *("", "[]", "{}", '{"law": {}, "curve": []}', '{"law": 3}', '{"law": {}, "curve": [{}], "settings": {}}'),
        *("\xff" * 9000, '{"a":' * 9000, '{"law": 1' + "0" * 400 + "}"),
    ],
    ids=range(9),
)
def test_a_damaged_learning_curve_is_named(tmp_path, text):
    shutil.copy(policy_folders("probe")[0] / WEIGHTS, tmp_path)
    (tmp_path / "training.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=r"training\.json' is damaged.*; allowed: "):
        learning_curves([tmp_path])
    with pytest.raises(ValueError, match=r"training\.json' is damaged.*; allowed: "):
        compared(tmp_path)
    assert learning_curves([tmp_path / "nowhere"]) == []
    assert len(learning_curves(policy_folders("circle"))) == 5


def test_of_several_policies_that_do_not_say_what_they_reached_none_is_the_best(tmp_path):
    for k, reached in enumerate((3.0, None, 2.0)):
        policy = read_policy(policy_folders("circle")[k])
        save_policy(replace(policy, training={"reached": {"pooled_mm": reached}}), tmp_path / f"seed_{k}")
    (tmp_path / "seed_old").mkdir()
    save_policy(policy, tmp_path / "seed_old")
    assert best_policy(tmp_path) == tmp_path / "seed_2"
    save_policy(replace(policy, training={}), tmp_path / "seed_1")
    with pytest.raises(ValueError, match=r"seed_1' does not say what it reached in validation; allowed: a folder that"):
        best_policy(tmp_path)


@pytest.mark.parametrize("reached", ["abc", "nan", float("nan"), float("inf"), 10**400, -1.0, True, [1], None])
def test_of_policies_that_reached_no_finite_error_none_is_the_best(tmp_path, reached):
    policy = read_policy(policy_folders("circle")[0])
    arrays, about = unsealed(policy_content(policy), FORMAT)
    for seed in ("seed_0", "seed_1"):
        (tmp_path / seed).mkdir()
        own = {**about, "training": {"reached": {"pooled_mm": reached}}}
        (tmp_path / seed / WEIGHTS).write_bytes(sealed(arrays, own))
    with pytest.raises(ValueError, match=r"policy = .*allowed: ") as refused:
        best_policy(tmp_path)
    assert len(str(refused.value)) < 1000
    assert best_policy(tmp_path / "seed_1") == tmp_path / "seed_1"


@pytest.mark.parametrize("name", names("policy"))
def test_shipped_policies_load_fit_and_are_small(name):
    places = policy_folders(name)
    assert [place.name for place in places] == [f"seed_{k}" for k in range(len(places))]
    for place in places:
        policy = read_policy(place)
        assert sum(path.stat().st_size for path in place.iterdir()) < 60_000
        training = json.loads((place / "training.json").read_text(encoding="utf-8"))
        rig = rig_for(training["settings"]["environment"], None)
        assert policy.network.inputs == len(observation_names(policy.settings, rig))
        assert training["policy"]["pooled_mm"] == policy.training["reached"]["pooled_mm"]
    reached = [read_policy(place).training["reached"]["pooled_mm"] for place in places]
    assert best_policy(name) == places[int(np.argmin(reached))]


@pytest.mark.parametrize(("sensors", "said"), [("honest", False), ("lab", True)])
def test_evaluation_says_of_a_policy_that_was_trained_with_other_sensors(tmp_path, monkeypatch, capsys, sensors, said):
    def refused(*_):
        raise ValueError("enough")

    monkeypatch.setattr(command, "run_tasks", refused)
    settings = command.Settings(policy="circle_honest_student", sensors=sensors, episodes=1, out=tmp_path)
    with pytest.raises(ValueError, match="enough"):
        command.run(settings)
    told = "the policy was trained with honest sensors; here they are lab"
    assert (told in capsys.readouterr().out) is said


def test_scores_are_of_policies_that_were_trained_with_their_sensors():
    names = {policy.partition("/")[0] for _, policy in _contestants("BirthSIM/Circle-v2") if policy}
    assert names == {"circle", "circle_lab", "circle_pure", "circle_apg", "circle_residual_apg", "circle_lab_apg"}


@pytest.mark.slow
def test_the_shipped_policy_of_the_circle_has_learned_weight_and_friction(monkeypatch):
    """Once round the circle each way instead of twice."""
    follow = inspection._follow
    monkeypatch.setattr(
        inspection,
        "_follow",
        lambda policy, settings, lanes, time, *what: follow(policy, settings, lanes, min(time, 8.0), *what),
    )
    policy = read_policy(best_policy("circle"))
    assert np.corrcoef(*weight_over_workspace(policy))[0, 1] > 0.95
    beyond = (Parameters().friction.static_ratio - 1) * 12  # N, on cylinder 1 at mid pressures
    for unknown, half in zip(*friction_along_circle(policy), strict=True):
        # Newton for newton. Where the law knows Coulomb's friction, what is left is what a slow piston has beyond it.
        slope, rest = np.polyfit(unknown, half, 1)
        assert 0.7 < slope < 1.3
        assert -2 < rest < beyond


@pytest.mark.slow
@pytest.mark.usefixtures("coarse")
def test_without_a_policy_the_scenarios_own_is_evaluated_with_every_seed(tmp_path, monkeypatch, capsys):
    asked, result = [], evaluate_piece("pid", "", Parameters().to_dict(), "BirthSIM/Probe-v3", {"duration": 4.5}, [], 0, 4)

    def computed(tasks, folder, jobs, title, cluster):
        asked.extend(Path(task.settings.get("policy", task.settings["controller"])).name for task in tasks)
        return {task.name: result for task in tasks}, {}

    monkeypatch.setattr(command, "run_tasks", computed)
    command.run(command.Settings(env="BirthSIM/Probe-v3", controller=["residual"], episodes=4, out=tmp_path))
    assert asked == ["backstepping", "backstepping-force-first", *(f"seed_{k}" for k in range(5))]
    assert "residual, 5 seeds " in capsys.readouterr().out
    for page in ("evaluation.md", "seeds.md"):
        assert "; 5 training seeds" in (tmp_path / page).read_text(encoding="utf-8")
    content = json.loads((tmp_path / "evaluation.json").read_text(encoding="utf-8"))
    assert content["arguments"]["policy"] == "probe"
    assert [len(result["seeds"]) for result in content["results"]] == [4] * 7

"""Cards of policies: what programs read of them is what was measured, and they say where a policy is worse."""

import pytest
import yaml

from agents.policy.files import read_policy
from agents.policy.seeds import best_policy
from agents.policy.shipped import SHIPPED
from agents.reports.card import METRICS, TRAINING, compared, model_card
from baselines.bench.evaluation import Evaluation
from birthsim_env.registry import names
from tests.console import call
from tests.training.test_seeds import evaluation


def measured(controller: str, settled: list[float], air: float) -> Evaluation:
    """Three episodes with one of them beyond the rig's strength, and no figure but these and zeros."""
    one = evaluation(controller, [0.0] * 3, beyond=[2])
    one.metrics |= {"settled_rms": settled, "air": [air] * 3, "stiffness_error": [float("nan")] * 3}
    return one


@pytest.mark.parametrize("name", names("policy"))
def test_the_hub_reads_what_was_measured_and_readers_where_it_is_worse(name):
    card = model_card(
        best_policy(name), name, [measured("this policy", [0.2, 0.4, 9.0], 30.0), measured("pid", [0.6] * 3, 20.0)]
    )
    (index,) = yaml.safe_load(card.split("---\n")[1])["model-index"]
    metrics = {one["type"]: one["value"] for one in index["results"][0]["metrics"]}
    # The third episode asks for more than the rig has; nothing was felt in any.
    assert (metrics["settled_rms median"], metrics["air median"]) == (pytest.approx(0.3), 30.0)
    assert set(metrics) == set(METRICS) - {"stiffness_error median"}
    assert "| settled error, median, mm | 0.3 | 0.6 |" in card
    assert "is worse in: air, median." in card
    assert (
        f"| uses the hand's force | {'yes' if read_policy(best_policy(name)).settings.force_sensor else 'no'} | yes |" in card
    )


def test_a_lost_episode_is_infinitely_bad():
    lost = measured("pid", [0.2, 0.4, 9.0], 30.0)
    lost.lost = [True, True, False]
    card = model_card(best_policy("circle"), "circle", [measured("this policy", [0.2] * 3, 30.0), lost])
    assert "| settled error, median, mm | 0.2 | lost |" in card
    assert "| lost episodes, % | 0 | 100 |" in card


@pytest.mark.slow
def test_the_folder_holds_what_a_policy_needs(tmp_path, monkeypatch, capsys):
    status, _, complaint = call("export", monkeypatch, capsys, "--to", "hub", "probe_apg", "--out", tmp_path)
    assert status == 0, complaint
    assert {path.name for path in tmp_path.iterdir()} == {"README.md", "policy.safetensors", TRAINING}
    shipped = best_policy("probe_apg") / "policy.safetensors"
    assert (tmp_path / "policy.safetensors").read_bytes() == shipped.read_bytes()
    whom = (tmp_path / "README.md").read_text().partition("| | ")[2].partition("\n")[0]
    assert whom.split(" | ")[:2] == ["this policy", "backstepping"]


def test_a_policy_without_its_training_is_refused(tmp_path):
    (tmp_path / "policy.safetensors").write_bytes((SHIPPED / "circle" / "seed_0" / "policy.safetensors").read_bytes())
    with pytest.raises(ValueError, match=r"policy = .*; allowed: a folder with training.json"):
        compared(tmp_path)

"""Cards of policies: what programs read of them is what the training wrote, and they say where a policy is worse."""

import json

import pytest
import yaml

from agents.policy.seeds import SHIPPED, best_policy, shipped_names
from agents.reports.card import FIGURES, TRAINING, model_card
from tests.console import call


@pytest.mark.parametrize("name", shipped_names())
def test_the_hubs_figures_are_those_of_the_training(name):
    folder = best_policy(name)
    card, found = model_card(folder, name), json.loads((folder / TRAINING).read_text())
    (index,) = yaml.safe_load(card.split("---\n")[1])["model-index"]
    metrics = {one["type"]: one["value"] for one in index["results"][0]["metrics"]}
    assert metrics == {key: found["policy"][key] for key in FIGURES if found["policy"][key] is not None}
    said = card.partition("It is worse in: ")[2].partition(".\n")[0]
    for key, value in metrics.items():
        assert (FIGURES[key][0] in said) == (found["law"][key] is not None and value > found["law"][key])


def test_the_folder_holds_what_a_policy_needs(tmp_path, monkeypatch, capsys):
    status, _, complaint = call("export", monkeypatch, capsys, "--to", "hub", "probe_apg", "--out", tmp_path)
    assert status == 0, complaint
    assert {path.name for path in tmp_path.iterdir()} == {"README.md", "policy.safetensors", TRAINING}
    shipped = best_policy("probe_apg") / "policy.safetensors"
    assert (tmp_path / "policy.safetensors").read_bytes() == shipped.read_bytes()


def test_a_policy_without_its_training_is_refused(tmp_path):
    (tmp_path / "policy.safetensors").write_bytes((SHIPPED / "circle" / "seed_0" / "policy.safetensors").read_bytes())
    with pytest.raises(ValueError, match=r"has no figures of its training .*; allowed: a folder with training.json"):
        model_card(tmp_path, "own")

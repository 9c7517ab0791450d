"""Optuna's journal after a kill: a line without an end, a lock without an owner, trials that nobody has begun."""

import optuna
import pytest

from baselines.commands.tune import open_journal


def study(path):
    return optuna.create_study(storage=open_journal(path), study_name="one", load_if_exists=True)


@pytest.mark.parametrize("torn", [b"{", b'{"op_code": 5, "worker_id": "a', b'{"op_code": 5}'])
def test_a_search_goes_on_where_the_journal_was_torn(torn, tmp_path):
    path = tmp_path / "trials.journal"
    before = study(path)
    before.tell(before.ask({"x": optuna.distributions.FloatDistribution(0, 1)}), 1.0)
    whole = path.read_bytes()
    path.write_bytes(whole + torn)
    (tmp_path / "trials.journal.lock").symlink_to(path)
    after = study(path)
    assert path.read_bytes().startswith(whole + b"{")
    assert torn not in path.read_bytes().splitlines()
    assert [trial.params for trial in after.trials] == [trial.params for trial in before.trials]
    after.tell(after.ask(), 2.0)
    assert len(study(path).trials) == 2

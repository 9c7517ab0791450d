"""What a study cannot do it says with status 2, before it writes anything."""

import pytest

from tests.console import call

WHOLE = "'0'; allowed: a whole number from 1 to 1000000"
TABLE = [
    ("accuracy", ("--rigs", "0"), WHOLE),
    ("accuracy", ("--parameters", "none.toml"), "'none.toml' cannot be read"),
    ("haptics", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, "),
    ("haptics", ("--subject", "moon"), "--subject"),
    ("haptics", ("--rigs", "0"), WHOLE),
    ("speed", ("--beside", "docs"), "error: --beside 'docs' has no birthsim_env; allowed: a checkout of the project\n"),
    ("stability", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, "),
    ("stability", ("--points", "0"), WHOLE),
    ("stability", ("--map", "moon"), "--map"),
    ("stability", ("--parameters", "nowhere.toml"), "parameters = 'nowhere.toml' cannot be read"),
]


@pytest.mark.parametrize(("study", "arguments", "complaint"), TABLE)
def test_a_study_refuses_plainly(study, arguments, complaint, tmp_path, monkeypatch, capsys):
    status, _, complained = call(study, monkeypatch, capsys, *arguments, "--out", tmp_path / "none")
    assert status == 2
    assert f"birthsim study {study}: error: " in complained
    assert complaint in complained
    assert not (tmp_path / "none").exists()

"""The tutorial of one's own bench: its files and commands make the log that it reads, and its words turn volts into SI."""

import os
import re
import shlex
import subprocess
import sys
import warnings

import numpy as np

from baselines.identification.log.log_columns import LogOptions
from baselines.identification.log.log_file import read_trial
from birthsim_env.physics.rig.parameters import load_parameters
from tests.console import ROOT

PAGE = (ROOT / "docs" / "tutorials" / "own_bench.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line) for line in re.findall(r"^    birthsim (.+)", PAGE.replace("\\\n", " "), re.MULTILINE)]


def test_the_log_of_the_tutorial_is_read_as_it_was_made(tmp_path):
    known, bench = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "known.toml").write_text(known)
    (tmp_path / "bench.toml").write_text(bench)
    volts = next(re.finditer(r"```{code-block} python\n(.*?)```", PAGE, re.DOTALL))[1]
    propose, simulate, identify, with_law = (line for line in COMMANDS if line[0] == "identify")
    for line in (["-m", "birthsim", *propose], ["-m", "birthsim", *simulate], ["-c", volts]):
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        subprocess.run([sys.executable, *line], cwd=tmp_path, env=environment, check=True, capture_output=True)
    assert with_law[with_law.index("--columns") + 1] == identify[identify.index("--columns") + 1]
    said = identify[identify.index("--columns") + 1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # nobody touches the bench, so that there is no force
        rig = load_parameters(tmp_path / "known.toml")
        found = read_trial(tmp_path / identify[1], rig, LogOptions(said))
    made = read_trial(tmp_path / "raw.csv", rig)
    np.testing.assert_allclose(found.times, made.times, atol=1e-9)
    np.testing.assert_allclose(found.openings, made.openings, atol=1e-6)
    np.testing.assert_allclose(found.pressures[2:], made.pressures[2:], atol=0.1)
    np.testing.assert_allclose(found.positions, made.positions, atol=1e-8)

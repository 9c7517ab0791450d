"""Command lines: options of every command with odd words, up to where work would begin; and odd rigs through commands."""

import contextlib
import io
import re
import sys
import traceback
from functools import cache
from unittest.mock import patch

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from birthsim.command_line.command import perform_with, program
from birthsim.command_line.start import perform
from birthsim.main import COMMANDS, load
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import entry, names
from birthsim_live.rig.folder import packed_page
from lab.engine.shelf import declared
from tests.fuzz.rigs import odd_rig
from tests.fuzz.strategies import sampled
from tests.fuzz.watched import cases, watched

ODD = (
    *("0", "-1", "1", "2", "1000000000", "9" * 320, "9" * 5000, "1e308", "nan", "inf", "-inf", "1.5", "0x10", "1_000", "", " "),
    *("x", "²", "٣", "१", "\udcff", "[[", "a=b", "=", "a=", "=b", "pid[", "pid[a=]", "pid[bandwidth=1e999]", "/dev/zero"),
    *("/", "..", "x\ny", "pid", "circle", "both", "lab", "BirthSIM/Circle-v2", "CartPole-v1", "BirthSIM/", "none", "true"),
    *("bandwidth=60", "--", "-x"),
)
WORDS = sampled(ODD) | st.text(st.characters(exclude_characters="\x00"), max_size=10)
BEFORE = {form: ["none.rec"] for form in ("parquet", "mcap")}
"""Words of an export without which it says no more than that they are missing."""


class BeganError(Exception):
    """A command has accepted its arguments."""


def begin(*_):
    raise BeganError


@cache
def settings_of(name):
    """The settings of a command, and its options."""
    command, _, form = name.partition(" ")
    if form:
        settings = entry("export", form).made.settings
    else:
        settings = declared("sweep").settings("") if command == "sweep" else load(command).Settings
    options = program("x", settings).assemble_argument_collection()
    return settings, [option for one in options for option in one.names if option.startswith("--")]


OF_ITS_OWN = {"study", "export"}
"""Commands that have others below them."""
LINES = [*(name for name in COMMANDS if name not in OF_ITS_OWN), *(f"export {form}" for form in names("export")), "sweep"]


@pytest.mark.parametrize("name", LINES)
@cases
@given(data=st.data())
def test_a_command_line(name, data):
    settings, options = settings_of(name)
    form = name.partition(" ")[2]
    line = [*(["--to", form] if form else []), *BEFORE.get(form, [])]
    chosen = data.draw(st.lists(sampled(options or ["--x"]), unique=True, max_size=4))
    for option in chosen:
        line += [option, data.draw(WORDS)]
    if data.draw(st.integers(0, 4)) == 0:
        line.insert(data.draw(st.integers(0, len(line))), data.draw(WORDS))
    said, status = io.StringIO(), 0
    with watched(runs_code=True), contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            with patch.object(sys, "argv", [name, *line]):
                perform_with(name, settings, begin, "")
        except BeganError:
            pass
        except SystemExit as end:
            status = end.code
    complained = [text for text in said.getvalue().split("\n") if "error:" in text]
    assert (status, len(complained)) in ((0, 0), (2, 1)), said.getvalue()


RUNS = {
    "evaluate": ("--env", "BirthSIM/Probe-v3", "--controller", "admittance-backstepping", "--episodes", "2"),
    "train": ("--config", "probe", "--steps", "4096"),
    "tune": ("--controller", "pid", "--trials", "1", "--lanes", "2"),
    "animate": ("--env", "BirthSIM/Probe-v3", "--end", "1.6", "--rate", "10"),
}


def attempt(command, path, out):
    """What a command has said of a rig: nothing where it works, a line where it is refused; anything else is returned whole."""
    complained = io.StringIO()
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(complained):
            if command == "live":
                packed_page(load_parameters(path))
                return ""
            words = [*RUNS[command], "--parameters", str(path), "--out", str(out)]
            with patch.object(sys, "argv", [f"birthsim {command}", *words]):
                perform(f"birthsim {command}", load(command))
        return ""
    except SystemExit as end:
        lines = [text for text in re.split(r"[\r\n]+", complained.getvalue()) if "error:" in text or "Error" in text]
        return lines[0] if end.code == 2 and len(lines) == 1 else complained.getvalue() + "\nstatus"
    except ValueError as error:  # which the page's command turns into its line
        return str(error) if command == "live" else traceback.format_exc()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(900, 903), *(pytest.param(k, marks=pytest.mark.weekly) for k in range(903, 908))])
def test_an_odd_rig_works_or_is_refused_in_a_line(seed, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(tomli_w.dumps(odd_rig(seed)), encoding="utf-8")
    for command in (*RUNS, "live"):
        said = attempt(command, path, tmp_path / (f"{command}.webp" if command == "animate" else command))
        assert "\n" not in said, f"{command}: {said}"

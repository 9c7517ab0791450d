"""The kind of command lines: options of every command with odd words, up to where work would begin."""

import contextlib
import importlib
import io
import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

from birthsim.command_line.command import perform_with, program
from lab.engine.shelf import declared
from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng

MODULES = {
    **{
        name: f"birthsim.commands.{name}"
        for name in ("figure4", "animate", "tune", "identify", "evaluate", "train", "explain", "live")
    },
    "build": "birthsim.exports.loops",
    "export": "birthsim.exports.policy",
    "log": "birthsim.exports.log",
}
ODD = (
    *("0", "-1", "1", "2", "1000000000", "9" * 320, "9" * 5000, "1e308", "nan", "inf", "-inf", "1.5", "0x10", "1_000", "", " "),
    *("x", "²", "٣", "१", "\udcff", "[[", "a=b", "=", "a=", "=b", "pid[", "pid[a=]", "pid[bandwidth=1e999]", "/dev/zero"),
    *("/", "..", "x\ny", "pid", "circle", "both", "lab", "BirthSIM/Circle-v1", "CartPole-v1", "BirthSIM/", "none", "true"),
    *("bandwidth=60", "--", "-x"),
)  # fmt: skip


class BeganError(Exception):
    """A command has accepted its arguments."""


def _options(settings: type[Any]) -> list[str]:
    options = program("x", settings).assemble_argument_collection()
    return [name for option in options for name in option.names if name.startswith("--")]


def _commands(_: Path) -> dict[str, tuple[Any, list[str]]]:
    settings = {name: importlib.import_module(place).Settings for name, place in MODULES.items()}
    settings["sweep"] = declared("sweep").settings("")
    return {name: (one, _options(one)) for name, one in settings.items()}


def _command(known: dict[str, tuple[Any, list[str]]], rng: Rng, folder: Path, case: Case) -> None:
    name = list(known)[rng.integers(len(known))]
    settings, options = known[name]
    forms = {"build": ["--to", "wasm"], "export": ["--to", "onnx"], "log": ["--to", "mcap", str(folder / "none.rec")]}
    line = forms.get(name, [])
    for option in dict.fromkeys(["--out", *(option for option in options if rng.random() < 0.3)]):
        if option in options:
            line += [option, str(folder / "out") if option == "--out" else str(ODD[rng.integers(len(ODD))])]
    if rng.random() < 0.2:
        line.insert(int(rng.integers(len(line) + 1)), ODD[rng.integers(len(ODD))])
    case.shown = f"{name} {line!r}"

    def begin(*_: Any) -> None:
        raise BeganError

    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), patch.object(sys, "argv", [name, *line]):
            perform_with(name, settings, begin, "")
    except BeganError:
        return
    except SystemExit as end:
        lines = [text for text in said.getvalue().split("\n") if "error:" in text]
        if end.code == 2 and len(lines) == 1:
            raise ValueError(f"{lines[0][:300]} (at the command line)") from None
        raise


COMMANDS: dict[str, Kind] = {"command": Kind(_commands, _command, runs_code=True)}

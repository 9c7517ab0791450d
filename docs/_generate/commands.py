"""Every console command of pyproject.toml with its options, from the parser that reads them."""

import argparse
import os
import sys
import tomllib
from pathlib import Path
from unittest import mock

from baselines.commands.start import command

PROJECT = Path(__file__).resolve().parent.parent.parent / "pyproject.toml"


class _FoundError(Exception):
    """Carries a command's parser out of it, before anything is done."""


def parser_of(name: str) -> argparse.ArgumentParser:
    """The parser of a console command such as ``birthsim-train``."""

    def give(self: argparse.ArgumentParser, *_: object) -> None:
        raise _FoundError(self)

    with (
        mock.patch.object(argparse.ArgumentParser, "parse_args", give),
        mock.patch.object(sys, "argv", [name]),
        mock.patch("signal.signal"),
    ):
        try:
            command()
        except _FoundError as found:
            return found.args[0]
    raise RuntimeError(f"{name} parsed no arguments")


def commands() -> str:
    """A section for every command."""
    names = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["scripts"]
    # argparse breaks its lines for a terminal, which may be none.
    with mock.patch.dict(os.environ, COLUMNS="100"):
        return "\n\n".join(_section(parser_of(name)) for name in sorted(names))


def _section(parser: argparse.ArgumentParser) -> str:
    formatter = parser._get_formatter()
    lines = [
        f"## `{parser.prog}`",
        "",
        _plain(parser.description),
        "",
        "```text",
        parser.format_usage().rstrip(),
        "```",
        "",
    ]
    lines += ["| option | what it does |", "|---|---|"]
    for action in parser._actions:
        if action.help is argparse.SUPPRESS or isinstance(action, argparse._HelpAction):
            continue
        value = formatter._format_args(action, action.dest.upper()) if action.nargs != 0 else ""
        option = f"{', '.join(action.option_strings)} {value}".strip()
        required = " Required." if action.required and action.option_strings else ""
        said = _plain(formatter._expand_help(action) if action.help else "")
        lines.append(f"| `{option}` | {said}{'.' if required and said else ''}{required} |")
    return "\n".join([*lines, "", _plain(parser.epilog)]).rstrip()


def _plain(text: str | None) -> str:
    """Text as argparse prints it, on one line, without what Markdown would take for its own."""
    words = " ".join((text or "").split())
    for sign in "\\*_[]<>|$":
        words = words.replace(sign, f"\\{sign}")
    return words

"""Every command of ``birthsim`` with its options, from the parser that reads them."""

import argparse
import os
import sys
from unittest import mock

from baselines.commands.command import program
from baselines.commands.start import load, perform
from birthsim.door import COMMANDS, GROUPS, overview
from birthsim.export import FORMS


class _FoundError(Exception):
    """Carries a command's parser out of it, before anything is done."""


def parser_of(package: str, module: str) -> argparse.ArgumentParser:
    """The parser of a command's module."""

    def give(self: argparse.ArgumentParser, *_: object) -> tuple[argparse.Namespace, list[str]]:
        if self.add_help:
            raise _FoundError(self)
        return argparse.Namespace(config=None), []  # what looks for --config only

    with mock.patch.object(argparse.ArgumentParser, "parse_known_args", give), mock.patch.object(sys, "argv", ["birthsim"]):
        try:
            perform("birthsim", package, module)
        except _FoundError as found:
            return found.args[0]
    raise RuntimeError(f"{package}.{module} parsed no arguments")


def commands() -> str:
    """A section for every command that parses options itself, and for every form of ``birthsim export``."""
    # argparse breaks its lines for a terminal, which may be none.
    with mock.patch.dict(os.environ, COLUMNS="80"):
        places = {
            f"birthsim {name}": COMMANDS[name]
            for group in GROUPS.values() for name in group if name not in ("export", "study")
        }  # fmt: skip
        sections = [_of(name, one.package, one.module, one.example) for name, one in places.items()]
        forms: dict[tuple[str, str], list[str]] = {}
        for form, (package, module, *_) in FORMS.items():
            forms.setdefault((package, module), []).append(form)
        for (package, module), names in forms.items():
            example = f"export --to {names[0]} {FORMS[names[0]][-1]}"
            sections.append(_of(f"birthsim export --to {', '.join(names)}", package, f"commands.{module}", example))
        return "\n\n".join([f"```text\n{overview()}\n```", *sections])


def _of(name: str, package: str, module: str, example: str) -> str:
    """A section, from the settings of a command."""
    loaded = load("birthsim", package, module)
    if not hasattr(loaded, "Settings"):
        return _section(name, parser_of(package, module), example)
    _, _, text = program(name, loaded.Settings).generate_docs(usage_name="birthsim").partition("\n")
    return f"## `{name}`\n{text.rstrip()}\n\nExample: `birthsim {example}`"


def _section(name: str, parser: argparse.ArgumentParser, example: str) -> str:
    formatter = parser._get_formatter()
    lines = [
        f"## `{name}`",
        "",
        _plain(parser.description),
        "",
        "```text",
        parser.format_usage().rstrip(),
        "",
        f"example: birthsim {example}",
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

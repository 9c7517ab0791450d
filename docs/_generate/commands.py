"""Every command of ``birthsim`` with its options, from the settings that are read; and the files of tables that they read."""

from typing import Any

from birthsim.command_line.command import program
from birthsim.main import COMMANDS, load, overview
from birthsim_env.registry import entries


def commands() -> str:
    """A section for every command that parses options itself, and for every form of ``birthsim export``."""
    typed = {name: one for name, one in COMMANDS.items() if name not in ("export", "study")}
    sections = [_of(name, load(name).Settings, f"{name} {one.example}") for name, one in typed.items()]
    forms: dict[type[Any], list[str]] = {}
    for form in entries("export"):
        forms.setdefault(form.made.settings, []).append(form.name)
    examples = {form.name: form.made.example for form in entries("export")}
    for settings, names in forms.items():
        sections.append(_of(f"export --to {', '.join(names)}", settings, f"export --to {names[0]} {examples[names[0]]}"))
    return "\n\n".join([f"```text\n{overview()}\n```", *sections])


def _of(name: str, settings: type[Any], example: str) -> str:
    """A section, from the settings of a command."""
    _, _, text = program(f"birthsim {name}", settings).generate_docs(usage_name="birthsim").partition("\n")
    return f"## `birthsim {name}`\n{text.rstrip()}\n\nExample: `birthsim {example.rstrip()}`"


def readers() -> str:
    """A row for each kind of file that holds a table."""
    rows = [f"| `{one.name}` | {one.about} | {', '.join(sorted(one.needs))} |" for one in entries("reader")]
    return "\n".join(["| ending, in any case | what is read | needs |", "|---|---|---|", *rows])

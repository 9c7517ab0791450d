"""Every command of ``birthsim`` with its options, from the settings that are read; and the files of tables that they read."""

from typing import Any

from birthsim.command_line.command import program
from birthsim.main import GROUPS, load
from birthsim_env.registry import entries

UNSECTIONED = ("export", "study")
"""Commands without options of their own: what follows them decides."""


def commands() -> str:
    """A table of every group of commands, whose rows lead to their options, and are where those stood on one page."""
    return "\n\n".join(f"## {title.capitalize()}\n\n{_group_table(title)}" for title in GROUPS)


def page_of(title: str) -> str:
    """The name of the page of a group, and of its generated part."""
    return title.replace(" ", "_")


def _group_table(title: str) -> str:
    rows = ["| command | what it does |", "|---|---|"]
    for name, one in GROUPS[title].items():
        page = "../laboratory/index.md" if name == "study" else f"commands/{page_of(title)}.md"
        place = page if name in UNSECTIONED else f"{page}#birthsim-{name}"
        rows.append(f'| <span id="birthsim-{name}"></span>[`birthsim {name}`]({place}) | {one.does} |')
    return "\n".join(rows)


def group(title: str) -> str:
    """A section for every command of a group that parses options itself, or for every form of ``birthsim export``."""
    typed = {name: one for name, one in GROUPS[title].items() if name not in UNSECTIONED}
    sections = [_of(name, load(name).Settings, f"{name} {one.example}") for name, one in typed.items()]
    return "\n\n".join([*sections, *(_exports() if "export" in GROUPS[title] else ())])


def _exports() -> list[str]:
    forms: dict[type[Any], list[str]] = {}
    for form in entries("export"):
        forms.setdefault(form.made.settings, []).append(form.name)
    examples = {form.name: form.made.example for form in entries("export")}
    return [
        _of(f"export --to {', '.join(names)}", settings, f"export --to {names[0]} {examples[names[0]]}")
        for settings, names in forms.items()
    ]


def _of(name: str, settings: type[Any], example: str) -> str:
    """A section, from the settings of a command."""
    _, _, text = program(f"birthsim {name}", settings).generate_docs(usage_name="birthsim").partition("\n")
    return f"## `birthsim {name}`\n{text.rstrip()}\n\nExample: `birthsim {example.rstrip()}`"


def readers() -> str:
    """A row for each kind of file that holds a table."""
    rows = [f"| `{one.name}` | {one.about} | {', '.join(sorted(one.needs))} |" for one in entries("reader")]
    return "\n".join(["| ending, in any case | what is read | needs |", "|---|---|---|", *rows])

"""Every command of ``birthsim`` with its options, from the settings that are read."""

from baselines.commands.command import program
from baselines.commands.start import load
from birthsim.door import COMMANDS, GROUPS, overview
from birthsim.export import FORMS


def commands() -> str:
    """A section for every command that parses options itself, and for every form of ``birthsim export``."""
    places = {
        f"birthsim {name}": COMMANDS[name] for group in GROUPS.values() for name in group if name not in ("export", "study")
    }
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
    _, _, text = program(name, loaded.Settings).generate_docs(usage_name="birthsim").partition("\n")
    return f"## `{name}`\n{text.rstrip()}\n\nExample: `birthsim {example}`"

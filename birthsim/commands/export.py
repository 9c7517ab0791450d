"""``birthsim export --to FORM``: what leaves BirthSIM, each form by the module of ``birthsim.exports`` that registers it."""

import sys
from argparse import ArgumentParser

from birthsim.command_line.command import perform_with
from birthsim_env.physics.rig.values import near, shown
from birthsim_env.registry import entries


def main() -> None:
    """Write the form that ``--to`` names, with all arguments."""
    options = ArgumentParser(add_help=False, allow_abbrev=False)
    options.add_argument("--to", nargs="?")
    asked: str | None = options.parse_known_args()[0].to
    forms = {one.name: one for one in entries("export")}
    if asked in forms:
        form = forms[asked].made
        perform_with("birthsim export", form.settings, form.write, f"birthsim export --to {asked} {form.example}")
    elif asked is None and {"-h", "--help"} & set(sys.argv):
        lines = ["usage: birthsim export --to FORM ...", "", "forms:"]
        lines += [f"  {name:10} {one.about}" for name, one in forms.items()]
        example = f"example: birthsim export --to wasm {forms['wasm'].made.example}"
        print("\n".join([*lines, "", "birthsim export --to FORM --help has a form's options.", example]))
        raise SystemExit(0)
    else:
        said, guess = ("is missing", "") if asked is None else (shown(asked), near(asked, forms))
        allowed = "what birthsim export --help lists" if guess else ", ".join(forms)
        print(f"birthsim export: error: --to {said}{guess}; allowed: {allowed}", file=sys.stderr)
        raise SystemExit(2)

"""``birthsim export --to FORM``: what leaves BirthSIM, each form by the command that writes it."""

import sys
from argparse import ArgumentParser

from baselines.commands.start import perform
from birthsim_env.physics.rig.values import near, shown

FORMS: dict[str, tuple[str, str, str, str]] = {
    "onnx": ("agents", "export", "a trained policy, for ONNX runtimes", "circle --out policy.onnx"),
    "hub": ("agents", "export", "a trained policy with its card, for the Hugging Face Hub", "circle --out out/hub"),
    "minari": ("agents", "dataset", "episodes of a controller, for offline learning", "--level expert --out datasets"),
    "wasm": ("birthsim_build", "build", "closed loops, as WebAssembly with JavaScript", "--out out/wasm"),
    "c": ("birthsim_build", "build", "closed loops, as a library for this processor", "--out out/c"),
    "x86-64": ("birthsim_build", "build", "closed loops, as a library with a C header", "--out out/x86-64"),
    "aarch64": ("birthsim_build", "build", "closed loops, as a library with a C header", "--out out/aarch64"),
    "cortex-m7": ("birthsim_build", "build", "controllers alone, as an object for a microcontroller", "--out out/cortex-m7"),
    "ptx": ("birthsim_build", "build", "closed loops, as kernels for NVIDIA's GPUs", "--out out/ptx"),
    "cubin": ("birthsim_build", "build", "the same for one kind of GPU, by NVIDIA's ptxas", "--gpu sm_90 --out out/cubin"),
    "fmu": ("birthsim_build", "fmu", "the rig or a closed loop, for Simulink and its like", "--out rig.fmu"),
    "parquet": ("birthsim_live", "log", "a recording or an evaluation, as a table", "run.rec --out run.parquet"),
    "mcap": ("birthsim_live", "log", "a recording or an evaluation, for PlotJuggler", "run.rec --out run.mcap"),
}
"""Form -> package and command that writes it, what it is, and an example's arguments."""


def main() -> None:
    """Run the command that ``--to`` names, with all arguments."""
    options = ArgumentParser(add_help=False, allow_abbrev=False)
    options.add_argument("--to", nargs="?")
    form: str | None = options.parse_known_args()[0].to
    if form in FORMS:
        package, module, _, example = FORMS[form]
        perform("birthsim export", package, f"commands.{module}", f"birthsim export --to {form} {example}")
    elif form is None and {"-h", "--help"} & set(sys.argv):
        forms = (f"  {name:10} {what}" for name, (_, _, what, _) in FORMS.items())
        lines = ["usage: birthsim export --to FORM ...", "", "forms:", *forms]
        example = f"example: birthsim export --to wasm {FORMS['wasm'][3]}"
        print("\n".join([*lines, "", "birthsim export --to FORM --help has a form's options.", example]))
        raise SystemExit(0)
    else:
        said, asked = ("is missing", "") if form is None else (shown(form), near(form, FORMS))
        allowed = "what birthsim export --help lists" if asked else ", ".join(FORMS)
        print(f"birthsim export: error: --to {said}{asked}; allowed: {allowed}", file=sys.stderr)
        raise SystemExit(2)

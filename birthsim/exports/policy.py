"""``--to onnx, hub``: a trained policy as one file for other runtimes, or with its card for the Hugging Face Hub."""

import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from agents.foreign.stable_baselines import SUFFIX
from birthsim.command_line.settings import Configured
from birthsim.exports import Form
from birthsim_env.extras import installation
from birthsim_env.files import make_folder, whole_results
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import register


@dataclass(kw_only=True)
class Settings(Configured):
    """Write a trained policy with its normalisation as one ONNX file, checked against what it was, or as a folder for the
    Hugging Face Hub, with a card that says where it is better and worse.

    The ONNX file says what its inputs and outputs are; examples/onnx_policy.py runs one with the controller at 1 kHz. An
    archive of Stable-Baselines3 (PPO, RecurrentPPO, SAC, TQC) can become one too. Loading an archive can run code in it.
    """

    policy: Annotated[str, Parameter(metavar="DIR")] = field(kw_only=False)
    """Folder that birthsim train wrote, or the name of what is shipped, such as circle; of several seeds the best. Or FILE.zip,
    an archive."""
    normalize: Annotated[Path | None, Parameter(metavar="FILE")] = None
    """For FILE.zip: the file that VecNormalize.save wrote."""
    to: Literal["onnx", "hub"]
    """Form."""
    out: Path | None = None
    """File or folder, else policy.onnx or hub in the policy's folder; of FILE.zip FILE.onnx."""


def main(settings: Settings) -> None:
    """Write, and say what was compared."""
    archive = settings.policy.endswith(SUFFIX)
    if settings.normalize is not None and not archive:
        raise ValueError(
            f"normalize = {named(settings.normalize)} with policy = {shown(settings.policy)}; allowed: with FILE{SUFFIX}"
        )
    if archive and settings.to == "hub":
        raise ValueError(f"policy = {shown(settings.policy)} with --to hub; allowed: with --to onnx")
    (_write_folder if settings.to == "hub" else _write_archive if archive else _write_file)(settings)


register(export="onnx", about="a trained policy, for ONNX runtimes", order=10)(Form(Settings, main, "circle --out policy.onnx"))
register(export="hub", about="a trained policy with its card, for the Hugging Face Hub", order=11)(
    Form(Settings, main, "circle --out out/hub")
)


def _write_folder(settings: Settings) -> None:
    try:
        from agents.policy.files import WEIGHTS
        from agents.policy.seeds import best_policy
        from agents.reports.card import TRAINING, compared, model_card
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: {installation('agents')}") from error

    folder = best_policy(settings.policy)
    card = model_card(folder, f"birthsim-{Path(settings.policy).name}", compared(folder))
    out = make_folder(settings.out or folder / "hub")
    with whole_results(out) as place:
        for name in (WEIGHTS, TRAINING):
            shutil.copyfile(folder / name, place / name)
        (place / "README.md").write_text(card, encoding="utf-8")
    print(card)
    print(f"written to {out}/: README.md, {WEIGHTS}, {TRAINING}; hf upload OWNER/NAME {out} publishes them")


def _write_archive(settings: Settings) -> None:
    try:
        from agents.foreign.onnx_export import TOLERANCE, export_archive
    except ImportError as error:
        raise ValueError(f"{error}; exporting needs the extras agents and onnx: {installation('agents', 'onnx')}") from error
    path = settings.out or Path(settings.policy).with_suffix(f".{settings.to}")
    exported = export_archive(Path(settings.policy), path, settings.normalize)
    print(f"{path}: {exported.size} bytes, {exported.inputs} observation entries to {exported.outputs} actions")
    print(
        f"largest difference of an action over {exported.compared} observations: {exported.difference:.1e} from "
        f"Stable-Baselines3; allowed: {TOLERANCE:.1g}"
    )
    print(f"{path.with_suffix('.json')}: how it was trained, for the leaderboard")


def _write_file(settings: Settings) -> None:
    try:
        # PyTorch takes seconds to load; it and the rest come with extras only.
        from agents.policy.files import read_policy
        from agents.policy.onnx_export import TOLERANCE, export_onnx
        from agents.policy.seeds import best_policy
    except ImportError as error:
        raise ValueError(f"{error}; exporting needs the extras agents and onnx: {installation('agents', 'onnx')}") from error
    folder = best_policy(settings.policy)
    policy = read_policy(folder)
    path = settings.out or folder / f"policy.{settings.to}"
    exported = export_onnx(policy, path)
    print(f"{path}: {exported.size} bytes, {policy.network.inputs} observation entries to {policy.network.outputs} actions")
    print(
        f"largest difference of an action over {exported.observations} observations: {exported.from_torch:.1e} from PyTorch, "
        f"{exported.from_numpy:.1e} from NumPy; allowed: {TOLERANCE:g}"
    )

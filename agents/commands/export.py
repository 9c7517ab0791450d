"""birthsim export: a trained policy as one file for other runtimes."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from baselines.commands.settings import Configured


@dataclass(kw_only=True)
class Settings(Configured):
    """Write a trained policy with its normalisation as one file, checked against PyTorch and NumPy.

    The file says what its inputs and outputs are; examples/onnx_policy.py runs one with the controller at 1 kHz.
    """

    policy: Annotated[str, Parameter(metavar="DIR")] = field(kw_only=False)
    """Folder that birthsim train wrote, or the name of what is shipped, such as circle; of several seeds the best."""
    to: Literal["onnx"]
    """Form of the file."""
    out: Path | None = None
    """File, else policy.onnx in the policy's folder."""


def main(settings: Settings) -> None:
    """Write the file and say what was compared."""
    try:
        # PyTorch takes seconds to load; it and the rest come with extras only.
        from agents.policy.files import load_policy
        from agents.policy.onnx_export import TOLERANCE, export_onnx
        from agents.policy.seeds import best_policy
    except ImportError as error:
        raise ValueError(f"{error}; exporting needs the extras agents and onnx: pip install 'birthsim[agents,onnx]'") from error
    folder = best_policy(settings.policy)
    policy = load_policy(folder)
    path = settings.out or folder / f"policy.{settings.to}"
    exported = export_onnx(policy, path)
    print(f"{path}: {exported.size} bytes, {policy.network.inputs} observation entries to {policy.network.outputs} actions")
    print(
        f"largest difference of an action over {exported.observations} observations: {exported.from_torch:.1e} from PyTorch, "
        f"{exported.from_numpy:.1e} from NumPy; allowed: {TOLERANCE:g}"
    )

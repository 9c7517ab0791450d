"""birthsim export: a trained policy as one file for other runtimes."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.shared import run

FORMATS = ("onnx",)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim export",
        description="Write a trained policy with its normalisation as one file, checked against PyTorch and NumPy.",
        epilog="The file says what its inputs and outputs are; examples/onnx_policy.py runs one with the law at 1 kHz.",
    )
    parser.add_argument(
        "policy",
        metavar="POLICY",
        help="folder that birthsim train wrote, or the name of what comes with the package, such as "
        "circle; of several seeds the best in validation is taken",
    )
    parser.add_argument("--to", choices=FORMATS, required=True, help="the form of the file")
    parser.add_argument("--out", type=Path, help="file (default: policy.onnx in the policy's folder)")
    run(parser, _export)


def _export(arguments: argparse.Namespace) -> None:
    try:
        # PyTorch takes seconds to load; it and the rest come with extras only.
        from agents.policy.files import load_policy
        from agents.policy.onnx_export import TOLERANCE, export_onnx
        from agents.policy.seeds import best_policy
    except ImportError as error:
        raise ValueError(f"{error}; exporting needs the extras agents and onnx: pip install 'birthsim[agents,onnx]'") from error
    folder = best_policy(arguments.policy)
    policy = load_policy(folder)
    path = arguments.out or folder / f"policy.{arguments.to}"
    exported = export_onnx(policy, path)
    print(f"{path}: {exported.size} bytes, {policy.network.inputs} observation entries to {policy.network.outputs} actions")
    print(
        f"largest difference of an action over {exported.observations} observations: {exported.from_torch:.1e} from PyTorch, "
        f"{exported.from_numpy:.1e} from NumPy; allowed: {TOLERANCE:g}"
    )

"""A small ``evaluation.json``, as ``birthsim evaluate`` writes it."""

import subprocess
import sys
from pathlib import Path

from tests.console import ROOT


def evaluation_in(folder: Path) -> Path:
    """The file of an evaluation of two episodes, which is made in a folder."""
    line = "evaluate --env BirthSIM/Circle-v2 --controller pid --episodes 2 --sensors lab --jobs 1 --out"
    subprocess.run([sys.executable, "-m", "birthsim", *line.split(), folder], cwd=ROOT, check=True, capture_output=True)
    return folder / "evaluation.json"

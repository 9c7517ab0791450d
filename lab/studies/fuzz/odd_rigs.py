"""Random rigs through every command: each works or is refused in one line that names the cause.

Bores are 16 to 63 mm, strokes 50 to 600 mm, masses 0.5 to 20 kg, rods, friction and valves in proportion; a file names nothing
else. Exits with 1 where a command ends in anything but success or one line.
"""

import contextlib
import io
import re
import sys
import tempfile
import traceback
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated
from unittest.mock import patch

import numpy as np
import tomli_w
from tqdm import tqdm

from birthsim.command_line.settings import Configured, Seed, whole
from birthsim.command_line.start import perform
from birthsim.main import load
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import register


@dataclass(kw_only=True)
class Settings(Configured):
    """Take random rigs through every command: each works or is refused in one line that names the cause."""

    rigs: Annotated[int, whole()] = 100
    seed: Seed = 0


COMMANDS = ("evaluate", "train", "tune", "animate", "live")


def odd_rig(seed: int) -> dict[str, dict[str, float]]:
    """Tables of a TOML file."""
    rng = np.random.default_rng(seed)
    tables: dict[str, dict[str, float]] = {"mechanics": {"mass": float(np.exp(rng.uniform(np.log(0.5), np.log(20))))}}
    bores = np.exp(rng.uniform(np.log(0.016), np.log(0.063), 2))
    for k, bore in enumerate(bores, start=1):
        tables[f"cylinder{k}"] = {
            "piston_diameter": float(bore), "rod_diameter": 0.4 * float(bore), "stroke": float(rng.uniform(0.05, 0.6)),
            "coulomb_friction": 12.0 * float(bore / 0.025) ** 2,
        }  # fmt: skip
    tables["valves"] = {"sonic_conductance": min(2e-8, 3.9e-9 * float(bores.max() / 0.025) ** 2)}
    return tables


def written(seed: int) -> str:
    """The TOML file of a rig."""
    return tomli_w.dumps(odd_rig(seed))


def _live(path: Path) -> None:
    from birthsim_live.rig.folder import packed_page

    packed_page(load_parameters(path))


def attempt(command: str, path: Path, folder: Path) -> tuple[str, str]:
    """Whether it "works", is "refused" or is "BAD", and what was said."""
    out = folder / command
    lines = {
        "evaluate": ("--env", "BirthSIM/Probe-v2", "--controller", "admittance-backstepping", "--episodes", "2"),
        "train": ("--config", "probe", "--steps", "4096"),
        "tune": ("--controller", "pid", "--trials", "1", "--lanes", "2"),
        "animate": ("--env", "BirthSIM/Probe-v2", "--end", "1.6", "--rate", "10"),
    }
    said, complained = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
            if command == "live":
                _live(path)
                return "works", ""
            place = out.with_suffix(".webp") if command == "animate" else out
            argv = [f"birthsim {command}", *lines[command], "--parameters", str(path), "--out", str(place)]
            with patch.object(sys, "argv", argv):
                perform(f"birthsim {command}", load(command))
        return "works", ""
    except SystemExit as end:
        line = [text for text in re.split(r"[\r\n]+", complained.getvalue()) if "error:" in text or "Error" in text]
        return ("refused", line[0]) if end.code == 2 and len(line) == 1 else ("BAD", complained.getvalue())
    except ValueError as error:  # which the page's command turns into its line
        return ("refused", str(error)) if command == "live" and "\n" not in str(error) else ("BAD", traceback.format_exc())
    except BaseException:
        return "BAD", traceback.format_exc()


@register(study="odd-rigs", about="random rigs through every command")
def main(settings: Settings) -> None:
    """Try the commands."""
    counts: dict[str, Counter[str]] = {command: Counter() for command in COMMANDS}
    causes: Counter[str] = Counter()
    bad = []
    for seed in tqdm(range(settings.seed, settings.seed + settings.rigs), unit=" rigs", file=sys.stderr):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "rig.toml").write_text(written(seed), encoding="utf-8")
            for command in COMMANDS:
                verdict, words = attempt(command, folder / "rig.toml", folder)
                counts[command][verdict] += 1
                if verdict == "refused":
                    causes[re.sub(r"-?\d[\d.e+-]*", "#", words.replace(name, ""))[:150]] += 1
                if verdict == "BAD":
                    bad.append(f"rig {seed}, {command}:\n{words[-1500:]}")
    print(f"{'command':12}{'works':>8}{'refused':>10}{'else':>8}")
    for command, found in counts.items():
        print(f"{command:12}{found['works']:8}{found['refused']:10}{found['BAD']:8}")
    for cause, count in causes.most_common():
        print(f"{count:5} {cause}")
    if bad:
        print("\n\n".join(bad))
        raise SystemExit(1)

"""Files that a user has and an empty folder lacks: made before the first command that names one.

Whoever reads "log.csv" in a page has a log. What stands for it here is written, or made by commands, which count too.
"""

import re
from itertools import pairwise
from pathlib import Path

from birthsim_env.physics.compiled.sources import ROOT
from lab.studies.installed.pages import python

RIG = '[mechanics]\nmass = 3.2\n[randomize]\n"mechanics.mass" = [3.0, 3.4]\n'
"""TOML of a rig that is not the default."""

POLICIES = """
import gymnasium as gym
from stable_baselines3 import PPO

import birthsim_env
from birthsim.benchmark.suites import SUITES

PPO("MlpPolicy", gym.make("BirthSIM/Circle-v2", sensors="lab")).save("policy.zip")
for task in SUITES["open"]:
    policy = PPO("MlpPolicy", gym.make(task.environment, **task.world))
    for seed in range(2):
        policy.save(f"ppo/{task.name}_{seed}.zip")
"""
"""A program that saves policies which have learned nothing."""

TEXTS = {
    "a.toml": RIG, "b.toml": RIG, "rig.toml": RIG, "RIG.toml": RIG, "my_rig.toml": RIG, "mine.toml": RIG, "lab.toml": RIG,
    "known.toml": RIG, "before.toml": RIG,
    "valve.csv": "opening,flow\n" + "".join(f"{k / 20},{max(0.0, k / 20 - 0.08) / 0.92}\n" for k in range(21)),
    "my_path.csv": "time,x,y\n0,0.5,0\n2,0.52,0.01\n8,0.5,0\n",
    "policies.py": POLICIES,
}  # fmt: skip
"""Name -> what stands in it."""

MADE = {
    "log.csv": ("birthsim identify --propose plan.csv", "birthsim identify --simulate plan.csv --out log.csv"),
    "other_log.csv": (
        "birthsim identify --propose plan_2.csv --seed 1",
        "birthsim identify --simulate plan_2.csv --seed 1 --out other_log.csv",
    ),
    "policy.zip": ("python policies.py",),
    "out/circle": ("birthsim train --config circle_quick --steps 20000 --out out/circle",),
    "out/reader/seed_0/reader.npz": ("birthsim train --config rig_reader --set rounds=1 --out out/reader",),
    "FILE": ("birthsim compare log.csv --parameters lab.toml --out twin", "cp twin/twin.rec FILE"),
}
"""Name -> commands that make it."""

NEEDS = {"policy.zip": ("policies.py",), "FILE": ("log.csv", "lab.toml")}
"""What these commands need in their turn."""


def classes() -> dict[str, str]:
    """Name -> Python of a controller and of a hand, as pages show them."""
    hand = (ROOT / "docs" / "how-to" / "hand.md").read_text(encoding="utf-8")
    (shown,) = (block for block in python(hand) if "class RandomSpring" in block)
    controller = (ROOT / "examples" / "pd.py").read_text(encoding="utf-8")
    return {
        "mine.py": f"{controller}\n\nMine = Law = PD\n",
        "my_hand.py": shown.partition("\n\nenv = ")[0],
    }


def lacking(command: list[str], folder: Path) -> list[str]:
    """The names of known files that a command takes and that are not in its folder, what they need before them."""
    words = re.split(r"[\s:=\[\],]", " ".join(command[1:]))
    outputs = [after for before, after in pairwise(command) if before in ("--out", "--propose")]
    named = [name for name in {**TEXTS, **MADE, **classes()} if name in words and name not in outputs]
    found = [one for name in named for one in (*NEEDS.get(name, ()), name)]
    return [one for one in dict.fromkeys(found) if not (folder / one).exists()]

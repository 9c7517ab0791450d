"""What the page says of itself: its numbers and plots, its choices, and where it comes from."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import birthsim_env
from baselines.controller import RESIDUAL
from birthsim_env.registry import entries

FIGURES = {
    "the hand feels": "Force over displacement along the force: how stiff the head seems to the hand that pulls it.",
    "time": "Simulated time since the last reset.",
    "user force": "What pulls at the head: your hand, and the scenario's where it acts too.",
    "displacement": "How far the head is from the target.",
    "force over stiffness": "How far the head should be from the target: at the diamond, the paper's compliant target (19).",
    "error": "Distance from the diamond to the head, and its root mean square over the last 2 s.",
    "position x": "Head, target and compliant target along x. Black on orange: the head gives way as asked for.",
    "position y": "Head, target and compliant target along y. Black on orange: the head gives way as asked for.",
    "pressure": "Absolute pressure in the four chambers. P pushes a piston out, N pulls it in.",
    "rendered stiffness": "Force over displacement along each axis, where at least 5 N act. Dotted: asked for.",
    "pneumatic stiffness": "How stiff the air in each cylinder is. Two valves a cylinder set it apart from the force.",
    "power": "Force times velocity of the head. Above zero the hand gives energy to the rig, below it takes some.",
    "valves and air": "Spools: to the right they open a chamber to the supply, to the left to the open air. Beside them the "
    "air that flows in (+) or out (−).",
    "forces in the cylinders": "What the air pushes with, and the friction that holds the piston back.",
    "stiffness at the head": "Each direction has a stiffness. The ellipse is asked for; the dot is what the hand feels now, "
    "and outside the ellipse that is too stiff.",
    "work": "What the hand has put in since it took hold, and how much of it the spring that is asked for would store. The "
    "rig took the rest, by friction and damping; where that is negative, it gave: a moving target carries the hand along.",
}
"""Figure, plot or picture -> what it shows."""

CHOICES = {
    "valves": {
        "two_valves": "Two valves a cylinder, one for each chamber: force and stiffness are free of each other.",
        "one_valve": "One 5/3 valve a cylinder: what fills one chamber empties the other.",
    },
    "sensors": {model.name: model.about for model in entries("sensors")},
    "scenario": {scenario.name: scenario.about for scenario in entries("scenario")},
}
"""Setting -> choice -> what it is; controllers say it where they are registered."""

LEARNING = "learning"
"""The controller that learns in the page."""

PAPER = {
    "words": "N. Herzig, R. Moreau, T. Redarce, F. Abry, X. Brun: Non linear position and closed loop stiffness control for a "
    "pneumatic actuated haptic interface: the BirthSIM. IROS 2015, pp. 1612-1618.",
    "address": "https://doi.org/10.1109/IROS.2015.7353583",
}


def controller_choice(name: str) -> dict[str, str]:
    """A controller: name, title, and what it is (``about``)."""
    policy = name.removeprefix(f"{RESIDUAL}:")
    if policy != name:
        title = f"{RESIDUAL} ({' '.join(Path(policy).parts[-2:])})"
        return {"name": name, "title": title, "about": f"A controller and a trained policy that corrects it: {policy}."}
    if name == LEARNING:
        return {"name": name, "title": "learning here", "about": "A network at the valves, which learns in this page."}
    about = {one.name: one.about for one in entries("controller")}
    return {
        "name": name,
        "title": Path(name).name.replace("-", " "),
        "about": about.get(name, "A controller of your own."),
    }


def described(choices: Iterable[str], about: Mapping[str, str]) -> list[dict[str, str]]:
    """Choices with what they are, as those of controllers."""
    return [{"name": name, "title": name.replace("_", " "), "about": about.get(name, "")} for name in choices]


def words() -> dict[str, Any]:
    """All of it, as a part of the page's greeting."""
    return {"figures": FIGURES, "paper": PAPER, "version": birthsim_env.__version__}

"""What a person can set: names, units, ranges and defaults. The page's worker refuses what is not among it."""

from dataclasses import dataclass
from typing import Any

from birthsim_env.physics.rig.parameters import Parameters

NOTHING = "nothing"
"""What a rig is compared with where no second one is beside it."""

OPENS = "backstepping"
"""The controller that a visitor of the page meets: the paper's law, whose error under a pull can be seen."""


@dataclass(frozen=True)
class Slider:
    """A number that can be set: what it is called, its unit, from where to where, and where it stands at first."""

    label: str
    symbol: str
    unit: str
    min: float
    max: float
    default: float
    log: bool = False


def sliders(rig: Parameters) -> dict[str, Slider]:
    """Name -> slider for a rig. All ranges are assumed: what the rig bears, and a little of what it does not."""
    mass = rig.mechanics.mass
    return {
        "Kclx": Slider("Closed-loop stiffness along x", "Kclx", "N/m", 200.0, 8000.0, 2000.0, log=True),
        "Kcly": Slider("Closed-loop stiffness along y", "Kcly", "N/m", 200.0, 8000.0, 2000.0, log=True),
        "Kpneu1": Slider("Pneumatic stiffness of cylinder 1", "K1", "N/m", 2000.0, 6000.0, 4600.0, log=True),
        "Kpneu2": Slider("Pneumatic stiffness of cylinder 2", "K2", "N/m", 1000.0, 3000.0, 2300.0, log=True),
        "damping": Slider("Damping, times the law's own", "B", "1", 1.0, 2.0, 1.0),
        "mass": Slider("Mass that moves; the controller believes the rig's", "m", "kg", min(1.5, mass), max(6.0, mass), mass),
        "friction": Slider("Friction, times the rig's; the controller believes 1", "Ff", "1", 0.0, 2.0, 1.0),
        "drag_stiffness": Slider("Spring between end effector and pointer", "Kdrag", "N/m", 100.0, 3000.0, 1000.0, log=True),
    }


def default_settings(rig: Parameters) -> dict[str, Any]:
    """A target at rest and nobody but the person who pushes: displacement is force over stiffness.

    ``compare`` is the controller of a second rig beside the first; ``scenario_force`` keeps or drops the scenario's own hand;
    ``stiffness_source`` says whether the setpoints are the scenario's or the sliders'.
    """
    words = {
        "scenario": "probe", "controller": OPENS, "compare": NOTHING, "valves": "two_valves", "sensors": "ideal",
        "scenario_force": False, "stiffness_source": "scenario",
    }  # fmt: skip
    return {**words, **{name: slider.default for name, slider in sliders(rig).items()}}

"""What a person can set: names, units, ranges and defaults, and what is refused."""

from __future__ import annotations

import dataclasses
import importlib.util
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from baselines.registry import CONTROLLERS, controller_names
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors import SENSORS
from birthsim_env.physics.parameters import Parameters

STIFFNESSES = ("Kclx", "Kcly", "Kpneu1", "Kpneu2")
"""Settings that take the place of the scenario's setpoints, in the order of a reference's rows 8 to 11."""

RESIDUAL = "residual"
"""Controller whose policies are choices of their own: ``residual:circle``."""


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


@dataclass(frozen=True)
class Settings:
    """What is set. Numbers are those of ``sliders``; ``scenario_force`` keeps or drops the scenario's own hand, and
    ``stiffness_source`` says whether the stiffness setpoints are the scenario's or the sliders'."""

    scenario: str = "probe"
    controller: str = "admittance-backstepping"
    valves: str = "two_valves"
    sensors: str = "ideal"
    scenario_force: bool = False
    stiffness_source: str = "scenario"
    Kclx: float = 2000.0
    Kcly: float = 2000.0
    Kpneu1: float = 4600.0
    Kpneu2: float = 2300.0
    damping: float = 1.0
    mass: float = 3.0
    friction: float = 1.0
    drag_stiffness: float = 1000.0


def default_settings(rig: Parameters) -> Settings:
    """A target at rest and nobody but the person who pushes: displacement is force over stiffness."""
    return Settings(mass=rig.mechanics.mass)


def controller_choices() -> list[dict[str, str]]:
    """Every controller of the registry, and every policy that comes with the package: name, title, and what is ``missing``."""
    choices = []
    for name in controller_names():
        choice = {"name": name, "title": name.replace("-", " ")}
        if name == "nonlinear-mpc" and importlib.util.find_spec("casadi") is None:
            choice["missing"] = "pip install 'birthsim[mpc]'"
        if name != RESIDUAL or name in CONTROLLERS:
            choices.append(choice)
            continue
        try:
            from agents.policy.files import load_policy  # noqa: F401  needs the extra
            from agents.policy.seeds import shipped_names
        except ImportError:
            choices.append({**choice, "missing": "pip install 'birthsim[agents]'"})
            continue
        choices += [{"name": f"{RESIDUAL}:{policy}", "title": f"{RESIDUAL} ({policy})"} for policy in shipped_names()]
    return choices


class Choices:
    """What can be set on a rig: ``sliders``, ``controllers`` and ``words``, name -> allowed words."""

    def __init__(self, rig: Parameters) -> None:
        self.sliders, self.controllers = sliders(rig), controller_choices()
        self.words: dict[str, tuple[str, ...]] = {
            "scenario": tuple(SCENARIOS),
            "controller": tuple(choice["name"] for choice in self.controllers if "missing" not in choice),
            "valves": VALVE_LAYOUTS,
            "sensors": tuple(SENSORS),
            "stiffness_source": ("scenario", "sliders"),
        }

    def checked(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """``changes`` with numbers as floats; ``ValueError`` naming the setting, its value and what is allowed."""
        return {name: self._checked(name, value) for name, value in changes.items()}

    def _checked(self, name: str, value: Any) -> Any:
        if name in self.sliders:
            return in_range(name, value, self.sliders[name])
        if name == "scenario_force":
            if not isinstance(value, bool):
                raise ValueError(f"{name} = {shown(value)}; allowed: true or false")
            return value
        if name not in self.words:
            allowed = (*self.words, "scenario_force", *self.sliders)
            raise ValueError(f"unknown setting {shown(name)}; allowed: {', '.join(allowed)}")
        if not (isinstance(value, str) and value in self.words[name]):
            missing = {choice["name"]: choice.get("missing") for choice in self.controllers}
            if name == "controller" and isinstance(value, str) and missing.get(value):
                raise ValueError(f"controller = {value!r} is not installed; allowed after: {missing[value]}")
            raise ValueError(f"{name} = {shown(value)}; allowed: {', '.join(self.words[name])}")
        return value


def in_range(name: str, value: Any, slider: Slider) -> float:
    """``value`` as a float, or a ``ValueError`` with the slider's range."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (number and math.isfinite(value) and slider.min <= value <= slider.max):
        raise ValueError(f"{name} = {shown(value)}; allowed: {slider.min:g} to {slider.max:g} {slider.unit}")
    return float(value)


def shown(value: Any) -> str:
    """``value`` for an error message, shortened."""
    text = repr(value) if not isinstance(value, int) or abs(value) < 1e15 else "a huge whole number"
    return text if len(text) <= 60 else text[:57] + "..."


def merged(settings: Settings, changes: Mapping[str, Any], setpoints: Mapping[str, float]) -> Settings:
    """``settings`` after checked ``changes``.

    Moving a stiffness slider takes all setpoints over from the scenario, which were ``setpoints``; choosing a scenario gives
    them back. Raises ``ValueError`` where one message asks for both sources.
    """
    moved = [name for name in STIFFNESSES if name in changes]
    changes = dict(changes)
    if moved and changes.get("stiffness_source") == "scenario":
        raise ValueError(f"stiffness_source = 'scenario' beside {', '.join(moved)}; allowed: one or the other")
    if moved:
        changes["stiffness_source"] = "sliders"
    elif "scenario" in changes:
        changes.setdefault("stiffness_source", "scenario")
    if changes.get("stiffness_source") == "sliders" and settings.stiffness_source == "scenario":
        changes = {**setpoints, **changes}
    return dataclasses.replace(settings, **changes)


def combined(pending: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Checked changes that do at once what ``pending`` and then ``changes`` would do."""
    gone: tuple[str, ...] = ()
    if any(name in changes for name in STIFFNESSES):
        gone = ("stiffness_source",)
    elif "scenario" in changes or changes.get("stiffness_source") == "scenario":
        gone = (*STIFFNESSES, "stiffness_source")
    return {**{name: value for name, value in pending.items() if name not in gone}, **changes}


def true_rig(rig: Parameters, settings: Settings) -> Parameters:
    """The rig that moves: mass as set, friction of both cylinders (Coulomb, static, viscous) times the factor."""
    changes: dict[str, Any] = {"mechanics.mass": settings.mass}
    for name, cylinder in (("cylinder1", rig.cylinder1), ("cylinder2", rig.cylinder2)):
        changes[f"{name}.coulomb_friction"] = cylinder.coulomb_friction * settings.friction
        changes[f"{name}.viscous_friction"] = cylinder.viscous_friction * settings.friction
    return rig.replace(changes)

"""What a person can set: names, units, ranges and defaults, and what is refused."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, ValidationError, create_model

from baselines import about
from baselines.registry import CONTROLLERS, listed_names
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import is_within

STIFFNESSES = ("Kclx", "Kcly", "Kpneu1", "Kpneu2")
"""Settings that take the place of the scenario's setpoints, in the order of a reference's rows 8 to 11."""

RESIDUAL = "residual"
"""Controller whose policies are choices of their own: ``residual:circle``."""


NOTHING = "nothing"
"""What a rig is compared with where no second one is beside it."""


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


class Strict(BaseModel):
    """What the page sends: nothing is converted, nothing is left over."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class Settings(Strict):
    """What is set. Numbers are those of ``sliders``; ``compare`` is the controller of a second rig beside the first;
    ``scenario_force`` keeps or drops the scenario's own hand, and ``stiffness_source`` says whether the stiffness setpoints
    are the scenario's or the sliders'."""

    scenario: str = "probe"
    controller: str = "admittance-backstepping"
    compare: str = NOTHING
    valves: str = "two_valves"
    sensors: str = "ideal"
    scenario_force: bool = False
    stiffness_source: Literal["scenario", "sliders"] = "scenario"
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


def opening_settings(rig: Parameters, policies: Sequence[str] = ()) -> Settings:
    """What a visitor of the page meets: the first of ``policies``, or the paper's law, whose error under a pull can be seen."""
    controller = f"{RESIDUAL}:{policies[0]}" if policies else "backstepping"
    return default_settings(rig).model_copy(update={"controller": controller})


def controller_choices(policies: Sequence[str] = ()) -> list[dict[str, str]]:
    """Every controller that is compared, every policy that comes with the package, and ``policies`` (folders): name, title,
    what it is (``about``), and what is ``missing``."""
    choices = []
    for name in listed_names():
        choice = {"name": name, "title": name.replace("-", " "), "about": about.CONTROLLERS.get(name, "")}
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
        choices += [
            {
                "name": f"{RESIDUAL}:{policy}",
                "title": f"{RESIDUAL} ({' '.join(Path(policy).parts[-2:])})",
                "about": f"A law and a trained policy that corrects it: {policy}.",
            }
            for policy in dict.fromkeys([*shipped_names(), *policies])
        ]
    return choices


class Choices:
    """What can be set on a rig: ``sliders``, ``controllers`` (``policies`` are folders of such) and ``words``, name -> allowed
    words."""

    def __init__(self, rig: Parameters, policies: Sequence[str] = ()) -> None:
        self.policies = policies
        self.sliders, self.controllers = sliders(rig), controller_choices(policies)
        known = tuple(choice["name"] for choice in self.controllers if "missing" not in choice)
        self.words: dict[str, tuple[str, ...]] = {
            "scenario": tuple(SCENARIOS),
            "controller": known,
            "compare": (NOTHING, *known),
            "valves": VALVE_LAYOUTS,
            "sensors": tuple(SENSORS),
        }
        ranges = {name: Annotated[float, within(one.min, one.max, one.unit)] for name, one in self.sliders.items()}
        words = {name: Annotated[str, AfterValidator(self._word(name))] for name in self.words}
        defaults = default_settings(rig)
        fields: Any = {name: (kind, getattr(defaults, name)) for name, kind in {**ranges, **words}.items()}
        self._model = create_model("Checked", __base__=Settings, **fields)

    def checked(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """``changes`` with numbers as floats; ``ValueError`` naming the setting, its value and what is allowed."""
        try:
            return self._model.model_validate(dict(changes)).model_dump(exclude_unset=True)
        except ValidationError as error:
            raise ValueError(refusal(error, ", ".join(Settings.model_fields))) from None

    def _word(self, name: str) -> Callable[[str], str]:
        def check(word: str) -> str:
            if word not in self.words[name]:
                missing = {choice["name"]: choice.get("missing") for choice in self.controllers}
                raise ValueError(f"after {missing[word]}" if missing.get(word) else ", ".join(self.words[name]))
            return word

        return check


def within(low: float, high: float, unit: str = "") -> BeforeValidator:
    """A pydantic check that a value is a number from ``low`` to ``high``."""

    def check(value: object) -> object:
        if not is_within(value, least=low, most=high):
            raise ValueError(f"{low:g} to {high:g} {unit}".rstrip())
        return value

    return BeforeValidator(check)


def refusal(error: ValidationError, names: str = "without it") -> str:
    """What is wrong first, with its value and what is allowed; ``names`` are those allowed where one is unknown."""
    first = error.errors(include_url=False)[0]
    name, value, allowed = ".".join(map(str, first["loc"])), repr(first["input"]), first["msg"]
    match first["type"]:
        case "json_invalid":
            return f"message is no JSON ({allowed}); allowed: a JSON object with a type"
        case "missing":
            return f"{name} is missing; allowed: a message with it"
        case "extra_forbidden":
            return f"{name[:60]} is unknown; allowed: {names}"
        case "bool_type":
            allowed = "true, false"
    for start in ("Value error, ", "Input should be "):
        allowed = allowed.removeprefix(start)
    return f"{name or 'message'} = {value if len(value) <= 60 else value[:57] + '...'}; allowed: {allowed}"


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
    return settings.model_copy(update=changes)


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

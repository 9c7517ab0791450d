"""Every registered controller and policy: what it is, what it is told, and each of its options and gains."""

import inspect
import re
from typing import Any

from agents.policy.shipped import loadable_for
from baselines import make_controller
from baselines.named import GUARDING, compiled_names, known_options, learns_mass, resolved, uses_force, with_brackets
from baselines.staged import StagedController
from birthsim_env import Parameters
from birthsim_env.registry import Entry, entries, entry

FAMILIES = {
    "backstepping": ("baselines.backstepping.", "baselines.rivals.abry"),
    "admittance": ("baselines.admittance.",),
    "rivals": ("baselines.rivals.",),
}
"""Page -> how the modules of its controllers begin; a controller belongs to the first page that takes it."""

WITH_ACCELERATION = Parameters().replace({"electronics.acceleration_bandwidth": 300.0})
"""A rig with an acceleration sensor."""

ON_A_RAIL = Parameters().replace({"linkage.kind": "rail"})
"""A rig of one cylinder."""

NUMBERS = re.compile(r"(?:zero or a positive number|a positive number >= (?P<least>\S+) and) <= (?P<most>\S+)")
"""What a refusal allows, as a table says shorter."""

FRACTION = ("1", "part of the believed Coulomb friction that is fed forward along the reference")
POSITION_LOOP = ("1/s", r"$\omega$, bandwidth of the position loop")
FOLLOWS_FORCE = ("1/s", "$b$, rate at which the force is followed")
MEANINGS: dict[str, tuple[str, str]] = {
    "weight_compensation": ("", "puts (14), the weight and the centrifugal force on cylinder 2, back into the model"),
    "pneumatic_gain": ("1/s", "$c_4$, of the pneumatic stiffness"),
    "sign_width": ("m/s", "speed over which the sign of the Coulomb friction (4) is smoothed"),
    "backstepping damping_ratio": ("1", r"$\zeta$ of the damping that slow pushes meet; none: equal gains, about 0.8"),
    "abry damping_ratio": ("1", r"$\zeta$ of the damping $B = 2 \zeta \sqrt{mK}$ that a hand feels"),
    "frozen_friction": ("", r"leaves the Coulomb friction out of $\dot F^*$"),
    "valves": (
        "",
        "a servovalve for each chamber, or one 5/3 valve for each cylinder, which leaves the pneumatic stiffness to itself",
    ),
    "force_first": ("", "where a valve saturates, pneumatic stiffness gives way and not the force"),
    "backstepping-integral integral_rate": ("1/s", "$a$, rate of the integral of the position error"),
    "backstepping-integral-compliant integral_rate": ("1/s", "$a$, rate of the integral of the distance from the spring"),
    "pid integral_rate": ("1/s", "$a$, rate of the integral"),
    "force_ratio": ("1", "$g$, how many times as fast as $B/m$ the force is followed"),
    "abry friction_fraction": ("1", "part of the believed Coulomb friction that is compensated"),
    "friction_fraction": FRACTION,
    "force_sensor": ("", "the hand's force is measured; otherwise it is estimated"),
    "learn": ("", "learns friction, a lighter mass, the tracker's noise and the force sensor's bias"),
    "identified": ("", "without a force sensor: the believed friction is the rig's to 5 %, as after `birthsim identify`"),
    "own_beliefs": ("", "lanes may believe in different rigs, which `believe` tells them"),
    "finds_rig": ("", "each lane finds ten parameters of its rig while it runs, and believes in them"),
    "reader": ("", "name or file of a network that corrects what is found; none by default"),
    "gain": ("1/s", "$c$, gain of the loop while the reference moves"),
    "rest_gain": ("1/s", "$c$ once the reference rests"),
    "rest_push": ("1", "weight of the position error of a piston that rests"),
    "admittance bandwidth": ("1/s", "of the observer of disturbances"),
    "nonlinear-mpc bandwidth": ("1/s", "of the observer of disturbances"),
    "bandwidth": POSITION_LOOP,
    "pressure_bandwidth": ("1/s", "of the observer of pressures, where their cells are noisy"),
    "friction_rate": ("1/s", "rate at which friction is learned; 0 learns none"),
    "admittance dead_zone": ("m", "error of a resting piston that moves nothing"),
    "dead_zone": ("m", "error at the end effector up to which nothing is integrated"),
    "lead_time": ("s", "time in which a spool follows its command"),
    "oscillation": ("m/s", "speed error beyond which a sustained half wave lowers the gain"),
    "yielding": ("1", "what such a half wave leaves of the gain"),
    "damping": ("1", r"$\zeta$ of the position loop"),
    "pressure_gain": ("1/s", "$b$, of the pressure loops"),
    "integral_tolerance": ("m s", "integral of the error that counts as much as the tolerated rate of force"),
    "position_tolerance": ("m", "error that counts as much"),
    "lqr speed_tolerance": ("m/s", "speed error that counts as much"),
    "force_tolerance": ("N", "force error that counts as much"),
    "nonlinear-mpc speed_tolerance": ("m/s", "speed error that counts as much as a position error of 0.1 mm"),
    "stiffness_tolerance": ("N/m", "error of pneumatic stiffness that counts as much"),
    "flow_tolerance": ("kg/s", "change of flow that counts as much"),
    "surface_rate": ("1/s", "$r$, rate at which errors decay on the surface"),
    "reaching_rate": ("m/s3", "$h$, rate at which the boundary layer is approached"),
    "layer_rate": ("1/s", "$b$, rate at which $s$ decays inside the layer"),
    "observer_bandwidth": ("1/s", "$o$, bandwidth of the extended state observer"),
    "filter_bandwidth": ("1/s", "$q$, of the filter $Q$"),
    "force_rate": FOLLOWS_FORCE,
    "delay": ("s", "$L$, in whole control periods"),
    "ideal_velocity_rate": ("1/s", "$g$, of the ideal velocity feedback; 0 is without it"),
    "rate_bound": ("m/s4", "$L$, how fast $3 r d$ may change at the end effector"),
    "error_rate": ("1/s", "$l$, rate at which errors decay where $s = 0$"),
    "feedback_rate": ("1/s", "$k$, rate at which $s$ decays"),
    "robustness": ("m/s2", "$h$, of the robust term; 0 is without it"),
    "learning_rate": ("1/s", "$a$, rate of learning; 0 learns nothing"),
    "learning": ("1", "$l$, part of the missing force that is learned in a lap"),
    "seed": ("", "of the random numbers"),
    "policy": ("", "a policy of the package, a folder of `birthsim train`, or in Python a function"),
    "settings": ("", "in Python, beside a function: its `ResidualSettings`"),
    "on_fault": ("", "what the valves do once control has ended: close, or vent both chambers"),
    "fault_time": ("s", "how long a signal may be missing before control ends"),
}
"""Option or gain, after a controller's name where it means something else there -> its unit and what it means."""


def controllers() -> str:
    """Tables of controllers, of names that are short for others, and of policies."""
    compiled = compiled_names()
    rows = [
        (
            f"[`{one.name}`]({page}.md)" if (page := _family(one)) else f"`{one.name}`",
            one.about,
            _needs(one, one.name),
            _yes(learns_mass(one.name)),
            _yes(_reads_acceleration(one.name)),
            _yes(one.name in compiled),
        )
        for one in entries("controller")
    ]
    heads = ("name", "what it is", "needs", "learns the mass", "reads acceleration", "compiled")
    table = _table(heads, rows)
    policies = [
        (
            f"`residual:{name}`",
            _needs(entry("policy", name), f"residual:{name}"),
            _yes(learns_mass(f"residual:{name}", parameters=rig)),
        )
        for rig in (Parameters(), ON_A_RAIL)
        for name in loadable_for(rig)
    ]
    short = [(f"`{one.name}`", whole) for one in entries("controller") if (whole := _short_for(one.name))]
    return "\n\n".join(
        [
            table,
            _table(("name", "short for"), short),
            _table(("policy that comes with the package", "needs", "learns the mass"), policies),
        ]
    )


def options(family: str) -> str:
    """Options and gains of the controllers of a family, a table for each that is not short for another."""
    own = [one for one in entries("controller") if _family(one) == family and resolved(one.name)[0] == one.name]
    return "\n\n".join(_options(one) for one in own)


def guarding() -> str:
    """Options of every compiled controller."""
    defaults = inspect.signature(StagedController.protect).parameters
    rows = [
        (f"`{name}`", *_meaning("", name), _allowed("backstepping", name), _shown(defaults[name].default)) for name in GUARDING
    ]
    return _table(("option", "unit", "meaning", "allowed", "default"), rows)


def _options(one: Entry) -> str:
    gains = _gains(one.made)
    signature = inspect.signature(one.made).parameters
    named = [name for name in known_options(one.name) or () if name not in GUARDING and name not in gains]
    parts = [f"### `{one.name}`", f"{_told(one)} Code: `{inspect.getmodule(one.made).__name__.replace('.', '/')}.py`."]  # type: ignore[union-attr]
    if named:
        rows = [
            (f"`{name}`", *_meaning(one.name, name), _allowed(one.name, name), _shown(signature[name].default))
            for name in named
        ]
        parts.append(_table(("option", "unit", "meaning", "allowed", "default"), rows))
    if gains:
        rows = [
            (f"`{name}`", *_meaning(one.name, name), f"{low:g} to {high:g}", *map(_shown, defaults), _allowed(one.name, name))
            for name, (low, high, *defaults) in gains.items()
        ]
        heads = (
            "gain",
            "unit",
            "meaning",
            "searched by `birthsim tune`",
            "default, ideal sensors",
            "default, sampled positions",
        )
        parts.append(_table((*heads, "allowed"), rows))
    return "\n\n".join(parts)


def _gains(made: Any) -> dict[str, tuple[float, float, float | None, float | None]]:
    """Gain -> lowest and highest that is searched, default for exact and for sampled positions."""
    if hasattr(made, "GAINS"):
        return dict(made.GAINS)
    tuned, rates = getattr(made, "TUNED", {}), getattr(made, "RATES", None)
    return {
        name: (*span, *(rates or (tuned[kind].get(name) for kind in ("ideal", "lab"))))
        for name, span in getattr(made, "TUNABLE", {}).items()
    }


def _told(one: Entry) -> str:
    """Who is told what, in sentences."""
    force = "It measures the hand's force" if uses_force(one.name) else "It does not measure the hand's force"
    mass = "learns the mass with sampled positions" if learns_mass(one.name) else "believes the mass that it is told"
    acceleration = " It reads an acceleration sensor where the rig has one." if _reads_acceleration(one.name) else ""
    return f"{force} and {mass}.{acceleration}"


def _reads_acceleration(name: str) -> bool:
    law = make_controller(name, WITH_ACCELERATION)
    return isinstance(law, StagedController) and any(one.reads_acceleration for one in law.controller_stages(True))


def _meaning(controller: str, name: str) -> tuple[str, str]:
    return MEANINGS.get(f"{controller} {name}", MEANINGS.get(name, ("", "")))


def _allowed(controller: str, name: str) -> str:
    """What the controller's own refusal says is allowed."""
    try:
        make_controller(controller, **{name: -1.0})
    except ValueError as error:
        said = str(error).partition("; allowed: ")[2]
        span = NUMBERS.fullmatch(said)
        return f"{span['least'] or '0'} to {span['most']}" if span else said
    return ""


def _family(one: Entry) -> str:
    """The page of a controller, "" for those that the overview says all of."""
    return next((page for page, modules in FAMILIES.items() if one.module.startswith(modules)), "")


def _shown(value: Any) -> str:
    if value is None or value == "":
        return "-"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else f"`{value}`"


def _short_for(name: str) -> str:
    whole = with_brackets(*resolved(name))
    return "" if whole == name else f"`{whole}`"


def _needs(one: Entry, name: str) -> str:
    force = ["force sensor"] if uses_force(name) else []
    return ", ".join([*force, *sorted(one.needs - {"force sensor"})])


def _yes(fact: bool) -> str:
    return "yes" if fact else "no"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *rows))

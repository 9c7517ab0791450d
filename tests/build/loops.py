"""Loops that tests run on a device, and the functions of all of them, whose code is compiled once."""

from functools import cache

import gymnasium

from agents.policy.files import read_policy
from agents.policy.seeds import best_policy
from birthsim_build.device.beginning import beginning_with
from birthsim_build.device.loops import controlled, pieces_of
from birthsim_env import Parameters, StiffnessSchedule
from birthsim_env.assembly import assemble
from birthsim_env.episodes import Episodes
from birthsim_env.parts.hands.contractions import Contractions
from birthsim_env.registry import names

OPTIONS = Parameters().replace(
    {
        "air.supply_conductance": 1e-8,
        "mechanics.mode_frequency": 20.0,
        "chambers.tube_length": 1.0,
        "friction.law": "gms",
        "valves.hysteresis": 0.02,
        "electronics.acceleration_bandwidth": 50.0,
    }
)

BEGUN = {
    **{f"{name} {sensors}": (name, {"sensors": sensors}) for name in names("scenario") for sensors in ("ideal", "lab")},
    **{f"circle {sensors}": ("circle", {"sensors": sensors}) for sensors in names("sensors")},
    "forceps honest": ("forceps", {"sensors": "honest"}),
    **{hand: ("probe", {"user_force": hand}) for hand in ("sine", "noise", "guided")},
    "options": ("circle", {"parameters": OPTIONS, "sensors": "lab"}),
    "options, honest, no force sensor": ("forceps", {"parameters": OPTIONS, "sensors": "honest", "force_sensor": False}),
    "sensors": ("probe", {"randomize": "sensors", "sensors": "honest"}),
    "frictions": ("probe", {"parameters": {"randomize": {"friction": "drawn-smooth"}}}),
    "nothing drawn": ("descent", {"randomize": False}),
    "two fields": ("vacuum", {"randomize": {"mechanics.mass": (2.0, 3.0), "cylinder1.piston_diameter": (0.031, 0.032)}}),
    "contractions": ("probe", {"user_force": Contractions((-9.0, 9.0), 3, 1.3, (0, 9), (0.1, 0.9), 2.1)}),
}
"""Scenario and arguments of episodes that begin on a device: all that a test there begins, because code for what is missing is
compiled anew. Not every scenario has every kind of sensors: what it draws does not depend on them."""

OFTEN = (
    *("circle ideal", "circle lab", "circle honest", "circle encoders-gauges", "forceps honest", "rail-steps lab"),
    *("noise", "guided", "options", "frictions", "contractions"),
)
"""Those that a commit begins: each way to draw, and each kind of sensors and rig; the others weekly."""

SOFT = StiffnessSchedule(closed_loop=(10.0,))
"""So soft that no controller has gains for it."""

LAWS = ("backstepping", "admittance-backstepping")
"""Controllers that are evaluated there."""

LOOKS = {"baselines.bench.measures:_measure", "baselines.bench.measures:_reward"}
"""What measures an evaluation."""


def begun(case, lanes):
    """The episodes of a case, whose rig is drawn unless it says otherwise."""
    scenario, arguments = BEGUN[case]
    return Episodes(assemble(lanes, scenario, **{"randomize": True, **arguments}))


@cache
def every_function(seldom):
    """Of episodes that begin, of residual policies, and of evaluations; of those too that begin weekly."""
    pieces = [beginning_with(begun(case, 2)) for case in (BEGUN if seldom else OFTEN)]
    scenarios = [name for name in names("policy") if name in names("scenario")] if seldom else ["circle"]
    policies = [read_policy(best_policy(scenario)) for scenario in scenarios]
    residual = [(policy.environment, policy.settings.to_dict()) for policy in policies]
    residual += [("BirthSIM/CircleResidual-v2", given) for given in ({"sensors": "lab"}, {"stiffness": SOFT})]
    for name, given in residual:
        env = gymnasium.make_vec(name, num_envs=2, randomize=True, device="host", **given)
        pieces.append(beginning_with(env.unwrapped._episodes))
    pieces += [pieces_of(controlled("circle", "lab", Parameters(), name, 0, 2).simulation) for name in LAWS]
    return LOOKS.union(*(one.functions for one in pieces))

"""Drawn worlds, what ``birthsim identify`` finds in a log of each, and what a hand feels of laws that are told it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

from baselines.backstepping.controller import BacksteppingController
from baselines.identification.experiment import propose
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.named import make_controller
from baselines.staged import StagedController
from baselines.work.tasks import Result
from birthsim_env.physics.rig.parameters import Parameters, value_of
from lab.studies.comparison.grid import as_described
from lab.studies.haptics.worlds import Condition
from lab.studies.sensorless.measures import felt
from lab.studies.sensorless.privileged import Privileged

SENSORS = "honest"


@dataclass(frozen=True)
class Informed(Condition):
    """Drawn rigs under a law that is ``told`` a rig for each."""

    told: Sequence[Parameters] = ()

    def law(self) -> Privileged:
        return Privileged([cast(StagedController, make_controller(self.controller, rig)) for rig in self.told])


def identified(duration: float, seed: int) -> Result:
    """The rig that a log of world ``seed`` tells, and of each quantity its true value, that of the rig, and the interval.

    The law of the experiment and the identification begin at the default rig; nobody touches the head.
    """
    owner = as_described(Parameters())
    true = Condition("", owner, SENSORS, seed, 1, False).drawn()
    trial = run_plan(propose(owner, duration, seed), true, BacksteppingController(owner), SENSORS, seed)[0]
    found = identify(trial, owner, seed)
    rows = {
        row.name: {
            "true": value_of(true[0], row.name),
            "value": row.value,
            "low": row.low,
            "high": row.high,
            "told": row.determined,
        }
        for row in found.rows
    }
    return {"rig": found.rig.to_dict(), "rows": rows, "misfit": list(found.misfit)}


def measure(
    controller: str, source: str, rig: dict[str, Any], told: list[dict[str, Any]], force_sensor: bool, seed: int
) -> Result:
    """``measures.measure`` of as many worlds as rigs are ``told``; of the sensors a controller believes what ``rig`` says."""
    owner = Parameters.from_dict(rig)
    board = {"electronics.acceleration_bandwidth": owner.electronics.acceleration_bandwidth}
    rigs = [Parameters.from_dict(one).replace(board) for one in told]
    return felt(Informed(controller, owner, SENSORS, seed, len(rigs), force_sensor, rigs))

"""What a controller is told, finds out and senses: columns of every table that compares controllers.

A comparison is of equal information among the rows that agree in these columns. What a controller senses its entry in the
registry says, what it learns the constants that its kernels read (``baselines.named``), and what it is told the study.
"""

from functools import cache
from typing import NamedTuple

from baselines.controller import RESIDUAL
from baselines.named import bare_name, learns_mass, uses_force
from birthsim.benchmark.contestant import TRAINING, training_of
from birthsim_env.ids import rig_for
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import entry, names

COLUMNS = ("rig", "mass learned", "force sensed")
"""Heads, which stand after that of the controller."""

DEFAULT, TOLD = "default", "told"
"""What a controller believes of its rig: the default one, whatever is drawn, or the one that it controls."""

LEGEND = (
    "*Rig*: the controller believes the default one, or is told each. *Mass learned*: it finds out by itself that the mass "
    "is another than believed. *Force sensed*: it measures the hand's force."
)
"""What the columns mean, in sentences."""


def informed(name: str, *sensors: str, rig: str = DEFAULT, parameters: str = "") -> list[str]:
    """Entries of ``COLUMNS``.

    Parameters
    ----------
    name
        Of a controller or policy, as ``make_controller`` takes it.
    *sensors
        Sensor models of the row. The mass counts as learned where it is learned with one of them.
    rig
        What the controller is told of its rig.
    parameters
        TOML file of the rig that it believes, from the root; "" for the default one.
    """
    return [rig, _yes(_learns(name, sensors, parameters)), _yes(uses_force(name))]


class Row(NamedTuple):
    """A controller, what it is told of its rig, and the TOML file of a rig with more sensors, from the root; "" for none."""

    controller: str
    rig: str = DEFAULT
    file: str = ""

    def facts(self, *sensors: str) -> list[str]:
        """Entries of ``COLUMNS`` with ``sensors``."""
        return informed(self.controller, *sensors, rig=self.rig, parameters=self.file)

    @property
    def name(self) -> str:
        """Its name in a head of a column, which has no others beside it that say what it is told."""
        more = [word for word, said in ((self.rig, self.rig == TOLD), ("accelerometer", self.file)) if said]
        return f"`{self.controller}`" + (f" ({', '.join(more)})" if more else "")


def informed_if_registered(name: str, *sensors: str) -> list[str]:
    """``informed``, and "-" for what only a file or a folder of a user's tells, of which nothing is read or run."""
    policy = name.removeprefix(f"{RESIDUAL}:")
    ours = policy in names("policy") if policy != name else bare_name(name) in names("controller")
    return informed(name, *sensors) if ours else [DEFAULT, "-", "-"]


@cache
def _learns(name: str, sensors: tuple[str, ...], parameters: str) -> bool:
    rig = load_parameters(str(ROOT / parameters)) if parameters else _default_rig(name)
    return any(learns_mass(name, entry("sensors", one).made.sampled, rig) for one in sensors)


def _default_rig(name: str) -> Parameters:
    """The default rig; of a policy that comes with the package that of its scenario, which has one cylinder on a rail."""
    policy = name.removeprefix(f"{RESIDUAL}:")
    if policy == name or policy not in names("policy"):
        return Parameters()
    trained = training_of(next(entry("policy", policy).made.glob(f"seed_*/{TRAINING}")))
    return rig_for(trained["settings"]["environment"], None) if trained else Parameters()


def _yes(fact: bool) -> str:
    return "yes" if fact else "no"

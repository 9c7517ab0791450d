"""Ids of environments: every scenario in each kind of environment, registered with Gymnasium."""

from typing import Any, NoReturn

from gymnasium.envs import registration
from gymnasium.error import DeprecatedEnv

from birthsim_env.parts.scenarios import environment_id, find_scenario, rig_of
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import Entry, follow

NAMESPACE = "BirthSIM"
FORMER = "birthsim_env.ids:refuse_former"
"""Entry point of the versions that were."""


def register_ids(kind: str, single: str, vector: str) -> None:
    """Register an id of every scenario, also of one that is registered later, and its former versions, which are refused.

    Parameters
    ----------
    kind : str
        What stands in the id behind the scenario: "", or "Residual" with a controller inside.
    single, vector : str
        Entry points of the single and the vector environment, "module:Class".
    """

    def register(scenario: Entry) -> None:
        name = environment_id(scenario.name, kind)
        if name in registration.registry:
            return
        registration.register(name, entry_point=single, vector_entry_point=vector, kwargs={"scenario": scenario.name})
        plain, _, version = name.rpartition("-v")
        for number in range(int(version)):
            asked = {"scenario": scenario.name, "former": f"{plain}-v{number}", "present": name}
            registration.register(asked["former"], entry_point=FORMER, vector_entry_point=FORMER, kwargs=asked)

    follow("scenario", register)


def environment_ids() -> list[str]:
    """All ids that make an environment, in the order of the alphabet."""
    found = registration.registry.items()
    return sorted(name for name, spec in found if spec.namespace == NAMESPACE and spec.entry_point != FORMER)


def rig_for(environment: str, parameters: Any) -> Parameters:
    """The rig of an environment id: ``parameters``, as ``load_parameters`` takes them, or its scenario's default."""
    found = registration.registry.get(environment.rpartition(":")[2]) if isinstance(environment, str) else None
    return (
        rig_of(found.kwargs["scenario"], parameters) if found and found.namespace == NAMESPACE else load_parameters(parameters)
    )


def refuse_former(scenario: str, former: str, present: str, **_: Any) -> NoReturn:
    """Raise Gymnasium's ``DeprecatedEnv``, which says what changed since a ``former`` id."""
    raise DeprecatedEnv(f"{former} is no more: {find_scenario(scenario).changed}; allowed: `{present}`")

"""Ids of environments: every scenario in each kind of environment, registered with Gymnasium."""

from gymnasium.envs import registration

from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import Entry, follow


def register_ids(kind: str, single: str, vector: str) -> None:
    """Register an id of every scenario, also of one that is registered later.

    Parameters
    ----------
    kind : str
        What stands in the id behind the scenario: "", or "Residual" with a controller inside.
    single, vector : str
        Entry points of the single and the vector environment, "module:Class".
    """

    def register(scenario: Entry) -> None:
        name = environment_id(scenario.name, kind)
        if name not in registration.registry:
            registration.register(name, entry_point=single, vector_entry_point=vector, kwargs={"scenario": scenario.name})

    follow("scenario", register)

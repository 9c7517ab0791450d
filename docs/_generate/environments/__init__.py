"""Pages of the environments: an overview, what each is made of, what all promise, and tables of what can be chosen."""

from functools import partial

from _generate.environments.choices import frictions, hands, sensors
from _generate.environments.contract import LINKAGES, contract
from _generate.environments.made import environment
from _generate.environments.overview import has_page, overview
from _generate.environments.scores import returns, what_to_beat
from birthsim_env.parts.scenarios import scored_scenarios
from birthsim_env.registry import names

PARTS = {
    "beat.md": what_to_beat,
    "environments.md": overview,
    "frictions.md": frictions,
    "hands.md": hands,
    "sensors.md": sensors,
    **{f"contract-{linkage}.md": partial(contract, linkage) for linkage in LINKAGES},
    **{f"environment-{scenario}.md": partial(environment, scenario) for scenario in filter(has_page, names("scenario"))},
    **{f"returns-{scenario}.md": partial(returns, scenario) for scenario in scored_scenarios()},
}
"""File -> what returns its text."""

"""A card for every environment: film and task."""

from pathlib import Path

from _generate.environments.scores import page_of
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import entry, names

PAGES = Path(__file__).resolve().parents[2] / "environments"


def overview() -> str:
    """The cards, those of new scenarios without a film."""
    return "\n\n".join([":::{container} cards", *map(_card, names("scenario")), ":::"])


def _card(scenario: str) -> str:
    name, about = environment_id(scenario), entry("scenario", scenario).about
    if not has_page(scenario):
        return f"`{name}`<br>{about}"
    page = f"{page_of(scenario)}.md"
    return f"[![Film of {name}]({scenario}.webp)]({page}) [`{name}`]({page})<br>{about}"


def has_page(scenario: str) -> bool:
    """Whether somebody has written a page and recorded a film of a scenario; one that is new has neither."""
    return (PAGES / f"{page_of(scenario)}.md").exists() and (PAGES / f"{scenario}.webp").exists()

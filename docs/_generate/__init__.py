"""Parts of the site that come from code: each function of ``PARTS`` returns the Markdown of one file.

`make docs` writes them into out/docs-generated, and pages include them.
"""

from functools import partial
from pathlib import Path

from _generate import environments
from _generate.api import SUBJECTS, api, front, subject
from _generate.benchmark import records, splits, suites
from _generate.commands import commands, group, page_of, readers
from _generate.configurations import configurations
from _generate.controllers import FAMILIES, controllers, guarding
from _generate.controllers import options as controller_options
from _generate.drives import faults, provoked
from _generate.metrics import metrics
from _generate.page import page
from _generate.pipeline import pipeline
from _generate.policies import policies
from _generate.rig import electronics, options, rig
from _generate.root_pages import PAGES, bibtex, root_page
from _generate.stages import stage
from birthsim.main import GROUPS

PARTS = {
    "api_birthsim.md": front,
    **{f"api_birthsim_{name}.md": partial(subject, name) for name in SUBJECTS},
    "api_birthsim_env.md": partial(api, "birthsim_env"),
    "api_baselines.md": partial(api, "baselines"),
    "api_agents.md": partial(api, "agents"),
    "bibtex.md": bibtex,
    "commands.md": commands,
    **{f"commands_{page_of(title)}.md": partial(group, title) for title in GROUPS},
    "configurations.md": configurations,
    "controllers.md": controllers,
    **{f"controllers_{family}.md": partial(controller_options, family) for family in FAMILIES},
    "electronics.md": electronics,
    "faults.md": faults,
    "guarding.md": guarding,
    "metrics.md": metrics,
    "options.md": options,
    "page.md": page,
    "pipeline.md": pipeline,
    "policies.md": policies,
    "provoked.md": provoked,
    "readers.md": readers,
    "rig.md": rig,
    **records(),
    "splits.md": splits,
    "suites.md": suites,
    **environments.PARTS,
    **{f"{page}.md": partial(root_page, name) for name, page in PAGES.items()},
}
"""File -> what returns its text."""


def write(folder: Path) -> None:
    """Write every part into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    stage("reference pages from code")
    for name, part in PARTS.items():
        (folder / name).write_text(part(), encoding="utf-8")

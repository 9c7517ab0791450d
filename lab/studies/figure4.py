"""The metrics of the paper's Fig. 4, whose picture ``birthsim figure4`` draws."""

from typing import Any

from baselines.work.tasks import Result, Task
from birthsim.commands.figure4 import metrics_of, record_run
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Options, Study
from lab.engine.tables import markdown


def measure(controller: str) -> Result:
    """``metrics_of`` the experiment with ideal sensors."""
    return metrics_of(record_run(controller), Parameters())


def _tasks(options: Options) -> dict[Any, Task]:
    return {name: Task(name, measure, {"controller": name}) for name in options.controller}


def _shown(content: Content) -> dict[str, str]:
    rows = [["controller", *information.COLUMNS, "metric", "x or 1", "y or 2"]]
    for controller, figures in content["figures"].items():
        for name, values in figures.items():
            if isinstance(values, list):
                facts = information.informed(controller, "ideal")
                rows.append([f"`{controller}`", *facts, f"`{name}`", *(f"{value:.3f}" for value in values)])
    return {"figure4.md": markdown(rows) + "\n"}


STUDY = Study(
    {"controller": ("backstepping",)},
    _tasks,
    show=_shown,
    words={"controller": "registered names"},
)
register(study="figure4", about="errors in the experiment of the paper's Fig. 4")(STUDY)

"""The error of the plant's integrator, over a rig and rigs drawn around it, against a model with adaptive steps."""

from pathlib import Path
from typing import Any

from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Options, Study, the_only_one
from lab.studies.accuracy import tables
from lab.studies.accuracy.errors import measure, rigs_to_measure
from lab.studies.accuracy.motions import MOTIONS


def _tasks(options: Options) -> dict[Any, Task]:
    rig = load_parameters(options.parameters or None).to_dict()
    return {"": Task("accuracy", accuracy, {"rig": rig, "rigs": options.rigs, "seed": options.seed})}


def accuracy(rig: dict[str, Any], rigs: int, seed: int) -> Result:
    """What ``measure`` finds."""
    return measure(rigs_to_measure(Parameters.from_dict(rig), rigs, seed), MOTIONS)


def _shown(content: Content) -> dict[str, str]:
    return {"accuracy.md": tables.tables(content["figures"]) + "\n"}


def _pictures(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.accuracy.figure import accuracy_figure

    return accuracy_figure(content["figures"], folder)


STUDY = Study(
    {"rigs": 8, "seed": 0, "parameters": ""},
    _tasks,
    the_only_one,
    {"position_m": "m", "pressure_relative": "", "steps_s": "s"},
    _shown,
    _pictures,
    words={"rigs": "random corners, and as many random rigs", "parameters": "TOML file of the nominal rig"},
)
register(study="accuracy", about="the error of the plant's integrator, against a second model")(STUDY)

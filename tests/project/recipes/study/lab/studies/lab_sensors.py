"""What the laboratory's sensors cost a controller on the circle: its settled error with them, beside that with ideal ones."""

from typing import Any

from baselines.bench.evaluation import evaluate
from baselines.bench.statistics import quantile
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Options, Study
from lab.engine.tables import markdown
from lab.engine.worlds import SEED, worlds

SENSORS = ("ideal", "lab")


def error(controller: str, sensors: str, episodes: int, seed: int) -> Result:
    """One piece: the settled error, mm, median over ``episodes``."""
    own = make_controller(controller, Parameters())
    found = evaluate("BirthSIM/Circle-v2", own, controller, episodes, seed, progress=False, sensors=sensors)
    return {"settled_rms": quantile(found.metrics["settled_rms"], 0.5)}


def tasks(options: Options) -> dict[Any, Task]:
    """A piece for each controller and kind of sensors; its key is its name in the result."""
    given = {"episodes": options.episodes, "seed": options.seed}
    return {
        f"{name} {sensors}": Task(f"{name}-{sensors}", error, {"controller": name, "sensors": sensors, **given})
        for name in options.controller
        for sensors in SENSORS
    }


def tables(content: Content) -> dict[str, str]:
    """What stands in docs/data/lab_sensors.md."""
    settings, found = content["settings"], content["figures"]
    rows = [["controller", *(f"{sensors}, mm" for sensors in SENSORS)]]
    for name in settings["controller"]:
        rows.append([f"`{name}`", *(f"{found[f'{name} {sensors}']['settled_rms']:.3f}" for sensors in SENSORS)])
    return {"lab_sensors.md": f"{worlds(settings['seed'], settings['episodes'])}\n\n{markdown(rows)}\n"}


STUDY = Study(
    {"controller": ("backstepping", "pid"), "episodes": 8, "seed": SEED},
    tasks,
    units={"settled_rms": "mm"},
    show=tables,
    words={"controller": "registered names"},
)
register(study="lab-sensors", about="what the laboratory's sensors cost a controller")(STUDY)

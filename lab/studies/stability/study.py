"""Where a controller is stable, over rigs that are not as believed and over hands that hold it."""

from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.work.tasks import Task
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import names, register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown
from lab.studies.stability import maps as stability
from lab.studies.stability.maps import MAPS, describe_map, stability_tasks


def _tasks(options: Options) -> dict[Any, Task]:
    settings = controller_settings(options.controller, load_parameters(options.parameters or None))
    return {
        **stability_tasks(list(dict.fromkeys(options.map)), settings, options.sensors, options.points or None, options.seed)
    }


def _kept(options: Options, found: Found) -> Any:
    """Map -> what it shows, and its variants."""
    rig: Parameters = load_parameters(options.parameters or None)
    return {
        key: {
            **describe_map(key, rig, options.points or None),
            "variants": {label: result for (place, label), result in found.items() if place == key},
        }
        for key in dict.fromkeys(options.map)
    }


def _heading(content: Content) -> str:
    return f"{content['settings']['controller']}, {content['settings']['sensors']} sensors"


def _shown(content: Content) -> dict[str, str]:
    parts = [f"{_heading(content)}: stable up to and including, from the left of the map"]
    for chart in content["figures"].values():
        parts += [f"{chart['title']}: {chart['x']['label']}", markdown(_rows(chart))]
    return {"stability.md": "\n\n".join(parts) + "\n"}


def _rows(chart: dict[str, Any]) -> list[list[str]]:
    """Per value of y and variant how far along x all is stable."""
    limits, last = [stability.stable_up_to(chart, label) for label in chart["variants"]], chart["x"]["values"][-1]
    values = chart["y"]["values"]
    rows = [[_number(value), *(_limit(row[k], last) for row in limits)] for k, value in enumerate(values)]
    return [[chart["y"]["label"], *chart["variants"]], *rows]


def _limit(value: float | None, last: float) -> str:
    return "nowhere" if value is None else _number(value) + (" (all)" if value == last else "")


def _number(value: float) -> str:
    """Four digits, without an exponent."""
    return f"{value:.0f}" if value >= 1000 else f"{value:.4g}"


def _pictures(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.stability.figure import stability_figure

    return [
        path for key, chart in content["figures"].items() for path in stability_figure(key, chart, _heading(content), folder)
    ]


STUDY = Study(
    {
        "controller": "admittance-backstepping",
        "sensors": "lab",
        "map": tuple(MAPS),
        "points": 0,
        "seed": 0,
        "parameters": "",
    },
    _tasks,
    _kept,
    {"motion_mm": "mm"},
    _shown,
    _pictures,
    allowed={"sensors": tuple(names("sensors")), "map": tuple(MAPS)},
    words={
        "controller": "a registered name, with options, or path/to/file.py:Class",
        "seed": "of the sensors' noise",
        "points": "values along each axis, 0 for those of the map",
        "parameters": "TOML file of the rig as it is believed",
    },
)
register(study="stability", about="maps of where a controller is stable")(STUDY)

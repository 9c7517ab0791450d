"""birthsim study sweep: grids, random draws and searches over controllers, rigs, sensors, scenarios, policies and trainings."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from baselines.bench.statistics import jsonable
from baselines.work.tasks import Task
from birthsim_env.files import finite
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.studies.sweeps.plan import HeatMap, Sweep, load_sweep
from lab.studies.sweeps.report import episodes, figures, table, write_parquet
from lab.studies.sweeps.search import best_trial, next_trials, write_journal
from lab.studies.sweeps.work import complete, pieces_of

EXAMPLE = ROOT / "examples" / "sweeps" / "robustness.toml"


def _sweep(options: Options) -> Sweep:
    return load_sweep(Path(options.file or EXAMPLE))


def _tasks(options: Options) -> dict[Any, Task]:
    sweep = _sweep(options)
    return pieces_of(sweep.points, sweep) if sweep.search is None else next_trials(sweep, {})


def _further(options: Options, found: Found) -> dict[Any, Task]:
    sweep = _sweep(options)
    return {} if sweep.search is None else next_trials(sweep, found)


def _kept(options: Options, found: Found) -> Any:
    sweep = _sweep(options)
    return finite(
        jsonable(
            {
                "base": sweep.base,
                "points": figures(*complete(found)),
                "maps": [asdict(chart) for chart in sweep.maps],
                "best": None if sweep.search is None else best_trial(sweep, found),
            }
        )
    )


def _shown(content: Content) -> dict[str, str]:
    found = content["figures"]
    base = ", ".join(f"{name} = {value}" for name, value in found["base"].items() if value is not None)
    caption = f"{len(found['points'])} points; {base}. A lost episode counts as infinitely bad."
    best = [f"The best of the trials: {found['best']}."] if found["best"] else []
    return {"sweep.md": "\n\n".join([caption, *best, table(found["points"], found["base"]["sensors"])]) + "\n"}


def _drawn(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.sweeps.maps import draw_map

    found = content["figures"]
    charts = [HeatMap(**chart) for chart in found["maps"]]
    return [path for k, chart in enumerate(charts) for path in draw_map(f"sweep_{k}", chart, found["points"], folder)]


def _written(options: Options, found: Found, folder: Path) -> list[str]:
    sweep = _sweep(options)
    write_parquet(episodes(*complete(found)), folder / "episodes.parquet")
    if sweep.search is None:
        return ["episodes.parquet"]
    write_journal(sweep, found, folder / "trials.journal")
    return ["episodes.parquet", "trials.journal"]


STUDY = Study(
    {"file": ""},
    _tasks,
    _kept,
    {},
    _shown,
    _drawn,
    partial=True,
    further=_further,
    write=_written,
    first="file",
    words={"file": "TOML file with tables [base], [grid], [draw], [search] and [[map]], as docs/sweeps.md says"},
)
register(study="sweep", about="grids, random draws and searches, from a TOML file")(STUDY)

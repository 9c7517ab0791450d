"""birthsim study sweep: grids, random draws and searches over controllers, rigs, sensors, scenarios, policies and trainings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from baselines.commands.settings import Processes
from baselines.work.files import make_folder, own_folder, whole_results, write_json, write_text
from baselines.work.tasks import Result, Task, run_tasks
from studies.sweeps.plan import Point, Sweep, load_sweep
from studies.sweeps.search import search_points
from studies.sweeps.work import tasks_of


@dataclass(kw_only=True)
class Settings(Processes):
    """Evaluate, or train and evaluate, every point of a grid, of random draws or of a search. docs/sweeps.md has examples.

    What the output folder holds of the same settings and code is kept, so that an interrupted sweep goes on.
    """

    file: Path = field(kw_only=False)
    """TOML file with tables [base], [grid], [draw], [search] and [[map]]."""
    out: Path
    """Folder for episodes.parquet, sweep.md, sweep.json and maps."""


def main(settings: Settings) -> None:
    """Evaluate the points that the folder lacks; write tables and maps."""
    sweep = load_sweep(settings.file)
    folder = make_folder(settings.out)

    def evaluated(points: Sequence[Point], title: str) -> tuple[list[list[Result] | None], dict[str, str]]:
        """The pieces of every point, None where one failed, and what went wrong."""
        return _evaluated(points, sweep, folder, title, settings)

    failures: dict[str, str] = {}
    with own_folder(folder):
        if sweep.search is None:
            points = sweep.points
            results, failures = evaluated(points, "sweep")
        else:
            points, results = search_points(sweep, evaluated, folder)
    whole = [(point, pieces) for point, pieces in zip(points, results, strict=True) if pieces is not None]
    if whole:
        _write([point for point, _ in whole], [pieces for _, pieces in whole], sweep, folder)
    if failures:
        name, problem = next(iter(failures.items()))
        raise ValueError(f"{len(points) - len(whole)} of {len(points)} points failed, the first {name}: {problem}")


def _evaluated(
    points: Sequence[Point], sweep: Sweep, folder: Path, title: str, settings: Settings
) -> tuple[list[list[Result] | None], dict[str, str]]:
    tasks: dict[int, list[Task]] = {}
    failures: dict[str, str] = {}
    for number, point in enumerate(points):
        try:
            tasks[number] = tasks_of(point, sweep)
        except ValueError as error:
            failures[f"point {number}"] = str(error)
    # Points with the same settings are one piece.
    every = {task.name: task for pieces in tasks.values() for task in pieces}
    done, failed = run_tasks(list(every.values()), folder, settings.jobs, title, settings.cluster)
    for number, pieces in tasks.items():
        failures |= {f"point {number}": failed[task.name] for task in pieces if task.name in failed}
    results = [
        [done[task.name] for task in tasks[number]]
        if number in tasks and all(task.name in done for task in tasks[number])
        else None
        for number in range(len(points))
    ]
    return results, failures


def _write(points: list[Point], results: list[list[Result]], sweep: Sweep, folder: Path) -> None:
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from studies.sweeps.maps import draw_map
    from studies.sweeps.report import episodes, figures, summary_json, table, write_parquet

    found = figures(points, results)
    base = ", ".join(f"{name} = {value}" for name, value in sweep.base.items() if value is not None)
    caption = f"{len(points)} points; {base}. A lost episode counts as infinitely bad."
    with whole_results(folder) as place:
        write_parquet(episodes(points, results), place / "episodes.parquet")
        write_json(place / "sweep.json", {"base": sweep.base, "points": summary_json(found)})
        write_text(place / "sweep.md", f"# Sweep\n\n{caption}\n\n{table(found)}\n")
        drawn = [path for number, chart in enumerate(sweep.maps) for path in draw_map(f"map_{number}", chart, found, place)]
    pictures = "".join(f", {path.name}" for path in drawn if path.suffix == ".png")
    lines: list[Any] = table(found).splitlines()
    print("\n".join(lines[:42]) + ("\n..." if len(lines) > 42 else ""))
    print(f"\nwritten to {folder}/: episodes.parquet, sweep.json, sweep.md{pictures}")

"""birthsim identify: a laboratory's own rig from a log, and the experiment that makes such a log."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from tqdm import tqdm

from baselines.identification.experiment import DURATION, propose, read_plan, suited
from baselines.identification.fit.free_parameters import unmeasured
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.identification.log.log_file import read_trial, write_trial
from baselines.identification.valve_table import fit_valve_table
from baselines.logs.writing import WRITERS
from baselines.named import make_controller
from birthsim.command_line.settings import CONTROLLER, SENSORS, TABLE, Logged, RigFile, Seed, Style, number, require_folder
from birthsim_env.files import make_folder, whole_results, write_text
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

ONLY_WITH = {
    **{"duration": "propose", "controller": "simulate", "sensors": "simulate"},
    **dict.fromkeys(("report", "columns", "skip", "decimal_comma", "friction_law"), "log"),
    "valve": "valve_table",
}
"""Option -> the one of log, propose and simulate that it belongs to."""


@dataclass(kw_only=True)
class Settings(Logged):
    r"""Estimate friction, mass, valves, dead volume and latency of a rig from a log, with 95 % intervals, and write the rig as
    TOML. --propose writes an experiment that reveals them, and --simulate runs it on the simulator.
    """

    log: Annotated[Path | None, TABLE] = field(default=None, kw_only=False)
    """The log: a table of time, openings, pressures, positions and forces, with one of the endings listed below."""
    friction_law: Literal["lugre", "coulomb", "elasto_plastic", "gms"] | None = None
    """The friction law to be fitted. [default: the one that the log supports best]"""
    propose: Annotated[Path | None, Parameter(metavar="PLAN")] = None
    """Write an experiment as CSV: the target, and openings to add."""
    simulate: Annotated[Path | None, Parameter(metavar="PLAN")] = None
    """Run an experiment on the simulator and write its log."""
    valve_table: Annotated[Path | None, Parameter(metavar="TABLE")] = None
    """Fit the curve of the valves to a table of opening (-1 to 1) and flow."""
    valve: Literal["P1", "N1", "P2", "N2"] | None = None
    """The chamber, if the table describes only one valve."""
    out: Path | None = None
    """File for the rig, .toml; with --simulate for the log, .csv, .parquet or .mcap."""
    report: Annotated[Path | None, Parameter(metavar="FOLDER")] = None
    """Folder for report.md and figures of the residuals."""
    style: Style = "screen"
    duration: Annotated[float | None, number("S")] = None
    """Duration of the proposed experiment. [default: 12]"""
    controller: Annotated[str | None, CONTROLLER] = None
    """Controller of --simulate, which believes the default values of all that a log can reveal. [default: backstepping]"""
    sensors: Annotated[str | None, SENSORS] = None
    """Sensors of --simulate. [default: lab]"""
    seed: Seed = 0
    """Seed of everything random."""
    parameters: RigFile = None


def main(settings: Settings) -> None:
    """Propose, simulate or identify."""
    asked = [name for name in ("log", "propose", "simulate", "valve_table") if getattr(settings, name) is not None]
    if len(asked) != 1:
        given = " and ".join(name.replace("_", "-") for name in asked) or "nothing"
        raise ValueError(f"{given} given; allowed: one of LOG, --propose PLAN, --simulate PLAN, --valve-table TABLE")
    for name, needed in ONLY_WITH.items():
        value = getattr(settings, name)
        if value is not None and value is not False and asked != [needed]:
            option = name.replace("_", "-")
            owner = "LOG" if needed == "log" else f"--{needed.replace('_', '-')}"
            raise ValueError(f"--{option} is given; allowed with {owner} only")
    require_folder(settings.style, settings.report, "report")
    rig = load_parameters(settings.parameters)
    if settings.log is not None:
        _from_log(settings, settings.log, rig)
    elif settings.propose is not None:
        _propose(settings, settings.propose, rig)
    elif settings.simulate is not None:
        _simulate(settings, settings.simulate, rig)
    elif settings.valve_table is not None:
        _from_valve_table(settings, settings.valve_table, rig)


def _propose(settings: Settings, path: Path, rig: Parameters) -> None:
    if settings.out is not None:
        raise ValueError("--out is given; allowed with LOG or --simulate, --propose names its own file")
    if path.suffix.lower() != ".csv":
        raise ValueError(f"--propose {str(path)!r}; allowed: a file that ends in .csv")
    plan = suited(propose(rig, DURATION if settings.duration is None else settings.duration, settings.seed), rig)
    plan.write(path)
    print(f"written to {path}: {len(plan.times)} rows of time, target and openings to add to a controller's")


def _simulate(settings: Settings, path: Path, rig: Parameters) -> None:
    out = _out(settings, (".csv", *WRITERS))
    plan = read_plan(path, rig)
    law = make_controller(settings.controller or "backstepping", unmeasured(rig))
    count = int((plan.times[-1] - plan.times[0]) / rig.electronics.control_period)
    with _bar(count, "experiment", "periods") as tick:
        trial = run_plan(plan, [rig], law, settings.sensors or "lab", settings.seed, tick)[0]
    write_trial(trial, out, rig)
    print(f"written to {out}: {len(trial.times)} rows, {trial.times[-1] - trial.times[0]:.4g} s")


def _from_valve_table(settings: Settings, table: Path, rig: Parameters) -> None:
    out = _out(settings, (".toml",))
    found = fit_valve_table(table)
    rig.replace(found.changes(rig, settings.valve or "")).to_toml(out)
    print("\n".join(found.words()))
    print(f"written to {out}: the valve of {settings.valve or 'each chamber'}")


def _from_log(settings: Settings, log: Path, owner: Parameters) -> None:
    out = _out(settings, (".toml",))
    trial = read_trial(log, owner, settings.options())
    print("".join(f"{note}\n" for note in trial.notes), end="", flush=True)
    folder = None if settings.report is None else make_folder(settings.report)
    with _bar(None, "fit", "evaluations") as tick:
        found = identify(trial, owner, settings.seed, tick=tick, friction_law=settings.friction_law)
    found.write(out, log.name)
    print("\n".join(found.words()))
    print(f"written to {out}: {sum(row.determined for row in found.rows)} of {len(found.rows)} parameters are from the log")
    if folder is not None:
        # pyplot takes half a second to load.
        from baselines.figures.identification import intervals_figure, residuals_figure
        from baselines.figures.style import drawn_for, linked

        with drawn_for(settings.style), whole_results(folder) as place:
            drawn = [*residuals_figure(found, place), *intervals_figure(found, place)]
            text = [f"# {log.name}", "", *(f"- {line}" for line in (*found.notes, *found.words())), "", *linked(drawn)]
            write_text(place / "report.md", "\n".join(text) + "\n")
        print(f"written to {folder}/: report.md, {', '.join(path.name for path in drawn)}")


def _out(settings: Settings, suffixes: tuple[str, ...]) -> Path:
    out = settings.out
    if out is None or out.suffix.lower() not in suffixes or not out.resolve().parent.is_dir():
        given = "is missing" if out is None else repr(str(out))
        raise ValueError(f"--out {given}; allowed: a file that ends in {', '.join(suffixes)}, in a folder that exists")
    return out


@contextmanager
def _bar(total: int | None, title: str, unit: str) -> Iterator[Callable[[], object]]:
    with tqdm(total=total, desc=title, unit=f" {unit}", leave=False) as bar:
        yield bar.update

"""birthsim compare: a log beside the models of one rig or several, where and when each leaves it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baselines.identification.comparing.report import data_of, printed, report
from birthsim.command_line.settings import MANY, TABLE, WORLD, Logged, Style, number, require_folder
from birthsim.identification import compare_log, judging_of
from birthsim_env.files import make_folder, whole_results, write_json, write_text
from birthsim_live.logs.recording import SUFFIX
from birthsim_live.logs.twin import write_twin

TWIN = f"twin{SUFFIX}"
"""The log beside the nearest rig, for the page."""

ASKED = ("window", "multiple", "pressure_limit", "position_limit", "horizon")
"""Options that say how a log is compared."""


@dataclass(kw_only=True)
class Settings(Logged):
    r"""Play a log's openings and forces through the model of a rig: by how much it is off in each signal, and where and when
    it departs from the log. Several rigs are ranked.
    """

    log: Annotated[Path, TABLE] = field(kw_only=False)
    """A table as birthsim identify reads it: time, openings, pressures, positions, forces."""
    parameters: Annotated[list[str] | None, MANY, Parameter(group=WORLD, metavar="FILE...")] = None
    """TOML files of the rigs. [default: the paper's rig]"""
    window: Annotated[float | None, number("S")] = None
    """Time after which the model starts again from the log. [default: 0.25]"""
    multiple: Annotated[float | None, number("TIMES")] = None
    """A free run has departed from the log where its error is this many times the noise. [default: 10]"""
    pressure_limit: Annotated[float | None, number("PA")] = None
    """For pressures, this error instead."""
    position_limit: Annotated[float | None, number("M")] = None
    """For positions, this error instead."""
    horizon: Annotated[float | None, number("S")] = None
    """Duration of the free runs, which begin all over the log. [default: 2]"""
    style: Style = "screen"
    out: Annotated[Path | None, Parameter(metavar="FOLDER")] = None
    """Folder for report.md, compare.json, figures, and twin.rec, which birthsim live --replay plays."""


def main(settings: Settings) -> None:
    """Compare, print, and write the report."""
    require_folder(settings.style, settings.out, "out")
    asked = {name: value for name in ASKED if (value := getattr(settings, name)) is not None}
    judging = judging_of(**asked)
    folder = None if settings.out is None else make_folder(settings.out)
    found = compare_log(settings.log, settings.parameters or [None], settings.options(), judging)
    print(printed(found))
    if folder is not None:
        # pyplot takes half a second to load.
        from baselines.figures.compared import free_run_figure, windows_figure
        from baselines.figures.style import drawn_for, linked

        with drawn_for(settings.style), whole_results(folder) as place:
            drawn = [*windows_figure(found, place), *free_run_figure(found, place)]
            write_text(place / "report.md", report(found, settings.log.name, linked(drawn)))
            write_json(place / "compare.json", data_of(found, settings.log.name))
            write_twin(found.nearest, found.trial, place / TWIN)
        print(f"written to {folder}/: report.md, compare.json, {', '.join(path.name for path in drawn)}, {TWIN}")
        print(f"birthsim live --replay {folder / TWIN} plays the log beside {found.nearest.name}")

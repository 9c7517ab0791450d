"""birthsim explain: what a trained residual has learned, and what a hand feels of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from baselines.bench.statistics import number
from baselines.tables import aligned, markdown
from birthsim.command_line.settings import Configured, Style
from birthsim_env.extras import installation
from birthsim_env.files import make_folder, whole_results, write_json, write_text


@dataclass(kw_only=True)
class Settings(Configured):
    """Look into a trained residual: its correction against the weight that the controller leaves out and against friction, the
    frictionless circle, and the stiffness test per setpoint on randomised rigs.
    """

    policy: Annotated[str, Parameter(metavar="DIR")] = "circle"
    """A folder that birthsim train wrote, or the name of a shipped policy."""
    no_pushes: bool = False
    """Leave out the stiffness test, which takes minutes."""
    style: Style = "screen"
    out: Path
    """Folder for the figure, residual.md, residual.json."""


def main(settings: Settings) -> None:
    """Compute, draw and write it."""
    try:
        from agents.policy.controller import ResidualController
        from agents.policy.files import read_policy
        from agents.policy.seeds import policy_folders
        from agents.reports import inspection
        from agents.reports.correction_figure import draw_corrections
        from agents.residual.settings import NO_LAW
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: {installation('agents')}") from error
    from baselines.figures.style import drawn_for
    from baselines.named import make_controller
    from birthsim_env.physics.rig.parameters import Parameters

    places = policy_folders(settings.policy)
    policies = [read_policy(place) for place in places]
    if any(policy.settings.law == NO_LAW for policy in policies):
        raise ValueError(f"--policy {settings.policy!r} drives the valves by itself; allowed: one that corrects a controller")
    names = [place.name for place in places]
    weights = [inspection.weight_over_workspace(policy) for policy in policies]
    correlations = [float(np.corrcoef(*weight)[0, 1]) for weight in weights]
    slopes = [float(np.polyfit(weight[1], weight[0], 1)[0]) for weight in weights]
    circles = [inspection.frictionless_circle(policy) for policy in policies]
    folder, friction = make_folder(settings.out), inspection.friction_along_circle(policies[0])
    law = policies[0].settings.law
    laws = dict.fromkeys(("backstepping", law))  # the paper's, and the one underneath
    controllers: list[tuple[str, Any]] = [(name, make_controller(name, Parameters())) for name in laws]
    controllers += [(name, ResidualController(policy=place)) for name, place in zip(names, places, strict=True)]
    rows = [] if settings.no_pushes else inspection.rendered(controllers)
    lines = [
        "Without friction, held still at 128 places with masses of 2 to 5 kg: correction on cylinder 2 over m g cos(theta1).",
        "Circle of 100 mm without friction: settled RMS error on x.",
        f"Without a policy the circle's error is that of {law}.",
    ]
    learned: list[tuple[str, ...]] = [
        (name, f"{correlation:.3f}", f"{slope:.2f}", f"{alone:.2f}", f"{helped:.3f}")
        for name, correlation, slope, (alone, helped) in zip(names, correlations, slopes, circles, strict=True)
    ]
    tables: list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]] = [
        ("\n".join(lines), ("policy", "correlation", "slope", "circle, mm", "with the policy, mm"), learned)
    ]
    head = ("controller", "error, %", "hunts on x, mm", "on y, mm", "lost")
    labels = ("error_percent", "hunting_x_mm", "hunting_y_mm")
    for setpoint in dict.fromkeys(row["setpoint"] for row in rows):
        there = [row for row in rows if row["setpoint"] == setpoint]
        felt = [
            (
                row["controller"],
                *(f"{number(row[f'{label}_median'])} ({number(row[f'{label}_q95'])})" for label in labels),
                str(row["lost"]),
            )
            for row in there
        ]
        title = f"Stiffness test at {setpoint:g} N/m on rigs drawn at random, {there[0]['cases']} pushes: median (95 %)."
        tables.append((title, head, felt))
    marked = [f"{title}\n\n{markdown(top, cells)}\n" for title, top, cells in tables]
    content = {"policies": names, "correlations": correlations, "slopes": slopes, "circles_mm": circles, "rendered": rows}
    with drawn_for(settings.style), whole_results(folder) as place:
        drawn = draw_corrections(weights[0], correlations[0], friction, place)
        write_text(place / "residual.md", "\n".join(marked))
        write_json(place / "residual.json", content)
    for title, top, cells in tables:
        print(f"{title}\n\n{aligned(top, cells)}\n")
    print(f"written to {folder}/: {', '.join(path.name for path in drawn)}, residual.md, residual.json")

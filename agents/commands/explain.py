"""birthsim explain: what a trained residual has learned, and what a hand feels of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from baselines.bench.statistics import number
from baselines.commands.settings import Configured
from baselines.work.files import make_folder, write_json, write_text


@dataclass(kw_only=True)
class Settings(Configured):
    """Look into a trained residual: its correction against the weight that the controller leaves out and against friction, the
    frictionless circle, and the stiffness test per setpoint on rigs drawn at random.
    """

    policy: Annotated[str, Parameter(metavar="DIR")] = "circle"
    """A folder that birthsim train wrote, or the name of what is shipped."""
    no_pushes: bool = False
    """Leave out the stiffness test, which takes minutes."""
    out: Path
    """Folder for correction.png and .svg, residual.md, residual.json."""


def main(settings: Settings) -> None:
    """Compute, draw and write it."""
    try:
        from agents.policy.controller import ResidualController
        from agents.policy.files import load_policy
        from agents.policy.seeds import policy_folders
        from agents.reports import inspection
        from agents.reports.correction_figure import draw_corrections
        from agents.residual.settings import NO_LAW
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: pip install 'birthsim[agents]'") from error
    from baselines.registry import make_controller
    from birthsim_env.physics.rig.parameters import Parameters

    places = policy_folders(settings.policy)
    policies = [load_policy(place) for place in places]
    if any(policy.settings.law == NO_LAW for policy in policies):
        raise ValueError(f"--policy {settings.policy!r} drives the valves by itself; allowed: one that corrects a law")
    names = [place.name for place in places]
    weights = [inspection.weight_over_workspace(policy) for policy in policies]
    correlations = [float(np.corrcoef(*weight)[0, 1]) for weight in weights]
    slopes = [float(np.polyfit(weight[1], weight[0], 1)[0]) for weight in weights]
    circles = [inspection.frictionless_circle(policy) for policy in policies]
    folder = make_folder(settings.out)
    draw_corrections(weights[0], correlations[0], inspection.friction_along_circle(policies[0]), folder)
    law = policies[0].settings.law
    laws = dict.fromkeys(("backstepping", law))  # the paper's, and the one underneath
    controllers: list[tuple[str, Any]] = [(name, make_controller(name, Parameters())) for name in laws]
    controllers += [(name, ResidualController(policy=place)) for name, place in zip(names, places, strict=True)]
    rows = [] if settings.no_pushes else inspection.rendered(controllers)
    lines = [
        "Without friction, held still at 128 places with masses of 2 to 5 kg: correction on cylinder 2 over m g cos(theta1).",
        "Circle of 100 mm without friction: settled RMS error on x.",
        "",
        f"| policy | correlation | slope | circle: {law} (mm) | with the policy (mm) |",
        "|---|---|---|---|---|",
    ]
    for name, correlation, slope, (alone, helped) in zip(names, correlations, slopes, circles, strict=True):
        lines.append(f"| {name} | {correlation:.3f} | {slope:.2f} | {alone:.2f} | {helped:.3f} |")
    if rows:
        lines += [
            "",
            f"Stiffness test on rigs drawn at random, {rows[0]['cases']} pushes per setpoint: median (95 %).",
            "",
            "| setpoint (N/m) | controller | error of the stiffness (%) | hunting x (mm) | hunting y (mm) | lost |",
            "|---|---|---|---|---|---|",
        ]
    for row in rows:
        figures = " | ".join(
            f"{number(row[f'{label}_median'])} ({number(row[f'{label}_q95'])})"
            for label in ("error_percent", "hunting_x_mm", "hunting_y_mm")
        )
        lines.append(f"| {row['setpoint']:g} | {row['controller']} | {figures} | {row['lost']} |")
    text = "\n".join(lines)
    write_text(folder / "residual.md", text + "\n")
    content = {"policies": names, "correlations": correlations, "slopes": slopes, "circles_mm": circles, "rendered": rows}
    write_json(folder / "residual.json", content)
    print(f"{text}\n\nwritten to {folder}/: correction.png and .svg, residual.md, residual.json")

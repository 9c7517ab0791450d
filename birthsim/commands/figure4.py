"""birthsim figure4: the experiment of the paper's Fig. 4 on the full plant, its figures and its picture."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import birthsim_env
from baselines.named import make_controller
from baselines.tables import aligned
from birthsim.command_line.settings import Configured, Controller, RigFile, Sensors, Set, Style
from birthsim.command_line.worlds import with_options
from birthsim.recorded import driven, record
from birthsim_env.files import make_folder, whole_file, whole_results, write_json
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.reward import SETTLED

PICTURE: dict[str, Any] = {"render_mode": "rgb_array", "picture_size": (1280, 960)}
PICTURE_TIME = 1.8
"""s: in the middle of the first push."""

FIELDS = (
    *("time", "since_jump", "user_force", "stiffness_setpoint", "pneumatic_stiffness", "pneumatic_stiffness_setpoint"),
    *("target", "compliant_target", "position", "tracking_error", "piston_position", "impact_speed"),
)


@dataclass(kw_only=True)
class Settings(Configured):
    """Reproduce Fig. 4 of Herzig et al. (IROS 2015)."""

    controller: Controller = "backstepping"
    set: Set = field(default_factory=list)
    sensors: Sensors = "ideal"
    parameters: RigFile = None
    style: Style = "screen"
    out: Path
    """Folder for the figure, figure4.json and rig.png."""


def record_run(
    controller: str, sensors: str = "ideal", parameters: Any = None, picture: Path | None = None
) -> dict[str, Array]:
    """The nominal Circle under a controller at the control rate: the ``info`` fields over time, SI units; and ``lost``,
    which is True where it ended before its time.

    ``picture`` is where to save what the rig looks like during the first push.
    """
    rig = load_parameters(parameters)
    env = driven("BirthSIM/Circle-v2", controller, rig, sensors=sensors, **PICTURE)

    def look(rows: int) -> None:
        if picture is not None and rows == round(PICTURE_TIME / rig.electronics.control_period):
            with whole_file(picture) as file:
                Image.fromarray(np.asarray(env.render())).save(file, format="png")

    return record(env, 0, FIELDS, "Fig. 4", look)


def metrics_of(record: dict[str, Array], rig: birthsim_env.Parameters) -> dict[str, Any]:
    """Settled RMS error per axis and half (mm), pneumatic stiffness error (% RMS), clearance from the end stops (mm)."""
    error, stiffness = 1e3 * record["tracking_error"], record["stiffness_setpoint"][:, 0]
    settled = record["since_jump"] >= SETTLED
    result: dict[str, Any] = {}
    for setpoint in np.unique(stiffness[settled]):
        chosen = settled & (stiffness == setpoint)
        result[f"settled_rms_mm_at_{setpoint:.0f}"] = np.sqrt((error[chosen] ** 2).mean(axis=0)).tolist()
        result[f"settled_max_mm_at_{setpoint:.0f}"] = np.abs(error[chosen]).max(axis=0).tolist()
    relative = record["pneumatic_stiffness"] / record["pneumatic_stiffness_setpoint"] - 1
    result["pneumatic_rms_percent"] = (100 * np.sqrt((relative**2).mean(axis=0))).tolist()
    half = np.array([rig.cylinder1.stroke / 2, rig.cylinder2.stroke / 2])
    result["least_clearance_mm"] = (1e3 * (half - np.abs(record["piston_position"]).max(axis=0))).tolist()
    result["finite"] = bool(all(np.isfinite(values).all() for values in record.values()))
    result["duration_s"] = float(record["time"][-1])
    result["lost"] = bool(record["lost"][-1])
    return result


def main(settings: Settings) -> None:
    """Run the experiment, print its figures, draw it."""
    rig = load_parameters(settings.parameters)
    controller = with_options([settings.controller], settings.set)[0]
    make_controller(controller, rig)
    folder = make_folder(settings.out)
    from baselines.figures.runs import figure4
    from baselines.figures.style import drawn_for

    with drawn_for(settings.style), whole_results(folder) as place:
        record = record_run(controller, settings.sensors, rig, place / "rig.png")
        result = metrics_of(record, rig)
        files = [path.name for path in figure4(record, place)]
        write_json(place / "figure4.json", result)
    if result["lost"]:
        raise ValueError(
            f"{controller} lost the end effector after {result['duration_s']:.3g} s: a piston ran "
            f"into its stop, or a chamber left its range; {folder}/ has what came before. Allowed: a controller "
            "and a rig that keep it"
        )
    print(f"Fig. 4 with {controller}, {settings.sensors} sensors, {result['duration_s']:g} s\n")
    rows = [(name, *(f"{value:.3f}" for value in values)) for name, values in result.items() if isinstance(values, list)]
    print(aligned(("", "x or 1", "y or 2"), rows))
    print(f"\nwritten to {folder}/: {', '.join(files)}, figure4.json, rig.png")

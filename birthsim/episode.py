"""What ``birthsim run`` does: one episode, its error over time printed, its motion drawn."""

from typing import TYPE_CHECKING

import numpy as np

from birthsim.command_line.settings import RANDOMIZE
from birthsim.command_line.worlds import check_environment, with_options
from birthsim.recorded import driven, record
from birthsim_env.files import make_folder, whole_results
from birthsim_env.ids import rig_for
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.physics.compiled.lanes import Array

if TYPE_CHECKING:
    from birthsim.commands.run import Settings

FIELDS = ("time", "position", "compliant_target", "tracking_error", "user_force")
"""What is kept of ``info``: s, m, m, m, N."""


def run(settings: "Settings") -> None:
    """Run an episode, print and draw it."""
    rig = rig_for(settings.env, settings.parameters)
    check_environment(settings.env)
    name = with_options([settings.controller], settings.set)[0]
    randomize = RANDOMIZE[settings.randomize]
    env = driven(settings.env, name, rig, sensors=settings.sensors, randomize=randomize, **settings.parts())
    folder = make_folder(settings.out)
    print(described(rig, randomize, settings.sensors))
    episode = record(env, settings.seed, FIELDS, "episode")
    # pyplot takes half a second to load.
    from baselines.figures.runs import episode_figure
    from baselines.figures.style import drawn_for

    title = f"{settings.env}, {name}, seed {settings.seed}, {settings.sensors} sensors"
    with drawn_for(settings.style), whole_results(folder) as place:
        files = [path.name for path in episode_figure(episode, title, place)]
    print("\n".join([title, "", *table(episode)]))
    if episode["lost"][-1]:
        print(f"\nlost after {episode['time'][-1]:.2f} s: a piston ran into its stop, or a chamber left its range")
    print(f"\nwritten to {folder}/: {', '.join(files)}")


def table(episode: dict[str, Array]) -> list[str]:
    """The hand's force and the error of every second, and of the whole episode."""
    size, force = 1e3 * np.linalg.norm(episode["tracking_error"], axis=1), np.linalg.norm(episode["user_force"], axis=1)
    lines = [f"{'time, s':>9}{'largest push, N':>18}{'RMS error, mm':>16}{'largest, mm':>13}"]
    seconds = np.floor(episode["time"])
    chosen = [(f"{second:.0f} to {second + 1:.0f}", seconds == second) for second in np.unique(seconds)]
    for label, rows in [*chosen, ("all", np.ones(len(size), bool))]:
        if rows.sum() > 1:
            rms = np.sqrt(np.mean(np.square(size[rows])))
            lines.append(f"{label:>9}{force[rows].max():18.1f}{rms:16.3f}{size[rows].max():13.3f}")
    return lines

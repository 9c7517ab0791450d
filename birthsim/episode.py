"""What ``birthsim run`` does: one episode, its error over time printed, its motion drawn."""

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from tqdm import tqdm

from baselines.commands.settings import RANDOMIZE
from baselines.commands.worlds import check_environment, policy_of, with_options
from baselines.registry import make_controller
from baselines.staged import NO_ACTION, driving
from birthsim_env.files import make_folder, whole_results
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import load_parameters

if TYPE_CHECKING:
    from birthsim.run import Settings

FIELDS = ("time", "position", "compliant_target", "tracking_error", "user_force")
"""What is kept of ``info``: s, m, m, m, N."""


def run(settings: "Settings") -> None:
    """Run an episode, print and draw it."""
    rig = load_parameters(settings.parameters)
    check_environment(settings.env)
    name = with_options([settings.controller], settings.set)[0]
    law = driving(make_controller(name, rig, **({"policy": policy_of(settings.env)} if name == "residual" else {})), name)
    env = gymnasium.make(
        settings.env, parameters=rig, sensors=settings.sensors, randomize=RANDOMIZE[settings.randomize],
        policy_period=rig.electronics.control_period, actuation=law, **settings.parts(),
    )  # fmt: skip
    folder = make_folder(settings.out)
    print(described(rig, RANDOMIZE[settings.randomize], settings.sensors))
    episode, lost = record(env, settings.seed)
    # pyplot takes half a second to load.
    from baselines.figures.runs import episode_figure

    title = f"{settings.env}, {name}, seed {settings.seed}, {settings.sensors} sensors"
    with whole_results(folder) as place:
        episode_figure(episode, title, place)
    print("\n".join([title, "", *table(episode)]))
    if lost:
        print(f"\nlost after {episode['time'][-1]:.2f} s: a piston ran into its stop, or a chamber left its range")
    print(f"\nwritten to {folder}/: episode.png, episode.svg")


def record(env: Any, seed: int) -> tuple[dict[str, Array], bool]:
    """``FIELDS`` of every control period of an episode, a row each, and whether it ended before its time."""
    _, info = env.reset(seed=seed)
    rows: dict[str, list[Any]] = {name: [np.copy(info[name])] for name in FIELDS}
    terminated = truncated = False
    with tqdm(total=env.get_wrapper_attr("duration"), desc="episode", unit=" s", leave=False) as bar:
        while not (terminated or truncated):
            _, _, terminated, truncated, info = env.step(NO_ACTION)
            for name, kept in rows.items():
                kept.append(np.copy(info[name]))
            if len(rows["time"]) % 500 == 0:
                bar.update(float(info["time"]) - bar.n)
    env.close()
    return {name: np.array(kept) for name, kept in rows.items()}, bool(terminated)


def table(episode: dict[str, Array]) -> list[str]:
    """The hand's force and the error of every second, and of the whole episode."""
    size, force = 1e3 * np.linalg.norm(episode["tracking_error"], axis=1), np.linalg.norm(episode["user_force"], axis=1)
    lines = [f"{'s':>9}{'hand, at most N':>18}{'error, RMS mm':>16}{'at most mm':>13}"]
    seconds = np.floor(episode["time"])
    chosen = [(f"{second:.0f} to {second + 1:.0f}", seconds == second) for second in np.unique(seconds)]
    for label, rows in [*chosen, ("all", np.ones(len(size), bool))]:
        if rows.sum() > 1:
            rms = np.sqrt(np.mean(np.square(size[rows])))
            lines.append(f"{label:>9}{force[rows].max():18.1f}{rms:16.3f}{size[rows].max():13.3f}")
    return lines

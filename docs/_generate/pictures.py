"""A moving picture of every environment under the best law, in real time."""

from pathlib import Path

import gymnasium
from PIL import Image

import birthsim_env
from baselines import make_controller
from baselines.driving import NO_ACTION, driving
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.sources import files_of
from birthsim_env.registry import names

SECONDS, EVERY = 8, 80
"""s shown of an episode, and ms from frame to frame."""


def pictures(folder: Path) -> None:
    """Write ``circle.webp`` and so on into a folder; one that is newer than the package's code is kept."""
    code = max(path.stat().st_mtime for path in files_of("birthsim_env"))
    for scenario in names("scenario"):
        file = folder / f"{scenario}.webp"
        if not file.exists() or file.stat().st_mtime < code:
            frames = _frames(environment_id(scenario))
            frames[0].save(file, save_all=True, append_images=frames[1:], duration=EVERY, loop=0, quality=60, method=4)


def _frames(name: str) -> list[Image.Image]:
    law = driving(make_controller("admittance-backstepping", birthsim_env.Parameters()), "admittance-backstepping")
    env = gymnasium.make(name, render_mode="rgb_array", picture_size=(480, 360), policy_period=1e-3, actuation=law)
    env.reset(seed=0)
    frames = []
    for k in range(1000 * SECONDS):
        _, _, terminated, truncated, _ = env.step(NO_ACTION)
        if terminated or truncated:
            break
        if k % EVERY == 0:
            frames.append(Image.fromarray(env.render()))
    env.close()
    return frames

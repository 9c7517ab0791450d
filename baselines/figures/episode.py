"""One episode as a figure: where the end effector is, how far from where it should be, and the hand's force."""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from baselines.figures.runs import DARK, MIDDLE, STYLE, save
from birthsim_env.physics.compiled.lanes import Array


def episode_figure(episode: dict[str, Array], title: str, folder: Path) -> list[Path]:
    """``episode.png`` and ``.svg`` from rows of time (s), positions and errors (m) and the hand's force (N), each (T, 2)."""
    time, millimetres = episode["time"], 1e3
    with plt.rc_context(STYLE):
        figure, (path, error, force) = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
        for name, colour, style in (("compliant_target", MIDDLE, "--"), ("position", DARK, "-")):
            path.plot(*(millimetres * episode[name].T), color=colour, ls=style, lw=1.2, label=name.replace("_", " "))
        path.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
        figure.suptitle(title, fontsize=9)
        path.legend()
        error.plot(time, millimetres * np.linalg.norm(episode["tracking_error"], axis=1), color=DARK, lw=1)
        error.set(xlabel="time (s)", ylabel="tracking error (mm)")
        for k, (axis, style) in enumerate((("x", "-"), ("y", "--"))):
            force.plot(time, episode["user_force"][:, k], color=(DARK, MIDDLE)[k], ls=style, lw=1, label=axis)
        force.set(xlabel="time (s)", ylabel="force of the hand (N)")
        force.legend()
        return save(figure, folder, "episode")

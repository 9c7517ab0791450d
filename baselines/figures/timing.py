"""The figure of how punctual a control loop was."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from baselines.figures.style import COLUMN, STYLE, look, save
from birthsim_env.physics.compiled.lanes import Array

SMALLEST = 1e-6
"""s: what is shorter is drawn as so much."""


def timing_figure(times: Mapping[str, Array], period: float, folder: Path) -> list[Path]:
    """Shares of periods in which each of some ``times`` (T,), s, was longer than a time, to files ``timing`` in a folder."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(COLUMN, 2.6), layout="constrained")
        for k, (name, values) in enumerate(times.items()):
            if len(values):
                ordered = np.sort(np.maximum(values, SMALLEST))
                share = 1.0 - np.arange(len(ordered)) / len(ordered)
                axes.step(1e3 * ordered, 100.0 * share, where="post", **look(k, markers=False), label=name)
        axes.axvline(1e3 * period, color="black", ls=(0, (1, 3)), label="control period")
        axes.set(xscale="log", yscale="log", xlabel="time (ms)", ylabel="longer than that (% of periods)")
        axes.legend()
        return save(figure, folder, "timing")

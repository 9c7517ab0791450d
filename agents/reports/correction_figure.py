"""The figure of what a residual has learned."""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from baselines.figures.style import ACCENT, COLUMN, DARK, MIDDLE, STYLE, headline, legend_below, save
from birthsim_env.physics.compiled.lanes import Array


def draw_corrections(
    weight: tuple[Array, Array], correlation: float, friction: tuple[Array, Array], folder: Path
) -> list[Path]:
    """``correction`` (PNG and SVG): what ``inspection.weight_over_workspace`` and ``friction_along_circle`` gave."""
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 2, figsize=(COLUMN, 2.9), layout="constrained")
        learned, truth = weight
        unknown, halves = friction
        for axes, values in ((panels[0], truth), (panels[1], unknown)):
            span = np.array([values.min(), values.max()])
            axes.plot(span, span, color=DARK, ls="--", label="what the controller leaves out")
        panels[0].plot(truth, learned, "^", color=MIDDLE, label="learned: weight")
        panels[0].set(xlabel=r"$m g \cos\theta_1$ (N)", ylabel="correction (N)")
        panels[0].set_title("Weight, held still,\ncylinder 2")
        for k, style in enumerate("os"):
            panels[1].plot(
                unknown[k], halves[k], style, color=(MIDDLE, ACCENT)[k], label=f"learned: friction of cylinder {k + 1}"
            )
        panels[1].set(xlabel=r"surplus of $F_c$ (N)", ylabel="out less in, halved (N)")
        panels[1].set_title("Friction,\nround a circle")
        headline(figure, f"The policy has learned the missing weight (r = {correlation:.2f}) and friction")
        legend_below(figure)
        return save(figure, folder, "correction")

"""The figure of what a residual has learned."""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

from baselines.figures.runs import ACCENT, DARK, MIDDLE, STYLE, save
from birthsim_env.physics.compiled.lanes import Array


def draw_corrections(
    weight: tuple[Array, Array], correlation: float, friction: tuple[Array, Array], folder: Path
) -> list[Path]:
    """``correction`` (PNG and SVG): what ``inspection.weight_over_workspace`` and ``friction_along_circle`` gave."""
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 2, figsize=(8, 3.4), layout="constrained")
        learned, truth = weight
        unknown, halves = friction
        for axes, values in ((panels[0], truth), (panels[1], unknown)):
            span = np.array([values.min(), values.max()])
            axes.plot(span, span, color=DARK, lw=1.0, ls="--", label="what the law leaves out")
        panels[0].plot(truth, learned, "o", color=MIDDLE, ms=3, label=f"learned, r = {correlation:.3f}")
        panels[0].set(xlabel=r"$m g \cos\theta_1$ (N)", ylabel="correction on cylinder 2 (N)")
        panels[0].set_title("(a) Weight, held still", loc="left", fontsize=9.5)
        for k, style in enumerate("os"):
            panels[1].plot(unknown[k], halves[k], style, color=(MIDDLE, ACCENT)[k], ms=3, label=f"cylinder {k + 1}")
        panels[1].set(xlabel=r"believed less true $F_c$ (N)", ylabel="correction, out less in, halved (N)")
        panels[1].set_title("(b) Friction, round a circle", loc="left", fontsize=9.5)
        for axes in panels:
            axes.legend()
        return save(figure, folder, "correction")

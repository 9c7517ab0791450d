"""Figure of a gradient through friction: how far a valve moves a piston that rested, and what the gradient says of it."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baselines.figures.style import ACCENT, COLUMN, DARK, STYLE, headline, legend_below, save

STEPS = 5
"""Of the grid of openings: how far a chord reaches on either side."""


def friction_figure(pushed: dict[str, Any], after: float, folder: Path) -> list[Path]:
    """``pushed`` has lists ``opening``, ``moved`` (m) and ``slope`` (m) after ``after`` seconds."""
    opening, moved, slope = (np.array(pushed[name]) for name in ("opening", "moved", "slope"))
    chord = (moved[2 * STEPS :] - moved[: -2 * STEPS]) / (opening[2 * STEPS :] - opening[: -2 * STEPS])
    reach = opening[STEPS] - opening[0]
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(COLUMN, 2.7), layout="constrained")
        left.plot(opening, 1e3 * moved, color=DARK, ls="--", label=f"motion, and its difference over ±{reach:.2g}")
        tangents = np.arange(STEPS, len(opening), 2 * STEPS)
        ends = np.array([[-reach], [reach]])
        left.plot(opening[tangents], 1e3 * moved[tangents], "o", color=ACCENT)
        left.plot(opening[tangents] + ends, 1e3 * (moved[tangents] + slope[tangents] * ends), color=ACCENT, lw=2)
        left.set(xlabel="valve opening (-)", ylabel="motion of piston 2 (mm)")
        right.plot(opening, 1e3 * slope, color=ACCENT, label="gradient")
        right.plot(opening[STEPS:-STEPS], 1e3 * chord, color=DARK, ls="--")
        right.set(xlabel="valve opening (-)", ylabel="slope (mm)")
        rest, most = 1e3 * slope[np.argmin(np.abs(opening))], 1e3 * slope.max()
        headline(figure, f"Friction flattens the gradient at rest: {rest:.2g} instead of {most:.2g} mm per unit of opening")
        legend_below(figure, said=f"after {1e3 * after:g} ms")
        return save(figure, folder, "gradients_friction")

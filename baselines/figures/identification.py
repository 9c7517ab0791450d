"""Figures of an identification: residuals over time and by lag, and intervals of the parameters."""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from baselines.figures.runs import ACCENT, DARK, LIGHT, LINES, MIDDLE, STYLE, legend_below, save
from baselines.identification.identified import Identified
from birthsim_env.physics.compiled.lanes import Array

CHAMBERS = ("P1", "N1", "P2", "N2")
LAGS = 40
"""Rows up to which residuals are compared with themselves."""


EVERY = 5
"""Of so many rows of pressures one is drawn."""


def residuals_figure(found: Identified, folder: Path) -> list[Path]:
    """Measured less predicted, pressures and positions, over time, and the pressures' correlation with themselves."""
    windows, problem = found.fit.problem.windows, found.fit.problem
    residual = problem.settled(found.fit.theta)[1]
    count, chambers = windows.pressures.shape[0], windows.pressures.shape[1] * 4
    pressures = residual[:, :chambers].reshape(count, -1, 4) * problem.noise.pressure
    positions = residual[:, chambers:].reshape(count, -1)[:, : windows.positions.shape[1] * 2].reshape(count, -1, 2)
    positions = positions * problem.noise.position
    period = windows.trial.period
    times = windows.trial.times[windows.starts][:, None] + period * np.arange(windows.length)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 1, figsize=(9, 8), layout="constrained")
        for k, (name, colour) in enumerate(zip(CHAMBERS, (DARK, MIDDLE, ACCENT, LIGHT), strict=True)):
            shown = times[:, ::EVERY].ravel(), pressures[:, ::EVERY, k].ravel()
            axes[0].plot(*shown, ".", ms=1.5, color=colour, label=f"chamber {name}", rasterized=True)
            lags, values = _correlation(pressures[..., k])
            axes[2].plot(1e3 * period * lags, values, color=colour, ls=LINES[k], label=f"chamber {name}")
        arrived = (windows.trial.times[windows.starts][:, None] + period * windows.arrived)[windows.valid]
        for k, (name, colour) in enumerate((("x", DARK), ("y", MIDDLE))):
            shown = arrived, 1e3 * positions[..., k][windows.valid]
            axes[1].plot(*shown, ".", ms=2, color=colour, label=f"position {name}", rasterized=True)
        axes[0].set(
            xlabel="time (s)", ylabel="pressure residual (Pa)", title=f"measured less predicted (pressures: one row in {EVERY})"
        )
        axes[1].set(xlabel="time (s)", ylabel="position residual (mm)")
        axes[2].set(xlabel="lag (ms)", ylabel="correlation of residuals (-)", ylim=(-0.3, 1.05))
        limit = 1.96 / np.sqrt(pressures[..., 0].size)
        axes[2].axhspan(-limit, limit, color="#888888", alpha=0.3, lw=0, label="white noise, 95 %")
        handles: dict[str, object] = {}
        for one in axes:
            handles.update({label: handle for handle, label in zip(*one.get_legend_handles_labels(), strict=True)})
        legend_below(figure, list(handles.values()), list(handles))
        return save(figure, folder, "residuals")


def _correlation(values: Array) -> tuple[Array, Array]:
    """Lags (L,) in rows and the correlation at each, within windows (W, K)."""
    lags = np.arange(min(LAGS, values.shape[1] - 1) + 1)
    power = float(np.mean(values**2))
    return lags, np.array([np.mean(values[:, : values.shape[1] - lag] * values[:, lag:]) / power for lag in lags])


def intervals_figure(found: Identified, folder: Path) -> list[Path]:
    """Every parameter over the owner's value, with its 95 % interval; open circles are what the log cannot tell."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(8, 0.32 * len(found.rows) + 1.2), layout="constrained")
        for place, row in enumerate(reversed(found.rows)):
            known = row.owner or row.value or 1.0  # a latency of zero is not divided by
            _interval(axes, place, row.low / known, row.value / known, row.high / known, row.determined)
        axes.axvline(1.0, color="black", lw=0.8, ls=":")
        axes.set(xscale="log", xlabel="value over the owner's (-)", yticks=range(len(found.rows)))
        axes.set_yticklabels([row.name for row in reversed(found.rows)])
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("{x:g}")
        axes.set_title("filled: from the log, with its 95 % interval; open: kept, the log cannot tell it", loc="left")
        return save(figure, folder, "intervals")


def _interval(axes: Axes, place: int, low: float, middle: float, high: float, determined: bool) -> None:
    colour = DARK if determined else MIDDLE
    axes.plot([max(low, 1e-3), high], [place, place], color=colour, lw=1.5)
    axes.plot(middle, place, "o", color=colour, mfc=colour if determined else "white", ms=5)

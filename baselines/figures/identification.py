"""Figures of an identification: residuals over time and by lag, and intervals of the parameters."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from baselines.figures.style import COLUMN, DARK, MIDDLE, STYLE, headline, legend_below, look, save
from baselines.identification.identified import Identified
from baselines.identification.log.log_columns import CHAMBERS
from birthsim_env.physics.compiled.lanes import Array

LAGS = 40
"""Rows up to which residuals are compared with themselves."""

PARTS = 24
"""Of a log, over each of which residuals are averaged."""


def residuals_figure(found: Identified, folder: Path) -> list[Path]:
    """Measured less predicted, pressures and positions, RMS over parts of the log, and how pressures correlate."""
    windows, problem = found.fit.problem.windows, found.fit.problem
    residual = problem.settled(found.fit.theta)[1]
    count, chambers = windows.pressures.shape[0], windows.pressures.shape[1] * 4
    pressures = residual[:, :chambers].reshape(count, -1, 4) * problem.noise.pressure
    positions = residual[:, chambers:].reshape(count, -1)[:, : windows.positions.shape[1] * 2].reshape(count, -1, 2)
    positions = positions[windows.valid] * problem.noise.position
    topology = windows.trial.topology
    pressures = pressures[..., list(topology.chambers)]
    period, starts = windows.trial.period, windows.trial.times[windows.starts][:, None]
    times = starts + period * np.arange(pressures.shape[1])
    arrived = (starts + period * windows.arrived)[windows.valid]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 1, figsize=(COLUMN, 5.2), layout="constrained")
        after = 0.0
        for k, chamber in enumerate(topology.chambers):
            style = {**look(chamber), "label": f"chamber {topology.name_of(CHAMBERS[chamber])}"}
            axes[0].plot(*_rms(times.ravel(), pressures[..., k].ravel()), **style)
            lags, values = _correlation(pressures[..., k])
            after = max(after, float(np.abs(values[1:]).max()))
            axes[2].plot(1e3 * period * lags, values, **style, markevery=4)
        for k, name in enumerate("xy"):
            axes[1].plot(*_rms(arrived, 1e3 * positions[:, k]), **look(k + 4), label=f"position {name}")
        for place, noise in zip(axes, (problem.noise.pressure, 1e3 * problem.noise.position), strict=False):
            place.axhline(noise, color="black", ls=(0, (1, 3)), label="sensors' noise")
            place.set(xlabel="time (s)", ylim=(0, 1.2 * place.get_ylim()[1]))
        axes[0].set(ylabel="RMS (Pa)", title="pressures, measured less predicted")
        axes[1].set(ylabel="RMS (mm)", title="positions, measured less predicted")
        axes[2].set(
            xlabel="lag (ms)", ylabel="correlation (-)", ylim=(-0.3, 1.05), title="residuals of pressures with later ones"
        )
        limit = 1.96 / np.sqrt(pressures[..., 0].size)
        axes[2].axhspan(-limit, limit, color="#888888", alpha=0.3, lw=0, label="white noise, 95 %")
        over = [
            np.sqrt(np.mean(pressures**2)) / problem.noise.pressure,
            np.sqrt(np.mean(np.sum(positions**2, axis=1)) / len(topology.cylinders)) / problem.noise.position,
        ]
        headline(
            figure,
            f"Residuals are {over[0]:.2f} (pressures) and {over[1]:.2f} (positions) times the noise, "
            f"and correlate with later ones by at most {after:.2g}",
        )
        legend_below(figure)
        return save(figure, folder, "residuals")


def _rms(times: Array, values: Array) -> tuple[Array, Array]:
    """Middle and root mean square of values (N,) in each of ``PARTS`` equal parts of the time that have some."""
    edges = np.linspace(times.min(), times.max(), PARTS + 1)
    part = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, PARTS - 1)
    size = np.bincount(part, minlength=PARTS)
    some = size > 0
    square = np.bincount(part, values**2, PARTS)[some] / size[some]
    return (edges[:-1] + edges[1:])[some] / 2, np.sqrt(square)


def _correlation(values: Array) -> tuple[Array, Array]:
    """Lags (L,) in rows and the correlation at each, within windows (W, K)."""
    lags = np.arange(min(LAGS, values.shape[1] - 1) + 1)
    power = float(np.mean(values**2))
    return lags, np.array([np.mean(values[:, : values.shape[1] - lag] * values[:, lag:]) / power for lag in lags])


def intervals_figure(found: Identified, folder: Path) -> list[Path]:
    """Every parameter over the owner's value, with its 95 % interval; open circles are what the log cannot tell."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(COLUMN, 0.2 * len(found.rows) + 1.2), layout="constrained")
        for place, row in enumerate(reversed(found.rows)):
            known = row.owner or row.value or 1.0  # a latency of zero is not divided by
            _interval(axes, place, row.low / known, row.value / known, row.high / known, row.determined)
        axes.axvline(1.0, color="black", lw=0.8, ls=":")
        axes.set(xscale="log", xlabel="value over the owner's (-)", yticks=range(len(found.rows)))
        axes.set_yticklabels([row.name for row in reversed(found.rows)])
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("{x:g}")
        told = sum(row.determined for row in found.rows)
        headline(figure, f"The log tells {told} of {len(found.rows)} parameters")
        for name, determined in (("from the log, with its 95 % interval", True), ("kept: the log cannot tell it", False)):
            axes.plot([], [], "o", **_filling(determined), label=name)
        legend_below(figure)
        return save(figure, folder, "intervals")


def _interval(axes: Axes, place: int, low: float, middle: float, high: float, determined: bool) -> None:
    style = _filling(determined)
    axes.plot([max(low, 1e-3), high], [place, place], color=style["color"], lw=1.5)
    axes.plot(middle, place, "o", **style)


def _filling(determined: bool) -> dict[str, Any]:
    return {"color": DARK, "mfc": DARK} if determined else {"color": MIDDLE, "mfc": "white"}

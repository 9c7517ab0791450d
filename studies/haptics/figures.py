"""Figures of what a hand feels: the impedance as Bode plot, energy at the port, a pull let go, maps of hands, Z-width."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.figures.runs import ACCENT, DARK, MIDDLE, STYLE, legend_below, save
from birthsim_env.physics.compiled.lanes import Array
from studies.haptics import coupled
from studies.haptics.coupled import stable_up_to
from studies.haptics.kept import PEAK
from studies.haptics.release import PULL, STIFFNESS
from studies.looks import label_of, log_ticks, look
from studies.stability.figure import stability_figure

Runs = Sequence[dict[str, Any]]

COLOURS = (DARK, MIDDLE, "#8e5ea2", "#b8860b")
"""Of the kinds of sensors."""


def haptic_figures(runs: Runs, folder: Path) -> list[Path]:
    """A figure for every subject that was measured."""
    drawn: list[Path] = []
    if "impedance" in runs[0]:
        drawn += bode_figure(runs, folder) + energy_figure(runs, folder)
    if "release" in runs[0]:
        drawn += release_figure(runs, folder)
    if "hands" in runs[0]:
        drawn += hand_figures(runs, folder)
    if "z_width" in runs[0]:
        drawn += z_width_figure(runs, folder)
    return drawn


def bode_figure(runs: Runs, folder: Path) -> list[Path]:
    """Magnitude and phase felt under multisines of ``PEAK``, median and quartiles over lanes, beside those declared."""
    laws = _laws(runs)
    with plt.rc_context(STYLE):
        figure, panels = _panels(2, len(laws))
        for column, law in enumerate(laws):
            above, below = panels[:, column]
            for colour, run in zip(COLOURS, _of(runs, law), strict=False):
                stiffness, curves = _curves(run)
                for axes, name in ((above, "magnitude"), (below, "phase")):
                    low, middle, high = _numbers(curves[name])
                    axes.fill_between(curves["frequency"], low, high, color=colour, alpha=0.2, lw=0)
                    axes.plot(curves["frequency"], middle, color=colour, label=run["sensors"])
            for axes, name in ((above, "magnitude"), (below, "phase")):
                if curves["declared"] is not None:
                    axes.plot(curves["frequency"], curves["declared"][name], color=ACCENT, ls="--", lw=2, label="declared")
                axes.set_xscale("log")
                log_ticks(axes.xaxis)
            above.set(yscale="log", ylim=(300, 3e5))
            below.set(xlabel="frequency (Hz)", ylim=(-60, 330), yticks=range(0, 271, 90))
            above.set_title(label_of(law), loc="left")
        panels[0, 0].set_ylabel("force over displacement (N/m)")
        panels[1, 0].set_ylabel("phase (degrees)")
        figure.suptitle(f"Impedance felt at {stiffness:g} N/m by a hand of {PEAK:g} N: median and quartiles", fontsize=10)
        return _finished(figure, panels[0], folder, "haptics_impedance")


def energy_figure(runs: Runs, folder: Path) -> list[Path]:
    """Energy that the worst lane has given to the hand, and the damping at the port over frequency."""
    laws = _laws(runs)
    with plt.rc_context(STYLE):
        figure, panels = _panels(2, len(laws))
        for column, law in enumerate(laws):
            above, below = panels[:, column]
            for colour, run in zip(COLOURS, _of(runs, law), strict=False):
                stiffness, curves = _curves(run)
                energy, (middle, least) = _numbers(curves["energy"]), _numbers(curves["damping"])
                above.plot(np.arange(len(energy)) * curves["energy_period"], energy, color=colour, label=run["sensors"])
                below.plot(curves["frequency"], middle, color=colour)
                below.plot(curves["frequency"], least, color=colour, ls=":")
            above.axhline(0, color="grey", lw=0.8)
            below.axhline(0, color="grey", lw=0.8)
            above.set(xlabel="time (s)")
            below.set(xscale="log", xlabel="frequency (Hz)")
            below.set_yscale("symlog", linthresh=30)
            log_ticks(below.xaxis)
            above.set_title(label_of(law), loc="left")
        panels[0, 0].set_ylabel("energy given, worst lane (J)")
        panels[1, 0].set_ylabel("port damping (N s/m)\nmedian, and dotted the least")
        figure.suptitle(f"Energy at the port, {stiffness:g} N/m, hand of {PEAK:g} N; below zero it takes", fontsize=10)
        return _finished(figure, panels[0], folder, "haptics_energy")


def release_figure(runs: Runs, folder: Path) -> list[Path]:
    """Displacement along a pull that is let go: median, and the range over lanes."""
    laws = _laws(runs)
    with plt.rc_context(STYLE):
        figure, panels = _panels(1, len(laws), height=3.6)
        for axes, law in zip(panels[0], laws, strict=True):
            for colour, run in zip(COLOURS, _of(runs, law), strict=False):
                curves = run["release"][0]["curves"]
                middle, least, largest = _numbers(curves["offset_mm"])
                axes.plot(curves["time"], middle, color=colour, label=run["sensors"])
                axes.fill_between(curves["time"], least, largest, color=colour, alpha=0.2, lw=0)
            if curves["declared"] is not None:
                axes.plot(curves["time"], curves["declared"], color=ACCENT, ls="--", lw=2, label="declared")
            axes.set(xlabel="time since the hand let go (s)")
            axes.axhline(0, color="grey", lw=0.8)
            axes.set_title(label_of(law), loc="left")
        panels[0, 0].set_ylabel("displacement along the pull (mm)")
        figure.suptitle(f"{PULL:g} N let go in 10 ms at {STIFFNESS:g} N/m: median and range", fontsize=10)
        return _finished(figure, panels[0], folder, "haptics_release")


def hand_figures(runs: Runs, folder: Path) -> list[Path]:
    """Maps over stiffness and mass of a hand without damping, a figure for each kind of sensors and a panel for each law."""
    drawn: list[Path] = []
    for sensors in dict.fromkeys(run["sensors"] for run in runs):
        variants = {label_of(run["controller"]): run["hands"][0] for run in runs if run["sensors"] == sensors}
        chart = {
            "title": f"Held at {coupled.SETPOINT:g} N/m by a hand without damping", "believed": [None, None],
            "x": {"label": "stiffness of the hand (N/m)", "values": list(coupled.STIFFNESSES), "logarithmic": True},
            "y": {"label": "mass of the hand (kg)", "values": list(coupled.MASSES), "logarithmic": False},
            "variants": variants,
        }  # fmt: skip
        drawn += stability_figure(f"hand_mass_held_{sensors}", chart, f"{sensors} sensors", folder)
    return drawn


def z_width_figure(runs: Runs, folder: Path) -> list[Path]:
    """The stiffest setpoint that is stable against every hand, over damping in units of the law's own."""
    kinds = list(dict.fromkeys(run["sensors"] for run in runs))
    with plt.rc_context(STYLE):
        figure, panels = _panels(1, len(kinds), height=3.8, width=4.2)
        for axes, sensors in zip(panels[0], kinds, strict=True):
            for k, law in enumerate(_laws(runs)):
                ((piece,),) = (run["z_width"] for run in _of(runs, law) if run["sensors"] == sensors)
                # Some laws have equal limits: a small shift keeps every marker in sight.
                limits = 1e-3 * np.array(stable_up_to(piece)) + 0.12 * k
                axes.plot(piece["factors"], limits, label=label_of(law), ms=6, **look(k))
            axes.set(xlabel="damping, times the law's own", ylim=(-0.5, 1e-3 * max(coupled.ASKED) + 1))
            axes.set_title(f"{sensors} sensors", loc="left")
        panels[0, 0].set_ylabel("stable up to (kN/m); 0: nowhere, 20: all")
        figure.suptitle(f"Z-width: stiffness that is stable against each of {len(coupled.HANDS)} hands", fontsize=10)
        return _finished(figure, panels[0], folder, "haptics_z_width")


def _panels(rows: int, columns: int, height: float = 6.0, width: float = 3.4) -> tuple[Figure, Any]:
    size = (max(5.0, width * columns + 0.6), height)
    figure, panels = plt.subplots(rows, columns, figsize=size, layout="constrained", sharey="row", squeeze=False)
    return figure, panels


def _finished(figure: Figure, labelled: Sequence[Axes], folder: Path, name: str) -> list[Path]:
    """With one legend of all labels below."""
    found: dict[str, Any] = {}
    for axes in labelled:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    legend_below(figure, list(found.values()), list(found))
    return save(figure, folder, name)


def _laws(runs: Runs) -> list[str]:
    return list(dict.fromkeys(run["controller"] for run in runs))


def _of(runs: Runs, law: str) -> list[dict[str, Any]]:
    return [run for run in runs if run["controller"] == law]


def _curves(run: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    """The setpoint at which the impedance's curves are kept, N/m, and they."""
    return next((piece["stiffness"], piece["curves"]) for piece in run["impedance"] if "curves" in piece)


def _numbers(values: Any) -> Array:
    """JSON's null is NaN."""
    return np.array(values, dtype=np.float64)

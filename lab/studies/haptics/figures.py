"""Figures of what a hand feels: the impedance as Bode plot, energy at the port, a pull let go, maps of hands, Z-width."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from baselines.figures.style import (
    ACCENT,
    COLOURS,
    COLUMN,
    LINES,
    PAGE,
    STYLE,
    headline,
    label_of,
    legend_below,
    log_ticks,
    look,
    save,
)
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.haptics import coupled
from lab.studies.haptics.kept import PEAK
from lab.studies.haptics.release import PULL, STIFFNESS
from lab.studies.stability.figure import stability_figure

Runs = Sequence[dict[str, Any]]

LINE_STYLES = tuple({"color": COLOURS[k], "ls": LINES[j]} for k, j in ((0, 0), (1, 2), (5, 3), (4, 0)))
"""Of the kinds of sensors."""


SEEN = 1e-3
"""mm: smaller motions are drawn as that."""


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
    laws, off = _laws(runs), dict[str, float]()
    with plt.rc_context(STYLE):
        figure, panels = _panels(2, len(laws))
        for column, law in enumerate(laws):
            above, below = panels[:, column]
            for style, run in zip(LINE_STYLES, _of(runs, law), strict=False):
                stiffness, curves = _curves(run)
                for axes, name in ((above, "magnitude"), (below, "phase")):
                    low, middle, high = _numbers(curves[name])
                    axes.fill_between(curves["frequency"], low, high, color=style["color"], alpha=0.2, lw=0)
                    axes.plot(curves["frequency"], middle, **style, label=f"{run['sensors']} sensors")
                    if name == "magnitude" and curves["declared"] is not None:
                        ratio = np.exp(np.nanmean(np.abs(np.log(middle / _numbers(curves["declared"][name])))))
                        off[law] = max(off.get(law, 1.0), float(ratio))
            for axes, name in ((above, "magnitude"), (below, "phase")):
                if curves["declared"] is not None:
                    axes.plot(curves["frequency"], curves["declared"][name], color=ACCENT, ls="--", lw=1.6, label="declared")
                axes.set_xscale("log")
                log_ticks(axes.xaxis, 1.0, 3.0)
            above.set(yscale="log", ylim=(300, 3e5))
            below.set(xlabel="frequency (Hz)", ylim=(-60, 330), yticks=range(0, 271, 90))
            above.set_title(label_of(law))
        panels[0, 0].set_ylabel("force over displacement (N/m)")
        panels[1, 0].set_ylabel("phase (degrees)")
        if off:
            best = min(off, key=off.__getitem__)
            headline(figure, f"{label_of(best)} feels most as declared: within a factor of {off[best]:.2g} on average")
        legend_below(figure, said=f"{stiffness:g} N/m, hand of {PEAK:g} N: median and quartiles")
        return save(figure, folder, "haptics_impedance")


def energy_figure(runs: Runs, folder: Path) -> list[Path]:
    """Energy that the worst lane has given to the hand, and the damping at the port over frequency."""
    laws, most = _laws(runs), dict[str, float]()
    with plt.rc_context(STYLE):
        figure, panels = _panels(2, len(laws))
        for column, law in enumerate(laws):
            above, below = panels[:, column]
            for style, run in zip(LINE_STYLES, _of(runs, law), strict=False):
                stiffness, curves = _curves(run)
                energy, (middle, least) = _numbers(curves["energy"]), _numbers(curves["damping"])
                above.plot(np.arange(len(energy)) * curves["energy_period"], energy, **style, label=f"{run['sensors']} sensors")
                below.plot(curves["frequency"], middle, **style)
                below.plot(curves["frequency"], least, **style, lw=0.6)
                most[f"{label_of(law)} with {run['sensors']} sensors"] = float(energy[-1])
            above.axhline(0, color="black", lw=0.6)
            below.axhline(0, color="black", lw=0.6)
            above.set(xlabel="time (s)")
            below.set(xscale="log", xlabel="frequency (Hz)")
            below.set_yscale("symlog", linthresh=30)
            below.set_yticks([-1000, -100, 0, 100, 1000])
            log_ticks(below.xaxis, 1.0, 3.0)
            above.set_title(label_of(law))
        panels[0, 0].set_ylabel("energy given, worst lane (J)")
        panels[1, 0].set_ylabel("port damping (N s/m)")
        name = max(most, key=most.__getitem__)
        finding = (
            f"{name} has given the hand {most[name]:.2g} J" if most[name] > 0 else "Every controller takes energy from the hand"
        )
        headline(figure, f"{finding} in the end")
        legend_below(figure, said=f"{stiffness:g} N/m, hand of {PEAK:g} N; damping: median, and thin the least of the lanes")
        return save(figure, folder, "haptics_energy")


def release_figure(runs: Runs, folder: Path) -> list[Path]:
    """Displacement along a pull that is let go: median, and the range over lanes."""
    laws, beyond = _laws(runs), dict[str, float]()
    with plt.rc_context(STYLE):
        figure, panels = _panels(1, len(laws), height=2.6)
        for axes, law in zip(panels[0], laws, strict=True):
            for style, run in zip(LINE_STYLES, _of(runs, law), strict=False):
                curves = run["release"][0]["curves"]
                middle, least, largest = _numbers(curves["offset_mm"])
                axes.plot(curves["time"], middle, **style, label=f"{run['sensors']} sensors")
                axes.fill_between(curves["time"], least, largest, color=style["color"], alpha=0.2, lw=0)
                beyond[law] = max(beyond.get(law, 0.0), -float(np.nanmin(middle)))
            if curves["declared"] is not None:
                axes.plot(curves["time"], curves["declared"], color=ACCENT, ls="--", lw=1.6, label="declared")
            axes.set(xlabel="time since release (s)")
            axes.axhline(0, color="black", lw=0.6)
            axes.set_title(label_of(law))
        panels[0, 0].set_ylabel("displacement (mm)")
        best, worst = min(beyond, key=beyond.__getitem__), max(beyond, key=beyond.__getitem__)
        headline(
            figure,
            f"Let go, {label_of(best)} overshoots by {beyond[best]:.2g} mm and {label_of(worst)} by {beyond[worst]:.2g} mm",
        )
        legend_below(figure, said=f"{PULL:g} N let go in 10 ms at {STIFFNESS:g} N/m: median and range")
        return save(figure, folder, "haptics_release")


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
    """Motion that the worst hand leaves, over the setpoint, with the damping that makes most setpoints stable."""
    kinds, asked, always = list(dict.fromkeys(run["sensors"] for run in runs)), 1e-3 * np.array(coupled.ASKED), list[str]()
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(
            len(kinds), 1, figsize=(COLUMN, 1.7 * len(kinds) + 1.2), layout="constrained", sharex=True, squeeze=False
        )
        for axes, sensors in zip(panels[:, 0], kinds, strict=True):
            for k, law in enumerate(_laws(runs)):
                ((piece,),) = (run["z_width"] for run in _of(runs, law) if run["sensors"] == sensors)
                motion, stable = np.maximum(_numbers(piece["motion_mm"]), SEEN), np.array(piece["stable"]) == True  # noqa: E712 - refused: None
                best = max(range(len(stable)), key=lambda row: (stable[row].sum(), -np.nansum(motion[row])))
                axes.plot(asked, motion[best], **look(k), mfc="white", label=label_of(law))
                axes.plot(asked[stable[best]], motion[best][stable[best]], **look(k) | {"linestyle": ""})
                always += [f"{label_of(law)} with {sensors} sensors"] * bool(stable[best].all())
            axes.set(xscale="log", yscale="log", ylabel="motion that remains (mm)", title=f"{sensors} sensors")
            axes.set_xticks(asked, [f"{value:g}" for value in asked], minor=False)
            axes.minorticks_off()
            log_ticks(axes.yaxis, 1.0)
        panels[-1, 0].set_xlabel("stiffness setpoint (kN/m)")
        headline(figure, f"Stable at every stiffness, against every hand: {', '.join(always) or 'no controller'}")
        legend_below(figure, said=f"worst of {len(coupled.HANDS)} hands, best damping; filled: stable")
        return save(figure, folder, "haptics_z_width")


def _panels(rows: int, columns: int, height: float = 4.0) -> tuple[Figure, Any]:
    size = (PAGE if columns > 2 else COLUMN, height)
    figure, panels = plt.subplots(rows, columns, figsize=size, layout="constrained", sharey="row", squeeze=False)
    return figure, panels


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

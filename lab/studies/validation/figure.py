"""Pictures of measured data beside what the package makes of them."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baselines.figures.style import COLUMN, MARKERS, STYLE, headline, legend_below, look, save
from baselines.identification.valve_table import parts_of
from lab.studies.validation.seals import BARS
from lab.studies.validation.tubes import FITTED


def validation_figure(found: dict[str, Any], folder: Path) -> list[Path]:
    """A picture a subject."""
    drawn = {"seals": _seals, "valve": _valve, "tubes": _tubes}
    return [path for subject in found for path in drawn[subject](found[subject], folder)]


def _seals(found: dict[str, Any], folder: Path) -> list[Path]:
    """Measured levels, and the line of each seal's F0 + k p with what Stribeck and viscous friction add at 10 mm/s."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(COLUMN, 2.6), layout="constrained")
        bars, speed = np.array([0.0, max(BARS)]), 0.01
        for k, (seal, one) in enumerate(found.items()):
            style = look(k)
            own = one["models"]["LuGre"]["parameters"]
            rise = 1 + (own["static_ratio"] - 1) / (1 + (speed / own["stribeck_speed"]) ** 2)
            line = (own["f0"] + own["per_bar"] * bars) * rise + own["viscous"] * speed
            axes.plot(bars, line, color=style["color"], linestyle=style["linestyle"])
            axes.plot(BARS, one["levels"], color=style["color"], marker=MARKERS[k], linestyle="", label=f"{seal}, measured")
        axes.set(xlabel="gauge pressure (bar)", ylabel="friction of sliding (N)", xlim=(0, None), ylim=(0, None))
        headline(figure, "Friction of a 25 mm piston grows with the pressure on its seal; lines: F0 + k p, fitted")
        legend_below(figure)
        return save(figure, folder, "validation_seals")


def _valve(found: dict[str, Any], folder: Path) -> list[Path]:
    """The catalogue's curve, the fitted characteristic and a linear one."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(COLUMN, 2.6), layout="constrained")
        openings = np.linspace(0, 1, 201)
        fitted = parts_of(openings, found["overlap"], found["curvature"], found["share"])
        axes.plot(openings, openings, **look(2, markers=False), label="linear")
        axes.plot(openings, fitted, **look(1, markers=False), label="overlap and curvature")
        axes.plot(found["openings"], found["catalogue"], **{**look(0), "linestyle": ""}, label="catalogue, ±10 %")
        axes.set(xlabel="opening of the spool (-)", ylabel="relative flow (-)", xlim=(0, 1), ylim=(0, None))
        headline(
            figure,
            f"Two numbers meet the catalogue's curve of an MPYE-5-M5-010-B within {100 * found['largest']:.1f} % of full flow; "
            f"a linear one errs by {100 * found['linear']:.0f} %",
        )
        legend_below(figure)
        return save(figure, folder, "validation_valve")


def _tubes(found: dict[str, Any], folder: Path) -> list[Path]:
    """Errors by length, those of tubes that were fitted apart."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(COLUMN, 2.4), layout="constrained")
        for k, (words, fitted) in enumerate((("fitted", True), ("foretold", False))):
            chosen = {int(length): value for length, value in found["by_length"].items() if (int(length) in FITTED) == fitted}
            axes.bar(list(chosen), list(chosen.values()), color=look(k)["color"], width=0.6, label=words)
        axes.set(xlabel="length of the tube (m)", ylabel="error (bar RMS)", xticks=[int(one) for one in found["by_length"]])
        headline(
            figure, f"Pressures at both ends of tubes that were not fitted are foretold within {found['foretold']:.2f} bar RMS"
        )
        legend_below(figure)
        return save(figure, folder, "validation_tubes")

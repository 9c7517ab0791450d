"""Figures of the studies: what the stiffness that a hand feels depends on, controller by controller."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.bench.statistics import number
from baselines.figures.style import (
    COLUMN,
    DARK,
    LIGHT,
    MIDDLE,
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

Study = Mapping[str, dict[str, Any]]
"""Label of a controller -> its result, as ``lab.studies.comparison.stiffness`` returns it."""

ELLIPSE_SCALE = 9e-6
"""m of the picture's workspace per N/m of a stiffness ellipse."""

EXACT = 1.0
"""%: an error of the stiffness that counts as none."""

STILL = 0.1
"""mm: a span of motion that counts as none."""

LEAST_HUNTING = 1e-4
"""mm; less is drawn as that, since nobody could measure it."""


def draw_studies(studies: Mapping[str, Study], folder: Path) -> list[Path]:
    """The figures of what ``studies`` (name -> label -> result) holds; returns the files written."""
    drawings: dict[str, Sequence[Callable[[Study, Path], list[Path]]]] = {
        "stiffness": (stiffness_figure, hunting_figure),
        "disturbance": (disturbance_figure,),
        "polar": (polar_figure,),
        "ellipses": (ellipse_figure,),
    }
    with plt.rc_context(STYLE):
        return [path for name, study in studies.items() for draw in drawings[name] for path in draw(study, folder)]


def _numbers(values: Any) -> Array:
    """JSON's nested lists as an array, NaN where a case was lost."""
    return np.array(values, dtype=np.float64)


def _spread(values: Array) -> tuple[Array, Array, Array]:
    """Least, median and largest of every row (rows, cases); NaN in rows that are lost altogether."""
    ordered = np.full((3, len(values)), np.nan)
    for row, cases in enumerate(values):
        said = cases[~np.isnan(cases)]
        if said.size:
            ordered[:, row] = said.min(), np.median(said), said.max()
    return ordered[0], ordered[1], ordered[2]


def _label(name: str, values: Array) -> str:
    lost = int(np.isnan(values).sum())
    return f"{label_of(name)} ({lost} of {values.size} lost)" if lost else label_of(name)


def stiffness_figure(study: Study, folder: Path) -> list[Path]:
    """Rendered against asked-for stiffness: a row per controller, a mark per setpoint, median and range over poses, axes and
    forces."""
    figure, axes = plt.subplots(figsize=(PAGE, 1.2 + 0.24 * len(study)), layout="constrained")
    within, labels = 0, []
    setpoints = list(dict.fromkeys(setpoint for result in study.values() for setpoint in result["setpoints"]))
    for row, (name, result) in enumerate(study.items()):
        errors = _numbers(result["error_percent"])
        within += bool(np.abs(_spread(errors)[1]).max() <= EXACT)
        labels.append(_label(name, errors))
        for setpoint, low, middle, high in zip(result["setpoints"], *_spread(errors), strict=True):
            k = setpoints.index(setpoint)
            place, style = row + 0.7 * ((k + 0.5) / len(setpoints) - 0.5), {**look(k), "linestyle": ""}
            axes.hlines(place, low, high, color=style["color"], lw=0.8)
            axes.plot(middle, place, **style, ms=3, label=f"{setpoint:g} N/m")
        if row:
            axes.axhline(row - 0.5, color="black", alpha=0.15, lw=0.6)
    axes.set_xscale("symlog", linthresh=1.0, linscale=0.6)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:+g}".replace("-", "−") if value else "0")
    axes.axvline(0, color="black", lw=0.8)
    axes.set_xlabel("error of the stiffness (%)")
    axes.set_yticks(range(len(study)), labels)
    axes.set_ylim(len(study) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    headline(figure, f"{within} of {len(study)} controllers render stiffness to {EXACT:g} % (medians)")
    legend_below(figure, said="stiffness setpoint: median and range over poses, axes and forces")
    return save(figure, folder, "rendered_stiffness")


def hunting_figure(study: Study, folder: Path) -> list[Path]:
    """Peak-to-peak motion at rest and in the hold: a box per controller over the cases of the stiffness study."""
    figure, axes = plt.subplots(figsize=(PAGE, 1.3 + 0.2 * len(study)), layout="constrained")
    labels, cases = [], []
    for name, result in study.items():
        hunting = _numbers(result["hunting_mm"]).ravel()
        labels.append(_label(name, hunting))
        cases.append(np.maximum(hunting[~np.isnan(hunting)], LEAST_HUNTING))
    axes.boxplot(
        cases,
        orientation="horizontal",
        whis=(0, 100),
        widths=0.6,
        patch_artist=True,
        tick_labels=labels,
        boxprops={"facecolor": LIGHT, "edgecolor": DARK},
        medianprops={"color": MIDDLE, "lw": 1.6},
    )
    axes.set(xscale="log")
    axes.set_xlabel("motion in 1 s (mm)")
    log_ticks(axes.xaxis, 1.0)
    axes.invert_yaxis()
    still = sum(bool(some.size) and np.median(some) <= STILL for some in cases)
    headline(figure, f"{still} of {len(study)} controllers rest within {STILL:g} mm (medians)")
    figure.supxlabel("quartiles and range over setpoints, poses, axes, forces", fontsize=plt.rcParams["xtick.labelsize"])
    return save(figure, folder, "hunting")


def disturbance_figure(study: Study, folder: Path) -> list[Path]:
    """Error in % of the displacement asked for, over the size of the push: the law with and without weight compensation."""
    frictions = list(dict.fromkeys(label.rpartition(", ")[2] for label in study))
    figure, panels = plt.subplots(1, len(frictions), figsize=(COLUMN, 3.0), layout="constrained", sharey=True, squeeze=False)
    largest = dict[str, float]()
    for axes, friction in zip(panels[0], sorted(frictions), strict=True):
        lost = 0
        for k, (label, result) in enumerate(item for item in study.items() if item[0].endswith(friction)):
            errors = _numbers(result["error_percent"])
            low, middle, high = (np.maximum(line, 1e-3) for line in _spread(errors))
            axes.plot(result["amplitudes"], middle, **look(k), label=label.rpartition(", ")[0])
            largest[label] = float(np.nanmax(middle))
            axes.fill_between(result["amplitudes"], low, high, color=look(k)["color"], alpha=0.15, lw=0)
            lost += int(np.isnan(errors).sum())
        ticks = result["amplitudes"]
        axes.set(xscale="log", yscale="log", xlabel="push (N)")
        axes.set_xticks(ticks[::2], [f"{tick:g}" for tick in ticks[::2]])
        axes.set_xticks([], minor=True)
        log_ticks(axes.yaxis, 1.0)
        axes.set_title(f"{friction[0].upper()}{friction[1:]}" + (f", {lost} cases lost" if lost else ""))
    panels[0, 0].set_ylabel("error (% of the displacement)")
    best = min(largest, key=largest.__getitem__)
    headline(
        figure, f"{best}: error of {number(largest[best])} % at most (median), others up to {number(max(largest.values()))} %"
    )
    legend_below(figure, said="median and range over poses and axes")
    return save(figure, folder, "disturbances")


def _panels(count: int, height: float, **options: Any) -> tuple[Figure, Iterator[Axes]]:
    """A figure of at least ``count`` panels, at most four beside each other, and these panels; as few as can be are blank."""
    columns = min(count, 4) if count < 5 else min((4, 3), key=lambda across: -count % across)
    rows = math.ceil(count / columns)
    size = (PAGE if columns > 2 else COLUMN, height * rows + 0.9)
    figure, panels = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)
    for axes in panels.flat[count:]:
        axes.set_visible(False)
    if "sharex" in options:
        # Numbers below the lowest panel of every column, which need not stand in the last row.
        for k, axes in enumerate(panels.flat[:count]):
            axes.tick_params(labelbottom=k + columns >= count)
    return figure, iter(panels.flat[:count])


LONGEST = 24
"""Letters of a name that fit above the narrowest panel."""


def _title(axes: Axes, name: str, said: str) -> None:
    """Above a panel; a long name takes two lines, broken at the hyphen nearest to its middle."""
    label = label_of(name)
    if len(label) > LONGEST:
        hyphens = [k + 1 for k, letter in enumerate(label) if letter == "-"]
        middle = min(hyphens, key=lambda k: abs(k - len(label) / 2))
        label = f"{label[:middle]}\n{label[middle:]}"
    axes.set_title(f"{label}\n{said}", loc="center")


def polar_figure(study: Study, folder: Path) -> list[Path]:
    """Rendered stiffness over the direction of the push, a panel per controller: median and range over poses."""
    figure, panels = _panels(len(study), 1.9, subplot_kw={"projection": "polar"})
    setpoint, alike = next(iter(study.values()))["setpoint"], 0
    for axes, (name, result) in zip(panels, study.items(), strict=True):
        rendered = _numbers(result["stiffness"])
        closed = [np.append(line, line[0]) for line in (np.array(result["angles"]), *_spread(rendered))]
        angles, low, middle, high = closed
        axes.fill_between(angles, low, high, color=LIGHT, alpha=0.5, lw=0, label="range")
        axes.plot(angles, middle, color=DARK, label="median over poses")
        axes.plot(np.linspace(0, 2 * np.pi, 200), np.full(200, setpoint), color=MIDDLE, ls="--", lw=1, label="setpoint")
        axes.set_ylim(0, 2 * setpoint)
        axes.set_yticks([setpoint / 2, setpoint, 1.5 * setpoint], [])
        axes.set_xticks(np.arange(4) * np.pi / 2, ["$x$", "$y$", "$-x$", "$-y$"])
        axes.tick_params(pad=-2)
        _title(axes, name, _range(rendered))
        round_off = float(np.abs(middle / setpoint - 1).max())
        alike += 100 * round_off <= EXACT
    headline(figure, f"{alike} of {len(study)} controllers are as stiff as asked for in every direction, to {EXACT:g} %")
    legend_below(figure, said=f"rendered stiffness over the direction of the push; rings {setpoint / 2:g} N/m apart")
    return save(figure, folder, "stiffness_by_direction")


def _percent(fraction: float) -> str:
    """Three digits; less than a hundredth of a percent cannot be seen."""
    return f"{100 * fraction:.3g} %" if fraction >= 1e-4 else "< 0.01 %"


def _range(rendered: Array) -> str:
    lost = int(np.isnan(rendered).sum())
    if lost == rendered.size:
        return "all lost"
    text = f"{np.nanmedian(rendered):.0f}, {np.nanmin(rendered):.0f} to {np.nanmax(rendered):.0f} N/m"
    return text + (f"; {lost} of {rendered.size} lost" if lost else "")


def ellipse_figure(study: Study, folder: Path) -> list[Path]:
    """Ellipses of rendered stiffness (the force that a unit displacement costs) at poses over the workspace."""
    figure, panels = _panels(len(study), 1.5, sharex=True, sharey=True)
    turn = np.linspace(0, 2 * np.pi, 100)
    circle, alike = np.stack([np.cos(turn), np.sin(turn)]), 0
    for k, (axes, (name, result)) in enumerate(zip(panels, study.items(), strict=True)):
        wanted = _numbers(result["setpoint"])
        for pose, matrix in zip(result["poses"], result["stiffness"], strict=True):
            centre = 1e3 * np.array(pose)[:, None]
            if matrix is None:
                axes.plot(*centre, color=DARK, marker="x", ls="", label="lost")
            else:
                # A spring's matrix is symmetric; what is not is no stiffness, and is left out of the ellipse.
                given = (_numbers(matrix) + _numbers(matrix).T) / 2
                axes.plot(*(centre + 1e3 * ELLIPSE_SCALE * given @ circle), color=LIGHT, lw=2, label="rendered")
            axes.plot(*(centre + 1e3 * ELLIPSE_SCALE * wanted @ circle), color=DARK, ls="--", lw=0.8, label="setpoint")
        off = [np.linalg.norm(_numbers(m) - wanted) / np.linalg.norm(wanted) for m in result["stiffness"] if m is not None]
        worst = f"off by {_percent(float(np.median(off)))}; {_percent(float(max(off)))}" if off else "all lost"
        alike += bool(off) and 100 * float(np.median(off)) <= EXACT
        _title(axes, name, worst)
        axes.set_aspect("equal")
        axes.set(xlim=(355, 645), ylim=(-130, 95))
        if k == 0:
            axes.plot([365, 365 + 1e6 * ELLIPSE_SCALE], [-124, -124], color="black", lw=2)
            axes.text(370 + 1e6 * ELLIPSE_SCALE, -125, "1000 N/m", fontsize=plt.rcParams["xtick.labelsize"], va="center")
    figure.supylabel("y (mm), below x (mm)", fontsize=plt.rcParams["font.size"])
    (kx, kxy), (_, ky) = wanted
    headline(figure, f"{alike} of {len(study)} controllers render the stiffness matrix to {EXACT:g} % (medians)")
    legend_below(
        figure,
        said=f"[[{kx:g}, {kxy:g}], [{kxy:g}, {ky:g}]] N/m; off by: difference over setpoint (norms), median; worst",
    )
    return save(figure, folder, "stiffness_ellipses")

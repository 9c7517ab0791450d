"""Figure of the frequency responses: magnitude above phase, a column for every pair of input and output."""

from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt

from baselines.figures.style import ACCENT, DARK, LINES, PAGE, STYLE, headline, legend_below, log_ticks, save
from lab.studies.responses.study import CURVES, DRAWN, FREQUENCY

LINE_STYLES = {
    ("sliding", "low"): {"color": DARK, "ls": LINES[0]}, ("stuck", "low"): {"color": DARK, "ls": LINES[1]},
    ("sliding", "high"): {"color": ACCENT, "ls": LINES[2]}, ("stuck", "high"): {"color": ACCENT, "ls": LINES[3]},
}  # fmt: skip


def responses_figure(figures: dict[str, Any], folder: Path) -> list[Path]:
    """``figures`` has what ``measure`` found, by the name of the curve."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, len(figures), figsize=(PAGE, 3.8), sharex=True, layout="constrained")
        for (above, below), (title, curves) in zip(axes.T, figures.items(), strict=True):
            for one in curves:
                style = LINE_STYLES[one["friction"], one["stiffness"]]
                label = f"{one['friction']} pistons, {one['stiffness']} stiffness"
                above.loglog(FREQUENCY[::DRAWN], one["magnitude"], label=label, **style)
                below.semilogx(FREQUENCY[::DRAWN], one["phase"], **style)
            above.set(title=f"{title} ({CURVES[title][0]})".replace(" to ", "\nto "))
            above.minorticks_off()
            below.set(xlabel="frequency (Hz)")
            log_ticks(below.xaxis, 1.0)
        axes[0, 0].set_ylabel("magnitude")
        axes[1, 0].set_ylabel("phase (degrees)")
        size = {one["friction"]: one["size"] for one in figures["hand Fx to x"] if one["stiffness"] == "low"}
        headline(
            figure, f"At 0.5 Hz a hand moves stuck pistons {size['sliding'] / size['stuck']:.2g} times less than sliding ones"
        )
        legend_below(figure)
        return save(figure, folder, "frequency_responses")

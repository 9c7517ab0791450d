"""Frequency responses of the rig with shut valves: from hand and valves to position, and from valves to stiffness.

    python examples/frequency_responses.py --out out/frequency

Sliding and stuck pistons at a low and a high pneumatic stiffness. Prints, for every curve, its resonance and bandwidth.
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from birthsim_env import balanced_pressures, linearize

FREQUENCY = np.geomspace(0.05, 200, 2000)
"""Hz."""

REFERENCE = 0.5
"""Hz: slow enough for the air to act as a spring, quick enough for leakage to have no time."""

STIFFNESS = {"low": (3500.0, 1900.0), "high": (5200.0, 2700.0)}
"""N/m of the cylinders, as (9) counts it."""

CURVES = {
    "hand Fx to x": ("mm/N", 1e3, "x", {"Fx": 1.0}, False),
    "hand Fy to y": ("mm/N", 1e3, "y", {"Fy": 1.0}, False),
    "valves 2, opposed, to x": ("mm/%", 10.0, "x", {"u2P": 1.0, "u2N": -1.0}, True),
    "valves 2, together, to K2": ("N/mm/%", 1e-5, "K2", {"u2P": 1.0, "u2N": 1.0}, True),
}
"""Unit, factor from SI, output, how the inputs move, and whether the rig integrates: the table is then of the output's rate."""


def response(model, output, inputs):
    """Complex response of an output to inputs that move together, (F,), SI."""
    row = [signal.name for signal in model.outputs].index(output)
    weights = np.array([inputs.get(signal.name, 0.0) for signal in model.inputs])
    return (model.frequency_response(FREQUENCY) @ weights)[:, row]


def resonance(answer):
    """Frequency (Hz) and height of the largest peak, relative to ``REFERENCE``; None where none is 20 % above it.

    Air that turns from isothermal to adiabatic stiffens without resonance; that alone is a hump of a tenth.
    """
    size = np.abs(answer) / np.abs(answer[np.searchsorted(FREQUENCY, REFERENCE)])
    best = int(np.argmax(np.where(FREQUENCY > REFERENCE, size, 0.0)))
    return (FREQUENCY[best], size[best]) if size[best] > 1.2 else None


def bandwidth(answer):
    """Last frequency, Hz, up to which the answer stays above 0.71 of its size at ``REFERENCE``."""
    start = np.searchsorted(FREQUENCY, REFERENCE)
    below = np.flatnonzero(np.abs(answer[start:]) < np.sqrt(0.5) * np.abs(answer[start]))
    return FREQUENCY[start + below[0]] if len(below) else FREQUENCY[-1]


def draw(pose, out):
    figure, axes = plt.subplots(2, len(CURVES), figsize=(16, 6.5), sharex=True, layout="constrained")
    print(
        "| response | pistons | stiffness | at 0.5 Hz | resonance, Hz | peak | bandwidth, Hz |\n|---|---|---|---|---|---|---|"
    )
    for column, (title, (unit, factor, output, inputs, integrates)) in zip(axes.T, CURVES.items(), strict=True):
        for friction, line in (("sliding", "-"), ("stuck", "--")):
            for colour, (name, stiffness) in zip(("tab:blue", "tab:red"), STIFFNESS.items(), strict=True):
                model = linearize(None, pose, balanced_pressures(None, pose, stiffness), friction=friction)
                answer = factor * response(model, output, inputs)
                column[0].loglog(FREQUENCY, np.abs(answer), line, color=colour, label=f"{friction}, {name}")
                column[1].semilogx(FREQUENCY, np.degrees(np.unwrap(np.angle(answer))), line, color=colour)
                told = 2 * np.pi * FREQUENCY * answer if integrates else answer
                size = f"{np.abs(told[np.searchsorted(FREQUENCY, REFERENCE)]):.3g} {unit}{'/s' if integrates else ''}"
                peak = "{:.3g} | {:.2f}".format(*found) if (found := resonance(told)) else "none | "
                print(f"| {title} | {friction} | {name} | {size} | {peak} | {bandwidth(told):.3g} |")
        column[0].set(title=title, ylabel=unit)
        column[1].set(xlabel="Hz", ylabel="degrees")
        for axis in column:
            axis.grid(alpha=0.3)
    axes[0, 0].legend()
    out.mkdir(parents=True, exist_ok=True)
    figure.savefig(out / "frequency_responses.png", dpi=90)
    plt.close(figure)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pose", type=float, nargs=2, default=(0.5, 0.0), help="end effector x, y, m")
    parser.add_argument("--out", type=Path, default=Path("out/frequency"))
    arguments = parser.parse_args()
    draw(arguments.pose, arguments.out)

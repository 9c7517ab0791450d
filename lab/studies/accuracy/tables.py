"""Markdown tables of what ``accuracy`` has measured."""

from typing import Any

import numpy as np

from lab.engine.tables import digits
from lab.studies.accuracy.errors import EVALUATIONS, SHIPPED


def tables(found: dict[str, Any]) -> str:
    """Errors by method and step, by adaptive method and tolerance, by friction law, and observed orders."""
    parts = [by_step(found, name) for name in found["motions"]]
    return "\n\n".join([*parts, adaptive(found), laws(found), orders(found)])


def by_step(found: dict[str, Any], motion: str) -> str:
    """Median and largest error over the rigs that met no end stop, a row per method and step."""
    measured = found["motions"][motion]
    clear = np.array(measured["clear_of_stops"])
    lines = [
        f'Motion "{motion}", {clear.sum()} of {len(clear)} rigs (the others met an end stop, which the reference has not):',
        "",
        "| method | step, ms | evaluations per ms | position, um: median | position, um: largest "
        "| pressure, ppm: median | pressure, ppm: largest |",
        "|---|---|---|---|---|---|---|",
    ]
    for method, values in measured["methods"].items():
        for k, step in enumerate(found["steps_s"]):
            position = 1e6 * _row(values["position_m"][k], clear)
            pressure = 1e6 * _row(values["pressure_relative"][k], clear)
            shipped = method == SHIPPED and step == found["present_step_s"]
            cells = [
                f"{method}, the plant's" if shipped else method, f"{1e3 * step:.3g}", f"{1e-3 * EVALUATIONS[method] / step:g}",
                *(number(v) for v in (np.median(position), position.max(), np.median(pressure), pressure.max())),
            ]  # fmt: skip
            lines.append("| " + " | ".join(f"**{cell}**" if shipped else cell for cell in cells) + " |")
    return "\n".join(lines)


def worst(found: dict[str, Any], motion: str) -> tuple[float, float, str]:
    """Largest position error (m), largest pressure error (relative) of the plant as it is, and the rig of the first."""
    measured = found["motions"][motion]
    k, clear = found["steps_s"].index(found["present_step_s"]), np.array(measured["clear_of_stops"])
    position = np.where(clear, _row(measured["methods"][SHIPPED]["position_m"][k]), -1.0)
    pressure = _row(measured["methods"][SHIPPED]["pressure_relative"][k], clear)
    return float(position.max()), float(pressure.max()), str(found["rigs"][int(position.argmax())])


def adaptive(found: dict[str, Any]) -> str:
    """Errors of adaptive methods on the first rig, a row per method and tolerance."""
    names = list(found["motions"])
    heads = [f"{name}: evaluations per ms | {name}: position, um | {name}: pressure, ppm" for name in names]
    lines = [
        f"Adaptive methods of SciPy's on the {found['rigs'][0]} rig, started anew at every change of the inputs:", "",
        f"| method | relative tolerance | {' | '.join(heads)} |", "|---|---|" + "---|---|---|" * len(names),
    ]  # fmt: skip
    for rows in zip(*(found["motions"][name]["adaptive"] for name in names), strict=True):
        cells = [rows[0]["method"], f"{rows[0]['tolerance']:.0e}"]
        for row in rows:
            position = 1e6 * row["position_m"] if row["position_m"] is not None else np.inf
            cells += [f"{row['evaluations_per_ms']:.1f}", number(position), number(_ppm(row["pressure_relative"]))]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def laws(found: dict[str, Any]) -> str:
    """Errors of the plant as it is by friction law, on the first rig."""
    lines = [
        f"The plant as it is on the {found['rigs'][0]} rig, by friction law:", "",
        "| friction law | motion | position, um | pressure, ppm |", "|---|---|---|---|",
    ]  # fmt: skip
    for law, motions in found["laws"].items():
        for motion, row in motions.items():
            position = 1e6 * row["position_m"] if row["position_m"] is not None else np.inf
            lines.append(f"| {law} | {motion} | {number(position)} | {number(_ppm(row['pressure_relative']))} |")
    return "\n".join(lines)


def orders(found: dict[str, Any]) -> str:
    """Observed orders of convergence, a row per method."""
    smooth = found["smooth"]
    lines = [
        f"Observed order where the motion is smooth ({1e3 * smooth['seconds']:g} ms, steps of "
        f"{', '.join(f'{1e3 * step:g}' for step in smooth['steps_s'])} ms), over all rigs:",
        "",
        "| method | order | observed, median | least | largest |",
        "|---|---|---|---|---|",
    ]
    for method, values in smooth["orders"].items():
        observed = _row(values)
        cells = [f"{v:.2f}" for v in (np.median(observed), observed.min(), observed.max())]
        lines.append(f"| {method} | {EVALUATIONS[method]} | {' | '.join(cells)} |")
    return "\n".join(lines)


def number(value: float | None) -> str:
    """Three digits; a run that blew up is unstable."""
    return "unstable" if value is None or not np.isfinite(value) else digits(value)


def _ppm(value: float | None) -> float | None:
    return None if value is None else 1e6 * value


def _row(values: list[float | None], chosen: Any = slice(None)) -> Any:
    """Numbers of a JSON list, infinite where it has none, of the ``chosen`` lanes."""
    return np.array([np.inf if value is None else value for value in values])[chosen]

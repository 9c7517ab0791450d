"""Markdown tables of what ``step`` has measured."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from birthsim_env.physics.step import DEFAULT
from lab.engine.tables import markdown
from lab.studies.accuracy.tables import number

Row = dict[str, Any]


def tables(found: dict[str, Any]) -> str:
    """Errors of the motion by friction law, and differences in closed loop by controller."""
    return "\n\n".join([by_law(found["courses"]), by_lanes(found["seconds"]), by_controller(found["loops"])])


def by_lanes(seconds: dict[str, dict[str, list[float]]]) -> str:
    """CPU time of the kernel a policy step and lane, a row per step: the least of all turns, and over the default's."""
    usual = seconds[DEFAULT]
    rows = [["step"]]
    for lanes in usual:
        rows[0] += [f"{lanes} lanes: us", f"of {DEFAULT}"]
    for method, own in seconds.items():
        least = {lanes: min(turns) for lanes, turns in own.items()}
        rows.append([method])
        for lanes, turns in usual.items():
            rows[-1] += [f"{1e6 * least[lanes]:.3g}", f"{least[lanes] / min(turns):.2f}"]
    return markdown(rows)


def by_law(courses: dict[str, Any]) -> str:
    """Median and largest errors, a row per law, motion and step."""
    head = [
        "friction law",
        "motion",
        "method",
        "step (ms)",
        "position, median (um)",
        "largest (um)",
        "pressure, median",
        "largest",
    ]
    rows = []
    for law, motions in courses.items():
        for motion, found in motions.items():
            for row in found["rows"]:
                micrometres = [number(1e6 * value) for value in row["position_m"]]
                where = [law, f"{motion}, {found['rigs']} rigs", row["method"], f"{1e3 * row['step_s']:.3g}"]
                rows.append([*where, *micrometres, *map(number, row["pressure_relative"])])
    return markdown([head, *rows])


def by_controller(loops: list[Row]) -> str:
    """A row per controller: how far metrics are from those of the default step, all scenarios and sensor models together."""
    others = list(dict.fromkeys(row["step"] for row in loops))
    head = ["controller", "metrics"]
    for method in others:
        head += [f"{method}: beyond scatter", "beyond twice the standard error", "largest difference / scatter"]
        head += ["median", "lost worlds"]
    names = dict.fromkeys(row["controller"] for row in loops)
    rows = [[name, *_counted([row for row in loops if row["controller"] == name], others)] for name in names]
    return markdown([head, *rows, ["all", *_counted(loops, others)]])


def _counted(rows: list[Row], others: Iterable[str]) -> list[str]:
    shown = [str(len({(row["controller"], row["environment"], row["sensors"], row["metric"]) for row in rows}))]
    for method in others:
        own = [row for row in rows if row["step"] == method]
        ratio = np.array([relative(row) for row in own])
        biased = sum(is_biased(row) for row in own)
        lost = {(row["controller"], row["environment"], row["sensors"]): row["lost"] for row in own}
        shown += [str(int((ratio > 1).sum())), str(biased), f"{ratio.max():.2g}", f"{np.median(ratio):.1g}"]
        shown += [" and ".join(str(sum(pair[k] for pair in lost.values())) for k in range(2))]
    return shown


def relative(row: Row) -> float:
    """Mean of the paired differences over the scatter between worlds; zero where nothing differs."""
    return abs(row["difference"]) / row["scatter"] if row["difference"] else 0.0


def is_biased(row: Row) -> bool:
    """Whether the mean of the paired differences is more than twice its standard error."""
    return bool(abs(row["difference"]) > 2 * row["spread"] / row["worlds"] ** 0.5)

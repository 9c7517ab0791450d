"""What a hand feels, in Markdown: a table for each subject, a row for each law under each kind of sensors."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from baselines.bench.statistics import quantile
from birthsim_env.physics.compiled.lanes import Array
from lab.engine import information
from lab.engine.tables import Cell, Head, markdown
from lab.studies.haptics.coupled import HANDS, SETPOINT, stable_up_to
from lab.studies.haptics.kept import PEAK
from lab.studies.haptics.multisine import words
from lab.studies.haptics.release import PULL, STIFFNESS

Runs = Sequence[dict[str, Any]]
"""What ``lab.studies.haptics.kept.kept`` gives, in the order of the rows."""


def reports(runs: Runs, parameters: str = "") -> dict[str, str]:
    """A text for each subject that was measured; controllers believe the rig of a file, ``parameters``."""
    tables = {
        "impedance": rendering_table,
        "energy": energy_table,
        "release": release_table,
        "backdriving": backdriving_table,
        "stability": stability_table,
    }
    return {name: own for name, table in tables.items() if (own := table(runs, parameters))}


def report(runs: Runs, parameters: str = "") -> str:
    """All tables in one text."""
    return "\n\n".join([heading(runs), *reports(runs, parameters).values()]) + "\n"


def heading(runs: Runs) -> str:
    """Which rigs and seeds."""
    first = runs[0]
    randomised = f"{first['rigs']} randomised rigs, seeds {first['seed']} to {first['seed'] + first['rigs'] - 1}"
    rigs = randomised if first["rigs"] else "the rig as the controllers believe it"
    cells = "Medians and worst are over poses, directions and rigs."
    return f"{rigs[0].upper()}{rigs[1:]}. {cells} {information.LEGEND}"


def rendering_table(runs: Runs, parameters: str = "") -> str:
    """Bandwidths and errors at ``PEAK``: median over lanes, and worst."""
    heads = [Head(quantity, WORST) for quantity in (*BANDWIDTHS.values(), *ERRORS.values())]
    rows = [
        [
            *who,
            *(_pair(piece, name, kept, lost, least=True) for name in BANDWIDTHS),
            *(_pair(piece, name, kept, lost) for name in ERRORS),
        ]
        for who, piece, kept, lost in _under_multisines(runs, parameters)
    ]
    best = heads[len(BANDWIDTHS) :], heads[: len(BANDWIDTHS)]
    return _table(f"### Impedance under {words(PEAK, runs[0]['seed'])}", [*WHO, "N/m", *heads], rows, *best)


def energy_table(runs: Runs, parameters: str = "") -> str:
    """Energy, air, saturation and lost lanes at ``PEAK``: median over lanes, and worst."""
    heads = [Head(quantity, WORST) for quantity in EFFORTS.values()]
    rows: list[list[Cell]] = [
        [*who, *(_pair(piece, name, kept, lost) for name in EFFORTS), str(int(lost.sum()))]
        for who, piece, kept, lost in _under_multisines(runs, parameters)
    ]
    return _table(
        f"### Energy, air and saturation under {words(PEAK, runs[0]['seed'])}", [*WHO, "N/m", *heads, "lost"], rows, heads
    )


def _under_multisines(runs: Runs, parameters: str) -> Iterator[tuple[list[Cell], dict[str, Any], Array, Array]]:
    """Of each controller, sensors and stiffness the first cells of a row, what was measured, which lanes are pushed by
    ``PEAK``, and which of these are lost."""
    for run in runs:
        for piece in run.get("impedance", ()):
            kept = np.array(piece["peak"]) == PEAK
            lost = np.array(piece["lost"], dtype=bool)[kept]
            yield [*_who(run, parameters), f"{piece['stiffness']:g}"], piece, kept, lost


def release_table(runs: Runs, parameters: str = "") -> str:
    """Overshoot, speed and energy of a pull that is let go, beside the declared impedance's."""
    rows: list[list[Cell]] = []
    for run in runs:
        for piece in run.get("release", ()):
            lost = np.array(piece["lost"], dtype=bool)
            own = {
                name: _spread(np.where(lost, np.inf, _numbers(piece[name]))) for name in ("overshoot_mm", "speed", "kinetic")
            }
            ideal = piece["ideal"] or {}
            wanted: dict[str, Cell] = {
                name: _spread(_numbers(ideal[name])) if ideal else "-" for name in ("overshoot_mm", "speed")
            }
            energy = _spread(np.where(lost, np.inf, _numbers(piece["energy"])))
            rows.append(
                [
                    *_who(run, parameters),
                    own["overshoot_mm"],
                    wanted["overshoot_mm"],
                    own["speed"],
                    wanted["speed"],
                    own["kinetic"],
                    float(piece["stored"]),
                    energy,
                    str(int(lost.sum())),
                ]
            )
    columns: list[str | Head] = [
        *WHO,
        LEAST[0],
        Head("overshoot of the declared impedance, mm", WORST),
        LEAST[1],
        Head("peak speed of the declared impedance, m/s", WORST),
        LEAST[2],
        "stored by the spring, J",
        LEAST[3],
        "lost",
    ]
    return _table(f"### A pull of {PULL:g} N let go in 10 ms at {STIFFNESS:g} N/m", columns, rows, LEAST)


def backdriving_table(runs: Runs, parameters: str = "") -> str:
    """Mean and largest force beyond ``K x``, over poses and directions, at each setpoint."""
    rows: list[list[Cell]] = []
    stiffnesses = list(dict.fromkeys(piece["stiffness"] for run in runs for piece in run.get("backdriving", ())))
    for run in runs:
        found = {piece["stiffness"]: piece for piece in run.get("backdriving", ())}
        if found:
            rows.append([*_who(run, parameters), *(_beyond(found[stiffness]) for stiffness in stiffnesses)])
    heads = [Head(f"at {value:g} N/m", ("median of the means", "largest")) for value in stiffnesses]
    return _table("### Force beyond K x at 10 mm/s, N", (*WHO, *heads), rows, heads)


def stability_table(runs: Runs, parameters: str = "") -> str:
    """Hands with which the law rests, the largest of motion, force (peak to peak) and energy, and the stiffest setpoint that is
    stable against all of ``HANDS``."""
    rows: list[list[Cell]] = []
    for run in runs:
        if not ("hands" in run or "z_width" in run):
            continue
        cells: list[Cell] = []
        for piece in run.get("hands", ()):
            every = [_numbers(piece[name]) for name in ("motion_mm", "force", "energy")]
            largest = [float(np.where(np.isfinite(values), values, np.inf).max()) for values in every]
            cells.append([f"{100 * np.array(piece['stable'], dtype=bool).mean():.0f}", *largest])
        for piece in run.get("z_width", ()):
            cells.append(_z_width(piece))
        rows.append([*_who(run, parameters), *cells])
    held = next((run["hands"] for run in runs if "hands" in run), ())
    most = ("stable, %", "most motion, mm", "most force, N", "most energy given, J")
    columns: list[str | Head] = [*WHO, *(Head(f"hands of {piece['damping']:g} N s/m", most) for piece in held)]
    if any("z_width" in run for run in runs):
        columns.append(Head("stable up to, N/m", ("own damping", "best damping")))
    title = f"### Held by hands of 0 to 20 kN/m and 0 to 2 kg at {SETPOINT:g} N/m, and Z-width against {len(HANDS)} of them"
    return _table(title, columns, rows, (), columns[len(WHO) :])


BANDWIDTHS = {"bandwidth": "bandwidth, Hz", "unnoticed": "1 JND up to, Hz", "unnoticed_without_work": "22 % up to, Hz"}
ERRORS = {"noticed": "JND at 1 Hz", "error_own_mm": "own error, mm", "error_spring_mm": "error to (19), mm"}
EFFORTS = {"energy": "energy given, J", "shortage": "shortage, N s/m", "air": "air, l/min", "saturation": "saturated, %"}
"""Metrics of a lane under multisines -> their heads, of tables that have each with its worst."""

WORST = ("median", "worst")
LEAST = tuple(Head(name, WORST) for name in ("overshoot, mm", "peak speed, m/s", "kinetic energy, J", "energy given, J"))
"""Of a release."""

WHO = ("controller", *information.COLUMNS, "sensors")


def _who(run: dict[str, Any], parameters: str) -> list[str]:
    """Of the hand's force counts what was measured: a run may hide it."""
    *facts, _ = information.informed(run["controller"], run["sensors"], parameters=parameters)
    return [f"`{run['controller']}`", *facts, "yes" if run["uses_force"] else "no", run["sensors"]]


def _numbers(values: Any) -> Array:
    """JSON's null is NaN."""
    return np.array(values, dtype=np.float64)


def _spread(values: Array, least: bool = False) -> Cell:
    """Median, and the worst, which is the largest or the ``least``."""
    if not np.isfinite(values).any():
        return "lost" if np.isinf(values).any() else "-"
    return [quantile(values, 0.5), quantile(values, 0.0 if least else 1.0)]


def _pair(piece: dict[str, Any], name: str, kept: Array, lost: Array, least: bool = False) -> Cell:
    if name not in piece:
        return "-"
    return _spread(np.where(lost, 0.0 if least else np.inf, _numbers(piece[name])[kept]), least)


def _beyond(piece: dict[str, Any]) -> Cell:
    if piece["refused"] is not None:
        return "refused"
    lost = np.array(piece["lost"], dtype=bool)
    mean, most = (np.where(lost, np.inf, _numbers(piece[name])) for name in ("mean", "most"))
    return [quantile(mean, 0.5), quantile(most, 1.0)]


def _z_width(piece: dict[str, Any]) -> list[str]:
    """The stiffest stable setpoint with damping as it is, and with the best."""
    limits = stable_up_to(piece)
    own, best = (f"{limit:g}" if limit else "none" for limit in (limits[0], max(limits)))
    return [own, best]


def _table(
    title: str,
    columns: Sequence[str | Head],
    rows: Sequence[Sequence[Cell]],
    least: Sequence[object],
    most: Sequence[object] = (),
) -> str:
    """Of the same sensors and told the same; impedances of the same setpoint, which follows there."""
    alike = [tuple(map(str, (row[1], *row[3 : len(WHO) + ("N/m" in columns)]))) for row in rows]
    return f"{title}\n\n{markdown([columns, *rows], least, most, alike)}" if rows else ""

"""How punctual a drive was: periods, jitter and computing time, from when samples arrived and openings were written."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array

EDGES = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 121)])
"""s, of the histograms' bins: 20 a decade."""

QUANTILES = (0.5, 0.99, 0.999, 1.0)


@dataclass(frozen=True)
class Timing:
    """Of T samples, in s: ``periods`` (T - 1,) between arrivals, ``jitter`` (T - 1,) by which these differ from the rig's own
    clock, ``computing`` (T,) from a sample's arrival until its openings were written. ``late`` are openings that took longer
    than a control period, and samples that were skipped for newer ones; ``missed`` are samples without an answer in time as the
    rig counts them, -1 where it does not."""

    period: float
    periods: Array
    jitter: Array
    computing: Array
    late: int
    missed: int

    def summary(self) -> dict[str, Any]:
        """As JSON: quantiles, s, histograms, and counts."""
        found: dict[str, Any] = {
            "samples": len(self.computing), "control_period": self.period, "late": self.late, "missed_by_the_rig": self.missed,
        }  # fmt: skip
        for name in ("periods", "jitter", "computing"):
            values = getattr(self, name)
            quantiles = np.quantile(values, QUANTILES).tolist() if len(values) else []
            found[name] = dict(zip(("median", "99 %", "99.9 %", "largest"), quantiles, strict=False))
            found[name]["histogram"] = np.histogram(values, EDGES)[0].tolist()
        return {**found, "edges": EDGES.tolist()}

    def words(self) -> list[str]:
        """A table in lines, us."""
        lines = [f"{'us':>14}{'median':>10}{'99 %':>10}{'99.9 %':>10}{'largest':>10}"]
        for name, values in (("period", self.periods), ("jitter", self.jitter), ("computing", self.computing)):
            if len(values):
                lines.append(f"{name:>14}" + "".join(f"{1e6 * one:10.0f}" for one in np.quantile(values, QUANTILES)))
        count = len(self.computing)
        share = 100.0 * self.late / count if count else 0.0
        said = "" if self.missed < 0 else f"; the rig missed {self.missed} answers"
        return [*lines, f"late: {self.late} of {count} ({share:.3g} %){said}"]


def timing_of(times: Array, arrived: Array, written: Array, period: float, missed: int) -> Timing:
    """The timing of samples that the rig took at ``times`` (T,), s, that ``arrived`` and were answered at ``written``, s of the
    computer's clock."""
    steps, periods, computing = np.diff(times), np.diff(arrived), written - arrived
    skipped = np.maximum(np.rint(steps / period) - 1.0, 0.0)
    late = int((computing > period).sum() + skipped.sum())
    return Timing(period, periods, np.abs(periods - steps), computing, late, missed)

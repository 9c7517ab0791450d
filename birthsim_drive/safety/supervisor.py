"""Looks at every sample and at every opening, and says what is wrong first."""

import math
from collections.abc import Sequence

import numpy as np

from birthsim_drive.plain import in_python
from birthsim_drive.safety.limits import Limits
from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import length_r4
from birthsim_env.physics.rig.parameters import Parameters

_length_r4 = in_python(length_r4)

CHAMBERS = ("P1", "N1", "P2", "N2")

HALF_OPEN = 0.5
"""Opening from which on a pressure must change, unless it has reached the supply's or the atmosphere's."""

REACHED = 0.1
"""Fraction of the supply's gauge pressure within which a pressure has reached it."""

Found = tuple[str, str] | None
"""Kind of a fault and what there is to say of it."""


class Supervisor:
    """Limits over the samples of one rig; ``needs`` are fields of a ``Measurement`` that the controller has to have."""

    def __init__(self, limits: Limits, rig: Parameters, needs: tuple[str, ...]) -> None:
        self._limits, self._rig, self._needs = limits, rig, needs
        self._period = rig.electronics.control_period
        self._pairs = [name for name in needs if name in ("position", "velocity", "user_force", "acceleration")]
        self._chambers = rig.linkage.topology.chambers
        self._half = [one.stroke / 2 for one in (rig.cylinder1, rig.cylinder2)]
        self._low = rig.air.atmospheric_pressure
        self._high = rig.air.supply_pressure
        self._missing = self._bad = self._still = self._late = 0
        self._time, self._arrived, self._begun = -math.inf, -math.inf, False
        self._pressures, self._stuck, self._openings = [math.nan] * 4, [0] * 4, [0.0] * 4

    @property
    def has_begun(self) -> bool:
        """Whether a good sample has come."""
        return self._begun

    def miss(self) -> Found:
        """No sample has come in a control period."""
        self._missing += 1
        waits = self._missing * self._period
        if waits <= self._limits.fault_time:
            return None
        return "missing", f"none for {waits:.3g} s; allowed: {self._limits.fault_time:g} s"

    def look(self, seen: Measurement, arrived: float, target: Sequence[float] | None) -> Found:
        """What is wrong with a sample that ``arrived``, s of the computer's clock.

        ``target`` (2,), m, is where the end effector should be, once it is to be there."""
        self._missing = 0
        time = float(seen.time)
        elapsed, self._arrived = arrived - self._arrived, arrived
        said = self._clock(time, elapsed) or self._not_finite(seen) or self._position_age(seen, time)
        if said or self._bad:
            return said
        self._begun = True
        return self._pressure(seen) or self._end_effector(seen, target)

    def command(self, openings: list[float]) -> Found:
        """What is wrong with the openings of a controller, of chambers P1, N1, P2, N2."""
        self._openings = openings
        if all(abs(one) <= 1.0 for one in self._openings):
            return None
        return "opening", f"{', '.join(f'{one:g}' for one in self._openings)}; allowed: -1 to 1"

    def computed(self, spent: float) -> Found:
        """What is wrong with the time, s, that passed between a sample and its answer."""
        self._late = self._late + 1 if spent > self._period else 0
        if self._late <= self._limits.late_periods:
            return None
        return "late", f"{self._late} in a row, the last after {1e3 * spent:.2f} ms; allowed: {self._limits.late_periods:g}"

    def _clock(self, time: float, elapsed: float) -> Found:
        step, self._still = time - self._time, self._still + 1 if time == self._time else 0
        if self._still * self._period > self._limits.fault_time:
            return "frozen", f"{time:.3f} s for {self._still * self._period:.3g} s; allowed: {self._limits.fault_time:g} s"
        if math.isfinite(self._time) and math.isfinite(time) and not (0.0 <= step <= self._period + self._limits.leap):
            self._time, said = time, f"{step:.4g} s; allowed: 0 to {self._period + self._limits.leap:g} s"
            # Samples that were lost, or that nobody read in time, are no leap of the clock.
            return ("missing", f"none of {said}") if step > 0.0 and elapsed > step / 2.0 else ("clock", f"it goes on by {said}")
        self._time = time if math.isfinite(time) else self._time
        return None

    def _not_finite(self, seen: Measurement) -> Found:
        times = float(seen.time) + float(seen.position_time)
        pairs = sum(sum(getattr(seen, name).tolist()) for name in self._pairs)
        if math.isfinite(times + sum(seen.pressures.tolist()) + pairs):
            self._bad = 0
            return None
        bad = [name for name in self._needs if not np.isfinite(self._own(name, getattr(seen, name))).all()]
        self._bad = self._bad + 1 if bad else 0
        if self._bad * self._period <= self._limits.fault_time:
            return None
        return "not finite", f"{', '.join(bad)} for {self._bad * self._period:.3g} s; allowed: {self._limits.fault_time:g} s"

    def _own(self, name: str, value: Array) -> Array:
        """A signal without what a rail lacks."""
        return value[list(self._chambers)] if name == "pressures" else value

    def _position_age(self, seen: Measurement, time: float) -> Found:
        age = time - float(seen.position_time)
        if not age > self._limits.position_age:
            return None
        return "blind", f"the newest is {age:.3g} s old; allowed: {self._limits.position_age:g} s"

    def _pressure(self, seen: Measurement) -> Found:
        limits, found = self._limits, seen.pressures.tolist()
        near = REACHED * (self._high - self._low)
        for k in self._chambers:
            if not limits.least_pressure <= found[k] <= limits.pressure:
                allowed = f"{limits.least_pressure / 1e5:.3g} to {limits.pressure / 1e5:.3g} bar"
                return "pressure", f"{CHAMBERS[k]} has {found[k] / 1e5:.3g} bar; allowed: {allowed}"
            ends = self._high - near if self._openings[k] > 0.0 else self._low + near
            flows = found[k] < ends if self._openings[k] > 0.0 else found[k] > ends
            waits = abs(self._openings[k]) > HALF_OPEN and flows and found[k] == self._pressures[k]
            self._stuck[k] = self._stuck[k] + 1 if waits else 0
            if self._stuck[k] * self._period > limits.stuck_time:
                stood = self._stuck[k] * self._period
                return (
                    "stuck",
                    f"{CHAMBERS[k]} stands at {found[k] / 1e5:.3g} bar for {stood:.3g} s; allowed: {limits.stuck_time:g}",
                )
        self._pressures = found
        return None

    def _end_effector(self, seen: Measurement, target: Sequence[float] | None) -> Found:
        limits = self._limits
        speed, force = math.hypot(*seen.velocity.tolist()), math.hypot(*seen.user_force.tolist())
        if speed > limits.speed:
            return "speed", f"{speed:.3g} m/s; allowed: {limits.speed:g} m/s"
        if force > limits.force:
            return "force", f"{force:.3g} N; allowed: {limits.force:g} N"
        pistons = self._pistons(seen.position)
        if pistons is None:
            return "workspace", f"{seen.position.tolist()} m is out of reach; allowed: within the strokes"
        for k in self._rig.linkage.topology.cylinders:
            left = self._half[k] - abs(pistons[k])
            if left < limits.margin:
                return "workspace", f"piston {k + 1} is {1e3 * left:.2g} mm from its stop; allowed: {1e3 * limits.margin:g} mm"
        if target is not None:
            away = math.dist(seen.position.tolist(), target)
            if away > limits.deviation:
                return "deviation", f"{1e3 * away:.3g} mm; allowed: {1e3 * limits.deviation:g} mm"
        return None

    def _pistons(self, position: Array) -> list[float] | None:
        """Where both pistons are, m; None for a place that no linkage reaches. A tracker's noise across a rail is none."""
        own, (x, y) = self._rig.geometry, position.tolist()
        r2 = math.hypot(x, y)
        if self._rig.linkage.is_rail:
            return [0.0, r2 - own.k2]
        dimensions = own.d3**2 + own.d6**2, 2.0 * own.d3 * own.d6, math.sin(own.gamma3), math.cos(own.gamma3)
        try:
            return [_length_r4(x / r2, -y / r2, *dimensions) - own.k1, r2 - own.k2]
        except (ValueError, ZeroDivisionError):
            return None

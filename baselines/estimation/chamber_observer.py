"""What goes on inside valves and chambers: spools from what was commanded, pressures from noisy cells.

A spool follows its command with the lag that is known. A pressure is carried on by the control model (6), with the flow that
the believed spool lets through and the dead volume, and corrected by what its cell measures,
    P' = k (r T q - P S L')/V + w (P_measured - P),   V = V0 + S L,
so that noise is averaged over 1/w without the delay of a filter: only the model's error of P' lags, and by 1/w.
"""

from baselines.valve_inverse import driving_flows, valve_of
from birthsim_env.loop.signals import Joints
from birthsim_env.physics import control_model
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.pneumatics import valves


@helper
def predicted_pressure(
    chamber: int, pressure: float, opening: float, area: float, length: float, length_rate: float, period: float, p: Rig
) -> float:
    """Pressure of a ``chamber``, 0 to 3, after one period of its valve's ``opening``, Pa, by (6); ``length`` is that of its
    air, m."""
    valve = valve_of(chamber, p)
    supply = valves.edge_conductance(opening, valve.supply, p.conductance, p.leakage)
    exhaust = valves.edge_conductance(-opening, valve.exhaust, p.conductance, p.leakage)
    fill, drain = driving_flows(pressure, p)
    flow = supply * fill - exhaust * drain
    whole, gas_t = max(length, 0.0) + p.dead_volume / area, p.gas * p.temperature
    filled = period * control_model.polytropic_rate_p(pressure, flow, 0.0, area, whole, p.index, gas_t)
    pressed = period * control_model.polytropic_rate_p(pressure, 0.0, length_rate, area, whole, p.index, gas_t)
    # However long the period: no flow goes beyond the pressure that drives it, and no stroke empties a chamber.
    filled = max(min(p.atmosphere - pressure, 0.0), min(max(p.supply - pressure, 0.0), filled))
    expected: float = max(pressure + filled + pressed, 0.5 * pressure)
    return expected


class Chambers(Rows):
    """What is believed of valves and chambers P1, N1, P2, N2."""

    spool = rows(4, "1", "opening of the spool")
    pressure = rows(4, "Pa", "pressure of the chamber, absolute")
    opening = rows(4, "1", "opening that was commanded")


@helper
def observe(chambers: Chambers, measured: Array, joints: Joints, p: Rig, period: float, fraction: float, fresh: Array) -> None:
    """Carries ``chambers`` on by one period to whose end pressures (4, N), Pa, were ``measured``, with a trust ``fraction`` in
    them.

    ``joints`` are those of its start. Where ``fresh`` (N,) is 1 valves are shut and pressures as measured.
    """
    kept = exact.exp(-period / p.tau)
    # Of the way that is left to the command, the mean over the period.
    mean = (1.0 - kept) * p.tau / period
    for chamber in range(4):
        cylinder, sign = chamber // 2, 1.0 - 2.0 * (chamber % 2)
        half = p.half_l1 if cylinder == 0 else p.half_l2
        area_p, area_n = (p.area_p1, p.area_n1) if cylinder == 0 else (p.area_p2, p.area_n2)
        area = area_p if chamber % 2 == 0 else area_n
        for i in range(fresh.shape[0]):
            opening = chambers.opening[chamber, i]
            away = chambers.spool[chamber, i] - opening
            expected = predicted_pressure(
                chamber,
                chambers.pressure[chamber, i],
                opening + mean * away,
                area,
                half + sign * joints.position[cylinder, i],
                sign * joints.speed[cylinder, i],
                period,
                p,
            )
            new, cell = fresh[i] > 0.0, measured[chamber, i]
            chambers.pressure[chamber, i] = cell if new else fraction * cell + (1.0 - fraction) * expected
            chambers.spool[chamber, i] = 0.0 if new else opening + kept * away

"""How well sensors tell the hand's force while a piston sticks: a bound for every controller without a force sensor.

A stuck piston is a bent bristle. At a pose with Jacobian J, about rest, the end effector is

    m a = F - K x - D v,    K = J^-T diag(s0) J^-1,   D = J^-T diag(s1 + Fv) J^-1,

and all that moves it is the hand's force F, since valves change nothing that is not known. F comes along a known direction and
is random with the power of the push (``Stimulus.together``) in a band, a Butterworth process of second order. The Kalman
filter that knows this model is the best causal one: no controller that a force sensor does not tell knows F better. It is told
what none is: rig, bristles, direction and power of the push, chamber forces without noise; samples come without delay. Pistons
that slide tell more.

Sensors are a tracker (all its noise, spread over the control periods), an acceleration sensor, encoders (noise and
counts) and gauges of the rods, which carry J^T (F - m a).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import expm

from baselines.bench.statistics import quantile
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import Cell, Head, markdown
from lab.studies.bandwidth.stimuli import KINDS, Stimulus, stimuli, words_of
from lab.studies.haptics.worlds import DIRECTIONS, POSES, Condition

TRACKER, ACCELERATION, ENCODERS, GAUGES = "tracker", "acceleration", "encoders", "rod gauges"
SENSORS = (
    (TRACKER,), (TRACKER, ACCELERATION), (ENCODERS,), (ENCODERS, ACCELERATION), (TRACKER, GAUGES),
    (ENCODERS, GAUGES, ACCELERATION),
)  # fmt: skip
"""Sets of sensors."""

DOUBLINGS = 40
"""At most: 2 to the power of this many periods settle any filter."""

TOLD = (0.1, 0.3, 1.0, 3.0)
"""Hz up to which forces are taken."""


class Stuck:
    """A stuck rig at a pose: motion (x, y, vx, vy) under a force, and what ``sensors`` see of it."""

    def __init__(self, rig: Parameters, pose: Sequence[float], direction: Sequence[float], sensors: Sequence[str]) -> None:
        self._period, board, mass = rig.electronics.control_period, rig.electronics, rig.mechanics.mass
        columns = jacobian(inverse_geometry(np.array(pose)[:, None], rig)[:, 0], rig)
        back, friction = np.linalg.inv(columns), rig.friction
        viscous = [rig.cylinder1.viscous_friction, rig.cylinder2.viscous_friction]
        stiffness = back.T @ np.diag([friction.bristle_stiffness] * 2) @ back
        damping = back.T @ np.diag(friction.bristle_damping + np.array(viscous)) @ back
        push, none, whole = np.array(direction)[:, None], np.zeros((2, 2)), np.eye(2)
        self.motion = np.block([[none, whole], [-stiffness / mass, -damping / mass]])
        self.force = np.vstack([np.zeros((2, 1)), push / mass])
        pulled = self.motion[2:]
        sampled = board.position_noise / np.sqrt(self._share(board.position_rate))
        counts = np.hypot(board.encoder_noise, board.encoder_resolution / np.sqrt(12.0))
        # Rows of the motion and of the force, and the noise of a control period.
        seen: dict[str, tuple[Array, Array, float]] = {
            TRACKER: (np.hstack([whole, none]), np.zeros((2, 1)), sampled),
            ACCELERATION: (pulled, push / mass, board.acceleration_noise),
            ENCODERS: (np.hstack([back, none]), np.zeros((2, 1)), counts / np.sqrt(self._share(board.encoder_rate))),
            GAUGES: (-mass * columns.T @ pulled, np.zeros((2, 1)), board.gauge_noise),
        }
        # In units of the noise.
        self.seen = np.vstack([np.hstack(seen[one][:2]) / seen[one][2] for one in sensors])

    def _share(self, rate: float) -> float:
        """Samples of a control period."""
        return min(1.0, rate * self._period)

    def error(self, size: float, band: float) -> float:
        """Error of the best causal filter over ``size``, N, of a force up to ``band``, Hz; both root mean squares."""
        w = 2 * np.pi * band
        a = np.zeros((6, 6))
        a[:4, :4], a[:4, 4:5] = self.motion, self.force * size
        a[4:, 4:] = [[0.0, w], [-w, -np.sqrt(2.0) * w]]
        driven = np.zeros((6, 6))
        driven[5, 5] = 2 * np.sqrt(2.0) * w
        # Exactly over a control period (Van Loan 1978).
        both = expm(np.block([[-a, driven], [np.zeros((6, 6)), a.T]]) * self._period)
        step = both[6:, 6:].T
        noise = step @ both[:6, 6:]
        seen = np.hstack([self.seen[:, :4], self.seen[:, 4:5] * size, np.zeros((len(self.seen), 1))])
        after = filtered(step, seen, (noise + noise.T) / 2)
        return float(np.sqrt(min(1.0, max(0.0, after[4, 4]))))


def filtered(step: Array, seen: Array, noise: Array) -> Array:
    """Covariance (n, n) of what the Kalman filter makes of samples, once it has settled.

    A state moves by ``step`` (n, n) and noise of a covariance (n, n) in a period; rows ``seen`` (m, n) of it are sampled with
    unit noise. The Riccati equation by doubling (Anderson 1978): periods 1, 2, 4 and so on, until nothing changes.
    """
    a, g, before = step.T, seen.T @ seen, noise
    whole = np.eye(len(step))
    for _ in range(DOUBLINGS):
        inner = np.linalg.solve(whole + g @ before, a)
        forward = np.linalg.solve(whole + g @ before, g)
        more = a.T @ before @ inner
        a, g, before = a @ inner, g + a @ forward @ a.T, before + (more + more.T) / 2
        if np.abs(more).max() <= 1e-13 * np.abs(before).max():
            break
    return np.asarray(before @ np.linalg.solve(whole + seen.T @ seen @ before, whole))


def bound(sensors: list[str], push: str, size: float, rigs: int, seed: int) -> Result:
    """``error`` of forces up to each of ``TOLD``, Hz: over directions and rigs, (2, R) each."""
    stimulus: Stimulus = KINDS[push](size, seed)
    errors = np.empty((len(TOLD), len(DIRECTIONS), rigs))
    for k, rig in enumerate(Condition("backstepping", Parameters(), "ideal", seed, rigs, False).drawn()):
        for way, direction in enumerate(DIRECTIONS):
            stuck = Stuck(rig, POSES[k % len(POSES)], direction, sensors)
            errors[:, way, k] = [stuck.error(stimulus.together(band), band) for band in TOLD]
    return {"errors": errors.tolist()}


def _tasks(options: Options) -> dict[Any, Task]:
    more = {"rigs": options.rigs, "seed": options.seed}
    return {
        (sensors, kind(size, options.seed).name): Task(
            f"{'-'.join(sensors).replace(' ', '-')}/{option}-{size:g}",
            bound,
            {"sensors": list(sensors), "push": option, "size": size, **more},
        )
        for sensors in SENSORS
        for option, kind in KINDS.items()
        for size in getattr(options, option)
    }


def _kept(options: Options, found: Found) -> Any:
    return [
        {
            "sensors": list(sensors),
            "push": push,
            "axis": axis,
            "errors": [[quantile(own[way], part) for part in (0.5, 1.0)] for own in found[sensors, push]["errors"]],
        }
        for sensors in SENSORS
        for push in stimuli(options)
        for way, axis in enumerate("xy")
    ]


def _shown(content: Content) -> dict[str, str]:
    settings = content["settings"]
    heads = [Head(f"below {band:g} Hz", ("median", "worst")) for band in TOLD]
    rows: list[list[Cell | Head]] = [["sensors", "what the hand does", "axis", *heads]]
    for row in content["figures"]:
        errors = [[100 * value for value in own] for own in row["errors"]]
        rows.append([", ".join(row["sensors"]), words_of(row["push"], settings["seed"]), row["axis"], *errors])
    first, count = settings["seed"], settings["rigs"]
    said = (
        "Error of the force that the best causal filter finds while pistons stick, % of that force, over "
        f"{count} randomised rigs, seeds {first} to {first + count - 1}. Those lines push that are below the frequency."
    )
    return {"stuck.md": f"{said}\n\n{markdown(rows)}\n"}


STUDY = Study(
    {"peak": (10.0,), "slow": (4.9,), "sine": (2.0, 5.0, 10.0), "rigs": 36, "seed": 7_300_000},
    _tasks,
    _kept,
    {"errors": "1"},
    _shown,
    words={
        "peak": "N that multisines of the hand reach",
        "slow": "N of each of its slow lines",
        "sine": "N of its lone sines",
        "rigs": "randomised ones",
    },
)
register(study="stuck", about="what sensors tell of a hand that moves no piston")(STUDY)

"""The whole identification of a trial: fit, certainty, a rig to write, and its description in words."""

from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

import numpy as np
import tomli_w

from baselines.identification.fit.certainty import DETERMINED, NORMAL, Certainty, certainty_of
from baselines.identification.fit.estimate import Fit, refine
from baselines.identification.fit.forms import Suspect, shown, suspects
from baselines.identification.fit.free_parameters import FreeParameter, free_of, shown_by, with_more
from baselines.identification.fit.laws import LAW, Laws, fit_law
from baselines.identification.fit.problem import Tick
from baselines.identification.log.log_columns import CHAMBERS
from baselines.identification.log.trial import Trial
from baselines.identification.windows.force_offset import ForceOffset, force_offset
from baselines.identification.windows.noise import cell_noises, guessed_noise
from baselines.identification.windows.starts import Noise
from baselines.identification.windows.windows import check_begins
from birthsim_env.files import write_text
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of


@dataclass(frozen=True)
class Row:
    """A parameter: the owner's value, the estimate with its 95 % interval, and whether the log determines it.

    Where the log does not tell it, ``value`` is the owner's, and the interval is what log and owner know together.
    """

    name: str
    owner: float
    value: float
    low: float
    high: float
    determined: bool

    def words(self) -> str:
        """One line: name, value, interval, unit."""
        unit = DECLARED[self.name].unit
        value = f"{self.name} = {self.value:.5g}{'' if unit == '-' else f' {unit}'}"
        interval = f"{self.low:.5g} to {self.high:.5g}"
        if self.determined:
            return f"{value}, 95 % interval {interval}; was {self.owner:.5g}"
        return f"{value}, KEPT: the log cannot tell it, it may be {interval}"


@dataclass(frozen=True)
class Identified:
    """What a log tells of a rig.

    Parameters
    ----------
    rows : tuple of Row
        One per parameter: its name, the owner's value, the estimate, ``low`` and ``high`` of the 95 % interval, and whether
        the log determines it.
    rig : Parameters
        The rig with these values.
    fit : Fit
        The search for them.
    certainty : Certainty
        Of the fit of all parameters.
    noise, quick_noise : Noise
        Of pressures (Pa) and positions (m), as the residuals have it, and as the log alone has it.
    notes : tuple of str
        What of the log was left out, a line each.
    pull : ForceOffset
        A constant force that the log lacks.
    left_over : array (4,)
        Residuals of each chamber's pressures over the noise that third differences show.
    suspects : tuple of Suspect
        Forms that the log shows and the model lacks, the likeliest first.
    laws : Laws
        The friction law that was chosen, and how likely each law is.
    zeros, known_zeros : tuple of array (2,), array (2,)
        What the zeros of encoders are off and the standard deviations, and those that were known before, m; empty where a
        tracker sees the end effector.

    Examples
    --------
    ``identify`` returns one; its docstring makes a log first, with which

    >>> import birthsim
    >>> print(birthsim.identify("log.csv").words()[0])  # doctest: +SKIP
    cylinder1.coulomb_friction = 12.067 N, 95 % interval 11.996 to 12.138; was 12
    """

    rows: tuple[Row, ...]
    rig: Parameters
    fit: Fit
    certainty: Certainty
    noise: Noise
    quick_noise: Noise
    notes: tuple[str, ...]
    pull: ForceOffset
    left_over: Array
    laws: Laws
    suspects: tuple[Suspect, ...] = ()
    zeros: tuple[Array, Array] = (np.empty(0), np.empty(0))
    known_zeros: Array = field(default_factory=lambda: np.empty(0))

    @property
    def misfit(self) -> tuple[float, float]:
        """Residuals of pressures and positions over the noise that third differences show."""
        return self.noise.pressure / self.quick_noise.pressure, self.noise.position / self.quick_noise.position

    def words(self) -> list[str]:
        """The result in lines."""
        lines = [*(row.words() for row in self.rows), *self.laws.words()]
        pressure, position = self.misfit
        lines.append(f"noise of pressures {self.noise.pressure:.4g} Pa, of positions {1e3 * self.noise.position:.4g} mm")
        lines.append(f"residuals over the noise of neighbouring samples: pressures {pressure:.2f}, positions {position:.2f}")
        if max(pressure, position) > MISFIT:
            lines.append(
                f"the model leaves more than noise in {self._worst()}: {self._forms()}, hands, an offset of the force sensor; "
                "see the residuals"
            )
        lines += [*self._encoders(), *self._causes(), *self._unlike_valves(), *(one.words for one in self.suspects)]
        if not self.fit.ended:
            lines.append("the search took all the evaluations that it may make, and may end before the best parameters")
        for row in self.rows:
            low, high = TUNED.get(row.name, (-inf, inf))
            if row.determined and not low <= row.value <= high:
                unit = DECLARED[row.name].unit
                lines.append(
                    f"{row.name} is outside {low:g} to {high:g} {unit}, for which controllers are tuned: "
                    "one that believes another rig may swing; give it this one (--parameters)"
                )
        for direction in self.certainty.weakest:
            named = ", ".join(f"{part:+.2f} {name}" for name, part in direction.parts)
            lines.append(f"least known: {named}; {direction.deviation:.2g} of what was unknown before")
        return lines

    def _worst(self) -> str:
        """The signals of which the model leaves more than noise."""
        pressures = [f"pressures_{name}" for name, left in zip(CHAMBERS, self.left_over, strict=True) if left > MISFIT]
        return ", ".join([*pressures, *(["the positions"] if self.misfit[1] > MISFIT else [])]) or "the pressures"

    def _forms(self) -> str:
        """What may be of another form, by the signal that fits worse."""
        if self.misfit[1] > self.misfit[0]:
            return f"{self.laws.others()}, friction along the stroke, a bore or a lever measured wrong"
        return "leaks, spools of second order, commands that are late, a curve of the valves or a tube that it does not know"

    def _encoders(self) -> list[str]:
        """What the zeros of encoders are off, a line each."""
        lines = []
        for k, (off, deviation, before) in enumerate(zip(*self.zeros, self.known_zeros, strict=True)):
            if k not in self.rig.linkage.topology.cylinders:
                continue
            reach = f"{1e3 * off:.3g} +- {1e3 * NORMAL * deviation:.2g} mm"
            told = "" if deviation < DETERMINED * before else f": no more than what was known, +- {2e3 * before:.2g} mm"
            lines.append(f"the encoder of cylinder {k + 1} counts {reach} too much{told}")
        return lines

    def _causes(self) -> list[str]:
        """Sensors that are off by more than their owner knows, a line each."""
        if self.pull.is_there:
            return [self.pull.words()]  # which biases of the cells make up for in part
        lines, known = [], self.rig.electronics.pressure_bias
        offsets = self.fit.problem.offsets.biases
        for name, bias in zip(CHAMBERS, offsets, strict=True):
            if abs(bias) > max(BIASED * known, LEAST_BIAS):
                lines.append(
                    f"pressures_{name} seems to be {abs(bias):.2g} Pa too {'high' if bias > 0 else 'low'}, "
                    f"electronics.pressure_bias is {known:g} Pa: a gauge pressure, or a cell whose zero has drifted"
                )
        return lines

    def _unlike_valves(self) -> list[str]:
        """A chamber of whose pressure the fit leaves more than of the others', in a line."""
        left, chambers = self.left_over, list(self.rig.linkage.topology.chambers)
        k = int(np.argmax(left))
        if left[k] < max(UNLIKE * float(np.median(left[chambers])), MISFIT):
            return []
        name = CHAMBERS[k]
        return [
            f"pressures_{name} fit worse than the others', {left[k]:.2f} of their noise: a valve unlike "
            f"the others ([valve_{name.lower()}]), a leak, a cell that errs; what all valves share may then be wrong too"
        ]

    def write(self, path: Path, source: str) -> None:
        """Write the rig as TOML; its head says what is from the log ``source`` and what is not."""
        head = [f"Identified by birthsim identify from {source}.", *self.notes, *self.words()]
        text = "".join(f"# {line}\n" for line in head)
        write_text(path, f"{text}\n{tomli_w.dumps(self.rig.to_dict())}")


TUNED = documented_ranges(Parameters(), "honest")
"""What the rigs have on which the controllers' gains were found. Where a controller believes the default rig, lighter ones
swing, and so do those with a later tracker (``birthsim study wide-rigs``)."""


MISFIT = 1.1
"""Residuals so many times larger than the noise are named."""

UNLIKE = 1.25
"""A chamber is named whose residuals, over its noise, are so many times the median of all; assumed."""

MOST_FORMS = 2
"""Times that forms are looked for which the log shows."""

BIASED, LEAST_BIAS = 3.0, 5e3
"""Standard deviations and Pa from which the bias of a cell is named."""


def identify(
    trial: Trial,
    owner: Parameters,
    seed: int = 0,
    free: tuple[FreeParameter, ...] | None = None,
    tick: Tick = lambda: None,
    friction_law: str | None = None,
) -> Identified:
    """The rig of a trial, as far as the trial determines it; all else is the owner's.

    Without ``free``, what a rig as its owner's has is identified, and what else the log shows (``forms``). Without a
    ``friction_law`` the laws that the plant knows are compared (``laws``).
    Parameters that the trial does not tell take the owner's value, and the others are fitted anew. Their intervals are those
    of the fit of all, which knows how far the owner may be wrong. ``ValueError`` for an owner's rig with options that
    ``windows.REMEMBER``.
    """
    check_begins(owner, "an identification")
    asked = free_of(owner, trial.latency) if free is None else free
    whole, laws = fit_law(trial, owner, seed, asked, tick, friction_law)
    owner = owner.replace({LAW: laws.chosen})
    more = () if free is not None else shown_by(owner)
    for _ in range(MOST_FORMS):
        with whole.problem.explained():
            values = shown(whole, tuple(one for one in more if one not in whole.free))
        if not values or whole.problem.windows.budget.over:
            break
        every = with_more(whole.free, (one for one in more if one.name in values))
        whole = refine(trial, replace(whole, rig=whole.rig.replace(values)), owner, every, tick)
    free = whole.free
    with whole.problem.explained():
        certainty, pull, others = (
            certainty_of(whole),
            force_offset(whole),
            suspects(whole),
        )
    zeros = whole.problem.offsets.encoders(whole.jacobian[: -len(free)], whole.covariance)
    before = np.empty(0) if trial.counted is None else trial.counted
    found = tuple(one for one, known in zip(free, certainty.determined, strict=True) if known)
    budget = whole.problem.windows.budget
    last = whole if budget.over or len(found) == len(free) or not found else refine(trial, whole, owner, found, tick)
    last = replace(last, ended=last.ended and not budget.over)
    rig = last.rig if found else owner
    rows = []
    for one, theta, deviation, known in zip(free, whole.theta, certainty.deviation, certainty.determined, strict=True):
        value = value_of(rig, one.name)
        middle, reach = (one.prior.coordinate(value) if known else float(theta)), NORMAL * float(deviation)
        if one.name == trial.latency and known:
            value, middle, reach = _latency(one, trial.period, middle, float(deviation))
        low, high = one.prior.value(middle - reach), one.prior.value(middle + reach)
        low = max(low, DECLARED[one.name].least)
        rows.append(Row(one.name, value_of(owner, one.name), value, low, high, bool(known)))
    changes = {row.name: row.value for row in rows if row.determined}
    seen = "position_noise" if trial.counted is None else "encoder_noise"
    noise = {"electronics.pressure_noise": last.noise.pressure, f"electronics.{seen}": last.noise.position}
    rig, quick = owner.replace({**changes, **noise}), guessed_noise(trial)
    left = left_over(last, trial)
    return Identified(
        tuple(rows), rig, last, certainty, last.noise, quick, trial.notes, pull, left, laws, tuple(others), zeros, before
    )


def left_over(found: Fit, trial: Trial) -> Array:
    """RMS of the residuals of each chamber's pressures over its own noise, (4,)."""
    residual, windows = found.problem.settled(found.theta)[1], found.problem.windows
    pressures = residual[:, : 4 * windows.length].reshape(len(residual), -1, 4) * found.problem.noise.pressure
    counted = np.sum(np.broadcast_to(windows.pressure_weights**2, pressures.shape), axis=(0, 1))
    sizes = np.sqrt(np.sum(pressures**2, axis=(0, 1)) / np.maximum(counted, 1.0))
    return np.asarray(sizes / cell_noises(trial))


def _latency(one: FreeParameter, period: float, middle: float, deviation: float) -> tuple[float, float, float]:
    """Value, coordinate and reach of the latency for the one at which rows show positions.

    A board that looks once a period shows a sample up to a period late, half a period in the mean; when in the period it
    arrived, no row tells.
    """
    value = max(one.prior.value(middle) - 0.5 * period, 0.0)
    rounding = period / 12**0.5 / one.prior.scale
    return value, one.prior.coordinate(value), NORMAL * (deviation**2 + rounding**2) ** 0.5

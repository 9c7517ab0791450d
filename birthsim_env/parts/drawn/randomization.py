"""Domain randomisation of the rig: uniform draws from the ranges that parameters are declared with.

Of a parameter that is known by its order of magnitude alone the logarithm is uniform; of a choice all words that are given are
alike.
"""

import copy
import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from birthsim_env.parts.drawn.frictions import with_ranges
from birthsim_env.parts.drawn.streams import Streams
from birthsim_env.parts.sensors.model import drawn_by
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.lanes import Array, parameter_columns
from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.consistency import least_dead_volume
from birthsim_env.physics.rig.parameters import DECLARED, FRICTION, SECTIONS, Parameters, parameter_of
from birthsim_env.physics.rig.values import is_finite, shown
from birthsim_env.registry import entries

Ranges = Mapping[str, tuple[Any, ...]]
"""Dotted name -> (low, high), or words of a choice."""

RANDOMIZE = (False, True, "plant", "scenario", "sensors")
"""Words of the environments' argument ``randomize``. With ``"sensors"`` the rig is the one described, and what a law believes
about its sensors is wrong: their parameters are drawn, and the scenario varies."""

_WHOLE = tuple(name for name, part in SECTIONS.items() if all(one.shared for one in part.parameters.values()))
SHARED = (*_WHOLE, *(name for name, one in DECLARED.items() if one.shared and name.partition(".")[0] not in _WHOLE))
"""Sections and parameters in which lanes cannot differ: workspace, clock and the limit of an episode are those of the nominal
rig, and sensors too where their model does not draw them (``SensorModel.drawn``)."""

BORES = ("cylinder1.piston_diameter", "cylinder2.piston_diameter")
"""Wide ones ask for dead volume, narrow ones for thin rods."""

KNOWN = 0.2
"""Share of a parameter by which it may be off where a rig's owner has described it; assumed."""


def _drawn_by_some() -> set[str]:
    """Names of the parameters that one sensor model or another draws."""
    return {name for model in entries("sensors") for name in model.made.drawn}


def documented_ranges(nominal: Parameters, sensors: str = "ideal") -> dict[str, tuple[Any, ...]]:
    """Dotted field name -> (low, high), SI units, or words: what domain randomisation of a rig with a sensor model draws from.

    A parameter of the default rig is assumed, and has the range that it is declared with; one that the owner
    has given another value is known to ``KNOWN``. Where the rig has ``ranges`` of its own, those count: more than what a
    friction of the sweep that it names says too.
    """
    ranges: dict[str, tuple[Any, ...]] = {}
    for dotted, one in DECLARED.items():
        if one.range and not one.on_request and nominal.linkage.topology.has(dotted):
            section, _, name = dotted.partition(".")
            value, low, high = getattr(getattr(nominal, section), name), *one.range
            if value != getattr(SECTIONS[section], name):
                low, high = max((1 - KNOWN) * value, one.least), min((1 + KNOWN) * value, one.most)
            ranges[dotted] = (low, high)
    volume = "chambers.dead_volume"
    ranges[volume] = (max(ranges[volume][0], least_dead_volume(nominal)), ranges[volume][1])
    own = nominal.own_ranges
    if FRICTION in own:
        ranges = with_ranges(own.pop(FRICTION)[0], nominal, ranges)
    ranges.update(own)
    left_out = _drawn_by_some() - set(drawn_by(sensors))
    return {name: pair for name, pair in ranges.items() if name not in left_out}


def ranges_of(nominal: Parameters, randomize: Any, sensors: str = "ideal") -> dict[str, tuple[Any, ...]]:
    """The ``documented_ranges`` that a word of the environments' argument ``randomize`` draws from, one of ``RANDOMIZE``."""
    if randomize in (False, "scenario"):
        return {}
    ranges = documented_ranges(nominal, sensors)
    return {name: ranges[name] for name in ranges if randomize != "sensors" or name in drawn_by(sensors)}


def described(nominal: Parameters, randomize: Any, sensors: str = "ideal") -> str:
    """What the environments' argument ``randomize`` draws of the rig, in words: ``rigs drawn: mass 2 to 5 kg, ...``."""
    if not isinstance(randomize, Mapping):
        randomize = ranges_of(nominal, randomize, sensors)
    named = []
    for name, bounds in randomize.items():
        section, _, own = name.partition(".")
        words = f"{own} of {section}" if section.startswith("cylinder") or parameter_of(name).choices else own
        unit = parameter_of(name).unit.removeprefix("-")
        of = " or ".join(bounds) if parameter_of(name).choices else "{:.4g} to {:.4g}".format(*bounds)
        named.append(f"{words.replace('_', ' ')} {of} {unit}".rstrip())
    drawn = "rigs" if set(randomize) - set(drawn_by(sensors)) else "sensors"
    return f"{drawn} drawn: {', '.join(named)}" if named else "the rig as described"


def checked_ranges(ranges: Ranges, nominal: Parameters, sensors: str = "ideal") -> dict[str, tuple[Any, ...]]:
    """``ranges`` if each names a field that lanes may differ in, with a finite (low, high), or words, possible for ``nominal``
    under a sensor model.

    Else ``ValueError`` naming the entry.
    """
    checked: dict[str, tuple[Any, ...]] = {}
    for name, bounds in ranges.items():
        if not isinstance(name, str):
            raise ValueError(f"randomize[{shown(name)}]; allowed: dotted names of parameters such as 'mechanics.mass'")
        if name not in drawn_by(sensors) and (name.partition(".")[0] in SHARED or name in SHARED):
            more = f"; with other sensors {name}" if name in _drawn_by_some() else ""
            raise ValueError(
                f"randomize[{shown(name)}]: allowed: all but {', '.join(SHARED)}, which are the same in all lanes{more}"
            )
        if choices := parameter_of(name).choices:
            words = tuple(bounds) if isinstance(bounds, (tuple, list)) else ()
            if not words or any(word not in choices for word in words) or len({*words}) < len(words):
                some = ", ".join(map(repr, choices))
                raise ValueError(f"randomize[{shown(name)}] = {shown(bounds)}; allowed: one or more of {some}, each once")
            checked[name] = words
            continue
        pair = tuple(bounds) if isinstance(bounds, (tuple, list, np.ndarray)) and shape_of(bounds) == (2,) else (math.nan,) * 2
        if not (is_finite(pair[0]) and is_finite(pair[1]) and pair[0] <= pair[1]):
            raise ValueError(f"randomize[{shown(name)}] = {shown(bounds)}; allowed: (low, high), finite and ordered")
        low, high = float(pair[0]), float(pair[1])
        checked[name] = (low, high)
        nominal.replace({name: low})
        nominal.replace({name: high})
    # Whatever is checked of several fields together grows or falls with each: of the rigs of the same words two are the worst.
    chosen = {name: words for name, words in checked.items() if DECLARED[name].choices}
    numbers = {name: pair for name, pair in checked.items() if name not in chosen}
    for thinnest, *said in itertools.product((False, True), *chosen.values()):
        at_least = {name for name in numbers if DECLARED[name].hardest_low or (thinnest and name in BORES)}
        worst = {name: low if name in at_least else high for name, (low, high) in numbers.items()}
        try:
            nominal.replace({**worst, **dict(zip(chosen, said, strict=True))})
        except ValueError as error:
            raise ValueError(f"randomize: some of the rigs drawn are impossible: {error}") from None
    return checked


def draw_parameters(nominal: Parameters, ranges: Ranges, rng: np.random.Generator) -> Parameters:
    """``nominal`` with every field in ``ranges`` drawn, independently, in the order of the names."""
    return nominal.replace(draw_figures(ranges, rng))


def draw_columns(nominal: Parameters, ranges: Ranges, streams: Streams, num_lanes: int) -> Array:
    """``parameter_column`` of what ``draw_parameters`` gives each lane, (PARAMETERS, num_lanes); ``ranges`` are checked."""
    return parameter_columns(draw_rig(nominal, ranges, streams), num_lanes)


def draw_rig(nominal: Parameters, ranges: Ranges, streams: Streams) -> Parameters:
    """What ``draw_parameters`` gives each of L lanes, in one rig whose drawn fields are (L,)."""
    drawn = draw_figures(ranges, streams)
    rig = copy.copy(nominal)
    for name, values in drawn.items():
        section, _, own = name.partition(".")
        if getattr(rig, section) is getattr(nominal, section):
            object.__setattr__(rig, section, copy.copy(getattr(rig, section)))
        # Past the checks of one rig: ``checked_ranges`` has refused what they could refuse.
        object.__setattr__(getattr(rig, section), own, values)
    if "chambers.dead_volume" not in drawn:
        bore, before = (np.maximum(one.cylinder1.area_p, one.cylinder2.area_p) for one in (rig, nominal))
        object.__setattr__(rig, "chambers", copy.copy(rig.chambers))
        object.__setattr__(rig.chambers, "dead_volume", bore / before * nominal.chambers.dead_volume)
    return rig


def draw_figures(ranges: Ranges, rng: Any) -> dict[str, Any]:
    """What is drawn of each range, sorted by name: a number or word from a generator, or (L,) from ``Streams`` of L lanes."""
    return {name: _one_drawn(name, ranges[name], rng) for name in sorted(ranges)}


class Words:
    """A word of each of L lanes, which knows where it is one word or another: ``words == "gms"`` is 1.0 there, else 0.0.

    ``place`` (L,) is where a lane's word stands among ``words``, and a fraction more.
    """

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, words: tuple[str, ...], place: Any) -> None:
        self._words, self._place = words, place

    def __eq__(self, word: object) -> Any:
        if word not in self._words:
            return 0.0
        k = self._words.index(str(word))
        return np.where(self._place < k + 1, 1.0, 0.0) * np.where(self._place < k, 0.0, 1.0)


def _one_drawn(name: str, bounds: tuple[Any, ...], rng: Any) -> Any:
    if parameter_of(name).choices:
        place = len(bounds) * rng.uniform()
        return bounds[int(place)] if isinstance(place, float) else Words(bounds, place)
    low, high = bounds
    if not parameter_of(name).logarithmic:
        return rng.uniform(low, high)
    share = rng.uniform()
    octaves = exact.number("log2", high / low)
    powers = np.empty_like(share)
    for lane, one in np.ndenumerate(share):
        powers[lane] = _exp(octaves * one / exact.LOG2_E)
    return np.minimum(low * powers, high)[()]


def _exp(x: Any) -> Any:
    """e^x, of a number, or of a symbol where the code that draws on a device is made."""
    return exact.number("exp", x) if isinstance(x, float) else x.graph.node("exp", x)

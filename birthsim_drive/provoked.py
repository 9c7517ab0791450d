"""What goes wrong with a simulated rig on purpose: ``--provoke KIND@SECONDS``, or ``KIND@SECONDS+LASTS``."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

from birthsim_drive.packet import CLOSED, Sample, pack_sample
from birthsim_env.physics.rig.values import near, shown

TIME, X, STAMP, SPEED, PRESSURE, PUSH = 0, 1, 3, 4, 10, 12
"""Numbers of the signals of a sample; the pressure is that of chamber P2, which a rail has too."""

Signals = list[float]


def _put(place: int, value: float) -> Callable[[Signals, Signals], None]:
    """A signal that reads ``value``."""

    def act(signals: Signals, _: Signals) -> None:
        signals[place] = value

    return act


def _keep(*places: int) -> Callable[[Signals, Signals], None]:
    """Signals that read what they read when it began."""

    def act(signals: Signals, then: Signals) -> None:
        for place in places:
            signals[place] = then[place]

    return act


def _add(place: int, value: float) -> Callable[[Signals, Signals], None]:
    """A signal that reads so much more."""

    def act(signals: Signals, _: Signals) -> None:
        signals[place] += value

    return act


def _lost(_: bytes) -> list[bytes]:
    return []


def _damaged(packet: bytes) -> list[bytes]:
    return [packet[:20] + bytes([packet[20] ^ 1]) + packet[21:]]


def _foreign(packet: bytes) -> list[bytes]:
    return [b"\xff" * len(packet), packet]


def _twice(packet: bytes) -> list[bytes]:
    return [packet, packet]


SIGNALS: dict[str, tuple[str, Callable[[Signals, Signals], None]]] = {
    "nan-pressure": ("a pressure cell reads NaN", _put(PRESSURE, math.nan)),
    "nan-position": ("the position is NaN", _put(X, math.nan)),
    "nan-force": ("the force sensor reads NaN", _put(PUSH, math.nan)),
    "infinite-velocity": ("the velocity is infinite", _put(SPEED, math.inf)),
    "high-pressure": ("a pressure cell reads 20 bar", _put(PRESSURE, 20e5)),
    "no-pressure": ("a pressure cell reads 0", _put(PRESSURE, 0.0)),
    "stuck-pressure": ("a pressure cell stands still", _keep(PRESSURE)),
    "fast": ("the velocity reads 5 m/s", _put(SPEED, 5.0)),
    "pushed": ("the force sensor reads 1000 N", _put(PUSH, 1000.0)),
    "moved": ("the position reads 0.3 m too far out", _add(X, 0.3)),
    "blind": ("the tracker shows the same old position", _keep(X, X + 1, STAMP)),
    "frozen": ("all signals stand still, the clock too", _keep(*range(14))),
    "nan-clock": ("the rig's clock reads NaN", _put(TIME, math.nan)),
    "clock-back": ("the rig's clock goes back by 1 s", _add(TIME, -1.0)),
}
"""Kind -> what happens to a sensor, and what that does to the signals now and when it began."""

PACKETS: dict[str, tuple[str, Callable[[bytes], list[bytes]]]] = {
    "silence": ("no sample comes", _lost),
    "damaged": ("a bit of every packet is flipped", _damaged),
    "foreign": ("packets of somebody else come besides", _foreign),
    "twice": ("every packet comes twice", _twice),
}
"""Kind -> what happens on the way, and what becomes of a packet."""

SHUT = "shut"
"""The rig's own watchdog closes the valves."""

KINDS = {
    **{name: about for name, (about, _) in SIGNALS.items()},
    **{name: about for name, (about, _) in PACKETS.items()},
    SHUT: "the rig says that it has closed its valves",
}
"""Kind -> what goes wrong."""

_WORDS = re.compile(r"([a-z-]+)@([0-9.]+)(?:\+([0-9.]+))?")


@dataclass
class Provoked:
    """Something that goes wrong from ``begins`` on, s of the rig's clock, for ``lasts`` s."""

    kind: str
    begins: float
    lasts: float = math.inf
    _then: Signals = field(default_factory=list)

    def is_on(self, time: float) -> bool:
        """Whether it goes wrong at a time, s."""
        return self.begins <= time < self.begins + self.lasts

    def sensed(self, sample: Sample) -> Sample:
        """What the sensors say instead of a sample."""
        if self.kind == SHUT:
            return sample._replace(flags=sample.flags | CLOSED)
        signals = list(sample.signals)
        self._then = self._then or signals.copy()
        SIGNALS[self.kind][1](signals, self._then)
        return sample._replace(signals=tuple(signals))


def said(sample: Sample, faults: list[Provoked]) -> list[bytes]:
    """The packets that a rig sends in place of a sample, under what goes wrong."""
    now = sample.signals[TIME]
    on = [one for one in faults if one.is_on(now)]
    for one in on:
        if one.kind not in PACKETS:
            sample = one.sensed(sample)
    packets = [pack_sample(sample)]
    for one in on:
        if one.kind in PACKETS:
            packets = [sent for packet in packets for sent in PACKETS[one.kind][1](packet)]
    return packets


def provoked(words: str) -> Provoked:
    """``"nan-pressure@1.5+0.1"``: from 1.5 s on, for 0.1 s. ``ValueError`` says what there is."""
    found = _WORDS.fullmatch(words)
    if not found or found[1] not in KINDS:
        like = near(words.partition("@")[0], KINDS)
        raise ValueError(f"provoke = {shown(words)}{like}; allowed: KIND@SECONDS or KIND@SECONDS+LASTS of {', '.join(KINDS)}")
    try:
        return Provoked(found[1], float(found[2]), float(found[3]) if found[3] else math.inf)
    except ValueError:
        raise ValueError(f"provoke = {shown(words)}; allowed: KIND@SECONDS+LASTS with numbers, as silence@1.5+0.1") from None

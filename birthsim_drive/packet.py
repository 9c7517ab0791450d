"""Packets between a rig and what drives it, over UDP: little-endian, one sample and one command per control period.

A *sample* goes from the rig, 156 bytes:

    bytes      type           what
    0 to 3     char[4]        "BSIM"
    4, 6       uint16 x 2     version, 1; kind, 1
    8          uint64         counter of the samples, from 1 on
    16         double x 14    time, s; position x, y, m; time of the position, s; velocity x, y, m/s; acceleration x, y, m/s2;
                              absolute pressures of chambers P1, N1, P2, N2, Pa; force of the hand x, y, N
    128        uint64         counter of the sample whose command was applied last, in time
    136        uint32         samples so far that no command answered in time
    140        uint32         flags: 1 positions are samples of a tracker or an encoder; 2 there is an acceleration; 4 there is
                              a force; 8 positions are of encoders; 16 the rig's own watchdog has closed the valves
    144        uint64         0, for later versions
    152        uint32         CRC-32 (zlib's) of all before

A *command* goes to the rig, 60 bytes:

    0 to 7                    as above, kind 2
    8          uint64         counter of the sample that it answers; 0 asks for samples
    16         double x 4     openings of chambers P1, N1, P2, N2, -1 to 1
    48         uint32         0 goes on, 1 the rig may close the valves and forget the sender
    52         uint32         0
    56         uint32         CRC-32 of all before

A signal that no sensor measures is 0, where its flag says so, and one whose sensor fails NaN.
The rig sends samples to where commands come from. It closes its valves by itself where no command comes for some 20 ms: no
program on a computer can do that for it. c/birthsim_udp.h has the same in C.
"""

import struct
import zlib
from typing import NamedTuple

MAGIC, VERSION = b"BSIM", 1
SAMPLE_KIND, COMMAND_KIND = 1, 2
SAMPLED, ACCELERATION, FORCE, ENCODERS, CLOSED = 1, 2, 4, 8, 16
"""Flags of a sample."""

GOES_ON, STOPS = 0, 1
"""States of a command."""

_SAMPLE, _COMMAND, _CRC = struct.Struct("<4sHHQ14dQIIQ"), struct.Struct("<4sHHQ4dII"), struct.Struct("<I")
SAMPLE_SIZE, COMMAND_SIZE = _SAMPLE.size + _CRC.size, _COMMAND.size + _CRC.size
SIGNALS = 14
"""Numbers of a sample."""


class Sample(NamedTuple):
    """What a rig says in a control period; ``signals`` are the 14 numbers of a sample."""

    counter: int
    signals: tuple[float, ...]
    answered: int = 0
    missed: int = 0
    flags: int = 0


class Command(NamedTuple):
    """What a rig is told in a control period."""

    answers: int
    openings: tuple[float, ...]
    state: int = GOES_ON


def pack_sample(sample: Sample) -> bytes:
    """The bytes of a sample."""
    told = (sample.answered, sample.missed, sample.flags, 0)
    body = _SAMPLE.pack(MAGIC, VERSION, SAMPLE_KIND, sample.counter, *sample.signals, *told)
    return body + _CRC.pack(zlib.crc32(body))


def pack_command(command: Command) -> bytes:
    """The bytes of a command."""
    body = _COMMAND.pack(MAGIC, VERSION, COMMAND_KIND, command.answers, *command.openings, command.state, 0)
    return body + _CRC.pack(zlib.crc32(body))


def read_sample(content: bytes) -> Sample | None:
    """The sample in a packet; None for anything else."""
    if not _is_whole(content, SAMPLE_SIZE, SAMPLE_KIND):
        return None
    _, _, _, counter, *numbers = _SAMPLE.unpack_from(content)
    return Sample(counter, tuple(numbers[:SIGNALS]), *numbers[SIGNALS : SIGNALS + 3])


def read_command(content: bytes) -> Command | None:
    """The command in a packet; None for anything else."""
    if not _is_whole(content, COMMAND_SIZE, COMMAND_KIND):
        return None
    _, _, _, answers, *numbers = _COMMAND.unpack_from(content)
    return Command(answers, tuple(numbers[:4]), numbers[4])


def _is_whole(content: bytes, size: int, kind: int) -> bool:
    if len(content) != size or content[:4] != MAGIC:
        return False
    version, found = struct.unpack_from("<HH", content, 4)
    (crc,) = _CRC.unpack_from(content, size - 4)
    return bool(version == VERSION and found == kind and zlib.crc32(content[:-4]) == crc)

"""Packets: every bit arrives, nothing else passes, and the C header says the same."""

import math
import re
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_drive import packet
from birthsim_drive.packet import Command, Sample, pack_command, pack_sample, read_command, read_sample
from tests.console import ROOT

NUMBERS = st.floats(allow_nan=True, width=64)


def same(one, other):
    return struct.pack("<d", one) == struct.pack("<d", other)


@given(st.integers(0, 2**64 - 1), st.lists(NUMBERS, min_size=14, max_size=14), st.integers(0, 2**32 - 1))
def test_a_sample_arrives_with_every_bit(counter, signals, missed):
    content = pack_sample(Sample(counter, tuple(signals), counter, missed, packet.SAMPLED))
    found = read_sample(content)
    assert len(content) == packet.SAMPLE_SIZE == 156
    assert (found.counter, found.answered, found.missed, found.flags) == (counter, counter, missed, packet.SAMPLED)
    assert all(same(*pair) for pair in zip(found.signals, signals, strict=True))


@given(st.integers(0, 2**64 - 1), st.lists(NUMBERS, min_size=4, max_size=4))
def test_a_command_arrives_with_every_bit(answers, openings):
    content = pack_command(Command(answers, tuple(openings), packet.STOPS))
    found = read_command(content)
    assert len(content) == packet.COMMAND_SIZE == 60
    assert (found.answers, found.state) == (answers, packet.STOPS)
    assert all(same(*pair) for pair in zip(found.openings, openings, strict=True))


@given(st.integers(0, 8 * 156 - 1))
def test_a_flipped_bit_is_found(bit):
    content = bytearray(pack_sample(Sample(7, tuple(map(float, range(14))))))
    content[bit // 8] ^= 1 << bit % 8
    assert read_sample(bytes(content)) is None


@given(st.binary(max_size=400))
def test_what_is_no_packet_is_none(content):
    assert read_sample(content) is None
    assert read_command(content) is None


def test_one_kind_is_not_the_other():
    assert read_sample(pack_command(Command(1, (0.0,) * 4))) is None
    assert read_command(pack_sample(Sample(1, (0.0,) * 14))) is None


def test_the_numbers_stand_where_they_are_said_to():
    """By the table in the module's docstring, not by its format."""
    content = pack_sample(Sample(2**40 + 1, tuple(k + 0.5 for k in range(14)), 3, 4, 5))
    told = re.search(r"bytes      type.*?CRC", packet.__doc__, re.DOTALL)[0]
    places = {int(first) for first in re.findall(r"^    (\d+)", told, re.MULTILINE)}
    assert places == {0, 4, 8, 16, 128, 136, 140, 144, 152}
    assert content[:4] == b"BSIM"
    assert struct.unpack_from("<HH", content, 4) == (1, 1)
    assert struct.unpack_from("<Q", content, 8) == (2**40 + 1,)
    assert struct.unpack_from("<14d", content, 16) == tuple(k + 0.5 for k in range(14))
    assert struct.unpack_from("<QII", content, 128) == (3, 4, 5)


def test_the_header_has_the_same_numbers():
    header = (ROOT / "birthsim_drive" / "c" / "birthsim_udp.h").read_text()
    numbers = dict(re.findall(r"(BIRTHSIM_UDP_\w+) = (\d+)", header))
    assert {name: int(value) for name, value in numbers.items()} == {
        "BIRTHSIM_UDP_VERSION": packet.VERSION, "BIRTHSIM_UDP_SAMPLE": packet.SAMPLE_KIND,
        "BIRTHSIM_UDP_COMMAND": packet.COMMAND_KIND, "BIRTHSIM_UDP_SAMPLE_SIZE": packet.SAMPLE_SIZE,
        "BIRTHSIM_UDP_COMMAND_SIZE": packet.COMMAND_SIZE, "BIRTHSIM_UDP_SAMPLED": packet.SAMPLED,
        "BIRTHSIM_UDP_ACCELERATION": packet.ACCELERATION, "BIRTHSIM_UDP_FORCE": packet.FORCE,
        "BIRTHSIM_UDP_ENCODERS": packet.ENCODERS, "BIRTHSIM_UDP_CLOSED": packet.CLOSED,
        "BIRTHSIM_UDP_GOES_ON": packet.GOES_ON, "BIRTHSIM_UDP_STOPS": packet.STOPS,
    }  # fmt: skip


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_a_failing_sensor_says_passes(value):
    assert same(read_sample(pack_sample(Sample(1, (value,) * 14))).signals[0], value)

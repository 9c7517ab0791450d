"""A rig behind a socket: dSPACE, Speedgoat, Simulink, TwinCAT or a microcontroller that speaks ``birthsim_drive.packet``."""

import select
import socket
import time

import numpy as np

from birthsim_drive.packet import (
    ACCELERATION,
    CLOSED,
    ENCODERS,
    FORCE,
    SAMPLE_SIZE,
    SAMPLED,
    STOPS,
    Command,
    Sample,
    pack_command,
    read_sample,
)
from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import register

WAITS = 3.0
"""Control periods after which a sample is missing."""

AGAIN = 0.1
"""s after which a rig that says nothing is asked for samples again."""

CLOSINGS = 3
"""Packets that say stop; one may be lost."""

SHUT = (0.0, 0.0, 0.0, 0.0)


@register(driver="udp", about="a rig that sends its samples over the network, udp:HOST:PORT", order=10)
class UdpDriver:
    """A rig at ``HOST:PORT``, which is asked for samples where the driver is made.

    Of samples that wait together the newest counts; older, damaged and foreign packets are left out.
    """

    def __init__(self, rig: Parameters, place: str) -> None:
        self._address = address_of(place)
        self.wait = WAITS * rig.electronics.control_period
        """s for which ``read`` waits."""
        self._last, self._asked = 0, 0.0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(self._address)
        self._closed = False
        self.sample = Sample(0, (0.0,) * 14)
        """The one that was read last."""
        self.ignored = 0
        """Packets that were none of the rig's, or came too late."""
        self._ask()

    @property
    def has_encoders(self) -> bool:
        """Whether positions are of encoders."""
        return bool(self.sample.flags & ENCODERS)

    @property
    def is_shut(self) -> bool:
        """Whether the rig's own watchdog has closed the valves."""
        return bool(self.sample.flags & CLOSED)

    @property
    def missed(self) -> int:
        """Samples that no command answered in time, as the rig counts them."""
        return self.sample.missed

    def read(self) -> Measurement:
        """The next sample. Raises ``TimeoutError`` where none comes within ``wait`` s."""
        self.sample = self._next()
        self._last = self.sample.counter
        numbers = np.array(self.sample.signals)
        acceleration = numbers[6:8] if self.sample.flags & ACCELERATION else None
        sampled = bool(self.sample.flags & SAMPLED)
        if not self.sample.flags & FORCE:  # a controller that needs it must not take it for 0 N
            numbers[12:14] = np.nan
        return Measurement(
            numbers[0], numbers[1:3], numbers[3], numbers[4:6], numbers[8:12], numbers[12:14], sampled, acceleration
        )

    def write(self, openings: Array) -> None:
        """Answer the sample that was read last."""
        self._send(Command(self._last, tuple(openings.tolist())))

    def stop(self) -> None:
        """Tell the rig to close its valves."""
        for _ in range(0 if self._closed else CLOSINGS):
            self._send(Command(self._last, SHUT, STOPS))
        self._closed = True
        self._socket.close()

    def _next(self) -> Sample:
        ends = time.perf_counter() + self.wait
        found: Sample | None = None
        while True:
            left = 0.0 if found else ends - time.perf_counter()
            if left < 0.0:
                break
            # A socket's own timeout counts in whole milliseconds.
            if not select.select([self._socket], [], [], left)[0]:
                break
            try:
                sample = read_sample(self._socket.recv(2 * SAMPLE_SIZE))
            except ConnectionRefusedError:
                if self._last:  # nobody is there any more
                    break
                continue
            if sample is None or sample.counter <= self._last:
                self.ignored += 1
            else:
                self.ignored += found is not None
                found, self._last = sample, sample.counter
        if found is None:
            self._ask()
            raise TimeoutError(f"no sample from {self._address[0]}:{self._address[1]} for {1e3 * self.wait:g} ms")
        return found

    def _ask(self) -> None:
        """Ask for samples, where none has come so far."""
        if self._last == 0 and time.perf_counter() - self._asked > AGAIN:
            self._asked = time.perf_counter()
            self._send(Command(0, SHUT))

    def _send(self, command: Command) -> None:
        try:
            self._socket.send(pack_command(command))
        except ConnectionRefusedError:  # of what was sent before
            self._socket.send(pack_command(command))


def address_of(place: str) -> tuple[str, int]:
    """``"192.168.0.5:5005"`` as host and port; ``ValueError`` for anything else."""
    host, _, port = place.rpartition(":")
    if not (host and port.isdigit() and 0 < int(port) < 65536):
        raise ValueError(f"driver = {shown(f'udp:{place}')}; allowed: udp:HOST:PORT, as udp:192.168.0.5:5005")
    try:
        return socket.gethostbyname(host), int(port)
    except OSError as error:
        raise ValueError(f"driver = {shown(f'udp:{place}')}: {error.strerror}; allowed: a host that is known") from None

"""Where a server listens, and who can reach it there."""

import ipaddress
import os
import socket

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine that no other machine can use."""


def listen(host: str, port: int) -> socket.socket:
    """A socket bound to the address; ``ValueError`` where it is taken, unknown or all addresses at once."""
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise ValueError(f"host = {host!r} is unknown ({error}); allowed: an address or name of this machine") from error
    if ipaddress.ip_address(address[0]).is_unspecified:
        raise ValueError(f"host = {host!r} means every address; allowed: one address or name, by which pages are opened")
    try:
        return socket.create_server(address, family=family)
    except OSError as error:
        why = os.strerror(error.errno or 0)  # without the address, which its own words repeat
        raise ValueError(
            f"port = {port} of {host} cannot be served ({why}); allowed: a free port, --port 0 finds one"
        ) from error


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in LOOPBACK

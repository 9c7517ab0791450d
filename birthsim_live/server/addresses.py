"""Where a server listens, and who can reach it there."""

import ipaddress
import os
import re
import socket

from birthsim_env.physics.rig.values import shown

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine that no other machine can use."""


NAME = re.compile(r"[a-z0-9_]([a-z0-9_.-]*[a-z0-9_])?")
"""A host's name, as browsers send it."""


def listen(host: str, port: int, named: bool = False) -> socket.socket:
    """A socket bound to the address; ``ValueError`` where it is taken or unknown, or all addresses at once where the names are
    not ``named`` by which pages are opened."""
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise ValueError(f"host = {host!r} is unknown ({error}); allowed: an address or name of this machine") from error
    if is_unspecified(str(address[0])) and not named:
        raise ValueError(
            f"host = {host!r} means every address; allowed: one address or name, by which pages are opened, or with "
            "--allowed-host the names by which they are"
        )
    try:
        return socket.create_server(address, family=family)
    except OSError as error:
        why = os.strerror(error.errno or 0)  # without the address, which its own words repeat
        raise ValueError(
            f"port = {port} of {host} cannot be served ({why}); allowed: a free port, --port 0 finds one"
        ) from error


def is_unspecified(address: str) -> bool:
    """Whether it means every address of this machine."""
    return ipaddress.ip_address(address).is_unspecified


def host_name(text: str) -> str:
    """A host's name or address as a browser sends it, without brackets; ``ValueError`` for what is more or less than that."""
    bare = text.strip().removeprefix("[").removesuffix("]")
    try:
        return str(ipaddress.ip_address(bare))
    except ValueError:
        pass
    try:
        name = bare.encode("idna").decode().lower()
    except UnicodeError:
        name = ""
    if not NAME.fullmatch(name):
        allowed = "a name or address alone, such as rig.example, without http:// or a port"
        raise ValueError(f"--allowed-host {shown(text)}; allowed: {allowed}")
    return name


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in LOOPBACK

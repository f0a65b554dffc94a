"""Addresses of routers, such as "tls/hub.example.org:7447"."""

import contextlib
import ipaddress
import os
import re
import socket

ENCRYPTED = ("tls", "quic")
"""Protocols of endpoints whose links are encrypted, with certificates of both ends."""
PLAIN = ("tcp", "udp")
DEFAULT_PORT = 7447
"""Of a router whose address names none."""
_FREE = range(20_000, 32_768)
"""Ports below those that systems give to who names none (Linux): until one is used, nobody else is given it."""
_TRIES = 100
_ENDPOINT = re.compile(r"(?:tcp|udp|tls|quic)/(?:\[[0-9a-fA-F:.%]+\]|[^\s/:\[\]]+):(\d{1,5})(?:[?#].*)?")


def is_encrypted(endpoint: str) -> bool:
    """Whether its links are encrypted."""
    return endpoint.partition("/")[0] in ENCRYPTED


def endpoint_fault(endpoint: str) -> str:
    """What is wrong with the address of a router; empty for a good one."""
    found = _ENDPOINT.fullmatch(endpoint)
    good = found is not None and int(found[1]) < 1 << 16
    return "" if good else f"is {endpoint!r}, expected tcp/HOST:PORT, tls/HOST:PORT or quic/HOST:PORT, such as tcp/127.0.0.1:7447"


def host_and_port(endpoint: str) -> tuple[str, int]:
    """Host without brackets, and port, 7447 where none is named."""
    place = endpoint.partition("/")[2].split("#")[0].split("?")[0]
    host, colon, port = place.rpartition(":")
    if not colon or not port.isdecimal():
        host, port = place, str(DEFAULT_PORT)
    return host.strip("[]"), int(port)


def answers(endpoint: str, within_s: float) -> bool:
    """Whether somebody takes TCP connections there."""
    try:
        socket.create_connection(host_and_port(endpoint), within_s).close()
    except OSError:
        return False
    return True


def may_answer(endpoint: str, within_s: float) -> bool:
    """False where surely nobody does: over UDP only who is answered knows."""
    return endpoint.startswith(("udp/", "quic/")) or bool(endpoint_fault(endpoint)) or answers(endpoint, within_s)


def free_port(protocol: str = "tcp") -> int:
    """A port of this machine that nobody uses now, and that no other program is likely to take before it is used."""
    kind = socket.SOCK_DGRAM if protocol in ("udp", "quic") else socket.SOCK_STREAM
    for _ in range(_TRIES):
        with socket.socket(type=kind) as s, contextlib.suppress(OSError):
            s.bind(("127.0.0.1", _FREE[int.from_bytes(os.urandom(4), "big") % len(_FREE)]))
            return s.getsockname()[1]
    with socket.socket(type=kind) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def is_local(endpoint: str) -> bool:
    """Whether only this machine reaches it."""
    host = host_and_port(endpoint)[0]
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def objection(endpoint: str, *, tls: bool, insecure: bool = False) -> str:
    """Why there should be no link to, or listening at, `endpoint`; empty where there may. tls: certificates are named; insecure:
    plain TCP beyond this machine is meant."""
    if endpoint.partition("/")[0] not in (*PLAIN, *ENCRYPTED):
        return f"the router's address {endpoint_fault(endpoint)}"
    if is_encrypted(endpoint):
        return "" if tls else f"{endpoint}: needs certificates: tls under [bus] in the conference file (vistel site certs init)"
    if tls:
        return f"{endpoint}: is not encrypted, and the conference file names certificates: expected tls/HOST:PORT"
    if is_local(endpoint) or insecure:
        return ""
    return (
        f"{endpoint}: plain TCP beyond this machine, where everybody who reaches the port may speak as anybody; use certificates "
        "(vistel site certs init), or say that it is meant: --insecure, or insecure = true under [bus]"
    )
